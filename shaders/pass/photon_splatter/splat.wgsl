// What a photon gives to a surface point: shared by the tiled gather and by quads.
//   E(x) = sum over photons of flux * K(|x - x_p| / h) / h^2,  K integrates to 1 over the unit disc.

// 0: constant, 1: cone, 2: Epanechnikov
override kernel: u32 = 2u;

const SPLAT_INVERSE_PI: f32 = 0.318309886;
// Cosine of the largest angle between the photon's and the receiver's normal: 45 degrees lets neighbouring facets share
// light and keeps the walls of a corner apart.
const SPLAT_NORMAL_AGREEMENT: f32 = 0.7;
// The slab around the photon's plane that receives it, as a share of the bandwidth: admits gentle curvature.
const SPLAT_SLAB: f32 = 0.25;
// And at least this thick, unit frame: depth and photon positions are f32.
const SPLAT_SLAB_FLOOR: f32 = 0x1p-11;

struct Bandwidth {
    // h = scale / sqrt(p), p = density / uniform density clamped to [lowest, highest]; scale alone if highest is 0
    scale: f32,
    uniform_density: f32,
    lowest: f32,
    highest: f32,
}

// K at squared relative distances q in [0, 1], four receivers at a time.
fn splat_kernel(q: vec4f) -> vec4f {
    switch kernel {
        case 0u: { return vec4f(SPLAT_INVERSE_PI); }
        case 1u: { return 3.0 * SPLAT_INVERSE_PI * (1.0 - sqrt(q)); }
        default: { return 2.0 * SPLAT_INVERSE_PI * (1.0 - q); }
    }
}

// Radius of a photon's kernel, unit frame (Yao et al. 2010, section 6, made dimensionless by area and pdf).
fn splat_bandwidth(b: Bandwidth, density: f32) -> f32 {
    if b.highest <= 0.0 {
        return b.scale;
    }
    return b.scale * inverseSqrt(clamp(density / b.uniform_density, b.lowest, b.highest));
}

// What a receiver needs of a photon's kernel, with all that does not depend on the receiver worked out.
struct Kernel {
    position: vec3f,
    inverse_radius_squared: f32,
    normal: vec3f,
    // Half thickness of the slab that receives it
    slab: f32,
    // Flux over squared radius, in units of the caller's choice
    strength: vec3f,
}

fn splat_prepare(position: vec3f, normal: vec3f, radius: f32, flux: vec3f) -> Kernel {
    let inverse = 1.0 / (radius * radius);
    return Kernel(position, inverse, normal, SPLAT_SLAB * radius + SPLAT_SLAB_FLOOR, flux * inverse);
}

// K at receivers at squared relative distance q, this far off the photon's plane, whose normals agree with its by this
// cosine; zero outside the disc, off the slab, or on a surface that turns away.
fn splat_weight(q: vec4f, off_plane: vec4f, agreement: vec4f, slab: f32) -> vec4f {
    let admitted = (q < vec4f(1.0)) & (off_plane <= vec4f(slab)) & (agreement >= vec4f(SPLAT_NORMAL_AGREEMENT));
    return select(vec4f(0.0), splat_kernel(min(q, vec4f(1.0))), admitted);
}

fn splat_position(view: View, pixel: vec2i) -> vec3f {
    let at = vec2u(pixel) + view.origin;
    return g_buffer_position(view, vec2f(pixel), textureLoad(depth_texture, at, 0).r);
}

// Geometric normal at a pixel, from its neighbours at full resolution.
fn splat_receiver_normal(view: View, pixel: vec2i, p: vec3f, shading: vec3f) -> vec3f {
    let limit = vec2i(view.size) - 1;
    let around = Neighbours(
        splat_position(view, vec2i(max(pixel.x - 1, 0), pixel.y)),
        splat_position(view, vec2i(min(pixel.x + 1, limit.x), pixel.y)),
        splat_position(view, vec2i(pixel.x, max(pixel.y - 1, 0))),
        splat_position(view, vec2i(pixel.x, min(pixel.y + 1, limit.y))),
    );
    return g_buffer_geometric_normal(view, pixel, p, around, shading);
}
