// Where paths go on from diffuse surfaces: the square of the two random numbers that a scattered direction is made of, in cells, for
// each place of a grid over the unit frame and each of the six directions that its normal may be nearest to.

// Places along each axis. Twin of `PLACES`.
const REFLECTION_PLACES: u32 = 16u;
const REFLECTION_TABLE_TOTAL: u32 = 6u * REFLECTION_PLACES * REFLECTION_PLACES * REFLECTION_PLACES;

// Along each axis. Twin of `REFLECTIONS`.
const REFLECTION_CELLS: u32 = 4u;
const REFLECTION_CELL_TOTAL: u32 = REFLECTION_CELLS * REFLECTION_CELLS;

struct ReflectionTable {
    // Sums of shares up to the end of each column of cells
    columns: array<f32, REFLECTION_CELLS>,
    // And, column by column, up to the end of each of its cells, as parts of the column's share
    rows: array<f32, REFLECTION_CELL_TOTAL>,
}

// The table of a place and a normal.
fn reflection_table(position: vec3f, normal: vec3f) -> u32 {
    let scaled = (0.5 * position + 0.5) * f32(REFLECTION_PLACES);
    let at = vec3u(clamp(scaled, vec3f(0.0), vec3f(f32(REFLECTION_PLACES) - 1.0)));
    let size = abs(normal);
    var side = select(0u, 1u, normal.x < 0.0);
    if size.y >= max(size.x, size.z) {
        side = select(2u, 3u, normal.y < 0.0);
    } else if size.z >= max(size.x, size.y) {
        side = select(4u, 5u, normal.z < 0.0);
    }
    return side + 6u * (at.x + REFLECTION_PLACES * (at.y + REFLECTION_PLACES * at.z));
}

// The cell of a direction about a normal.
fn reflection_cell(normal: vec3f, direction: vec3f) -> u32 {
    let u = sampling_cosine_inverse(direction * sampling_frame(normal));
    let at = min(vec2u(u * f32(REFLECTION_CELLS)), vec2u(REFLECTION_CELLS - 1u));
    return at.x * REFLECTION_CELLS + at.y;
}
