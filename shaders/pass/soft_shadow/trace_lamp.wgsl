// Visibility by rays to points all over the lamp: the share of its light on the receiver that they bring.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var base_color_texture: texture_2d<f32>;
@group(0) @binding(5) var<storage, read> lights: array<Light>;
@group(0) @binding(6) var<storage, read> polygons: array<Polygon>;
@group(0) @binding(7) var visibility: texture_storage_2d<r32float, write>;

// Rays end this share of their length before the lamp, which may be a surface itself.
const BEFORE_LAMP: f32 = 0x1p-10;

struct LampRay {
    direction: vec3f,
    furthest: f32,
    // In proportion to the light that comes this way
    weight: f32,
}

fn ray_to_polygons(light: Light, receiver: Receiver, u: vec2f) -> LampRay {
    var last = light.first_polygon;
    let end = light.first_polygon + light.direct_polygons;
    while last + 1u < end && u.x >= polygons[last].until {
        last++;
    }
    let polygon = polygons[last];
    var begins = 0.0;
    if last > light.first_polygon {
        begins = polygons[last - 1u].until;
    }
    var at = vec2f(clamp((u.x - begins) / max(polygon.until - begins, 0x1p-60), 0.0, 1.0), u.y);
    if polygon.corners == 3u && at.x + at.y > 1.0 {
        at = 1.0 - at;
    }
    let way = polygon.corner + at.x * polygon.u + at.y * polygon.v - receiver.position;
    let squared = dot(way, way);
    let direction = way * inverseSqrt(max(squared, 0x1p-60));
    let leaving = max(0.0, -dot(normalize(cross(polygon.u, polygon.v)), direction));
    return LampRay(direction, (1.0 - BEFORE_LAMP) * sqrt(squared), leaving / max(squared, 0x1p-60));
}

fn ray_to_lamp(light: Light, receiver: Receiver, u: vec2f) -> LampRay {
    if light.kind == LIGHT_AREA {
        return ray_to_polygons(light, receiver, u);
    }
    let disc = light.extent * sampling_disc(u);
    let across = sampling_frame(receiver.to_light) * vec3f(disc, 0.0);
    if light.kind == LIGHT_DIRECTIONAL {
        return LampRay(normalize(receiver.to_light + across), BVH_FURTHEST, 1.0);
    }
    let way = receiver.distance * receiver.to_light + across;
    return LampRay(normalize(way), (1.0 - BEFORE_LAMP) * length(way), 1.0);
}

fn traced(light: Light, receiver: Receiver, id: vec2u) -> f32 {
    let start = receiver.position + SHADOW_BIAS * receiver.normal;
    let seed = hash_pcg4d(vec4u(id, params.light, params.sample_offset));
    let shift = vec2f(seed.xy >> vec2u(8u)) * 0x1p-24;
    // Light that arrives, and that would
    var sum = vec2f(0.0);
    for (var i = 0u; i < params.rays; i++) {
        let ray = ray_to_lamp(light, receiver, fract(random_recurrence(i) + shift));
        let weight = ray.weight * max(0.0, dot(receiver.normal, ray.direction));
        if weight <= 0.0 {
            continue;
        }
        let is_free = bvh_is_free(start, ray.direction, ray.furthest, BVH_CASTS_SHADOW);
        sum += weight * vec2f(select(0.0, 1.0, is_free), 1.0);
    }
    return select(0.0, sum.x / sum.y, sum.y > 0.0);
}

@compute @workgroup_size(8, 8)
fn trace_pixels(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= view.size) {
        return;
    }
    let light = lights[params.light];
    let receiver = receiver_at(light, id.xy);
    let is_seen = textureLoad(base_color_texture, id.xy + view.origin, 0).a > 0.0;
    var seen = 0.0;
    if is_seen && receiver_faces(light, receiver) {
        seen = traced(light, receiver, id.xy);
    }
    textureStore(visibility, id.xy, vec4f(seen));
}
