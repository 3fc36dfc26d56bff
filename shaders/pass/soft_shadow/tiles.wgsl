// Tiles of 8 x 8 pixels: what the test found in each, and the list of those that may hold a penumbra.

const TILE_HOLDS_LIGHT: u32 = 1u;
const TILE_HOLDS_SHADOW: u32 = 2u;
const TILE_HOLDS_BITS: u32 = 2u;

// Workgroups in a row of the dispatch over the list.
const TILE_ROW: u32 = 256u;

// Twin of `TileList`, with the first of them.
struct TileList {
    // Of an indirect dispatch with a workgroup for each
    workgroups: array<u32, 3>,
    count: u32,
    tiles: array<u32>,
}

// Tiles that a distance in pixels may lead away.
fn tile_steps(pixels: f32) -> u32 {
    return u32(min(ceil((pixels + 1.0) / 8.0), 4096.0));
}

fn tile_pack(holds: u32, steps: u32) -> u32 {
    return holds | (steps << TILE_HOLDS_BITS);
}

fn tile_counts() -> vec2u {
    return (view.size + 7u) / 8u;
}

// Where the flag of a light stands in a list of them.
fn tile_flag_word(tile: vec2u, light: u32) -> u32 {
    let counts = tile_counts();
    return ((light / 32u) * counts.y + tile.y) * counts.x + tile.x;
}

fn tile_flag(light: u32) -> u32 {
    return 1u << (light % 32u);
}
