// New paths replace the oldest of the pool: what these had sent on is taken from their lights, and what those send on goes to the
// lights nearest to where they arrived. One invocation an impact. All of it is whole numbers, so that a light holds the sum of
// the impacts that point to it, exactly and for good.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> grid: SurfaceLightGrid;
@group(0) @binding(2) var<storage, read> photons: array<Photon>;
@group(0) @binding(3) var<storage, read> lights: array<SurfaceLight>;
@group(0) @binding(4) var<storage, read> cells: array<u32>;
@group(0) @binding(5) var<storage, read_write> pool: array<Impact>;
// Of each light red, green, blue, and how many impacts
@group(0) @binding(6) var<storage, read_write> flux: array<array<atomic<u32>, 4>>;

@compute @workgroup_size(64)
fn stream_impacts(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * params.row + id.x;
    if index >= params.path_count * params.hop_count {
        return;
    }
    let path = (params.first_path + index % params.path_count) % params.pool_count;
    let slot = (index / params.path_count) * params.pool_count + path;
    let old = pool[slot];
    if impact_counts(old) {
        atomicSub(&flux[old.light][0], old.red);
        atomicSub(&flux[old.light][1], old.green);
        atomicSub(&flux[old.light][2], old.blue);
        atomicSub(&flux[old.light][3], 1u);
    }
    let photon = photons[index];
    let sent_on = flux_steps(exitant_flux(photon) * params.share, slot);
    var light = NO_LIGHT;
    if any(sent_on > vec3u(0u)) {
        light = nearest_light(photon.position, octahedral_unpack(photon.normal));
    }
    if light == NO_LIGHT {
        pool[slot] = Impact();
        return;
    }
    pool[slot] = Impact(light, sent_on.x, sent_on.y, sent_on.z, photon.position - lights[light].position, 0u);
    atomicAdd(&flux[light][0], sent_on.x);
    atomicAdd(&flux[light][1], sent_on.y);
    atomicAdd(&flux[light][2], sent_on.z);
    atomicAdd(&flux[light][3], 1u);
}
