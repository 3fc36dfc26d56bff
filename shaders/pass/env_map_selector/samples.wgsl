// What candidates see of samples of the surfaces that light reaches, and of those around (pick_samples.wgsl), so that the
// outside of a building, which no light of its rooms reaches, does not count. One bit for each sample and candidate.

// What a sample of the second half counts against one where light arrives: it decides among places that see the light
// alike, and what lies in the dark gets its map if there is one to spare.
const SAMPLES_AROUND: f32 = 0.0625;
// A second look at a sample counts as little as this against a first: it decides where nothing new is to be seen.
const SAMPLES_SECOND_LOOK: f32 = 0.002;

fn samples_words() -> u32 {
    return (params.sample_count + 31u) / 32u;
}

// What the samples of these bits of a word are worth.
fn samples_weight(word: u32, bits: u32) -> f32 {
    return select(1.0, SAMPLES_AROUND, 2u * word >= samples_words()) * f32(countOneBits(bits));
}

// The bits of a candidate: a workgroup for each.
@compute @workgroup_size(256)
fn see_samples(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let candidate = group.x;
    var seen = 0.0;
    for (var word = lane; word < samples_words(); word += LANES) {
        var bits = 0u;
        for (var bit = 0u; bit < 32u; bit++) {
            let index = 32u * word + bit;
            if index < params.sample_count && samples[index].position.x < SURFACE_SAMPLE_NOWHERE {
                let sees = candidate_sees(candidate, samples[index].position, octahedral_unpack(samples[index].normal));
                bits |= u32(sees) << bit;
            }
        }
        seen_by[candidate * CANDIDATE_TEXELS + word] = bits;
        seen += samples_weight(word, bits);
    }
    let total = sum_lanes(lane, vec2f(seen, 0.0)).x;
    if lane == 0u {
        sights[candidate].area = total;
        sights[candidate].unseen = total;
        sights[candidate].own = total;
    }
}

// Samples of a word that some of these maps see, and those that at least two of them see.
fn samples_seen(word: u32, maps: u32) -> vec2u {
    var seen = vec2u(0u);
    for (var left = maps; left != 0u; left &= left - 1u) {
        let own = seen_by[selection.chosen[countTrailingZeros(left)] * CANDIDATE_TEXELS + word];
        seen = vec2u(seen.x | own, seen.y | (seen.x & own));
    }
    return seen;
}

// What a candidate's view of a word is worth beside what other maps see.
fn samples_worth(word: u32, own: u32, others: vec2u) -> f32 {
    return samples_weight(word, own & ~others.x) + SAMPLES_SECOND_LOOK * samples_weight(word, own & others.x & ~others.y);
}

// This lane's part of what a candidate's view is worth beside the selected maps, and beside the other selected maps.
fn samples_unseen(candidate: u32, lane: u32, others: u32) -> vec2f {
    var worth = vec2f(0.0);
    for (var word = lane; word < samples_words(); word += LANES) {
        let own = seen_by[candidate * CANDIDATE_TEXELS + word];
        worth += vec2f(
            samples_worth(word, own, samples_seen(word, selection.selected)),
            samples_worth(word, own, samples_seen(word, others)),
        );
    }
    return worth;
}

// This lane's part of the samples that valid candidates see, those that selected maps do not see first.
fn samples_uncovered(lane: u32) -> vec2f {
    var counts = vec2f(0.0);
    for (var word = lane; word < samples_words(); word += LANES) {
        var reachable = 0u;
        for (var candidate = 0u; candidate < min(params.candidate_count, arrayLength(&sights)); candidate++) {
            if sights[candidate].is_valid == 1u {
                reachable |= seen_by[candidate * CANDIDATE_TEXELS + word];
            }
        }
        counts += vec2f(
            samples_weight(word, reachable & ~samples_seen(word, selection.selected).x), samples_weight(word, reachable),
        );
    }
    return counts;
}

// What exchanging the map of a bit for a candidate gains; all lanes must call it, with sums up to date.
fn samples_gain(candidate: u32, bit: u32, lane: u32) -> f32 {
    let others = selection.selected & ~(1u << bit);
    var worth = 0.0;
    for (var word = lane; word < samples_words(); word += LANES) {
        worth += samples_worth(word, seen_by[candidate * CANDIDATE_TEXELS + word], samples_seen(word, others));
    }
    return sum_lanes(lane, vec2f(worth, 0.0)).x - sights[selection.chosen[bit]].own;
}

// For each candidate, what it would gain in the place of a selected map: a workgroup for each.
@compute @workgroup_size(256)
fn try_exchanges(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let candidate = group.x;
    if lane == 0u {
        // Nothing to try counts as done here.
        is_done = selection.is_done | u32(sights[candidate].is_valid == 0u || bit_of_candidate(candidate) != NONE);
        shared_bits = selection.selected;
        sights[candidate].exchange = -1.0;
    }
    if workgroupUniformLoad(&is_done) != 0u {
        return;
    }
    var best_gain = -1.0;
    for (var left = workgroupUniformLoad(&shared_bits); left != 0u; left &= left - 1u) {
        best_gain = max(best_gain, samples_gain(candidate, countTrailingZeros(left), lane));
    }
    if lane == 0u {
        sights[candidate].exchange = best_gain;
    }
}

// Makes the best of them; if it gains too little, the selection is stable.
@compute @workgroup_size(256)
fn exchange_map(@builtin(local_invocation_index) lane: u32) {
    var own = vec2f(-1.0, 0.0);
    for (var i = lane; i < params.candidate_count; i += LANES) {
        if sights[i].exchange > own.x {
            own = vec2f(sights[i].exchange, f32(i));
        }
    }
    let winner = best_of_lanes(lane, own);
    if lane == 0u {
        shared_bits = select(selection.selected, 0u, winner.x < params.least_gain * selection.total || selection.is_done != 0u);
    }
    let candidate = u32(winner.y);
    var best_gain = 0.0;
    var best_bit = NONE;
    for (var left = workgroupUniformLoad(&shared_bits); left != 0u; left &= left - 1u) {
        let bit = countTrailingZeros(left);
        let gain = samples_gain(candidate, bit, lane);
        best_bit = select(best_bit, bit, gain > best_gain);
        best_gain = max(best_gain, gain);
    }
    if lane != 0u || selection.is_done != 0u {
        return;
    }
    if best_bit == NONE {
        selection.is_done = 1u;
        selection.is_stable = 1u;
    } else {
        selection.chosen[best_bit] = candidate;
        selection.swaps += 1u;
    }
}
