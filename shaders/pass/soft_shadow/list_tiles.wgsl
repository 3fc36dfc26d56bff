// Lists the tiles that may hold a penumbra: those that see both light and shadow as far as they reach.

struct Listing {
    workgroups: array<atomic<u32>, 3>,
    count: atomic<u32>,
    tiles: array<u32>,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> tiles: array<u32>;
@group(0) @binding(2) var<storage, read_write> list: Listing;

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

@compute @workgroup_size(8, 8)
fn list_tiles(@builtin(global_invocation_id) id: vec3u) {
    let size = (view.size + 7u) / 8u;
    if any(id.xy >= size) || !may_hold_penumbra(vec2i(id.xy), vec2i(size)) {
        return;
    }
    let place = atomicAdd(&list.count, 1u);
    list.tiles[place] = id.y * size.x + id.x;
    atomicMax(&list.workgroups[0], min(place + 1u, TILE_ROW));
    atomicMax(&list.workgroups[1], place / TILE_ROW + 1u);
    atomicStore(&list.workgroups[2], 1u);
}
