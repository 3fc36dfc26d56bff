// Some paths of a pool that holds all there are: one invocation a path.

@group(1) @binding(0) var<storage, read> listed: PathList;

@compute @workgroup_size(64)
fn stream_listed(@builtin(global_invocation_id) id: vec3u) {
    let place = path_list_place(id, listed.workgroups[0]);
    if place >= listed.count {
        return;
    }
    for (var hop = 0u; hop < params.hop_count + params.keeps_changes; hop++) {
        let slot = hop * params.pool_count + listed.paths[place];
        exchange(photons[slot], slot, hop);
    }
}
