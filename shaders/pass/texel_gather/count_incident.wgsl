// Adds up where the photons came from that point to texels which are gathered, of those that were scattered before: one
// invocation an impact (Larsen 2004, section 4.6.2).

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> lights: array<SurfaceLight>;
@group(0) @binding(2) var<storage, read> pool: array<Impact>;
@group(0) @binding(3) var<storage, read> photons: array<Photon>;
// Of each texel one more than its place among those chosen, or 0
@group(0) @binding(4) var<storage, read> places: array<u32>;
@group(0) @binding(5) var<storage, read_write> incident: array<atomic<u32>>;

@compute @workgroup_size(64)
fn count_incident(@builtin(global_invocation_id) id: vec3u) {
    let slot = id.y * params.slot_row + id.x;
    if id.x >= params.slot_row || slot >= params.slot_count || !impact_counts(pool[slot]) {
        return;
    }
    let impact = pool[slot];
    let place = places[impact.light];
    if place == 0u || !photon_is_indirect(photons[slot].state) {
        return;
    }
    let direction = -octahedral_unpack(photons[slot].direction) * sampling_frame(lights[impact.light].normal);
    if direction.z > 0.0 {
        let first = (place - 1u) * INCIDENT_STRIDE;
        atomicAdd(&incident[first + incident_cell(direction)], impact.red + impact.green + impact.blue);
        atomicAdd(&incident[first + INCIDENT_CELLS], 1u);
    }
}
