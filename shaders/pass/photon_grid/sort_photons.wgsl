// Photons in the order of the cells of space that they lie in, ready to be added up.

@group(0) @binding(0) var<uniform> grid: GridParams;
@group(0) @binding(1) var<storage, read> photons: array<Photon>;
// By slot before they are sorted, by cell after
@group(0) @binding(2) var<storage, read_write> keys: array<u32>;
@group(0) @binding(3) var<storage, read_write> slots: array<u32>;
@group(0) @binding(4) var<storage, read_write> splats: array<Splat>;
// Of each cell the first of its splats, and where those of the last end
@group(0) @binding(5) var<storage, read_write> first_splats: array<u32>;

fn slot_of(id: vec3u) -> u32 {
    return select(id.y * grid.row + id.x, 0xffffffffu, id.x >= grid.row);
}

@compute @workgroup_size(64)
fn find_cells(@builtin(global_invocation_id) id: vec3u) {
    let index = slot_of(id);
    if index >= grid.slot_count {
        return;
    }
    let photon = photons[grid.first_slot + index];
    keys[index] = select(grid_total(), grid_index(grid_cell(photon.position)), photon_is_indirect(photon.state));
    slots[index] = index;
}

@compute @workgroup_size(64)
fn find_first(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let cell = 64u * (group.y * groups.x + group.x) + lane;
    if cell <= grid_total() {
        first_splats[cell] = first_of_key(cell, grid.slot_count);
    }
}

@compute @workgroup_size(64)
fn prepare_splats(@builtin(global_invocation_id) id: vec3u) {
    let index = slot_of(id);
    if index >= grid.slot_count || keys[index] >= grid_total() {
        return;
    }
    let photon = photons[grid.first_slot + slots[index]];
    let h = min(bandwidth_radius(grid.bandwidth, photon), 2.0 / f32(grid.cells));
    if h > 0.0 {
        splats[index] = splat_record(photon, h);
    } else {
        splats[index] = splat_nothing();
    }
}
