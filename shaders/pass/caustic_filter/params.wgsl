// The uniform of both steps.

struct Params {
    // Slots of the photons that are read: from, how many
    first_slot: u32,
    slot_count: u32,
    // Invocations in a row of the dispatch over them
    row: u32,
    // Steps of the sums in one unit-frame flux, and what a photon's flux is multiplied by before
    steps: f32,
    share: f32,
    // Of the filter, unit frame; and in pixels, from, to
    radius: f32,
    least_pixels: f32,
    most_pixels: f32,
}

// Side of a tile, pixels.
const TILE: u32 = 8u;

fn tile_counts() -> vec2u {
    return (view.size + TILE - 1u) / TILE;
}

// Pixels to each side that are summed up around a pixel so wide at its distance.
fn filter_pixels(pixel_width: f32) -> i32 {
    return i32(clamp(round(params.radius / pixel_width), params.least_pixels, params.most_pixels));
}
