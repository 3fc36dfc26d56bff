// Samples of surfaces, a workgroup for each. The first half lie where light arrives: a hop of photons of its own run of
// slots. The second half lie around: on what a candidate shows that sees such a place. No light is known to arrive there:
// it may be dark, or unseen by the maps in use, so that no photon could be followed to it.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var atlas: texture_2d<u32>;
@group(0) @binding(2) var<storage, read> centers: array<vec4f>;
@group(0) @binding(3) var<storage, read> sights: array<Sight>;
@group(0) @binding(4) var<storage, read> photons: array<Photon>;
@group(0) @binding(5) var<storage, read_write> samples: array<SurfaceSample>;

const LANES: u32 = 64u;
const NONE: u32 = 0xffffffffu;
// Texels of the candidate that each lane tries.
const TRIES: u32 = 2u;
// Random numbers of a group.
const DIMENSION_SLOT: u32 = 0u;
const DIMENSION_CANDIDATE: u32 = 1u;
const DIMENSION_TEXEL: u32 = 2u;

var<workgroup> soonest: atomic<u32>;
var<workgroup> winner: atomic<u32>;
var<workgroup> winner_of_all: u32;

// One of many in proportion to their weights, the least of exponential variates.
struct Race {
    time: f32,
    index: u32,
}

fn race() -> Race {
    return Race(1e30, NONE);
}

fn race_enter(race: ptr<function, Race>, index: u32, weight: f32, u: f32) {
    // Above zero whatever the logarithm's rounding: times are compared by their bits.
    let time = max(-log(1.0 - u), 0x1p-40) / weight;
    if weight > 0.0 && time < (*race).time {
        *race = Race(time, index);
    }
}

// The winner of all lanes' races, NONE if nobody ran; all lanes must call it.
fn race_winner(lane: u32, own: Race) -> u32 {
    if lane == 0u {
        atomicStore(&soonest, NONE);
        atomicStore(&winner, NONE);
    }
    workgroupBarrier();
    atomicMin(&soonest, bitcast<u32>(own.time));
    workgroupBarrier();
    if bitcast<u32>(own.time) == atomicLoad(&soonest) {
        atomicMin(&winner, own.index);
    }
    workgroupBarrier();
    if lane == 0u {
        winner_of_all = atomicLoad(&winner);
    }
    return workgroupUniformLoad(&winner_of_all);
}

fn nowhere() -> SurfaceSample {
    return SurfaceSample(vec3f(2.0 * SURFACE_SAMPLE_NOWHERE), 0u);
}

// The surface that a texel of a candidate shows.
fn surface_of(candidate: u32, index: u32) -> SurfaceSample {
    let texel = candidate_texel(candidate, index);
    let position = centers[candidate].xyz + texel.direction * texel.surface.distance;
    return SurfaceSample(position, octahedral_pack(texel.surface.normal));
}

@compute @workgroup_size(64)
fn pick_samples(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    // All slots are in a run: the first so many runs are longer by one.
    let half = params.sample_count / 2u;
    let run = group.x % half;
    let longer = params.slot_count % half;
    let first = run * (params.slot_count / half) + min(run, longer);
    let end = first + params.slot_count / half + u32(run < longer);
    var slots = race();
    for (var slot = first + lane; slot < end; slot += LANES) {
        let is_stored = (photons[slot].state & PHOTON_STATE_MASK) == PHOTON_STORED;
        race_enter(&slots, slot, f32(is_stored), hash_unit(slot, DIMENSION_SLOT));
    }
    let slot = race_winner(lane, slots);
    if slot == NONE || group.x < half {
        if lane == 0u {
            var sample = nowhere();
            if slot != NONE {
                sample = SurfaceSample(photons[slot].position, photons[slot].normal);
            }
            samples[group.x] = sample;
        }
        return;
    }
    let position = photons[slot].position;
    let normal = octahedral_unpack(photons[slot].normal);
    var viewers = race();
    for (var candidate = lane; candidate < params.candidate_count; candidate += LANES) {
        let sees = sights[candidate].is_valid == 1u && candidate_sees(candidate, position, normal);
        race_enter(&viewers, candidate, f32(sees), hash_unit(group.x * params.candidate_count + candidate, DIMENSION_CANDIDATE));
    }
    let viewer = race_winner(lane, viewers);
    var texels = race();
    for (var i = 0u; i < TRIES && viewer != NONE; i++) {
        let number = (group.x * LANES + lane) * TRIES + i;
        let index = u32(hash_unit(number, DIMENSION_TEXEL) * f32(CANDIDATE_TEXELS));
        let area = candidate_area(candidate_texel(viewer, index));
        race_enter(&texels, index, area, hash_unit(number, DIMENSION_TEXEL + 1u));
    }
    let texel = race_winner(lane, texels);
    if lane == 0u {
        var sample = nowhere();
        if texel != NONE {
            sample = surface_of(viewer, texel);
        }
        samples[group.x] = sample;
    }
}
