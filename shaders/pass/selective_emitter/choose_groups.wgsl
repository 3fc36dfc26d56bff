// Lists all paths of the groups that have changed most, as many as the budget allows, in the order of the groups: one workgroup.
// Change is told apart by its powers of two; of those of the last power that fits, the first ones from a place on that turns.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> grouped: array<GroupedLight>;
@group(0) @binding(2) var<storage, read_write> changed: array<u32>;
@group(0) @binding(3) var<storage, read_write> chosen: PathList;
@group(0) @binding(4) var<storage, read_write> counts: array<u32, 4>;

const LANES: u32 = 256u;
const COUNT_CHOSEN: u32 = 2u;
const COUNT_WAITING: u32 = 3u;

// Of each power of two of change, paths of such groups.
var<workgroup> by_power: array<atomic<u32>, 32>;
var<workgroup> sums: array<u32, LANES>;
// Groups of a power above this are chosen, and of this one as many paths as are left.
var<workgroup> last_power: i32;
var<workgroup> left: u32;

// Sum of the values of the lanes before this one; all must call it.
fn sum_before(lane: u32, value: u32) -> u32 {
    workgroupBarrier();
    sums[lane] = value;
    workgroupBarrier();
    for (var step = 1u; step < LANES; step *= 2u) {
        var before = 0u;
        if lane >= step {
            before = sums[lane - step];
        }
        workgroupBarrier();
        sums[lane] += before;
        workgroupBarrier();
    }
    return sums[lane] - value;
}

@compute @workgroup_size(256)
fn choose_groups(@builtin(local_invocation_index) lane: u32) {
    for (var group = lane; group < params.group_count; group += LANES) {
        if changed[group] > 0u {
            atomicAdd(&by_power[firstLeadingBit(changed[group])], members_of(group));
        }
    }
    workgroupBarrier();
    if lane == 0u {
        var power = 31;
        var rest = params.budget;
        while power >= 0 && atomicLoad(&by_power[power]) <= rest {
            rest -= atomicLoad(&by_power[power]);
            power--;
        }
        last_power = power;
        left = rest;
    }
    workgroupBarrier();
    let power = last_power;
    let rest = left;
    // Of the last power, those from this group on come first.
    let turn = (params.round * LANES) % max(params.group_count, 1u);
    var written = 0u;
    var of_last = 0u;
    var waiting = 0u;
    for (var first = 0u; first < params.group_count; first += LANES) {
        let place = first + lane;
        let group = (place + turn) % params.group_count;
        var members = 0u;
        var own_power = -1;
        if place < params.group_count && changed[group] > 0u {
            own_power = i32(firstLeadingBit(changed[group]));
            members = members_of(group);
        }
        let is_of_last = own_power >= 0 && own_power == power;
        let before_of_last = of_last + sum_before(lane, select(0u, members, is_of_last));
        of_last += sums[LANES - 1u];
        // One group at least, however small the budget.
        let fits = before_of_last + members <= rest || (rest == params.budget && before_of_last == 0u);
        let is_chosen = own_power > power || (is_of_last && fits);
        let at = written + sum_before(lane, select(0u, members, is_chosen));
        written += sums[LANES - 1u];
        waiting += select(0u, 1u, own_power >= 0 && !is_chosen);
        if is_chosen {
            changed[group] = 0u;
            for (var i = 0u; i < members; i++) {
                chosen.paths[at + i] = member_of(group, i);
            }
        }
    }
    _ = sum_before(lane, waiting);
    if lane == 0u {
        chosen.count = written;
        chosen.workgroups = path_list_workgroups(written);
        counts[COUNT_CHOSEN] = written;
        counts[COUNT_WAITING] = sums[LANES - 1u];
    }
}
