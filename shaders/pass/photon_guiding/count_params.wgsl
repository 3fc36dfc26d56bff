// The uniform of the counts.

struct CountParams {
    // Paths of the photons, and slots of all their hops
    path_count: u32,
    slot_count: u32,
    light_count: u32,
    // Invocations in a row of the dispatch over all slots
    row: u32,
}
