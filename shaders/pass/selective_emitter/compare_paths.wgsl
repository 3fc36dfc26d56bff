// Probes beside what they were: where a path has become another, its group has changed.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> grouped: array<GroupedLight>;
@group(0) @binding(2) var<storage, read> photons: array<Photon>;
@group(0) @binding(3) var<storage, read> listed: PathList;
@group(0) @binding(4) var<storage, read> kept: array<Photon>;
@group(0) @binding(5) var<storage, read_write> changed: array<atomic<u32>>;
@group(0) @binding(6) var<storage, read_write> counts: array<atomic<u32>, 4>;

// Steps of change in the flux that a path starts with.
const CHANGE_STEPS: f32 = 256.0;
// Places of `counts`.
const COUNT_PROBED: u32 = 0u;
const COUNT_DIVERGED: u32 = 1u;

fn brightness(photon: Photon) -> f32 {
    let is_stored = (photon.state & PHOTON_STATE_MASK) == PHOTON_STORED;
    return select(0.0, photon.flux.x + photon.flux.y + photon.flux.z, is_stored);
}

// Whether a photon arrived elsewhere than before, at something else, or with another flux.
fn has_diverged(before: Photon, now: Photon) -> bool {
    if (now.state & PHOTON_STATE_MASK) == PHOTON_EMPTY {
        return (before.state & PHOTON_STATE_MASK) != PHOTON_EMPTY;
    }
    // How the surface scatters is among the bits of both.
    if before.state != now.state || before.light_and_surface != now.light_and_surface {
        return true;
    }
    if (now.state & PHOTON_STATE_MASK) != PHOTON_STORED {
        return false;
    }
    let flux = abs(before.flux - now.flux);
    let least = params.flux_tolerance * max(before.flux, now.flux);
    return distance(before.position, now.position) > params.position_tolerance
        || before.reflectance != now.reflectance
        || any(flux > least);
}

@compute @workgroup_size(64)
fn compare_paths(@builtin(global_invocation_id) id: vec3u) {
    let place = path_list_place(id, listed.workgroups[0]);
    if place >= min(listed.count, params.kept_count) {
        return;
    }
    let path = listed.paths[place];
    var change = 0.0;
    var whole = 0.0;
    var is_other = false;
    for (var hop = 0u; hop < params.hop_count; hop++) {
        let before = kept[hop * params.kept_count + place];
        let now = photons[hop * params.path_count + path];
        whole = max(whole, max(brightness(before), brightness(now)));
        if has_diverged(before, now) {
            is_other = true;
            change += brightness(before) + brightness(now);
        }
    }
    atomicAdd(&counts[COUNT_PROBED], 1u);
    if is_other {
        let light = grouped[light_of_path(path)];
        let group = light.first_group + (path - light.first_path) % light.group_count;
        atomicAdd(&counts[COUNT_DIVERGED], 1u);
        atomicAdd(&changed[group], 1u + u32(CHANGE_STEPS * change / max(whole, 0x1p-100)));
    }
}
