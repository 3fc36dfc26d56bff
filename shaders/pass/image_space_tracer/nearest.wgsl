// Every map is asked, and the nearest surface that any of them shows wins: the paper's rule (Yao et al. 2010, section 5)
// with a surer search in each map. A distant map adds coarse silhouettes in front of the true hit, so more maps can be
// worse than fewer.

fn nearest_trace(origin: vec3f, normal: vec3f, r: vec3f) -> Hit {
    var best = hit_nothing(HIT_LOST);
    for (var map = 0u; map < params.map_count; map++) {
        if !trace_is_on(map) {
            continue;
        }
        let center = centers[map].xyz;
        let x = origin - center;
        let found = trace_map(map, x, r, 0.0, TRACE_FURTHEST, trace_sees(map, x, normal));
        let is_hit = found.kind == HIT_SURFACE || found.hit.kind == HIT_SURFACE;
        if is_hit && (best.kind != HIT_SURFACE || found.hit.distance < best.distance) {
            best = found.hit;
            best.position += center;
            best.kind = HIT_SURFACE;
        } else if found.kind == HIT_ESCAPED && best.kind == HIT_LOST {
            best.kind = HIT_ESCAPED;
        }
    }
    return best;
}
