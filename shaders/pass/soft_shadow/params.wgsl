// How the penumbra of a light is looked for. Twin of `PenumbraParams`.

struct Params {
    // Index of the light
    light: u32,
    shadow_map_size: u32,
    layer_count: u32,
    // 0: no search, one radius for all
    search: u32,
    search_taps: u32,
    blur_taps: u32,
    disc_taps: u32,
    // Rays to the lamp
    rays: u32,
    // Turns the rays of another frame
    sample_offset: u32,
    // How what the test finds is gathered, a `GATHERED_`
    gathered: u32,
    max_radius: f32,
    range_scale: f32,
}

// Nothing follows the test.
const GATHERED_NOT: u32 = 0u;
// The steps of this pass do it.
const GATHERED_BY_STEPS: u32 = 1u;
// A pass that comes later does it, over the tiles that are flagged.
const GATHERED_LATER: u32 = 2u;
