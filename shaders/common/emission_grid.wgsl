// The cells of a light's emission.

// Along each axis. Twin of `CELLS`.
const EMISSION_CELLS: u32 = 16u;
const EMISSION_CELL_TOTAL: u32 = EMISSION_CELLS * EMISSION_CELLS;
// For each: the weight of the hops of its paths that were seen, and how many these were. Twin of `EMISSION_COUNTS`.
const EMISSION_COUNTS: u32 = 2u;
