// The uniform of the tiled shape.

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
