// How a photon leaves its light.

struct Emission {
    ray: LightRay,
    // Per solid angle, or per perpendicular area (directional)
    pdf: f32,
}

fn emit(light: Light, u: vec2f) -> Emission {
    switch light.kind {
        case LIGHT_DIRECTIONAL: {
            let offset = light.disc_radius * sampling_disc(u);
            return Emission(light_ray(light, light.direction, offset), light.density);
        }
        case LIGHT_SPOT: {
            let local = sampling_spot(u, light.inner, light.outer);
            let direction = mat3x3f(light.right, light.up, light.direction) * local;
            let v = sampling_one_minus_cos(local, vec3f(0.0, 0.0, 1.0));
            let falloff = sampling_spot_falloff(v, light.inner, light.outer);
            return Emission(light_ray(light, normalize(direction), vec2f(0.0)), light.density * falloff);
        }
        default: {
            return Emission(light_ray(light, sampling_sphere(u), vec2f(0.0)), light.density);
        }
    }
}

fn light_of(photon: u32) -> u32 {
    var index = 0u;
    while photon >= lights[index].first_photon + lights[index].photon_count && index + 1u < params.light_count {
        index++;
    }
    return index;
}

// `boost`: how many times as many photons start this way as would if they were spread evenly; `kept`: bits of the state that
// say so.
fn emit_photon(index: u32, u: vec2f, boost: f32, kept: u32) {
    let light_index = light_of(index);
    let light = lights[light_index];
    if index < light.first_photon || index >= light.first_photon + light.photon_count {
        photons[index] = photon_gone(PHOTON_EMPTY, vec3f(0.0), vec3f(0.0, 0.0, 1.0), 0u);
        return;
    }
    if starts_on_surface(light) {
        var place = surface_start(light, params.sample_offset + index, light.photon_count);
        place.flux /= boost;
        let direction = normalize(sampling_frame(place.normal) * sampling_cosine(u));
        photons[index] = photon_started(place, light_index, direction, 1.0, kept);
        return;
    }
    let within = light_within(light, params.sample_offset + index);
    let emission = emit(within, u);
    photons[index] = photon_on_ray(light_index, emission.ray, emission.pdf, within.photon_flux / boost, kept);
}
