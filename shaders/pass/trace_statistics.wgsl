// Energy audit of a photon buffer: one workgroup a hop adds up flux by what became of it, in a fixed order.

struct Params {
    photon_count: u32,
}

struct Sums {
    // rgb: flux; a: records
    stored: vec4f,
    tentative: vec4f,
    absorbed: vec4f,
    escaped: vec4f,
    lost: vec4f,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> photons: array<Photon>;
@group(0) @binding(2) var<storage, read_write> hops: array<Sums>;

const LANES: u32 = 64u;

var<workgroup> lane_sums: array<Sums, LANES>;

@compute @workgroup_size(64)
fn sum_hops(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    var sums = Sums();
    for (var i = lane; i < params.photon_count; i += LANES) {
        let photon = photons[group.x * params.photon_count + i];
        let flux = vec4f(photon.flux, 1.0);
        switch photon.state & PHOTON_STATE_MASK {
            case PHOTON_STORED: {
                sums.stored += flux;
                sums.tentative += select(vec4f(0.0), flux, photon_is_unresolved(photon.state));
                sums.absorbed += vec4f(photon.flux * (1.0 - reflectance_unpack(photon.reflectance)), 1.0);
            }
            case PHOTON_ESCAPED: { sums.escaped += flux; }
            case PHOTON_LOST: { sums.lost += flux; }
            default: {}
        }
    }
    lane_sums[lane] = sums;
    workgroupBarrier();
    for (var half = LANES / 2u; half > 0u; half /= 2u) {
        if lane < half {
            let other = lane_sums[lane + half];
            lane_sums[lane].stored += other.stored;
            lane_sums[lane].tentative += other.tentative;
            lane_sums[lane].absorbed += other.absorbed;
            lane_sums[lane].escaped += other.escaped;
            lane_sums[lane].lost += other.lost;
        }
        workgroupBarrier();
    }
    if lane == 0u {
        hops[group.x] = lane_sums[0];
    }
}
