// How wide kernels are: the uniform that says it, and what of it does not hang on a view.

struct Bandwidth {
    // h = scale / sqrt(p), p the density over the uniform one, clamped to [lowest, highest]
    scale: f32,
    lowest: f32,
    highest: f32,
    // The uniform density, per area: of one photon of a hop, by BANDWIDTH_BIN of all photons
    uniform: f32,
    // BANDWIDTH_...
    rule: u32,
    // Smallest and largest radius in pixels of the G-buffer
    min_radius: f32,
    max_radius: f32,
    // Pixels of the G-buffer for each one of the irradiance, along each axis
    factor: u32,
}

const BANDWIDTH_FIXED: u32 = 0u;
const BANDWIDTH_DENSITY: u32 = 1u;
const BANDWIDTH_BIN: u32 = 2u;

// Where more photons come by than elsewhere, the rule that goes by density narrows their kernels: noise and blur together are least
// where radii fall as the sixth root of the number of photons. Half of them are taken to be guided.
fn bandwidth_narrowing(b: Bandwidth, photon: Photon) -> f32 {
    return select(1.0, pow(photon_boost(photon.state, 0.5), -1.0 / 6.0), b.rule == BANDWIDTH_DENSITY);
}

// Radius of a photon's kernel, unit frame (Yao et al. 2010, section 6, made dimensionless by area and pdf); by BANDWIDTH_BIN that
// of a photon of uniform density.
fn bandwidth_radius(b: Bandwidth, photon: Photon) -> f32 {
    let density = clamp(photon.density / b.uniform, b.lowest, b.highest);
    let narrowed = b.scale * inverseSqrt(density) * bandwidth_narrowing(b, photon);
    return select(b.scale, narrowed, b.rule == BANDWIDTH_DENSITY);
}
