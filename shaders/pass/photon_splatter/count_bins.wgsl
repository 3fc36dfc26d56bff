// How many photons lie in each bin of the screen.

@group(0) @binding(0) var<uniform> params: RasterParams;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<storage, read> photons: array<Photon>;
@group(0) @binding(3) var<storage, read_write> bins: array<atomic<u32>>;

@compute @workgroup_size(64)
fn count_bins(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * params.row + id.x;
    if id.x >= params.row || index >= params.slot_count {
        return;
    }
    let photon = photons[params.first_slot + index];
    if photon_is_splatted(photon.state) {
        let grid = bin_grid(params.bandwidth);
        let bin = bin_of(params.bandwidth, photon.position);
        if bin < grid.x * grid.y {
            atomicAdd(&bins[bin], 1u);
        }
    }
}
