// A hop of the paths that another tracer lost, over what it wrote.

@group(2) @binding(0) var<storage, read> lost: LostRays;

@compute @workgroup_size(64)
fn walk_lost(@builtin(global_invocation_id) id: vec3u) {
    let place = id.y * (lost.workgroups[0] * 64u) + id.x;
    if place < lost.count {
        walk_path(lost.paths[place]);
    }
}
