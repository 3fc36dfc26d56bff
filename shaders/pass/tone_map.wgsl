// Radiance to display values in [0, 1]: exposure, a curve, and gamma.

struct Params {
    exposure: f32,
    // 0: clamp; 1: filmic
    curve: u32,
    inverse_gamma: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var radiance: texture_2d<f32>;

// A rational fit of a filmic response (Narkowicz 2015).
fn filmic(x: vec3f) -> vec3f {
    return (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let texel = textureLoad(radiance, vec2u(position.xy), 0);
    var x = max(texel.rgb * params.exposure, vec3f(0.0));
    if params.curve == 1u {
        x = filmic(min(x, vec3f(1e4)));
    }
    return vec4f(pow(clamp(x, vec3f(0.0), vec3f(1.0)), vec3f(params.inverse_gamma)), texel.a);
}
