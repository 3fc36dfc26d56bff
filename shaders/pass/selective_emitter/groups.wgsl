// Which group a path is of. The module brings `grouped`.

// The light of a group.
fn light_of_group(group: u32) -> u32 {
    var light = 0u;
    while light + 1u < params.light_count && group >= grouped[light].first_group + grouped[light].group_count {
        light++;
    }
    return light;
}

// The light of a path.
fn light_of_path(path: u32) -> u32 {
    var light = 0u;
    while light + 1u < params.light_count && path >= grouped[light].first_path + grouped[light].path_count {
        light++;
    }
    return light;
}

// Paths of a group.
fn members_of(group: u32) -> u32 {
    let light = grouped[light_of_group(group)];
    let first = group - light.first_group;
    return (light.path_count - first + light.group_count - 1u) / light.group_count;
}

// Of a group's paths the i-th.
fn member_of(group: u32, i: u32) -> u32 {
    let light = grouped[light_of_group(group)];
    return light.first_path + group - light.first_group + i * light.group_count;
}
