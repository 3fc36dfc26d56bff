// What a photon gives to surface points: shared by all shapes. The module says how many at a time: its `Receivers` is f32 or a
// vector of it.
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

// K at squared relative distances q in [0, 1].
fn splat_kernel(q: Receivers) -> Receivers {
    switch kernel {
        case 0u: { return Receivers(SPLAT_INVERSE_PI); }
        case 1u: { return 3.0 * SPLAT_INVERSE_PI * (1.0 - sqrt(q)); }
        default: { return 2.0 * SPLAT_INVERSE_PI * (1.0 - q); }
    }
}

// The relative distance within which a kernel has this share of its weight: the inverses of r^2, 3 r^2 - 2 r^3, 2 r^2 - r^4.
fn splat_kernel_radius(share: f32) -> f32 {
    switch kernel {
        case 0u: { return sqrt(share); }
        case 1u: { return 0.5 - sin(asin(1.0 - 2.0 * share) / 3.0); }
        default: { return sqrt(1.0 - sqrt(1.0 - share)); }
    }
}

// Half thickness of the slab that receives a photon of this radius.
fn splat_slab(radius: f32) -> f32 {
    return SPLAT_SLAB * radius + SPLAT_SLAB_FLOOR;
}

// K at receivers at squared relative distance q, this far off the photon's plane, whose normals agree with its by this
// cosine; zero outside the disc, off the slab, or on a surface that turns away.
fn splat_weight(q: Receivers, off_plane: Receivers, agreement: Receivers, slab: f32) -> Receivers {
    let near = (q < Receivers(1.0)) & (off_plane <= Receivers(slab));
    let admitted = near & (agreement >= Receivers(SPLAT_NORMAL_AGREEMENT));
    return select(Receivers(0.0), splat_kernel(min(q, Receivers(1.0))), admitted);
}
