// Outgoing radiance: emitted + reflectance / pi * (direct + indirect + caustic irradiance), or of a specular surface what is seen
// in it, scaled back to world units; where no surface is seen, the environment.

struct Params {
    // Radiance per unit-frame radiance, times pre-exposure
    output_scale: f32,
    direct_weight: f32,
    indirect_weight: f32,
    // 0 where there are none apart from indirect light
    caustic_weight: f32,
    emission_weight: f32,
    diffuse_weight: f32,
    // 0: specular surfaces are taken for diffuse ones
    has_specular: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
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

const INVERSE_PI: f32 = 0.318309886;

// Along which the eye looks through a pixel.
fn view_direction(pixel: vec2f) -> vec3f {
    if view.eye.w == 0.0 {
        return view.eye.xyz;
    }
    // From the end of the depth range that is further off: near the eye the difference has no digits.
    let uv = (pixel + 0.5) / vec2f(view.size);
    let at = vec2f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y);
    let ends = array(
        view.inverse_view_projection * vec4f(at, 0.0, 1.0),
        view.inverse_view_projection * vec4f(at, 1.0, 1.0),
    );
    let far = select(ends[1], ends[0], abs(ends[0].w) < abs(ends[1].w));
    return normalize(select(1.0, -1.0, far.w < 0.0) * (far.xyz - view.eye.xyz * far.w));
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let at = vec2u(position.xy);
    let pixel = at + view.origin;
    let base_color = textureLoad(base_color_texture, pixel, 0);
    if base_color.a <= 0.0 {
        return vec4f(environment_radiance(view_direction(vec2f(at))) * (params.emission_weight * params.output_scale), 0.0);
    }
    let direct = textureLoad(direct_irradiance, at, 0).rgb * params.direct_weight;
    let indirect = textureLoad(indirect_irradiance, at, 0).rgb * params.indirect_weight;
    let caustic = textureLoad(caustic_irradiance, at, 0).rgb * params.caustic_weight;
    let emission = textureLoad(emission_texture, pixel, 0).rgb * params.emission_weight;
    var scattered = base_color.rgb * (INVERSE_PI * params.diffuse_weight) * (direct + indirect + caustic);
    if params.has_specular == 1u && lobe_is_specular(textureLoad(surface_texture, pixel, 0).r >> 16u) {
        scattered = textureLoad(specular_radiance, at, 0).rgb;
    }
    return vec4f((emission + scattered) * params.output_scale, 1.0);
}
