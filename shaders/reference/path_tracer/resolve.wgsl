// The mean of all samples so far, in world units.

struct Params {
    width: u32,
    output_scale: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> sums: array<vec4f>;

@fragment
fn fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2u(at.xy);
    let sum = sums[2u * (pixel.y * params.width + pixel.x)];
    return vec4f(sum.rgb * (params.output_scale / max(1.0, sum.w)), 1.0);
}
