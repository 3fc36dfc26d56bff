// Twin of `resource::PathList`: some paths of many.

struct PathList {
    // Of an indirect dispatch with an invocation for each path, 64 to a workgroup
    workgroups: array<u32, 3>,
    count: u32,
    paths: array<u32>,
}

// The place in a list of so many workgroups in a row that an invocation of its dispatch takes.
fn path_list_place(id: vec3u, workgroups: u32) -> u32 {
    return id.y * (workgroups * 64u) + id.x;
}

// Workgroups for `count` invocations of 64, none above 65535 along an axis.
fn path_list_workgroups(count: u32) -> array<u32, 3> {
    let groups = count / 64u + u32(count % 64u > 0u);
    let rows = max(1u, groups / 65535u + u32(groups % 65535u > 0u));
    return array<u32, 3>(groups / rows + u32(groups % rows > 0u), rows, 1u);
}
