// Rays from the surface points that pixels see, as dense as the cosine: one invocation a pixel.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var base_color_texture: texture_2d<f32>;
@group(0) @binding(5) var surface_texture: texture_2d<u32>;
@group(0) @binding(6) var<storage, read_write> rays: array<SurfaceRay>;

// Two numbers of a pixel's own, which shift its points on the square.
fn shift(pixel: vec2u) -> vec2f {
    let word = hash_pcg4d(vec4u(pixel, params.sample_offset, 0u));
    return vec2f(word.xy >> vec2u(8u)) * 0x1p-24;
}

@compute @workgroup_size(8, 8)
fn spread_rays(@builtin(global_invocation_id) id: vec3u) {
    let width = subsampling_size(view.size, params.factor).x;
    if id.x >= width || id.y >= params.row_count {
        return;
    }
    let pixel = vec2u(id.x, params.first_row + id.y);
    let receiver = receiver_at(subsampling_pixel(pixel, params.factor, view.size));
    let normal = select(vec3f(0.0, 0.0, 1.0), receiver.normal, receiver.is_seen);
    let frame = sampling_frame(normal);
    let packed = octahedral_pack(normal);
    let first = params.ray_count * (id.y * width + id.x);
    let own = shift(pixel);
    for (var i = 0u; i < params.ray_count; i++) {
        let direction = cosine_direction(frame, i, params.ray_count, own);
        rays[first + i] = SurfaceRay(receiver.position, packed, direction, 0u);
    }
}
