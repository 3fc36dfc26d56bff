// A ray of the photon walk against the triangles: it sees the instances that environment maps see.

fn trace_ray(position: vec3f, normal: vec3f, direction: vec3f) -> Hit {
    let origin = bvh_offset(position, normal);
    let met = bvh_closest(origin, direction, BVH_FURTHEST, BVH_IN_ENV_MAPS);
    if met.instance == BVH_NONE {
        return hit_nothing(HIT_ESCAPED);
    }
    let surface = bvh_surface(met);
    let is_back = dot(surface.geometric_normal, direction) > 0.0;
    let side = select(surface.geometric_normal, -surface.geometric_normal, is_back);
    let number = bvh_instances[met.instance].mask >> BVH_SURFACE_SHIFT;
    return Hit(HIT_SURFACE, met.distance, surface.position, side, bvh_base_color(surface), number);
}
