// Chooses candidates of the highest priorities, as many as a budget allows: by one workgroup. Priorities are told apart by
// their powers of two; of those of the last power that fits, the first ones from a place on that turns. The module brings
// `candidate_count()`, `candidate_budget()`, `candidate_turn()`; of each candidate `candidate_priority(i)`, 0: it is none, and
// `candidate_size(i)`; and `take_candidate(i, at)`, which is called in an order that is always the same, `at` the sizes before
// it.

const CHOICE_LANES: u32 = 256u;

// Sizes of those chosen, and how many candidates were left.
struct Choice {
    taken: u32,
    waiting: u32,
}

// Of each power of two of priority, sizes of such candidates.
var<workgroup> choice_powers: array<atomic<u32>, 32>;
var<workgroup> choice_sums: array<u32, CHOICE_LANES>;
// Those of a power above this are chosen, and of this one as many as fit what is left.
var<workgroup> choice_last: i32;
var<workgroup> choice_left: u32;

// Sum of the values of the lanes before this one; all must call it.
fn choice_sum_before(lane: u32, value: u32) -> u32 {
    workgroupBarrier();
    choice_sums[lane] = value;
    workgroupBarrier();
    for (var step = 1u; step < CHOICE_LANES; step *= 2u) {
        var before = 0u;
        if lane >= step {
            before = choice_sums[lane - step];
        }
        workgroupBarrier();
        choice_sums[lane] += before;
        workgroupBarrier();
    }
    return choice_sums[lane] - value;
}

// All lanes of the workgroup call it; all are told the same.
fn choose_most(lane: u32) -> Choice {
    let count = candidate_count();
    for (var i = lane; i < count; i += CHOICE_LANES) {
        let priority = candidate_priority(i);
        if priority > 0u {
            atomicAdd(&choice_powers[firstLeadingBit(priority)], candidate_size(i));
        }
    }
    workgroupBarrier();
    if lane == 0u {
        var power = 31;
        var left = candidate_budget();
        while power >= 0 && atomicLoad(&choice_powers[power]) <= left {
            left -= atomicLoad(&choice_powers[power]);
            power--;
        }
        choice_last = power;
        choice_left = left;
    }
    workgroupBarrier();
    let last = choice_last;
    let left = choice_left;
    var taken = 0u;
    var of_last = 0u;
    var waiting = 0u;
    for (var first = 0u; first < count; first += CHOICE_LANES) {
        let place = first + lane;
        let i = (place + candidate_turn() % count) % count;
        var size = 0u;
        var power = -1;
        let priority = candidate_priority(i);
        if place < count && priority > 0u {
            power = i32(firstLeadingBit(priority));
            size = candidate_size(i);
        }
        let is_of_last = power >= 0 && power == last;
        let before_of_last = of_last + choice_sum_before(lane, select(0u, size, is_of_last));
        of_last += choice_sums[CHOICE_LANES - 1u];
        // One at least, however small the budget.
        let fits = before_of_last + size <= left || (left == candidate_budget() && before_of_last == 0u);
        let is_taken = power > last || (is_of_last && fits);
        let at = taken + choice_sum_before(lane, select(0u, size, is_taken));
        taken += choice_sums[CHOICE_LANES - 1u];
        waiting += select(0u, 1u, power >= 0 && !is_taken);
        if is_taken {
            take_candidate(i, at);
        }
    }
    _ = choice_sum_before(lane, waiting);
    return Choice(taken, choice_sums[CHOICE_LANES - 1u]);
}
