// The uniform of all steps, and what they count.

struct Params {
    // Paths of the photons, and slots of all their hops
    path_count: u32,
    slot_count: u32,
    light_count: u32,
    // Invocations in a row of the dispatch over all slots
    row: u32,
    // Share of the photons that are guided
    share: f32,
    // Of what was counted before, the part that is kept
    kept: f32,
}

// For each cell of an emission: the weight of the hops of its paths that were seen, and how many these were. Twin of
// `EMISSION_COUNTS`.
const EMISSION_COUNTS: u32 = 2u;
// For each table of reflections: how many hops of paths that went on there were seen, and for each cell the weight of those of
// paths that went that way. Twin of `REFLECTION_COUNTS`.
const REFLECTION_COUNTS: u32 = 1u + REFLECTION_CELL_TOTAL;
// Each way has so many hops beside those that were seen, of the mean weight: what few hops say is chance.
const SEEN_BY_CHANCE: f32 = 4.0;
