// The sum of what was found beforehand.

@group(0) @binding(0) var<uniform> parts: Parts;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var base_color_texture: texture_2d<f32>;
@group(0) @binding(3) var emission_texture: texture_2d<f32>;
@group(0) @binding(4) var direct_irradiance: texture_2d<f32>;
@group(0) @binding(5) var indirect_irradiance: texture_2d<f32>;
@group(0) @binding(6) var caustic_irradiance: texture_2d<f32>;
@group(0) @binding(7) var surface_texture: texture_2d<u32>;
@group(0) @binding(8) var specular_radiance: texture_2d<f32>;
@group(0) @binding(9) var<uniform> environment: Environment;
@group(0) @binding(10) var environment_image: texture_2d<f32>;

@fragment
fn fragment(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let at = vec2u(position.xy);
    let base_color = textureLoad(base_color_texture, at + view.origin, 0);
    if base_color.a <= 0.0 {
        return background_radiance(at);
    }
    let direct = textureLoad(direct_irradiance, at, 0).rgb;
    return surface_radiance(at, base_color.rgb, direct, textureLoad(indirect_irradiance, at, 0).rgb);
}
