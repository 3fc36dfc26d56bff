// Emits some of the photons anew towards what they are aimed at, over what is there.

@group(2) @binding(0) var<storage, read> listed: PathList;

@compute @workgroup_size(64)
fn emit_listed_at_targets(@builtin(global_invocation_id) id: vec3u) {
    let place = path_list_place(id, listed.workgroups[0]);
    if place < listed.count {
        emit_photon_at_targets(listed.paths[place]);
    }
}
