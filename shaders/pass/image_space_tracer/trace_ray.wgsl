// Ray against k environment maps: what the ways of searching share, and the choice between them.
//
// Walking along the ray, a point is in front of a map's surface, so the map vouches for the space up to it, or behind it,
// so the map knows nothing there.

struct Params {
    map_count: u32,
    map_size: u32,
    iterations: u32,
    // 1 - cos of the largest angle that the paper's test accepts
    epsilon: f32,
    // Most fetches of the hierarchical walk for a ray; what it has not found by then it cannot tell
    most_fetches: u32,
    // 1: a certain hit is tentative all the same where the map is too coarse for the surface's facets
    doubts_normals: u32,
}

@group(1) @binding(0) var<uniform> params: Params;
@group(1) @binding(1) var env_maps: texture_2d_array<u32>;
// w: 1 where the map is to be asked, 0 where it is switched off
@group(1) @binding(2) var<storage, read> centers: array<vec4f>;

@group(1) @binding(3) var depth_ranges: texture_2d_array<u32>;

// Twin of `TraceMethod`.
override method: u32 = 5u;

const METHOD_PAPER: u32 = 0u;
const METHOD_PLANE: u32 = 1u;
const METHOD_NEAREST_MARCH: u32 = 2u;
const METHOD_NEAREST_WALK: u32 = 3u;
const METHOD_ORDERED_MARCH: u32 = 4u;
const METHOD_ORDERED_WALK: u32 = 5u;
const METHOD_VERIFIED_WALK: u32 = 6u;

// Rays leave a surface from this far above it, along its geometric normal, unit frame.
const TRACE_OFFSET: f32 = 0x1p-12;
// They are searched from here to there, unit frame: a thousandth of a region of radius 1, and a little over the diameter
// of one that grew to a radius of 2 since the frame was made.
const TRACE_NEAREST: f32 = 0x1p-10;
const TRACE_FURTHEST: f32 = 5.0;
// Where nothing is: further from any map's centre than any point of a ray.
const TRACE_SKY: f32 = 16.0;
// A hit may leave the texel whose plane it was computed from by this many texels.
const TRACE_FOOTPRINT: f32 = 1.5;
// A map sees the origin if it lies no further behind the texel's plane than this (unit frame) plus a quarter texel.
const TRACE_BEHIND: f32 = 0x1p-9;

// Whether a map is to be asked: while its place is not yet known to be a good one it may be switched off.
fn trace_is_on(map: u32) -> bool {
    return centers[map].w > 0.0;
}

// Distance of the map's surface in the direction of p; beyond all rays where there is none.
fn trace_surface(map: u32, p: vec3f) -> f32 {
    let stored = env_map_distance(map, p, params.map_size);
    return select(TRACE_SKY, stored, stored > 0.0);
}

// Surface distance over point distance in the direction of p: at least 1 in front of the surface, less behind it.
fn trace_ratio(map: u32, p: vec3f) -> f32 {
    return trace_surface(map, p) / max(length(p), 1e-9);
}

// Where the chord of the surface between an undershoot (t, w >= 1) and an overshoot (t, w < 1) meets the ray, w as
// trace_ratio gives it: t = t1 (1 - b) + t2 b, b = w2 (w1 - 1) / (w1 - w2), because a point
// (1 - u) w1 p1 + u w2 p2 lies on the line p1 p2 where its weights sum to 1.
fn trace_chord(under: vec2f, over: vec2f) -> f32 {
    let b = over.y * (under.y - 1.0) / (under.y - over.y);
    return under.x + (over.x - under.x) * clamp(b, 0.0, 1.0);
}

// The surface that a texel shows, hit at p from the side that is seen.
fn trace_hit(surface: SurfaceTexel, distance: f32, p: vec3f) -> Hit {
    let back = select(0u, HIT_BACK, (surface.flags & SURFACE_TEXEL_BACK_FACE) != 0u);
    let lobe = surface_texel_lobe(surface) | back;
    return Hit(HIT_SURFACE, distance, p, surface.normal, surface.reflectance, surface_texel_surface(surface), lobe, 1.0);
}

// Ray against the plane of the texel's surface: it must be met from the front, and near where the texel lies.
fn trace_accept_plane(texel: EnvMapTexel, x: vec3f, r: vec3f) -> Hit {
    let n = texel.surface.normal;
    let toward = dot(n, r);
    if toward > -1e-4 {
        return hit_nothing(HIT_LOST);
    }
    let distance = dot(n, texel.direction * texel.surface.distance - x) / toward;
    if !(distance >= TRACE_NEAREST && distance <= TRACE_FURTHEST) {
        return hit_nothing(HIT_LOST);
    }
    let p = x + distance * r;
    if dot(p, cube_face_forward(texel.face)) <= 0.0 {
        return hit_nothing(HIT_LOST);
    }
    let away = abs(cube_face_uv(texel.face, p) * f32(params.map_size) - texel.middle);
    if max(away.x, away.y) > TRACE_FOOTPRINT {
        return hit_nothing(HIT_LOST);
    }
    return trace_hit(texel.surface, distance, p);
}

// Whether a map sees a surface point from its front: then the ray starts in space that the map knows.
fn trace_sees(map: u32, x: vec3f, n: vec3f) -> bool {
    if dot(n, x) >= 0.0 {
        return false;
    }
    let texel = env_map_texel(map, x, params.map_size);
    let behind = TRACE_BEHIND + 0.5 * length(x) / f32(params.map_size);
    let offset = x - texel.direction * texel.surface.distance;
    return texel.surface.distance > 0.0 && dot(texel.surface.normal, offset) >= -behind;
}

// What one map says of a stretch of a ray.
struct MapTrace {
    // HIT_SURFACE: `hit` is certain. HIT_ESCAPED: all of it is free. HIT_LOST: free up to `free`, unknown beyond.
    kind: u32,
    free: f32,
    // The first crossing found, certain or not; HIT_LOST if there is none
    hit: Hit,
}

// What this ray has cost so far.
var<private> trace_steps: u32;
var<private> trace_maps: u32;

// What a map says of the ray from `start` to `end`, given whether it sees the point at the start; x is relative to the
// map's centre, and so is the hit.
fn trace_map(map: u32, x: vec3f, r: vec3f, start: f32, end: f32, starts_in_front: bool) -> MapTrace {
    trace_maps++;
    if method == METHOD_ORDERED_MARCH || method == METHOD_NEAREST_MARCH {
        return march_map(map, x, r, start, end, starts_in_front);
    }
    return hierarchy_map(map, x, r, start, end, starts_in_front);
}

fn trace_ray(position: vec3f, normal: vec3f, r: vec3f) -> Hit {
    env_map_fetches = 0u;
    trace_maps = 0u;
    trace_steps = 0u;
    let origin = position + TRACE_OFFSET * normal;
    switch method {
        case METHOD_PAPER, METHOD_PLANE: {
            return false_position_trace(origin, normal, r);
        }
        case METHOD_NEAREST_MARCH, METHOD_NEAREST_WALK: {
            return nearest_trace(origin, normal, r);
        }
        default: {
            return ordered_trace(origin, normal, r);
        }
    }
}
