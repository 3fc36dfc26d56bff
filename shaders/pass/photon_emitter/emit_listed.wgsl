// Emits some of the photons anew, evenly spread, over what is there.

@group(1) @binding(0) var<storage, read> listed: PathList;

@compute @workgroup_size(64)
fn emit_listed_photons(@builtin(global_invocation_id) id: vec3u) {
    let place = path_list_place(id, listed.workgroups[0]);
    if place < listed.count {
        let index = listed.paths[place];
        emit_photon(index, random_pair(params.sample_offset + index, 0u), 1.0, 0u);
    }
}
