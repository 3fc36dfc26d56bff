// Flags the tiles that may hold a penumbra of one light, for a later pass.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<storage, read> tiles: array<u32>;
// A bit a light, and a word a tile for each 32 lights
@group(0) @binding(3) var<storage, read_write> flags: array<u32>;

@compute @workgroup_size(8, 8)
fn flag_tiles(@builtin(global_invocation_id) id: vec3u) {
    let size = tile_counts();
    if any(id.xy >= size) {
        return;
    }
    let word = tile_flag_word(id.xy, params.light);
    let flag = tile_flag(params.light);
    flags[word] = select(flags[word] & ~flag, flags[word] | flag, may_hold_penumbra(vec2i(id.xy), vec2i(size)));
}
