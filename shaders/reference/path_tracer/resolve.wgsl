// The mean of all samples so far, in world units.

struct Params {
    width: u32,
    output_scale: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> moments: array<vec4f>;

@fragment
fn fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2u(at.xy);
    let mean = moments[2u * (pixel.y * params.width + pixel.x)].rgb;
    return vec4f(params.output_scale * mean, 1.0);
}
