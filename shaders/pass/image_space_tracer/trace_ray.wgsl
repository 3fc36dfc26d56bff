// Ray against k environment maps by false position (Yao et al. 2010, section 5, after Szirmay-Kalos et al. 2005).
//
// A map is the radial graph of a surface: look-up in the direction of a point p of the ray gives the distance s at which
// the map's surface lies. With w = s / |p|, w > 1 says that p is in front of the surface (undershoot), w < 1 behind it
// (overshoot). Between an undershoot and an overshoot, the chord of their two surface points meets the ray at
//     t = t1 (1 - b) + t2 b,   b = w2 (w1 - 1) / (w1 - w2),
// because a point (1 - u) w1 p1 + u w2 p2 lies on the line p1 p2 where its weights sum to 1.
// The first guess is the plane through the surface point A in the ray's own direction, perpendicular to it; while one
// bracket is missing, A stands in for the ray's point at infinity, which gives t = t1 + |A| (1 - 1/w1).

// 0: the paper's test, angle alone. 1: front face, texel plane, footprint, origin seen.
override hit_test: u32 = 1u;

const HIT_TEST_ANGLE: u32 = 0u;
const TRACE_HIT: u32 = 1u;
const TRACE_ESCAPED: u32 = 2u;
const TRACE_LOST: u32 = 3u;

// Rays are searched from here to there, unit frame: a thousandth of a region of radius 1, and a little over its diameter.
const TRACE_NEAREST: f32 = 0x1p-10;
const TRACE_FURTHEST: f32 = 2.5;
// What a texel where nothing was seen stands for while iterating.
const TRACE_NOTHING: f32 = 2.5;
// A hit may leave the texel whose plane it was computed from by this many texels.
const TRACE_FOOTPRINT: f32 = 1.5;
// A map sees the origin if it lies no further behind the texel's plane than this (unit frame) plus a quarter texel.
const TRACE_BEHIND: f32 = 0x1p-9;

struct Hit {
    kind: u32,
    distance: f32,
    position: vec3f,
    normal: vec3f,
    reflectance: vec3f,
}

fn trace_nothing(kind: u32) -> Hit {
    return Hit(kind, TRACE_FURTHEST, vec3f(0.0), vec3f(0.0), vec3f(0.0));
}

// w of the comment above: surface distance over point distance, in the direction of p.
fn trace_ratio(map: u32, p: vec3f) -> f32 {
    let stored = env_map_distance(map, p, params.map_size);
    return select(TRACE_NOTHING, stored, stored > 0.0) / max(length(p), 1e-9);
}

// Where the ray x + t r (x relative to the map's centre) meets the map's surface, as far as false position can tell.
fn trace_search(map: u32, x: vec3f, r: vec3f) -> f32 {
    let stored = env_map_distance(map, r, params.map_size);
    let first = select(TRACE_NOTHING, stored, stored > 0.0);
    var t = clamp(first - dot(x, r), TRACE_NEAREST, TRACE_FURTHEST);
    var under = vec2f(0.0);
    var over = vec2f(0.0);
    for (var i = 0u; i < params.iterations; i++) {
        let w = trace_ratio(map, x + t * r);
        if w >= 1.0 {
            under = vec2f(t, w);
        } else {
            over = vec2f(t, w);
        }
        if under.y > 0.0 && over.y > 0.0 {
            let b = over.y * (under.y - 1.0) / (under.y - over.y);
            t = under.x + (over.x - under.x) * clamp(b, 0.0, 1.0);
        } else {
            t = clamp(t + first * (1.0 - 1.0 / max(w, 1e-9)), TRACE_NEAREST, TRACE_FURTHEST);
        }
    }
    return t;
}

// The paper's acceptance: the stored point itself, if it lies within a small angle of the ray as seen from its origin.
fn trace_accept_angle(texel: EnvMapTexel, x: vec3f, r: vec3f) -> Hit {
    let stored = texel.direction * texel.surface.distance;
    let offset = stored - x;
    let distance = length(offset);
    let error = 1.0 - dot(offset, r) / max(distance, 1e-9);
    // A point's own texel lies on every ray from it: nearer than this is the origin itself.
    if error > params.epsilon || distance < 4.0 * TRACE_NEAREST {
        return trace_nothing(TRACE_LOST);
    }
    return Hit(TRACE_HIT, distance, stored, texel.surface.normal, texel.surface.reflectance);
}

// Ray against the plane of the texel's surface: it must be met from the front, and near where the texel lies.
fn trace_accept_plane(texel: EnvMapTexel, x: vec3f, r: vec3f) -> Hit {
    let n = texel.surface.normal;
    let toward = dot(n, r);
    if toward > -1e-4 {
        return trace_nothing(TRACE_LOST);
    }
    let distance = dot(n, texel.direction * texel.surface.distance - x) / toward;
    if !(distance >= TRACE_NEAREST && distance <= TRACE_FURTHEST) {
        return trace_nothing(TRACE_LOST);
    }
    let p = x + distance * r;
    if dot(p, cube_face_forward(texel.face)) <= 0.0 {
        return trace_nothing(TRACE_LOST);
    }
    let away = abs(cube_face_uv(texel.face, p) * f32(params.map_size) - texel.middle);
    if max(away.x, away.y) > TRACE_FOOTPRINT {
        return trace_nothing(TRACE_LOST);
    }
    return Hit(TRACE_HIT, distance, p, n, texel.surface.reflectance);
}

// What one map says of the ray.
fn trace_map(map: u32, x: vec3f, r: vec3f) -> Hit {
    let t = trace_search(map, x, r);
    let texel = env_map_texel(map, x + t * r, params.map_size);
    if texel.surface.distance <= 0.0 {
        return trace_nothing(TRACE_ESCAPED);
    }
    if hit_test == HIT_TEST_ANGLE {
        return trace_accept_angle(texel, x, r);
    }
    return trace_accept_plane(texel, x, r);
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

// The nearest hit that any map accepts. With the plane test only maps that see the ray's origin are asked, if there are
// any: another map's surfaces may lie behind walls that it does not know.
fn trace_ray(origin: vec3f, normal: vec3f, r: vec3f) -> Hit {
    var best = trace_nothing(TRACE_LOST);
    var asked = 0u;
    for (var round = 0u; round < 2u; round++) {
        for (var map = 0u; map < params.map_count; map++) {
            let center = centers[map].xyz;
            let x = origin - center;
            if round == 0u && hit_test != HIT_TEST_ANGLE && !trace_sees(map, x, normal) {
                continue;
            }
            asked++;
            let hit = trace_map(map, x, r);
            if hit.kind == TRACE_HIT && (best.kind != TRACE_HIT || hit.distance < best.distance) {
                best = hit;
                best.position += center;
            } else if hit.kind == TRACE_ESCAPED && best.kind == TRACE_LOST {
                best.kind = TRACE_ESCAPED;
            }
        }
        if asked > 0u {
            break;
        }
    }
    return best;
}
