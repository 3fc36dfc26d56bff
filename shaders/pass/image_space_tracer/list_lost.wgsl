// Lists the paths whose hop could not be resolved, in the order of the paths: counts them in blocks of 64, sums the counts,
// and writes each to the place that the sums give it.

@group(0) @binding(0) var<uniform> walk: WalkParams;
@group(0) @binding(1) var<storage, read> photons: array<Photon>;
@group(0) @binding(2) var<storage, read_write> lost: PathList;
// Of each block: how many of its paths are lost, then how many of those before it
@group(0) @binding(3) var<storage, read_write> blocks: array<u32>;

const BLOCK: u32 = 64u;
const LANES: u32 = 256u;

var<workgroup> sums: array<u32, LANES>;

// Sum of the values of the lanes before this one, of the first `lanes`; all of them must call it.
fn sum_before(lane: u32, lanes: u32, value: u32) -> u32 {
    sums[lane] = value;
    workgroupBarrier();
    for (var step = 1u; step < lanes; step *= 2u) {
        var left = 0u;
        if lane >= step {
            left = sums[lane - step];
        }
        workgroupBarrier();
        sums[lane] += left;
        workgroupBarrier();
    }
    return sums[lane] - value;
}

// Paths that the list has room for.
fn path_count() -> u32 {
    return min(walk.photon_count, arrayLength(&lost.paths));
}

fn block_count() -> u32 {
    return (path_count() + BLOCK - 1u) / BLOCK;
}

fn is_lost(path: u32) -> u32 {
    if path >= path_count() {
        return 0u;
    }
    return u32(photon_is_unresolved(photons[walk.first_hop * walk.photon_count + path].state));
}

fn block_of(group: vec3u) -> u32 {
    return group.y * (walk.row / BLOCK) + group.x;
}

@compute @workgroup_size(64)
fn count_lost(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let block = block_of(group);
    let own = is_lost(block * BLOCK + lane);
    let before = sum_before(lane, BLOCK, own);
    if lane == BLOCK - 1u && block < block_count() {
        blocks[block] = before + own;
    }
}

// One workgroup; each lane takes a run of blocks.
@compute @workgroup_size(256)
fn sum_blocks(@builtin(local_invocation_index) lane: u32) {
    let run = (block_count() + LANES - 1u) / LANES;
    let first = min(lane * run, block_count());
    let end = min(first + run, block_count());
    var own = 0u;
    for (var block = first; block < end; block++) {
        own += blocks[block];
    }
    var before = sum_before(lane, LANES, own);
    for (var block = first; block < end; block++) {
        let count = blocks[block];
        blocks[block] = before;
        before += count;
    }
    if lane == LANES - 1u {
        lost.count = before;
        lost.workgroups = path_list_workgroups(before);
    }
}

@compute @workgroup_size(64)
fn write_lost(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let block = block_of(group);
    let path = block * BLOCK + lane;
    let own = is_lost(path);
    let before = sum_before(lane, BLOCK, own);
    if own == 1u {
        lost.paths[blocks[block] + before] = path;
    }
}
