// The cells of where paths go on to from diffuse surfaces: of the square of the two random numbers that a scattered direction is made of,
// for each place of a grid over the unit frame and each of the six directions of the axes that a normal may be nearest to.

// Cells along each axis. Twin of `REFLECTIONS`.
const REFLECTION_CELLS: u32 = 4u;
const REFLECTION_CELL_TOTAL: u32 = REFLECTION_CELLS * REFLECTION_CELLS;
// Places along each axis. Twin of `PLACES`.
const REFLECTION_PLACES: u32 = 16u;
// For each table: how many hops of paths that went on there were seen, and for each cell the weight of those of paths that went that
// way. Twin of `REFLECTION_COUNTS`.
const REFLECTION_COUNTS: u32 = 1u + REFLECTION_CELL_TOTAL;
const REFLECTION_TABLES: u32 = 6u * REFLECTION_PLACES * REFLECTION_PLACES * REFLECTION_PLACES;

// The table of a place and a normal.
fn reflection_table(position: vec3f, normal: vec3f) -> u32 {
    let most = f32(REFLECTION_PLACES) - 1.0;
    let at = vec3u(clamp((0.5 * position + 0.5) * f32(REFLECTION_PLACES), vec3f(0.0), vec3f(most)));
    let place = at.x + REFLECTION_PLACES * (at.y + REFLECTION_PLACES * at.z);
    let size = abs(normal);
    let is_y = size.y > size.x && size.y >= size.z;
    let is_z = size.z > size.x && size.z > size.y;
    let axis = select(select(0u, 1u, is_y), 2u, is_z);
    return 6u * place + 2u * axis + u32(normal[axis] < 0.0);
}

// The cell of a pair of numbers.
fn reflection_cell_at(u: vec2f) -> u32 {
    let at = min(vec2u(u * f32(REFLECTION_CELLS)), vec2u(REFLECTION_CELLS - 1u));
    return at.x * REFLECTION_CELLS + at.y;
}

// The cell of a direction about a normal.
fn reflection_cell(normal: vec3f, direction: vec3f) -> u32 {
    return reflection_cell_at(sampling_cosine_inverse(direction * sampling_frame(normal)));
}
