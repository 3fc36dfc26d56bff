// A ray of the photon walk against the triangles: it sees the instances that environment maps see.

fn trace_ray(position: vec3f, normal: vec3f, direction: vec3f) -> Hit {
    let origin = bvh_offset(position, normal);
    let met = bvh_closest(origin, direction, BVH_FURTHEST, BVH_IN_ENV_MAPS);
    if met.instance == BVH_NONE {
        return hit_nothing(HIT_ESCAPED);
    }
    let surface = bvh_surface(met);
    let is_back = dot(surface.geometric_normal, direction) > 0.0;
    let number = bvh_instances[met.instance].mask >> BVH_SURFACE_SHIFT;
    var lobe = bvh_lobe(surface);
    // What reflects and refracts is as smooth as it is shaded, wherever the ray comes from that side.
    let is_shaded = lobe_is_specular(lobe) && (dot(surface.shading_normal, direction) > 0.0) == is_back;
    let front = select(surface.geometric_normal, surface.shading_normal, is_shaded);
    lobe |= select(0u, HIT_BACK, is_back);
    let side = select(front, -front, is_back);
    return Hit(HIT_SURFACE, met.distance, surface.position, side, bvh_base_color(surface), number, lobe);
}
