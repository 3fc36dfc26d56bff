// The walk of some paths, over what is there: a hop of those that another tracer lost, or all of theirs.

@group(2) @binding(0) var<storage, read> listed: PathList;

@compute @workgroup_size(64)
fn walk_listed(@builtin(global_invocation_id) id: vec3u) {
    let place = path_list_place(id, listed.workgroups[0]);
    if place < listed.count {
        walk_path(listed.paths[place]);
    }
}
