// Where the paths of a light go on from their first hit, if that is diffuse: the square of the two random numbers that the
// scattered direction is made of, in cells, for each emission cell of the light.

// Along each axis. Twin of `REFLECTIONS`.
const REFLECTION_CELLS: u32 = 4u;
const REFLECTION_CELL_TOTAL: u32 = REFLECTION_CELLS * REFLECTION_CELLS;

struct ReflectionTable {
    // Sums of shares up to the end of each column of cells
    columns: array<f32, REFLECTION_CELLS>,
    // And, column by column, up to the end of each of its cells, as parts of the column's share
    rows: array<f32, REFLECTION_CELL_TOTAL>,
}

// The cell of a direction about a normal.
fn reflection_cell(normal: vec3f, direction: vec3f) -> u32 {
    let u = sampling_cosine_inverse(direction * sampling_frame(normal));
    let at = min(vec2u(u * f32(REFLECTION_CELLS)), vec2u(REFLECTION_CELLS - 1u));
    return at.x * REFLECTION_CELLS + at.y;
}
