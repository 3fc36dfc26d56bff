// The walk of some paths, over what is there: a hop of those that another tracer lost, or all of theirs.

@group(2) @binding(0) var<storage, read> listed: PathList;

@compute @workgroup_size(64)
fn walk_listed(@builtin(global_invocation_id) id: vec3u) {
    let place = id.y * (listed.workgroups[0] * 64u) + id.x;
    if place < listed.count {
        walk_path(listed.paths[place]);
    }
}
