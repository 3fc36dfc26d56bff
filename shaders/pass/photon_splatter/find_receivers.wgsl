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
@group(0) @binding(5) var surface_texture: texture_2d<u32>;
@group(0) @binding(6) var receivers: texture_storage_2d<rgba32uint, write>;

@compute @workgroup_size(8, 8)
fn find_receivers(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= subsampling_size(view.size, params.factor)) {
        return;
    }
    let pixel = subsampling_pixel(id.xy, params.factor, view.size);
    textureStore(receivers, id.xy, receiver_pack(receiver_at(pixel), receiver_depth(pixel)));
}
