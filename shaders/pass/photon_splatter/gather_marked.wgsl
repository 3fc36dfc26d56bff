// The gather of marked pixels alone, at another sub-sampling than the one that photons were sorted for.

struct MarkedParams {
    bandwidth: Bandwidth,
    // Pixels of the G-buffer for each one that may be marked, along each axis
    factor: u32,
    // 1: kernels count by the part of them that lies on the surface
    is_corrected: u32,
    sample_offset: u32,
}

@group(0) @binding(0) var<uniform> params: MarkedParams;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<storage, read> splats: array<Splat>;
@group(0) @binding(3) var<storage, read> first_splats: array<u32>;
@group(0) @binding(4) var<storage, read> reach: array<u32>;
@group(0) @binding(5) var depth_texture: texture_2d<f32>;
@group(0) @binding(6) var normal_texture: texture_2d<f32>;
@group(0) @binding(7) var base_color_texture: texture_2d<f32>;
@group(0) @binding(8) var surface_texture: texture_2d<u32>;
@group(0) @binding(9) var<storage, read> marked: MarkedPixels;
@group(0) @binding(10) var irradiance: texture_storage_2d<rgba32float, write>;

alias Receivers = f32;
alias Surfaces = u32;

@compute @workgroup_size(64)
fn gather_marked(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = 64u * (group.y * groups.x + group.x) + lane;
    if index >= marked.count {
        return;
    }
    let pixel = vec2u(marked.pixels[index] & 0xffffu, marked.pixels[index] >> 16u);
    let full = subsampling_pixel(pixel, params.factor, view.size);
    let seen = receiver_at(full);
    var g = gathered_nothing(seen);
    // Among the pixels that photons were sorted for.
    let place = irradiance_place(params.bandwidth, vec2f(full) + 0.5);
    gather_photons(&g, place, place);
    let light = boundary_corrected(seen, vec4f(g.red, g.green, g.blue, g.radius));
    textureStore(irradiance, pixel, vec4f(light, 1.0));
}
