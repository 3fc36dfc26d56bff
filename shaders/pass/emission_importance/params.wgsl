// The uniform of both steps.

struct Params {
    // Paths of the photons, and slots of all their hops
    path_count: u32,
    slot_count: u32,
    light_count: u32,
    // Invocations in a row of the dispatch over all slots
    row: u32,
    // Share of the photons that start where paths were seen, the others being spread evenly
    share: f32,
    // Of what was counted before, the part that is kept
    kept: f32,
}
