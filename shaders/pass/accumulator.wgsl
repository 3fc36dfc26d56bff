// Plain f32 mean of frames: sum so far plus this frame, and the sum divided by the number of frames. In the sum's alpha, how
// far the frames' light (sum of the channels) spreads, over its mean, squared: Welford's update, as shares of the mean so
// that no exposure leaves the range of f32.

struct Params {
    // Summed before
    frames: f32,
    // 1 / (frames + 1)
    mean_weight: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var frame: texture_2d<f32>;
@group(0) @binding(2) var history: texture_2d<f32>;

struct Sums {
    @location(0) sum: vec4f,
    @location(1) mean: vec4f,
}

fn channel_sum(light: vec3f) -> f32 {
    return light.r + light.g + light.b;
}

// The squared spread with a frame more, over the square of the new mean.
fn spread_with(light: vec3f, before: vec4f, mean: vec3f) -> f32 {
    let now = channel_sum(mean);
    if now <= 0.0 {
        return 0.0;
    }
    let of_frame = channel_sum(light) / now;
    let last = channel_sum(before.rgb) / params.frames / now;
    return before.a * last * last + (of_frame - last) * (of_frame - 1.0);
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> Sums {
    let at = vec2u(position.xy);
    let light = textureLoad(frame, at, 0);
    if params.frames == 0.0 {
        return Sums(vec4f(light.rgb, 0.0), light);
    }
    let before = textureLoad(history, at, 0);
    let sum = before.rgb + light.rgb;
    let mean = sum * params.mean_weight;
    return Sums(vec4f(sum, spread_with(light.rgb, before, mean)), vec4f(mean, light.a));
}
