// The uniform of all steps, and how their counts lie.

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

// Numbers for each emission cell: the weight of the hops of its paths that were seen, how many those were; and for each of the
// reflections by which paths go on from a diffuse first hit, the weight of those that came that way.
const CELL_COUNTS: u32 = 2u + REFLECTION_CELL_TOTAL;
