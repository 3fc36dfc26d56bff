// A ray of the photon walk against the triangles: it sees the instances that environment maps see.

// What a photon's flux is to be multiplied by where a surface reflects or refracts by its shading normal, so that light goes as
// paths from the eye see it: |i.s| |o.g| / (|i.g| |o.s|), i from where it comes, o to where it goes, g and s the normals (Veach 1997,
// section 5.3). Glass is taken to refract if it can.
fn adjoint_factor(surface: BvhSurface, direction: vec3f, lobe: u32, is_back: bool) -> f32 {
    let g = select(surface.geometric_normal, -surface.geometric_normal, is_back);
    let s = select(surface.shading_normal, -surface.shading_normal, is_back);
    var out = reflect(direction, s);
    if lobe_kind(lobe) == LOBE_GLASS {
        let index = lobe_index_of_refraction(lobe);
        let refracted = refract(direction, s, select(1.0 / index, index, is_back));
        out = select(out, refracted, dot(refracted, refracted) > 0.0);
    }
    let factor = dot(direction, s) * dot(out, g) / (dot(direction, g) * dot(out, s));
    return clamp(factor, 0.0, ADJOINT_MOST);
}

// Light that grazes a facet would be multiplied by anything.
const ADJOINT_MOST: f32 = 4.0;

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
    let adjoint = select(1.0, adjoint_factor(surface, direction, lobe, is_back), is_shaded);
    lobe |= select(0u, HIT_BACK, is_back);
    let side = select(front, -front, is_back);
    return Hit(HIT_SURFACE, met.distance, surface.position, side, bvh_base_color(surface), number, lobe, adjoint);
}
