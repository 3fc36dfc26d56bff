// The uniform of both steps.

struct Params {
    // Pixels of the G-buffer for each one of the irradiance, along each axis
    factor: u32,
    // Rays of a pixel
    ray_count: u32,
    // Rows of the irradiance: from, how many
    first_row: u32,
    row_count: u32,
    sample_offset: u32,
    map_count: u32,
    map_size: u32,
}
