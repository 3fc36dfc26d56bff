// The cells of a light's emission.

// Along each axis. Twin of `CELLS`.
const EMISSION_CELLS: u32 = 16u;
const EMISSION_CELL_TOTAL: u32 = EMISSION_CELLS * EMISSION_CELLS;
