// Emits photons from every light, evenly or as tables say.

@group(1) @binding(0) var<storage, read> emission_tables: array<EmissionTable>;

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
    while index + 1u < params.light_count && photon >= lights[index].first_photon + lights[index].photon_count {
        index++;
    }
    return index;
}

// Evenly spread.
@compute @workgroup_size(64)
fn emit_photons(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * params.row + id.x;
    if id.x < params.row && index < params.photon_count {
        emit_photon(index, random_pair(params.sample_offset + index, 0u), 1.0, 0u);
    }
}

// The first of each light's, a share of them rounded by chance, as the tables say: both parts of the sequence are as evenly spread
// as the whole.
@compute @workgroup_size(64)
fn emit_guided_photons(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * params.row + id.x;
    if id.x >= params.row || index >= params.photon_count {
        return;
    }
    let light = light_of(index);
    let sequence_index = params.sample_offset + index;
    let rounded = params.guided * f32(lights[light].photon_count) + hash_unit(params.sample_offset, light);
    let is_guided = f32(index - lights[light].first_photon) < floor(rounded);
    var u = random_pair(sequence_index, 0u);
    if is_guided {
        u = emission_place(light, u);
    }
    let cell = emission_cell_at(u);
    let guiding = photon_guiding(is_guided, cell, emission_guidance(light, cell), random_guidance(sequence_index, 0u));
    emit_photon(index, u, photon_boost(guiding, params.guided), guiding);
}

// `boost`: how many times as many photons start this way as would if they were spread evenly; `kept`: bits of the state that say
// so.
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
