// The uniform of all steps.

struct Params {
    // Of the store
    path_count: u32,
    hop_count: u32,
    light_count: u32,
    group_count: u32,
    // Groups are probed every so many frames, a part of them in each
    interval: u32,
    // Which part, and which member of each group
    first_group: u32,
    round: u32,
    // Paths that may be traced anew
    budget: u32,
    // Slots of `kept` of a hop
    kept_count: u32,
    // Lengths in the unit frame, and shares of flux, up to which a photon is where it was
    position_tolerance: f32,
    flux_tolerance: f32,
    // Bits of lights that moved
    moved_low: u32,
    moved_high: u32,
}

// Paths of a light, and their groups: path i of it is in group i modulo their number.
struct GroupedLight {
    first_path: u32,
    path_count: u32,
    first_group: u32,
    group_count: u32,
}
