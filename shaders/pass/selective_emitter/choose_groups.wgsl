// Lists all paths of the groups that have changed most, as many as the budget allows.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> grouped: array<GroupedLight>;
@group(0) @binding(2) var<storage, read_write> changed: array<u32>;
@group(0) @binding(3) var<storage, read_write> chosen: PathList;
@group(0) @binding(4) var<storage, read_write> counts: array<u32, 4>;

const COUNT_CHOSEN: u32 = 2u;
const COUNT_WAITING: u32 = 3u;

fn candidate_count() -> u32 {
    return params.group_count;
}

fn candidate_budget() -> u32 {
    return params.budget;
}

fn candidate_turn() -> u32 {
    return params.round * CHOICE_LANES;
}

fn candidate_priority(group: u32) -> u32 {
    return changed[group];
}

fn candidate_size(group: u32) -> u32 {
    return members_of(group);
}

fn take_candidate(group: u32, at: u32) {
    changed[group] = 0u;
    for (var i = 0u; i < members_of(group); i++) {
        chosen.paths[at + i] = member_of(group, i);
    }
}

@compute @workgroup_size(256)
fn choose_groups(@builtin(local_invocation_index) lane: u32) {
    let choice = choose_most(lane);
    if lane == 0u {
        chosen.count = choice.taken;
        chosen.workgroups = path_list_workgroups(choice.taken);
        counts[COUNT_CHOSEN] = choice.taken;
        counts[COUNT_WAITING] = choice.waiting;
    }
}
