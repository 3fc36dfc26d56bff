// Ray against k environment maps, nearest map first, each marched in equal angles.
//
// Walking along the ray, a point is in front of a map's surface, so the map vouches for the space up to it, or behind it,
// so the map knows nothing. A step from front to behind brackets a crossing: a surface, if its texel's plane accepts the
// ray, and a silhouette beyond which nothing is known otherwise. What one map knows to be free is carried to the next,
// which starts there. A crossing found in front of all unknown parts ends the ray; one behind them is tentative, and
// counts if no other map tells better.

// Angle of a step as seen from the map's centre: 32 steps for a ray that passes from horizon to horizon.
const MARCH_STEP: f32 = 0.0981747704;
// Steps of false position once a crossing is bracketed.
const MARCH_REFINEMENTS: u32 = 5u;
// A ray through a map's centre is a single texel on either side; nearer than this it is moved aside to have an angle.
const MARCH_CLOSEST: f32 = 0x1p-14;

struct March {
    // HIT_SURFACE, HIT_ESCAPED: certain. HIT_LOST: known to be free up to `free`, unknown beyond.
    kind: u32,
    free: f32,
    // The first crossing found, certain or tentative; HIT_LOST if there is none
    hit: Hit,
}

// The surface crossing between a point in front (t, w) and one behind.
fn march_refine(map: u32, x: vec3f, r: vec3f, front: vec2f, behind: vec2f) -> Hit {
    var under = front;
    var over = behind;
    var t = trace_chord(under, over);
    for (var i = 0u; i < MARCH_REFINEMENTS; i++) {
        let w = trace_ratio(map, x + t * r);
        if w >= 1.0 {
            under = vec2f(t, w);
        } else {
            over = vec2f(t, w);
        }
        // Halving every other step, because false position alone creeps along a curved bracket.
        t = select(trace_chord(under, over), 0.5 * (under.x + over.x), (i & 1u) == 1u);
    }
    var texel = env_map_texel(map, x + over.x * r, params.map_size);
    let hit = trace_accept_plane(texel, x, r);
    if hit.kind == HIT_SURFACE {
        return hit;
    }
    // The crossing may fall exactly between two texels: the one in front may hold the surface.
    texel = env_map_texel(map, x + under.x * r, params.map_size);
    if texel.surface.distance <= 0.0 {
        return hit;
    }
    return trace_accept_plane(texel, x, r);
}

// What one map says of the ray from `start` on, given whether it sees the point there.
fn march_map(map: u32, x: vec3f, r: vec3f, start: f32, starts_in_front: bool) -> March {
    let closest = -dot(x, r);
    let aside = max(length(x + closest * r), MARCH_CLOSEST);
    let first_angle = atan((start - closest) / aside);
    let last_angle = atan((TRACE_FURTHEST - closest) / aside);
    let steps = u32(ceil((last_angle - first_angle) / MARCH_STEP));
    var result = March(HIT_LOST, start, hit_nothing(HIT_LOST));
    var is_certain = starts_in_front;
    var in_front = starts_in_front;
    var previous = vec2f(start, 1.0);
    let step_tan = tan((last_angle - first_angle) / f32(max(steps, 1u)));
    var tangent = (start - closest) / aside;
    for (var i = 1u; i <= steps; i++) {
        // tan(a + b) from tan a and tan b.
        tangent = (tangent + step_tan) / (1.0 - tangent * step_tan);
        let t = select(closest + aside * tangent, TRACE_FURTHEST, i == steps);
        let w = trace_ratio(map, x + t * r);
        if in_front && w < 1.0 {
            let hit = march_refine(map, x, r, previous, vec2f(t, w));
            if hit.kind == HIT_SURFACE {
                result.hit = hit;
                result.kind = select(HIT_LOST, HIT_SURFACE, is_certain);
                return result;
            }
            is_certain = false;
        }
        in_front = w >= 1.0;
        previous = vec2f(t, w);
        if in_front && is_certain {
            result.free = t;
        }
    }
    if is_certain {
        result.kind = HIT_ESCAPED;
    }
    return result;
}

// The map after `last` in order of (distance, index) to a point; params.map_count if there is none.
fn march_next_map(origin: vec3f, last: vec2f) -> vec2f {
    var next = vec2f(1e30, f32(params.map_count));
    for (var map = 0u; map < params.map_count; map++) {
        let candidate = vec2f(distance(origin, centers[map].xyz), f32(map));
        let is_later = candidate.x > last.x || (candidate.x == last.x && candidate.y > last.y);
        if is_later && candidate.x < next.x && trace_is_on(map) {
            next = candidate;
        }
    }
    return next;
}

// Whether a map vouches for the ray's point at `free`: for its origin by the surface it lies on, further on by distance.
fn march_knows(map: u32, x: vec3f, normal: vec3f, r: vec3f, free: f32) -> bool {
    if free > 0.0 {
        let p = x + free * r;
        return trace_surface(map, p) >= length(p);
    }
    return trace_sees(map, x, normal);
}

// The ray through the maps in order. Maps that do not know where it stands are passed over, for what they see may lie
// behind walls; only a ray whose origin no map knows is looked for everywhere.
fn ordered_march_trace(origin: vec3f, normal: vec3f, r: vec3f) -> Hit {
    var free = 0.0;
    var tentative = hit_nothing(HIT_LOST);
    var is_known = false;
    for (var round = 0u; round < 2u && !is_known; round++) {
        var ordered = vec2f(-1.0, -1.0);
        for (var i = 0u; i < params.map_count; i++) {
            ordered = march_next_map(origin, ordered);
            let map = u32(ordered.y);
            if map >= params.map_count {
                break;
            }
            let center = centers[map].xyz;
            let x = origin - center;
            let knows = march_knows(map, x, normal, r, free);
            if !knows && round == 0u {
                continue;
            }
            is_known = is_known || knows;
            var march = march_map(map, x, r, free, knows);
            march.hit.position += center;
            if march.kind == HIT_SURFACE {
                return march.hit;
            }
            if march.kind == HIT_ESCAPED {
                return hit_nothing(HIT_ESCAPED);
            }
            free = march.free;
            // A crossing that this map knows to lie in free space is no surface.
            if tentative.kind == HIT_SURFACE && tentative.distance < free {
                tentative = hit_nothing(HIT_LOST);
            }
            if march.hit.kind == HIT_SURFACE && (tentative.kind != HIT_SURFACE || march.hit.distance < tentative.distance) {
                tentative = march.hit;
            }
        }
    }
    return tentative;
}
