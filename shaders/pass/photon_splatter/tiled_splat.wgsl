// What the steps of the tiled shape share.

struct TiledParams {
    bandwidth: Bandwidth,
    // Slots of the photon buffer to read: from, how many
    first_slot: u32,
    slot_count: u32,
    // Invocations in a row of the dispatch
    row: u32,
}

// Bits of a splat's radius that number its surface, where photons keep to surfaces.
const SPLAT_SURFACE_BITS: u32 = 0xffffu;

// Parts of a pixel that reach is counted in.
const REACH_STEPS: u32 = 16u;

// A photon ready to be added up.
struct Splat {
    position: vec3f,
    // Bits of one over the squared radius; where photons keep to surfaces, the last sixteen are the surface's number
    inverse_radius_squared: u32,
    // Flux over squared radius
    strength: vec3f,
    normal: u32,
}

fn splat_inverse(splat: Splat) -> f32 {
    if splat_keeps_to_surfaces {
        return bitcast<f32>(splat.inverse_radius_squared & ~SPLAT_SURFACE_BITS);
    }
    return bitcast<f32>(splat.inverse_radius_squared);
}

// One that reaches no receiver.
fn splat_nothing() -> Splat {
    return Splat(vec3f(0.0), bitcast<u32>(0x1p100f), vec3f(0.0), 0u);
}
