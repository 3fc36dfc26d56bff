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

// Numbers for each emission cell: the weight of the hops of its paths that were seen, and how many those were.
const CELL_COUNTS: u32 = 2u;
// Behind them, for each table of reflections: how many hops of paths that went on there were seen, and for each way the weight
// of those that came by it.
const REFLECTION_COUNTS: u32 = 1u + REFLECTION_CELL_TOTAL;
const REFLECTION_COUNTS_FROM: u32 = CELL_COUNTS * EMISSION_CELL_TOTAL * 64u;
