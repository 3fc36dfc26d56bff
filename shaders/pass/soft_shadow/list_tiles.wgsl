// Lists the tiles that may hold a penumbra.

struct Listing {
    workgroups: array<atomic<u32>, 3>,
    count: atomic<u32>,
    tiles: array<u32>,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> tiles: array<u32>;
@group(0) @binding(2) var<storage, read_write> list: Listing;

@compute @workgroup_size(8, 8)
fn list_tiles(@builtin(global_invocation_id) id: vec3u) {
    let size = tile_counts();
    if any(id.xy >= size) || !may_hold_penumbra(vec2i(id.xy), vec2i(size)) {
        return;
    }
    let place = atomicAdd(&list.count, 1u);
    list.tiles[place] = id.y * size.x + id.x;
    atomicMax(&list.workgroups[0], min(place + 1u, TILE_ROW));
    atomicMax(&list.workgroups[1], place / TILE_ROW + 1u);
    atomicStore(&list.workgroups[2], 1u);
}
