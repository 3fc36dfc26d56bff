// Rays from what pixels see to lights, or all around: one invocation a pixel.

@group(0) @binding(8) var<storage, read_write> rays: array<SurfaceRay>;

fn ray_to(index: u32, receiver: Receiver) -> SurfaceRay {
    let direction = normalize(lights[index].position - receiver.position);
    return SurfaceRay(receiver.position, octahedral_pack(receiver.normal), direction, 0u);
}

// Rays that ask about lights; how many there are.
fn spread_to_lights(receiver: Receiver, pixel: vec2u, first: u32) -> u32 {
    let all = scale_of_rays(receiver);
    let random = pixel_random(pixel).x;
    var passed = 0.0;
    var ray = 0u;
    for (var i = 0u; i < params.light_count && ray < params.ray_count; i++) {
        if flux[i].w == 0u {
            continue;
        }
        let own = luminance(irradiance_of(i, receiver.position, receiver.normal));
        passed += own;
        if params.shadows == SHADOWS_ALL {
            if own > params.least {
                rays[first + ray] = ray_to(i, receiver);
                ray++;
            }
            continue;
        }
        while ray < params.ray_count && own > 0.0 && ray_place(ray, all, random) < passed {
            rays[first + ray] = ray_to(i, receiver);
            ray++;
        }
    }
    return ray;
}

@compute @workgroup_size(8, 8)
fn spread_rays(@builtin(global_invocation_id) id: vec3u) {
    let width = subsampling_size(view.size, params.factor).x;
    if id.x >= width || id.y >= params.row_count {
        return;
    }
    let pixel = vec2u(id.x, params.first_row + id.y);
    let receiver = receiver_of(pixel);
    let first = params.ray_count * (id.y * width + id.x);
    var ray = 0u;
    if receiver.is_seen && params.shadows == SHADOWS_AMBIENT {
        let normal = octahedral_pack(receiver.normal);
        let random = pixel_random(pixel);
        for (; ray < params.ray_count; ray++) {
            let direction = cosine_direction(sampling_frame(receiver.normal), ray, params.ray_count, random);
            rays[first + ray] = SurfaceRay(receiver.position, normal, direction, 0u);
        }
    } else if receiver.is_seen {
        ray = spread_to_lights(receiver, pixel, first);
    }
    for (; ray < params.ray_count; ray++) {
        rays[first + ray] = SurfaceRay(NOWHERE, octahedral_pack(vec3f(0.0, 0.0, 1.0)), vec3f(0.0, 0.0, 1.0), 0u);
    }
}
