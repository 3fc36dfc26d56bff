// Least distance in each tile of the shadow maps of lights with an extent, then in each tile and those around it.

struct Params {
    light_count: u32,
    shadow_map_size: u32,
    layer_count: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> lights: array<Light>;
@group(0) @binding(2) var shadow_maps: texture_2d_array<u32>;
@group(0) @binding(3) var<storage, read_write> nearest: array<f32>;

const TILES: u32 = 8u;
// The largest f32: nothing is there. Floats above zero are ordered as their bits are.
const NOTHING: u32 = 0x7f7fffffu;

var<workgroup> least: atomic<u32>;

// Index of the light with an extent that a layer belongs to, or the number of lights.
fn light_of(layer: u32) -> u32 {
    for (var i = 0u; i < params.light_count; i++) {
        let light = lights[i];
        if layer >= light.first_layer && layer < light.first_layer + light.layer_count && light.extent > 0.0 {
            return i;
        }
    }
    return params.light_count;
}

// One workgroup a tile (x) and layer (y).
@compute @workgroup_size(64)
fn reduce_tiles(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) invocation: u32) {
    let tile = vec2u(group.x % TILES, group.x / TILES);
    let size = params.shadow_map_size;
    let first = tile * size / TILES;
    let end = ((tile + 1u) * size + TILES - 1u) / TILES;
    let span = end - first;
    let has_extent = light_of(group.y) < params.light_count;
    if invocation == 0u {
        atomicStore(&least, NOTHING);
    }
    workgroupBarrier();
    var own = NOTHING;
    for (var i = invocation; has_extent && i < span.x * span.y; i += 64u) {
        let at = first + vec2u(i % span.x, i / span.x);
        let distance = textureLoad(shadow_maps, at, group.y, 0).x;
        // Zero: nothing is there.
        own = select(own, min(own, distance), distance > 0u);
    }
    atomicMin(&least, own);
    workgroupBarrier();
    if invocation == 0u && has_extent {
        nearest[group.y * TILES * TILES + group.x] = bitcast<f32>(atomicLoad(&least));
    }
}

// One workgroup a layer, one invocation a tile.
@compute @workgroup_size(64)
fn spread_tiles(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) tile: u32) {
    let index = light_of(group.x);
    if index == params.light_count {
        return;
    }
    let light = lights[index];
    var distance = bitcast<f32>(NOTHING);
    for (var i = 0u; i < 9u; i++) {
        let offset = vec2f(f32(i % 3u) - 1.0, f32(i / 3u) - 1.0);
        var uv = (vec2f(f32(tile % TILES), f32(tile / TILES)) + 0.5 + offset) / f32(TILES);
        var layer = group.x;
        if light.layer_count == 6u {
            let point = cube_face_point(cube_face_direction(layer - light.first_layer, uv));
            layer = light.first_layer + point.face;
            uv = point.uv;
        }
        let at = cube_face_texel(uv, TILES);
        distance = min(distance, nearest[(layer * TILES + at.y) * TILES + at.x]);
    }
    nearest[(params.layer_count + group.x) * TILES * TILES + tile] = distance;
}
