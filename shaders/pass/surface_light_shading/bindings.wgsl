// What all steps bind first.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var base_color_texture: texture_2d<f32>;
@group(0) @binding(5) var surface_texture: texture_2d<u32>;
@group(0) @binding(6) var<storage, read> lights: array<SurfaceLight>;
@group(0) @binding(7) var<storage, read> flux: array<vec4u>;

// The receiver of a pixel of the irradiance.
fn receiver_of(id: vec2u) -> Receiver {
    return receiver_at(subsampling_pixel(id, params.factor, view.size));
}
