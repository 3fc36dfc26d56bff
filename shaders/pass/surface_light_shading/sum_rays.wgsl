// What arrives where rays say that it does: one invocation a pixel.

@group(0) @binding(8) var<storage, read> hits: array<SurfaceHit>;
@group(0) @binding(9) var irradiance: texture_storage_2d<rgba32float, write>;

// What a ray meets this much nearer than its light is in the way: lights lie on surfaces, and maps show these coarsely.
const NEARER: f32 = 0.02;
const NEARER_ANYHOW: f32 = 0x1p-8;

// Whether something stands within a distance of where a ray starts. What is lost is not known of: then nothing does.
fn is_blocked(ray: u32, distance: f32) -> bool {
    let hit = hits[ray];
    let is_hit = hit.kind == HIT_SURFACE || hit.kind == HIT_TENTATIVE;
    return is_hit && hit.distance < distance;
}

fn is_seen(ray: u32, index: u32, receiver: Receiver) -> bool {
    let distance = length(lights[index].position - receiver.position);
    return !is_blocked(ray, distance * (1.0 - NEARER) - NEARER_ANYHOW);
}

fn lit(receiver: Receiver, pixel: vec2u, first: u32) -> vec3f {
    let all = scale_of_rays(receiver);
    let random = pixel_random(pixel).x;
    var passed = 0.0;
    var ray = 0u;
    var sum = vec3f(0.0);
    for (var i = 0u; i < params.light_count; i++) {
        if flux[i].w == 0u {
            continue;
        }
        let light = irradiance_of(i, receiver.position, receiver.normal);
        let own = luminance(light);
        passed += own;
        if params.shadows == SHADOWS_ALL {
            if own > params.least && ray < params.ray_count {
                sum += select(vec3f(0.0), light, is_seen(first + ray, i, receiver));
                ray++;
            } else {
                sum += light;
            }
            continue;
        }
        // Each ray stands for its share of all light.
        while ray < params.ray_count && own > 0.0 && ray_place(ray, all, random) < passed {
            if is_seen(first + ray, i, receiver) {
                sum += light / own * (all / f32(params.ray_count));
            }
            ray++;
        }
    }
    return sum;
}

@compute @workgroup_size(8, 8)
fn sum_rays(@builtin(global_invocation_id) id: vec3u) {
    let width = subsampling_size(view.size, params.factor).x;
    if id.x >= width || id.y >= params.row_count {
        return;
    }
    let pixel = vec2u(id.x, params.first_row + id.y);
    let receiver = receiver_of(pixel);
    let first = params.ray_count * (id.y * width + id.x);
    var sum = vec3f(0.0);
    if params.ray_count == 0u {
        // Room for none.
        sum = unshadowed(receiver);
    } else if receiver.is_seen && params.shadows == SHADOWS_AMBIENT {
        var open = 0.0;
        for (var ray = 0u; ray < params.ray_count; ray++) {
            open += select(1.0, 0.0, is_blocked(first + ray, params.reach));
        }
        sum = unshadowed(receiver) * (open / f32(params.ray_count));
    } else if receiver.is_seen {
        sum = lit(receiver, pixel, first);
    }
    textureStore(irradiance, pixel, vec4f(sum, f32(receiver.is_seen)));
}
