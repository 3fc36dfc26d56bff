// The surface points that irradiance is estimated at.

struct ReceiverParams {
    // Pixels of the G-buffer for each one of the irradiance, along each axis
    factor: u32,
}

@group(0) @binding(0) var<uniform> params: ReceiverParams;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var base_color_texture: texture_2d<f32>;
@group(0) @binding(5) var receivers: texture_storage_2d<rgba32uint, write>;

fn position_at(pixel: vec2i) -> vec3f {
    let at = vec2u(pixel) + view.origin;
    return g_buffer_position(view, vec2f(pixel), textureLoad(depth_texture, at, 0).r);
}

@compute @workgroup_size(8, 8)
fn find_receivers(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= subsampling_size(view.size, params.factor)) {
        return;
    }
    let pixel = vec2i(subsampling_pixel(id.xy, params.factor, view.size));
    let at = vec2u(pixel) + view.origin;
    if textureLoad(base_color_texture, at, 0).a <= 0.0 {
        textureStore(receivers, id.xy, receiver_nowhere());
        return;
    }
    let p = position_at(pixel);
    let limit = vec2i(view.size) - 1;
    let around = Neighbours(
        position_at(vec2i(max(pixel.x - 1, 0), pixel.y)),
        position_at(vec2i(min(pixel.x + 1, limit.x), pixel.y)),
        position_at(vec2i(pixel.x, max(pixel.y - 1, 0))),
        position_at(vec2i(pixel.x, min(pixel.y + 1, limit.y))),
    );
    let shading = g_buffer_normal(view, textureLoad(normal_texture, at, 0));
    textureStore(receivers, id.xy, receiver_pack(p, g_buffer_geometric_normal(view, pixel, p, around, shading)));
}
