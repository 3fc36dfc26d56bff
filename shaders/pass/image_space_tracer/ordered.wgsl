// Maps are asked in order of their distance to the ray's origin, and what one knows to be free is carried to the next,
// which starts there. A crossing found in front of all unknown parts ends the ray; one behind them is tentative, and
// counts if no other map tells better.

// A map may deny a tentative crossing unless it is further from it than the map that showed it by this factor.
const ORDERED_DENIAL: f32 = 1.5;
// A certain crossing is looked at again from up to so many maps that are nearer to it by this factor at least.
const ORDERED_WITNESSES: u32 = 3u;
const ORDERED_NEARER: f32 = 0.8;
// So far before and behind it: this many texels of the map that showed it, and no less than this, unit frame.
const ORDERED_WINDOW: f32 = 4.0;
const ORDERED_LEAST_WINDOW: f32 = 0x1p-8;

// The map after `last` in order of (distance, index) to a point; params.map_count if there is none.
fn ordered_next_map(p: vec3f, last: vec2f) -> vec2f {
    var next = vec2f(1e30, f32(params.map_count));
    for (var map = 0u; map < min(params.map_count, arrayLength(&centers)); map++) {
        let candidate = vec2f(distance(p, centers[map].xyz), f32(map));
        let is_later = candidate.x > last.x || (candidate.x == last.x && candidate.y > last.y);
        if is_later && candidate.x < next.x && trace_is_on(map) {
            next = candidate;
        }
    }
    return next;
}

// Whether a map vouches for a point of space.
fn ordered_sees_space(map: u32, p: vec3f) -> bool {
    return trace_surface(map, p) >= length(p);
}

// Whether a map vouches for the ray's point at `free`: for its origin by the surface it lies on.
fn ordered_knows(map: u32, x: vec3f, normal: vec3f, r: vec3f, free: f32) -> bool {
    if free > 0.0 {
        return ordered_sees_space(map, x + free * r);
    }
    return trace_sees(map, x, normal);
}

// Whether a crossing that is not certain is to be preferred: one seen from the front to one inferred from behind, then the
// nearer.
fn ordered_is_better(hit: Hit, than: Hit) -> bool {
    if hit.kind == HIT_LOST || than.kind == HIT_LOST || hit.kind == than.kind {
        return hit.kind != HIT_LOST && (than.kind == HIT_LOST || hit.distance < than.distance);
    }
    return hit.kind == HIT_SURFACE;
}

struct Verdict {
    // HIT_SURFACE: `hit` stands, as the nearest map shows it. HIT_ESCAPED: there is nothing, up to `free`.
    kind: u32,
    hit: Hit,
    free: f32,
}

// Looks again at a crossing that one map is certain of, from nearer maps.
fn ordered_verify(origin: vec3f, r: vec3f, crossing: Hit, map: u32) -> Verdict {
    var verdict = Verdict(HIT_SURFACE, crossing, crossing.distance);
    let reach = distance(crossing.position, centers[map].xyz);
    let window = max(ORDERED_LEAST_WINDOW, ORDERED_WINDOW * 2.0 * reach / f32(params.map_size));
    let start = max(0.0, crossing.distance - window);
    let end = crossing.distance + window;
    var ordered = vec2f(-1.0, -1.0);
    for (var i = 0u; i < ORDERED_WITNESSES; i++) {
        ordered = ordered_next_map(crossing.position, ordered);
        if ordered.x > ORDERED_NEARER * reach {
            break;
        }
        let witness = u32(ordered.y);
        let center = centers[witness].xyz;
        let x = origin - center;
        if !ordered_sees_space(witness, x + start * r) {
            continue;
        }
        var found = trace_map(witness, x, r, start, end, true);
        if found.kind == HIT_SURFACE {
            found.hit.position += center;
            return Verdict(HIT_SURFACE, found.hit, found.hit.distance);
        }
        if found.kind == HIT_ESCAPED {
            return Verdict(HIT_ESCAPED, crossing, end);
        }
    }
    return verdict;
}

// The ray through the maps in order. A map that does not know where the ray stands may see what lies behind walls. The walk
// notices when a ray comes out of a wall. The march does not: it passes over such maps, and only a ray whose origin no map
// knows is looked for everywhere.
fn ordered_trace(origin: vec3f, normal: vec3f, r: vec3f) -> Hit {
    let only_knowing = method == METHOD_ORDERED_MARCH;
    var free = 0.0;
    var tentative = hit_nothing(HIT_LOST);
    // Of the map that showed it
    var tentative_reach = 0.0;
    var is_known = false;
    for (var round = 0u; round < 2u && !is_known && (only_knowing || round == 0u); round++) {
        var ordered = ordered_next_map(origin, vec2f(-1.0, -1.0));
        for (; u32(ordered.y) < params.map_count; ordered = ordered_next_map(origin, ordered)) {
            let map = u32(ordered.y);
            let center = centers[map].xyz;
            let x = origin - center;
            let knows = ordered_knows(map, x, normal, r, free);
            if !knows && only_knowing && round == 0u {
                continue;
            }
            is_known = is_known || knows;
            // A map that cannot be certain is of use only where it shows something nearer.
            let end = select(TRACE_FURTHEST, tentative.distance, !knows && tentative.kind == HIT_SURFACE);
            var found = trace_map(map, x, r, free, end, knows);
            found.hit.position += center;
            if found.kind == HIT_ESCAPED {
                return hit_nothing(HIT_ESCAPED);
            }
            free = found.free;
            if found.kind == HIT_SURFACE {
                if method != METHOD_VERIFIED_WALK {
                    return found.hit;
                }
                let verdict = ordered_verify(origin, r, found.hit, map);
                if verdict.kind == HIT_SURFACE {
                    return verdict.hit;
                }
                free = verdict.free;
                found.hit = hit_nothing(HIT_LOST);
            }
            let may_deny = distance(tentative.position, center) <= ORDERED_DENIAL * tentative_reach;
            if tentative.kind != HIT_LOST && tentative.distance < free && may_deny {
                tentative = hit_nothing(HIT_LOST);
            }
            if ordered_is_better(found.hit, tentative) {
                tentative = found.hit;
                tentative_reach = distance(found.hit.position, center);
            }
        }
    }
    // What a ray must have met is only known of one that set out where a map looks: others may never have come there, like
    // those from the outside of a building that is seen from within.
    if tentative.kind == HIT_TENTATIVE && !is_known {
        return hit_nothing(HIT_LOST);
    }
    if tentative.kind == HIT_SURFACE {
        tentative.kind = HIT_TENTATIVE;
    }
    return tentative;
}
