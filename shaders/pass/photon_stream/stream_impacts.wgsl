// New paths replace the oldest of the pool, or some of its paths are replaced by what has become of them: what was sent on is
// taken from the lights, and what is goes to the lights nearest to where it arrived. All of it is whole numbers, so that a
// light holds the sum of the impacts that point to it, exactly and for good.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> grid: SurfaceLightGrid;
@group(0) @binding(2) var<storage, read> photons: array<Photon>;
@group(0) @binding(3) var<storage, read> lights: array<SurfaceLight>;
@group(0) @binding(4) var<storage, read> cells: array<u32>;
@group(0) @binding(5) var<storage, read_write> pool: array<Impact>;
// Of each light red, green, blue, and how many impacts
@group(0) @binding(6) var<storage, read_write> flux: array<array<atomic<u32>, 4>>;
// Of each light what came and went, and of that what had been scattered before
@group(0) @binding(7) var<storage, read_write> changes: array<array<atomic<u32>, 2>>;

// Changes are counted in 2^4 steps of flux, so that many frames of them fit.
const CHANGE_SHIFT: u32 = 4u;

fn note_change(impact: Impact, is_indirect: bool) {
    let change = (impact.red + impact.green + impact.blue) >> CHANGE_SHIFT;
    atomicAdd(&changes[impact.light][0], change);
    if is_indirect {
        atomicAdd(&changes[impact.light][1], change);
    }
}

// What an impact counts for, if anything.
fn impact_of(photon: Photon, slot: u32) -> Impact {
    let sent_on = flux_steps(exitant_flux(photon) * params.share, slot);
    if all(sent_on == vec3u(0u)) {
        return Impact();
    }
    let light = nearest_light(photon.position, octahedral_unpack(photon.normal));
    if light == NO_LIGHT {
        return Impact();
    }
    return Impact(light, sent_on.x, sent_on.y, sent_on.z, photon.position - lights[light].position, 0u);
}

// Puts a photon in the place of the one that was in a slot of the pool.
fn exchange(photon: Photon, slot: u32, hop: u32) {
    let before = pool[slot];
    let now = impact_of(photon, slot);
    pool[slot] = now;
    let is_same = all(vec4u(before.light, before.red, before.green, before.blue) == vec4u(now.light, now.red, now.green, now.blue));
    let keeps_changes = params.keeps_changes == 1u && !is_same;
    // What arrives last is of use for its changes alone.
    let goes_on = hop < params.hop_count;
    if impact_counts(before) && goes_on {
        atomicSub(&flux[before.light][0], before.red);
        atomicSub(&flux[before.light][1], before.green);
        atomicSub(&flux[before.light][2], before.blue);
        atomicSub(&flux[before.light][3], 1u);
    }
    if impact_counts(now) && goes_on {
        atomicAdd(&flux[now.light][0], now.red);
        atomicAdd(&flux[now.light][1], now.green);
        atomicAdd(&flux[now.light][2], now.blue);
        atomicAdd(&flux[now.light][3], 1u);
    }
    if impact_counts(before) && keeps_changes {
        note_change(before, hop > 0u);
    }
    if impact_counts(now) && keeps_changes {
        note_change(now, hop > 0u);
    }
}

// One invocation an impact.
@compute @workgroup_size(64)
fn stream_impacts(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * params.row + id.x;
    if index >= params.path_count * (params.hop_count + params.keeps_changes) {
        return;
    }
    let hop = index / params.path_count;
    let path = (params.first_path + index % params.path_count) % params.pool_count;
    exchange(photons[index], hop * params.pool_count + path, hop);
}
