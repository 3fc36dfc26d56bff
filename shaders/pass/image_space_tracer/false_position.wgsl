// Ray against k environment maps by false position (Yao et al. 2010, section 5, after Szirmay-Kalos et al. 2005).
//
// A map is the radial graph of a surface: the look-up in the direction of a point of the ray says whether the point is in
// front of the surface (undershoot) or behind it (overshoot). The first guess is the plane through the surface point A in
// the ray's own direction, perpendicular to it; while one bracket is missing, A stands in for the ray's point at
// infinity, which gives t = t1 + |A| (1 - 1/w1). The nearest hit that any map accepts wins.

// Where the ray x + t r (x relative to the map's centre) meets the map's surface, as far as false position can tell.
fn false_position_search(map: u32, x: vec3f, r: vec3f) -> f32 {
    let first = trace_surface(map, r);
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
            t = trace_chord(under, over);
        } else {
            t = clamp(t + first * (1.0 - 1.0 / max(w, 1e-9)), TRACE_NEAREST, TRACE_FURTHEST);
        }
    }
    return t;
}

// The paper's acceptance: the stored point itself, if it lies within a small angle of the ray as seen from its origin.
fn false_position_accept_angle(texel: EnvMapTexel, x: vec3f, r: vec3f) -> Hit {
    let stored = texel.direction * texel.surface.distance;
    let offset = stored - x;
    let distance = length(offset);
    let error = 1.0 - dot(offset, r) / max(distance, 1e-9);
    // A point's own texel lies on every ray from it: nearer than this is the origin itself.
    if error > params.epsilon || distance < 4.0 * TRACE_NEAREST {
        return hit_nothing(HIT_LOST);
    }
    return trace_hit(texel.surface, distance, stored);
}

// What one map says of the ray.
fn false_position_map(map: u32, x: vec3f, r: vec3f) -> Hit {
    let t = false_position_search(map, x, r);
    let texel = env_map_texel(map, x + t * r, params.map_size);
    if texel.surface.distance <= 0.0 {
        return hit_nothing(HIT_ESCAPED);
    }
    if method == METHOD_PAPER {
        return false_position_accept_angle(texel, x, r);
    }
    return trace_accept_plane(texel, x, r);
}

// The nearest hit that any map accepts. With the plane test only maps that see the ray's origin are asked, if there are
// any: another map's surfaces may lie behind walls that it does not know.
fn false_position_trace(origin: vec3f, normal: vec3f, r: vec3f) -> Hit {
    var best = hit_nothing(HIT_LOST);
    var asked = 0u;
    for (var round = 0u; round < 2u; round++) {
        for (var map = 0u; map < params.map_count; map++) {
            if !trace_is_on(map) {
                continue;
            }
            let center = centers[map].xyz;
            let x = origin - center;
            if round == 0u && method != METHOD_PAPER && !trace_sees(map, x, normal) {
                continue;
            }
            asked++;
            trace_maps++;
            let hit = false_position_map(map, x, r);
            if hit.kind == HIT_SURFACE && (best.kind != HIT_SURFACE || hit.distance < best.distance) {
                best = hit;
                best.position += center;
            } else if hit.kind == HIT_ESCAPED && best.kind == HIT_LOST {
                best.kind = HIT_ESCAPED;
            }
        }
        if asked > 0u {
            break;
        }
    }
    return best;
}
