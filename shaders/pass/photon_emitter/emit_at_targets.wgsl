// Emits photons from every light towards what they are aimed at.

@group(1) @binding(0) var<storage, read> targets: PhotonTargets;

fn nothing_emitted() -> Photon {
    return photon_gone(PHOTON_EMPTY, vec3f(0.0), vec3f(0.0, 0.0, 1.0), 0u);
}

// From a surface.
fn start_at_targets(light: Light, light_index: u32, sequence_index: u32, count: u32) -> Photon {
    let place = surface_start(light, sequence_index, count);
    let aim = aim_from_point(place.position, random_pair(sequence_index, 0u));
    let by_cosine = dot(aim.at, place.normal) / POLYGON_PI;
    if by_cosine <= 0.0 || aim.density <= 0.0 {
        return nothing_emitted();
    }
    return photon_started(place, light_index, aim.at, aim.density / by_cosine, 0u);
}

// From any other; its flux is spread by `density` times the spot's falloff.
fn emit_at_targets(light: Light, light_index: u32, sequence_index: u32, count: u32) -> Photon {
    let u = random_pair(sequence_index, 0u);
    var density = light.density;
    var aim: Aim;
    var ray: LightRay;
    if light.kind == LIGHT_DIRECTIONAL {
        aim = aim_along(light.right, light.up, u);
        density *= select(0.0, 1.0, length(aim.at.xy) <= light.disc_radius);
        ray = light_ray(light, light.direction, aim.at.xy);
    } else {
        aim = aim_from_point(light.position, u);
        if light.kind == LIGHT_SPOT {
            density *= sampling_spot_falloff(sampling_one_minus_cos(aim.at, light.direction), light.inner, light.outer);
        }
        ray = light_ray(light, aim.at, vec2f(0.0));
    }
    if density <= 0.0 || aim.density <= 0.0 {
        return nothing_emitted();
    }
    let all = light.photon_flux * f32(max(light.photon_count, 1u));
    return photon_on_ray(light_index, ray, aim.density, all * (density / (f32(count) * aim.density)), 0u);
}

// Any of them; of one that no light sends, nothing.
fn emit_photon_at_targets(index: u32) {
    var light_index = 0u;
    while light_index + 1u < params.light_count && index >= targets.ranges[light_index].x + targets.ranges[light_index].y {
        light_index++;
    }
    let range = targets.ranges[light_index];
    if index < range.x || index >= range.x + range.y {
        photons[index] = nothing_emitted();
        return;
    }
    let light = lights[light_index];
    let sequence_index = params.sample_offset + index;
    if starts_on_surface(light) {
        photons[index] = start_at_targets(light, light_index, sequence_index, range.y);
    } else {
        photons[index] = emit_at_targets(light_within(light, sequence_index), light_index, sequence_index, range.y);
    }
}

@compute @workgroup_size(64)
fn emit_photons_at_targets(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * params.row + id.x;
    if id.x < params.row && index < params.photon_count {
        emit_photon_at_targets(index);
    }
}
