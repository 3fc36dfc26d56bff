// The uniform of all steps, and the cells of space that photons are sorted into: the cube [-1, 1]^3 of the unit frame. What lies
// outside counts to the cells at its rim.

struct Params {
    bandwidth: Bandwidth,
    // Slots of the photon buffer to read: from, how many
    first_slot: u32,
    slot_count: u32,
    // Invocations in a row of a dispatch over them
    row: u32,
    // Cells along each axis; no kernel is wider than one
    cells: u32,
    map_size: u32,
    // Texels of the irradiance along a face
    size: u32,
    light_count: u32,
    shadow_map_size: u32,
    // 1: kernels count by the part of them that lies on the surface
    is_corrected: u32,
    sample_offset: u32,
}

fn cell_of(p: vec3f) -> vec3i {
    let at = (0.5 * p + 0.5) * f32(params.cells);
    return vec3i(clamp(at, vec3f(0.0), vec3f(f32(params.cells) - 0.5)));
}

fn cell_index(cell: vec3i) -> u32 {
    let c = vec3u(cell);
    return (c.z * params.cells + c.y) * params.cells + c.x;
}

fn cell_total() -> u32 {
    return params.cells * params.cells * params.cells;
}
