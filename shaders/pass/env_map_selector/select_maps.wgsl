// The selection itself: which candidates together see the most (Yao et al. 2010, section 4). Every step is a dispatch; a
// step that finds the work done returns at once, so that the host records them all without knowing how many it takes.
//
// What is seen is measured by area, texel by texel, or in samples of the surfaces that light reaches (samples.wgsl).

struct Selection {
    tag: u32,
    // Bits of `chosen` in use
    selected: u32,
    // Bit added last; NONE: nothing was added
    newest: u32,
    is_done: u32,
    // The last swap gave back what it took
    is_stable: u32,
    swaps: u32,
    coverage: f32,
    // All there is to be seen: area, or worth of samples
    total: f32,
    // Candidate by bit
    chosen: array<u32, 32>,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var atlas: texture_2d<u32>;
@group(0) @binding(2) var<storage, read> centers: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> sights: array<Sight>;
// By area: for each texel of each candidate, one bit for each selected map that sees its surface. By samples: for each
// candidate, one bit for each sample that it sees
@group(0) @binding(4) var<storage, read_write> seen_by: array<u32>;
@group(0) @binding(5) var<storage, read_write> selection: Selection;
@group(0) @binding(6) var<storage, read> samples: array<SurfaceSample>;
// Centres of environment maps in use, w: 1 on, 0 off
@group(1) @binding(0) var<storage, read_write> map_centers: array<vec4f>;

const NONE: u32 = 0xffffffffu;
const LANES: u32 = 256u;

var<workgroup> counted: array<atomic<u32>, 2>;
var<workgroup> nearest: atomic<u32>;
var<workgroup> sums: array<vec2f, LANES>;
var<workgroup> best: array<vec2f, LANES>;
var<workgroup> is_done: u32;
var<workgroup> shared_bits: u32;

fn bit_of_candidate(candidate: u32) -> u32 {
    for (var bit = 0u; bit < 32u; bit++) {
        if (selection.selected >> bit & 1u) == 1u && selection.chosen[bit] == candidate {
            return bit;
        }
    }
    return NONE;
}

// Adds up what every lane brings, always in the same order.
fn sum_lanes(lane: u32, value: vec2f) -> vec2f {
    sums[lane] = value;
    workgroupBarrier();
    for (var half = LANES / 2u; half > 0u; half /= 2u) {
        if lane < half {
            sums[lane] += sums[lane + half];
        }
        workgroupBarrier();
    }
    let total = sums[0];
    workgroupBarrier();
    return total;
}

// The candidate of the greatest value among the lanes' own (value, candidate); the first of equals.
fn best_of_lanes(lane: u32, own: vec2f) -> vec2f {
    best[lane] = own;
    workgroupBarrier();
    for (var half = LANES / 2u; half > 0u; half /= 2u) {
        if lane < half {
            let other = best[lane + half];
            let mine = best[lane];
            if other.x > mine.x || (other.x == mine.x && other.y < mine.y) {
                best[lane] = other;
            }
        }
        workgroupBarrier();
    }
    let winner = best[0];
    workgroupBarrier();
    return winner;
}

// Forgets every map.
@compute @workgroup_size(1)
fn start_anew() {
    selection.selected = 0u;
    selection.swaps = 0u;
}

// What each candidate sees: a workgroup for each.
@compute @workgroup_size(256)
fn inspect_candidates(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let candidate = group.x;
    if lane == 0u {
        atomicStore(&counted[0], 0u);
        atomicStore(&counted[1], 0u);
        atomicStore(&nearest, NONE);
    }
    workgroupBarrier();
    var area = 0.0;
    for (var i = lane; i < CANDIDATE_TEXELS; i += LANES) {
        let texel = candidate_texel(candidate, i);
        seen_by[candidate * CANDIDATE_TEXELS + i] = 0u;
        if texel.surface.distance > 0.0 {
            atomicAdd(&counted[0], 1u);
            atomicMin(&nearest, bitcast<u32>(texel.surface.distance));
        }
        if (texel.surface.flags & SURFACE_TEXEL_BACK_FACE) != 0u {
            atomicAdd(&counted[1], 1u);
        }
        area += candidate_area(texel);
    }
    let total = sum_lanes(lane, vec2f(area, 0.0)).x;
    if lane == 0u {
        let surfaces = atomicLoad(&counted[0]);
        let back_faces = atomicLoad(&counted[1]);
        let closest = atomicLoad(&nearest);
        let is_outside = f32(back_faces) <= params.back_face_limit * f32(surfaces);
        let is_clear = bitcast<f32>(closest) >= params.clearance;
        let is_valid = surfaces > 0u && is_outside && is_clear;
        sights[candidate] = Sight(surfaces, back_faces, closest, u32(is_valid), total, total, total, 0.0);
    }
}

// Before any step: gives up selected maps whose place is no longer valid. If no candidate is valid, those that see the
// smallest share of back faces are admitted, so that a scene of inside-out surfaces still gets its light.
@compute @workgroup_size(256)
fn admit_candidates(@builtin(local_invocation_index) lane: u32) {
    var valid = 0.0;
    var least_inside = vec2f(-2.0, 0.0);
    for (var i = lane; i < params.candidate_count; i += LANES) {
        valid += f32(sights[i].is_valid);
        if sights[i].surfaces > 0u {
            let inside = f32(sights[i].back_faces) / f32(sights[i].surfaces);
            least_inside = select(least_inside, vec2f(-inside, 0.0), -inside > least_inside.x);
        }
    }
    valid = sum_lanes(lane, vec2f(valid, 0.0)).x;
    let share = -best_of_lanes(lane, least_inside).x;
    for (var i = lane; i < params.candidate_count && valid == 0.0; i += LANES) {
        let surfaces = f32(sights[i].surfaces);
        sights[i].is_valid = u32(surfaces > 0.0 && f32(sights[i].back_faces) <= share * surfaces);
    }
    storageBarrier();
    if lane == 0u {
        for (var bit = 0u; bit < 32u; bit++) {
            let candidate = selection.chosen[bit];
            if (selection.selected >> bit & 1u) == 1u && sights[candidate].is_valid == 0u {
                selection.selected &= ~(1u << bit);
            }
        }
        selection.tag = params.tag;
        selection.newest = NONE;
        selection.is_done = 0u;
        selection.is_stable = 0u;
    }
}

fn mark(candidate: u32, lane: u32, bits: u32) {
    for (var i = lane; i < CANDIDATE_TEXELS; i += LANES) {
        let texel = candidate_texel(candidate, i);
        if texel.surface.distance <= 0.0 {
            continue;
        }
        let at = candidate * CANDIDATE_TEXELS + i;
        let p = centers[candidate].xyz + texel.direction * texel.surface.distance;
        var mask = seen_by[at] & ~bits;
        for (var left = bits; left != 0u; left &= left - 1u) {
            let bit = countTrailingZeros(left);
            if candidate_sees(selection.chosen[bit], p, texel.surface.normal) {
                mask |= 1u << bit;
            }
        }
        seen_by[at] = mask;
    }
}

// Every texel of every candidate against all selected maps.
@compute @workgroup_size(256)
fn mark_all(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    mark(group.x, lane, selection.selected);
}

// And against the newest alone.
@compute @workgroup_size(256)
fn mark_newest(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    if selection.is_done == 0u && selection.newest != NONE {
        mark(group.x, lane, 1u << selection.newest);
    }
}

// A(v | C) of every candidate, and A(v | C - v) of those selected.
@compute @workgroup_size(256)
fn sum_unseen(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let candidate = group.x;
    if lane == 0u {
        is_done = selection.is_done;
    }
    if workgroupUniformLoad(&is_done) != 0u {
        return;
    }
    let bit = bit_of_candidate(candidate);
    let others = selection.selected & ~select(0u, 1u << (bit & 31u), bit != NONE);
    // By samples, of which there are none by area.
    var sum = samples_unseen(candidate, lane, others);
    for (var i = lane; i < CANDIDATE_TEXELS && params.sample_count == 0u; i += LANES) {
        let seen = seen_by[candidate * CANDIDATE_TEXELS + i] & selection.selected;
        let area = candidate_area(candidate_texel(candidate, i));
        sum += vec2f(select(0.0, area, seen == 0u), select(0.0, area, (seen & others) == 0u));
    }
    let total = sum_lanes(lane, sum);
    if lane == 0u {
        sights[candidate].unseen = total.x;
        sights[candidate].own = total.y;
    }
}

// Of what valid candidates see: the part that selected maps do not see, and all of it.
fn uncovered(lane: u32) -> vec2f {
    var area = samples_uncovered(lane);
    for (var i = lane; i < params.candidate_count && params.sample_count == 0u; i += LANES) {
        area += select(vec2f(0.0), vec2f(sights[i].unseen, sights[i].area), sights[i].is_valid == 1u);
    }
    return sum_lanes(lane, area);
}

// Where light arrives nowhere, all of it is seen; where candidates see nothing but backs, nothing.
fn coverage(uncovered: vec2f) -> f32 {
    return select(f32(params.sample_count > 0u), 1.0 - uncovered.x / uncovered.y, uncovered.y > 0.0);
}

// The unselected candidate that sees the most new, the first of equals; NONE if there is none left.
fn best_addition(lane: u32) -> u32 {
    var own = vec2f(-1.0, f32(params.candidate_count));
    for (var i = lane; i < params.candidate_count; i += LANES) {
        let is_free = sights[i].is_valid == 1u && bit_of_candidate(i) == NONE;
        if is_free && sights[i].unseen > own.x {
            own = vec2f(sights[i].unseen, f32(i));
        }
    }
    let winner = best_of_lanes(lane, own);
    return select(NONE, u32(winner.y), winner.x >= 0.0);
}

fn add(candidate: u32) {
    let bit = countTrailingZeros(~selection.selected);
    selection.selected |= 1u << bit;
    selection.chosen[bit] = candidate;
    selection.newest = bit;
}

// Greedy: takes the best addition, unless there are enough maps, enough is seen, or it would add too little. With a
// target of 1 nothing is too little.
@compute @workgroup_size(256)
fn add_map(@builtin(local_invocation_index) lane: u32) {
    let unseen_of_all = uncovered(lane);
    let addition = best_addition(lane);
    if lane != 0u || selection.is_done != 0u {
        return;
    }
    let count = countOneBits(selection.selected);
    if count >= params.limit || addition == NONE {
        selection.is_done = 1u;
        return;
    }
    let gain = sights[addition].unseen;
    let sees_nothing = params.sample_count > 0u && gain <= 0.0;
    let is_worth_it = params.coverage_target >= 1.0 || gain >= params.least_gain * unseen_of_all.y;
    let is_first = count == 0u && !sees_nothing;
    if is_first || (is_worth_it && !is_satisfied(coverage(unseen_of_all))) {
        add(addition);
    } else {
        selection.is_done = 1u;
    }
}

// A target of 1 is never met.
fn is_satisfied(covered: f32) -> bool {
    return params.coverage_target < 1.0 && covered >= params.coverage_target;
}

// After the greedy steps: swaps may follow, unless all that was asked for is seen.
@compute @workgroup_size(256)
fn begin_swaps(@builtin(local_invocation_index) lane: u32) {
    let unseen_of_all = uncovered(lane);
    if lane == 0u {
        selection.total = unseen_of_all.y;
        selection.is_done = u32(is_satisfied(coverage(unseen_of_all)));
        selection.is_stable = selection.is_done;
    }
}

// First half of a swap: one map more than there may be.
@compute @workgroup_size(256)
fn add_for_swap(@builtin(local_invocation_index) lane: u32) {
    let addition = best_addition(lane);
    if lane != 0u || selection.is_done != 0u {
        return;
    }
    if addition == NONE {
        selection.is_done = 1u;
        selection.is_stable = 1u;
    } else {
        add(addition);
    }
}

// Bit of the selected map that sees the least that no other does; `preferred` among equals.
fn least_own(preferred: u32) -> u32 {
    var found = preferred;
    var least = sights[selection.chosen[preferred]].own;
    for (var bit = 0u; bit < 32u; bit++) {
        if (selection.selected >> bit & 1u) == 1u && sights[selection.chosen[bit]].own < least {
            least = sights[selection.chosen[bit]].own;
            found = bit;
        }
    }
    return found;
}

// Second half: drops the map that sees the least that no other does. If that gains too little, it drops the newest, and the
// selection is stable.
@compute @workgroup_size(1)
fn drop_map() {
    if selection.is_done != 0u {
        return;
    }
    let newest = selection.newest;
    let least = least_own(newest);
    let gain = sights[selection.chosen[newest]].own - sights[selection.chosen[least]].own;
    if least == newest || gain < params.least_gain * selection.total {
        selection.selected &= ~(1u << newest);
        selection.is_done = 1u;
        selection.is_stable = 1u;
    } else {
        selection.selected &= ~(1u << least);
        selection.swaps += 1u;
    }
}

// So that sums are taken once more, of the selection as it now stands.
@compute @workgroup_size(1)
fn end_steps() {
    selection.is_done = 0u;
}

// A scene that has become simpler may need a map less: tries without the one that sees the least.
@compute @workgroup_size(256)
fn try_without(@builtin(local_invocation_index) lane: u32) {
    let covered = coverage(uncovered(lane));
    if lane != 0u || selection.is_done != 0u {
        return;
    }
    if is_satisfied(covered) && countOneBits(selection.selected) > 1u {
        selection.newest = least_own(countTrailingZeros(selection.selected));
        selection.selected &= ~(1u << selection.newest);
    } else {
        selection.is_done = 1u;
    }
}

// And takes it back where it was needed: then all are.
@compute @workgroup_size(256)
fn keep_if_needed(@builtin(local_invocation_index) lane: u32) {
    let covered = coverage(uncovered(lane));
    if lane != 0u || selection.is_done != 0u {
        return;
    }
    if is_satisfied(covered) {
        selection.is_stable = 0u;
    } else {
        selection.selected |= 1u << selection.newest;
        selection.is_done = 1u;
    }
}

@compute @workgroup_size(256)
fn measure_coverage(@builtin(local_invocation_index) lane: u32) {
    let covered = coverage(uncovered(lane));
    if lane == 0u {
        selection.coverage = covered;
    }
}

// Until a selection arrives, maps stand at the first candidates: those at invalid ones are switched off.
@compute @workgroup_size(64)
fn switch_maps(@builtin(global_invocation_id) id: vec3u) {
    if id.x < min(arrayLength(&map_centers), min(params.candidate_count, params.limit)) {
        map_centers[id.x].w = f32(sights[id.x].is_valid);
    }
}
