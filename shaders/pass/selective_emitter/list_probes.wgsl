// One path of each group, another one every time (Larsen 2004, section 9.1). Groups of lights that moved have changed.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> grouped: array<GroupedLight>;
// Of each group, how much its probes have found changed since it was traced
@group(0) @binding(2) var<storage, read_write> changed: array<u32>;
@group(0) @binding(3) var<storage, read_write> probes: PathList;

// What a light that moved has changed: more than any probe finds.
const LIGHT_MOVED: u32 = 0x100000u;
const MOST_CHANGED: u32 = 0x200000u;

fn has_moved(group: u32) -> bool {
    let light = light_of_group(group);
    let moved = select(params.moved_low, params.moved_high, light >= 32u);
    return ((moved >> (light % 32u)) & 1u) == 1u;
}

@compute @workgroup_size(64)
fn list_probes(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let index = id.y * groups.x * 64u + id.x;
    if index < params.group_count {
        // Those that wait gain on what changes again.
        var change = changed[index];
        change += select(0u, 1u + change / 16u, change > 0u);
        change += select(0u, LIGHT_MOVED, has_moved(index));
        changed[index] = min(change, MOST_CHANGED);
    }
    let count = (params.group_count - params.first_group + params.interval - 1u) / params.interval;
    if index == 0u {
        probes.count = count;
        probes.workgroups = path_list_workgroups(count);
    }
    if index < count {
        let group = params.first_group + index * params.interval;
        probes.paths[index] = member_of(group, params.round % members_of(group));
    }
}
