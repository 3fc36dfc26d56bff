// What probes were, before they are traced anew.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> photons: array<Photon>;
@group(0) @binding(2) var<storage, read> listed: PathList;
@group(0) @binding(3) var<storage, read_write> kept: array<Photon>;

@compute @workgroup_size(64)
fn keep_paths(@builtin(global_invocation_id) id: vec3u) {
    let place = path_list_place(id, listed.workgroups[0]);
    if place >= min(listed.count, params.kept_count) {
        return;
    }
    for (var hop = 0u; hop < params.hop_count; hop++) {
        kept[hop * params.kept_count + place] = photons[hop * params.path_count + listed.paths[place]];
    }
}
