// From sums to irradiance: what hangs over a rim is made up for.

struct FinishParams {
    factor: u32,
    // 1: kernels count by the part of them that lies on the surface
    is_corrected: u32,
    sample_offset: u32,
}

@group(0) @binding(0) var<uniform> params: FinishParams;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var base_color_texture: texture_2d<f32>;
@group(0) @binding(5) var surface_texture: texture_2d<u32>;
@group(0) @binding(6) var receivers: texture_2d<u32>;
// rgb: irradiance, a: its channels by the radii of the kernels that brought it
@group(0) @binding(7) var sums: texture_2d<f32>;
@group(0) @binding(8) var irradiance: texture_storage_2d<rgba32float, write>;

alias Receivers = f32;

@compute @workgroup_size(8, 8)
fn finish_pixels(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= subsampling_size(view.size, params.factor)) {
        return;
    }
    let pixel = subsampling_pixel(id.xy, params.factor, view.size);
    let receiver = receiver_unpack(textureLoad(receivers, id.xy, 0), pixel);
    let light = boundary_corrected(receiver, textureLoad(sums, id.xy, 0));
    textureStore(irradiance, id.xy, vec4f(light, f32(receiver.is_seen)));
}
