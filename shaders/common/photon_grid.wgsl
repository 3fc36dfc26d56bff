// The cells of space that photons are sorted into: the cube [-1, 1]^3 of the unit frame. What lies outside counts to the cells
// at its rim. The module brings `grid`.

struct GridParams {
    bandwidth: Bandwidth,
    // Slots of the photon buffer to read: from, how many
    first_slot: u32,
    slot_count: u32,
    // Invocations in a row of a dispatch over them
    row: u32,
    // Cells along each axis; no kernel is wider than one
    cells: u32,
}

fn grid_cell(p: vec3f) -> vec3i {
    let at = (0.5 * p + 0.5) * f32(grid.cells);
    return vec3i(clamp(at, vec3f(0.0), vec3f(f32(grid.cells) - 0.5)));
}

fn grid_index(cell: vec3i) -> u32 {
    let c = vec3u(cell);
    return (c.z * grid.cells + c.y) * grid.cells + c.x;
}

fn grid_total() -> u32 {
    return grid.cells * grid.cells * grid.cells;
}
