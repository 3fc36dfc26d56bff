// What a ray meets. Every tracer of the photon walk has a `trace_ray(position, normal, direction) -> Hit`: from a point of
// a surface, along a unit direction on the side that the geometric normal points to.

const HIT_SURFACE: u32 = 1u;
const HIT_ESCAPED: u32 = 2u;
const HIT_LOST: u32 = 3u;
const HIT_TENTATIVE: u32 = 4u;

struct Hit {
    // HIT_SURFACE: all else holds. HIT_TENTATIVE: the same, but a surer tracer may find otherwise. HIT_ESCAPED: there is
    // nothing. HIT_LOST: the tracer cannot tell.
    kind: u32,
    distance: f32,
    // Unit frame
    position: vec3f,
    // On the side hit: geometric, of metal and glass the shading normal
    normal: vec3f,
    reflectance: vec3f,
    // The surface hit, 0: none in particular
    surface: u32,
    // How it scatters (lobe.wgsl), and HIT_BACK
    lobe: u32,
    // Factor of a photon's flux where the normal is not that of the triangle; else 1
    adjoint: f32,
}

// Beside a lobe: the back of a surface is hit, as from inside a body.
const HIT_BACK: u32 = 0x4000u;

fn hit_nothing(kind: u32) -> Hit {
    return Hit(kind, 0.0, vec3f(0.0), vec3f(0.0), vec3f(0.0), 0u, 0u, 1.0);
}
