// At every pixel the lights that may reach its tile: a workgroup a tile marks them, then each pixel goes through the marks, in
// the order of the lights.

@group(0) @binding(8) var irradiance: texture_storage_2d<rgba32float, write>;

const LANES: u32 = 64u;
// Lights whose marks are held at once.
const BATCH: u32 = 1024u;

var<workgroup> marks: array<atomic<u32>, 32>;
var<workgroup> lows: array<vec3f, LANES>;
var<workgroup> highs: array<vec3f, LANES>;

fn squared_distance_to_box(p: vec3f, low: vec3f, high: vec3f) -> f32 {
    let away = max(max(low - p, p - high), vec3f(0.0));
    return dot(away, away);
}

@compute @workgroup_size(8, 8)
fn tile_lights(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) lane: u32) {
    let is_within = all(id.xy < subsampling_size(view.size, params.factor));
    var receiver = receiver_nowhere();
    if is_within {
        receiver = receiver_of(id.xy);
    }
    lows[lane] = select(vec3f(3e38), receiver.position, receiver.is_seen);
    highs[lane] = select(vec3f(-3e38), receiver.position, receiver.is_seen);
    workgroupBarrier();
    for (var half = LANES / 2u; half > 0u; half /= 2u) {
        if lane < half {
            lows[lane] = min(lows[lane], lows[lane + half]);
            highs[lane] = max(highs[lane], highs[lane + half]);
        }
        workgroupBarrier();
    }
    let low = lows[0];
    let high = highs[0];
    var sum = vec3f(0.0);
    for (var first = 0u; first < params.light_count; first += BATCH) {
        if lane < BATCH / 32u {
            atomicStore(&marks[lane], 0u);
        }
        workgroupBarrier();
        for (var i = lane; i < BATCH; i += LANES) {
            if first + i >= params.light_count || low.x > high.x {
                break;
            }
            let ball = influence(first + i);
            if ball.radius > 0.0 && squared_distance_to_box(ball.center, low, high) <= ball.radius * ball.radius {
                atomicOr(&marks[i / 32u], 1u << (i % 32u));
            }
        }
        workgroupBarrier();
        for (var word = 0u; word < BATCH / 32u; word++) {
            var rest = atomicLoad(&marks[word]);
            while rest != 0u {
                let bit = firstTrailingBit(rest);
                rest &= rest - 1u;
                if receiver.is_seen {
                    sum += irradiance_of(first + 32u * word + bit, receiver.position, receiver.normal);
                }
            }
        }
        workgroupBarrier();
    }
    if is_within {
        textureStore(irradiance, id.xy, vec4f(sum, f32(receiver.is_seen)));
    }
}
