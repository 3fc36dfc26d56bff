// Photons in the order of the cells of space that they lie in, ready to be added up.

@group(0) @binding(0) var<uniform> grid: GridParams;
@group(0) @binding(1) var<storage, read> photons: array<Photon>;
// By slot before they are sorted, by cell after
@group(0) @binding(2) var<storage, read_write> keys: array<u32>;
@group(0) @binding(3) var<storage, read_write> slots: array<u32>;
@group(0) @binding(4) var<storage, read_write> splats: array<Splat>;
// Of each cell the first of its splats, and where those of the last end
@group(0) @binding(5) var<storage, read_write> first_splats: array<u32>;

// Photons on rough metals instead of those on diffuse surfaces; their kernels hold the direction of light for a normal.
override grid_is_glossy: bool = false;

fn is_sorted(photon: Photon) -> bool {
    if !grid_is_glossy {
        return photon_is_indirect(photon.state);
    }
    // Of light straight from a source only that of flat lamps: the others shine from single directions.
    let is_punctual = (photon.state & (PHOTON_FIRST_HIT | PHOTON_OF_FLAT)) == PHOTON_FIRST_HIT;
    let is_stored = (photon.state & PHOTON_STATE_MASK) == PHOTON_STORED && !is_punctual;
    return is_stored && lobe_is_glossy(photon_lobe(photon.state, photon.light_and_surface));
}

// As densities are of photons on diffuse surfaces: by the footprint.
fn as_sorted(photon: Photon) -> Photon {
    var own = photon;
    if grid_is_glossy {
        let radius = max(photon_footprint_of(photon.density).x, 0x1p-20);
        let cosine = abs(dot(octahedral_unpack(photon.normal), octahedral_unpack(photon.direction)));
        own.density = cosine / (radius * radius);
        own.normal = photon.direction;
    }
    return own;
}

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
    keys[index] = select(grid_total(), grid_index(grid_cell(photon.position)), is_sorted(photon));
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
    let photon = as_sorted(photons[grid.first_slot + slots[index]]);
    let h = min(bandwidth_radius(grid.bandwidth, photon), 2.0 / f32(grid.cells));
    if h > 0.0 {
        splats[index] = splat_record(photon, h);
        if grid_is_glossy && (photon.state & PHOTON_FIRST_HIT) != 0u {
            splats[index].inverse_radius_squared |= SPLAT_STRAIGHT;
        }
    } else {
        splats[index] = splat_nothing();
    }
}
