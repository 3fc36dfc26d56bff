// Ray against one environment map, marched in equal angles: few fetches, and thin things between two steps are missed.
//
// A step from front to behind brackets a crossing: a surface, if its texel's plane accepts the ray, and a silhouette beyond
// which nothing is known otherwise.

// Angle of a step as seen from the map's centre: 32 steps for a ray that passes from horizon to horizon.
const MARCH_STEP: f32 = 0.0981747704;
// Steps of false position once a crossing is bracketed.
const MARCH_REFINEMENTS: u32 = 5u;
// A ray through a map's centre is a single texel on either side; nearer than this it is moved aside to have an angle.
const MARCH_CLOSEST: f32 = 0x1p-14;

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

fn march_map(map: u32, x: vec3f, r: vec3f, start: f32, end: f32, starts_in_front: bool) -> MapTrace {
    let closest = -dot(x, r);
    let aside = max(length(x + closest * r), MARCH_CLOSEST);
    let first_angle = atan((start - closest) / aside);
    let last_angle = atan((end - closest) / aside);
    let steps = u32(max(ceil((last_angle - first_angle) / MARCH_STEP), 0.0));
    var result = MapTrace(HIT_LOST, start, hit_nothing(HIT_LOST));
    var is_certain = starts_in_front;
    var in_front = starts_in_front;
    var previous = vec2f(start, 1.0);
    let step_tan = tan((last_angle - first_angle) / f32(max(steps, 1u)));
    var tangent = (start - closest) / aside;
    for (var i = 1u; i <= steps; i++) {
        // tan(a + b) from tan a and tan b.
        tangent = (tangent + step_tan) / (1.0 - tangent * step_tan);
        let t = select(closest + aside * tangent, end, i == steps);
        trace_steps++;
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
