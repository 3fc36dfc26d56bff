// Which tiles may hold a penumbra: those that see both light and shadow as far as they reach. The module brings `tiles`.

const BOTH: u32 = TILE_HOLDS_LIGHT | TILE_HOLDS_SHADOW;

// Whether light and shadow lie within reach of a tile, rings of tiles around it one after the other.
fn may_hold_penumbra(tile: vec2i, size: vec2i) -> bool {
    let own = tiles[tile.y * size.x + tile.x];
    var holds = own & BOTH;
    let reach = i32(own >> TILE_HOLDS_BITS);
    // Nothing seen here.
    if holds == 0u {
        return false;
    }
    for (var ring = 1; ring <= reach && holds != BOTH; ring++) {
        let first = max(tile - ring, vec2i(0));
        let last = min(tile + ring, size - 1);
        for (var y = first.y; y <= last.y; y++) {
            let is_end = abs(y - tile.y) == ring;
            let step = select(2 * ring, 1, is_end);
            for (var x = tile.x - ring; x <= last.x; x += step) {
                if x >= 0 {
                    holds |= tiles[y * size.x + x] & BOTH;
                }
            }
        }
        if all(first == vec2i(0)) && all(last == size - 1) {
            break;
        }
    }
    return holds == BOTH;
}
