// A stable radix sort of keys with values, one digit of seven bits a pass (Satish, Harris and Garland 2009): each block
// of keys counts its digits, the counts are summed over digits and blocks, and each key goes where the sums say, behind
// those before it of the same digit. Equal keys stay in order, so that the same input gives the same order, always.

struct SortParams {
    count: u32,
    blocks: u32,
    // Lowest bit of this pass's digit
    shift: u32,
    // Workgroups in a row of the dispatch
    row: u32,
}

@group(0) @binding(0) var<uniform> sort: SortParams;
@group(0) @binding(1) var<storage, read> keys_in: array<u32>;
@group(0) @binding(2) var<storage, read> values_in: array<u32>;
@group(0) @binding(3) var<storage, read_write> keys_out: array<u32>;
@group(0) @binding(4) var<storage, read_write> values_out: array<u32>;
// By block, then by digit: how many, then how many before them of the same digit
@group(0) @binding(5) var<storage, read_write> counts: array<u32>;
// By digit: how many there are of lower digits
@group(0) @binding(6) var<storage, read_write> totals: array<u32>;

const DIGITS: u32 = 128u;
const LANES: u32 = 256u;
// Keys of a block over lanes
const ROUNDS: u32 = 4u;
// Words that hold a bit for each lane
const WORDS: u32 = LANES / 32u;

fn sort_digit(key: u32) -> u32 {
    return (key >> sort.shift) & (DIGITS - 1u);
}

fn sort_block(group: vec3u) -> u32 {
    return group.y * sort.row + group.x;
}

var<workgroup> digit_counts: array<atomic<u32>, DIGITS>;

@compute @workgroup_size(256)
fn count_digits(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let block = sort_block(group);
    for (var round = 0u; round < ROUNDS; round++) {
        let i = (block * ROUNDS + round) * LANES + lane;
        if i < sort.count {
            atomicAdd(&digit_counts[sort_digit(keys_in[i])], 1u);
        }
    }
    workgroupBarrier();
    if lane < DIGITS && block < sort.blocks {
        counts[block * DIGITS + lane] = atomicLoad(&digit_counts[lane]);
    }
}

var<workgroup> sums: array<u32, DIGITS>;

// One workgroup, one invocation a digit: over blocks, then over digits.
@compute @workgroup_size(128)
fn sum_digits(@builtin(local_invocation_index) digit: u32) {
    var own = 0u;
    for (var block = 0u; block < sort.blocks; block++) {
        let count = counts[block * DIGITS + digit];
        counts[block * DIGITS + digit] = own;
        own += count;
    }
    sums[digit] = own;
    workgroupBarrier();
    for (var step = 1u; step < DIGITS; step *= 2u) {
        var left = 0u;
        if digit >= step {
            left = sums[digit - step];
        }
        workgroupBarrier();
        sums[digit] += left;
        workgroupBarrier();
    }
    totals[digit] = sums[digit] - own;
}

// Of each digit: a bit for each lane whose key has it, and where its next key goes.
var<workgroup> lanes_of: array<atomic<u32>, DIGITS * WORDS>;
var<workgroup> next: array<u32, DIGITS>;

@compute @workgroup_size(256)
fn place_keys(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let block = min(sort_block(group), sort.blocks - 1u);
    let is_block = sort_block(group) < sort.blocks;
    if lane < DIGITS {
        next[lane] = totals[lane] + counts[block * DIGITS + lane];
    }
    for (var round = 0u; round < ROUNDS; round++) {
        let i = (block * ROUNDS + round) * LANES + lane;
        let is_key = is_block && i < sort.count;
        var key = 0u;
        if is_key {
            key = keys_in[i];
            atomicOr(&lanes_of[sort_digit(key) * WORDS + lane / 32u], 1u << (lane % 32u));
        }
        workgroupBarrier();
        if is_key {
            let digit = sort_digit(key);
            var at = next[digit];
            for (var word = 0u; word < lane / 32u; word++) {
                at += countOneBits(atomicLoad(&lanes_of[digit * WORDS + word]));
            }
            let own_word = atomicLoad(&lanes_of[digit * WORDS + lane / 32u]);
            at += countOneBits(own_word & ((1u << (lane % 32u)) - 1u));
            keys_out[at] = key;
            values_out[at] = values_in[i];
        }
        workgroupBarrier();
        if lane < DIGITS {
            for (var word = 0u; word < WORDS; word++) {
                next[lane] += countOneBits(atomicExchange(&lanes_of[lane * WORDS + word], 0u));
            }
        }
        workgroupBarrier();
    }
}
