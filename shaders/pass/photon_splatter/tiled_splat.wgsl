// What the steps of the tiled shape share.

struct TiledParams {
    bandwidth: Bandwidth,
    // Slots of the photon buffer to read: from, how many
    first_slot: u32,
    slot_count: u32,
    // Invocations in a row of the dispatch
    row: u32,
}

// Parts of a pixel that reach is counted in.
const REACH_STEPS: u32 = 16u;

// A photon ready to be added up.
struct Splat {
    position: vec3f,
    inverse_radius_squared: f32,
    // Flux over squared radius
    strength: vec3f,
    normal: u32,
}

// One that reaches no receiver.
fn splat_nothing() -> Splat {
    return Splat(vec3f(0.0), 0x1p100, vec3f(0.0), 0u);
}
