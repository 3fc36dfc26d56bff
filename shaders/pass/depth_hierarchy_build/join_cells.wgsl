// A coarser level of the hierarchy: each cell joins the four below it.

@group(0) @binding(0) var finer: texture_2d_array<u32>;
@group(0) @binding(1) var coarser: texture_storage_2d_array<r32uint, write>;
@group(0) @binding(2) var<storage, read> maps: array<u32>;

@compute @workgroup_size(8, 8)
fn join_cells(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(coarser)) {
        return;
    }
    // Cells beyond the map's size hold zeros, infinitely far, and no ray comes there.
    let layer = 6u * maps[id.z / 6u] + id.z % 6u;
    let corner = 2u * id.xy;
    var joined = textureLoad(finer, corner, layer, 0).x;
    for (var i = 1u; i < 4u; i++) {
        joined = depth_range_join(joined, textureLoad(finer, corner + vec2u(i & 1u, i >> 1u), layer, 0).x);
    }
    textureStore(coarser, id.xy, layer, vec4u(joined));
}
