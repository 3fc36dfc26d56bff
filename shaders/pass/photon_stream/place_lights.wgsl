// Each light shines from where the impact arrived that is nearest to its place, and not from the place itself, which may be
// hidden: below a column's foot, between two walls. Impacts are kept as offsets from their lights, and move along with them.

struct Params {
    // Of the pool
    slot_count: u32,
    light_count: u32,
    // Invocations in a row of the dispatch
    row: u32,
}

// What is looked for of each light: the complement of the least distance, and that of the first slot with it. All are above 0.
struct Nearest {
    distance: atomic<u32>,
    slot: atomic<u32>,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> pool: array<Impact>;
@group(0) @binding(2) var<storage, read> lights: array<SurfaceLight>;
@group(0) @binding(3) var<storage, read_write> nearest: array<Nearest>;
@group(0) @binding(4) var<storage, read_write> shining: array<SurfaceLight>;

// As a number that falls as it grows.
fn nearness(impact: Impact) -> u32 {
    return ~bitcast<u32>(dot(impact.offset, impact.offset));
}

@compute @workgroup_size(64)
fn find_distances(@builtin(global_invocation_id) id: vec3u) {
    let slot = id.y * params.row + id.x;
    if slot < params.slot_count && impact_counts(pool[slot]) {
        atomicMax(&nearest[pool[slot].light].distance, nearness(pool[slot]));
    }
}

@compute @workgroup_size(64)
fn find_slots(@builtin(global_invocation_id) id: vec3u) {
    let slot = id.y * params.row + id.x;
    if slot < params.slot_count && impact_counts(pool[slot]) {
        let light = pool[slot].light;
        if atomicLoad(&nearest[light].distance) == nearness(pool[slot]) {
            atomicMax(&nearest[light].slot, ~slot);
        }
    }
}

@compute @workgroup_size(64)
fn place_lights(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= params.light_count {
        return;
    }
    var light = lights[id.x];
    if atomicLoad(&nearest[id.x].distance) != 0u {
        light.position += pool[~atomicLoad(&nearest[id.x].slot)].offset;
    }
    shining[id.x] = light;
}
