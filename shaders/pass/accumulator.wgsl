// Plain f32 mean of frames: sum so far plus this frame, and the sum divided by the number of frames.

struct Params {
    // 0 for the first frame: what the sum held before does not count
    history_weight: f32,
    // 1 / frames summed
    mean_weight: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var frame: texture_2d<f32>;
@group(0) @binding(2) var history: texture_2d<f32>;

struct Sums {
    @location(0) sum: vec4f,
    @location(1) mean: vec4f,
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> Sums {
    let at = vec2u(position.xy);
    var sum = textureLoad(frame, at, 0);
    if params.history_weight > 0.0 {
        sum += textureLoad(history, at, 0);
    }
    return Sums(sum, sum * params.mean_weight);
}
