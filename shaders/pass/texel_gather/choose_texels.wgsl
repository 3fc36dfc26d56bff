// Lists the texels that are due most, as many as the budget allows.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read_write> due: array<u32>;
@group(0) @binding(2) var<storage, read_write> chosen: PathList;
// Texels gathered, and those that wait
@group(0) @binding(3) var<storage, read_write> counts: array<u32, 2>;
// Of each texel one more than its place in the list, or 0
@group(0) @binding(4) var<storage, read_write> places: array<u32>;
@group(0) @binding(5) var<storage, read> lights: array<SurfaceLight>;
@group(0) @binding(6) var<storage, read> shining: array<SurfaceLight>;
// Of each in the list how far it stands from its place, where photons arrive that it does not hide from
@group(0) @binding(7) var<storage, read_write> shifts: array<vec4f>;

fn candidate_count() -> u32 {
    return params.texel_count;
}

fn candidate_budget() -> u32 {
    return params.budget;
}

fn candidate_turn() -> u32 {
    return params.round * params.budget;
}

fn candidate_priority(texel: u32) -> u32 {
    return due[texel];
}

fn candidate_size(texel: u32) -> u32 {
    return 1u;
}

fn take_candidate(texel: u32, at: u32) {
    if params.keeps_due == 0u {
        due[texel] = 0u;
    }
    chosen.paths[at] = texel;
    places[texel] = at + 1u;
    shifts[at] = vec4f(shining[texel].position - lights[texel].position, 0.0);
}

@compute @workgroup_size(256)
fn choose_texels(@builtin(local_invocation_index) lane: u32) {
    let choice = choose_most(lane);
    if lane == 0u {
        chosen.count = choice.taken;
        chosen.workgroups = array<u32, 3>(choice.taken, 1u, 1u);
        counts = array<u32, 2>(choice.taken, choice.waiting);
    }
}
