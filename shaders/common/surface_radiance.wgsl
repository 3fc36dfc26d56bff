// Outgoing radiance: emitted + reflectance / pi * (direct + indirect + caustic irradiance), or of a specular surface what is seen
// in it, scaled back to world units; where no surface is seen, the environment. The module brings `parts`, the textures of
// the G-buffer, `caustic_irradiance` and `specular_radiance`.

struct Parts {
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

// What the eye sees where there is no surface.
fn background_radiance(at: vec2u) -> vec4f {
    return vec4f(environment_radiance(view_direction(vec2f(at))) * (parts.emission_weight * parts.output_scale), 0.0);
}

// Of the surface that a pixel shows; base colour with it.
fn surface_radiance(at: vec2u, base_color: vec3f, direct: vec3f, indirect: vec3f) -> vec4f {
    let pixel = at + view.origin;
    let caustic = textureLoad(caustic_irradiance, at, 0).rgb * parts.caustic_weight;
    let emission = textureLoad(emission_texture, pixel, 0).rgb * parts.emission_weight;
    let irradiance = direct * parts.direct_weight + indirect * parts.indirect_weight + caustic;
    var scattered = base_color * (INVERSE_PI * parts.diffuse_weight) * irradiance;
    if parts.has_specular == 1u && lobe_is_specular(textureLoad(surface_texture, pixel, 0).r >> 16u) {
        scattered = textureLoad(specular_radiance, at, 0).rgb;
    }
    return vec4f((emission + scattered) * parts.output_scale, 1.0);
}
