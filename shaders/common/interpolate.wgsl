// Irradiance at more pixels from samples at a part of them: joint bilateral interpolation (Yao et al., soft shadows and
// image-space photon mapping, section 3.5), with the distance from the receiver's tangent plane in the place of depth. The
// module brings `interpolation`, the textures of the G-buffer, and `coarse`, the samples.

struct Interpolation {
    // Pixels of the G-buffer along each axis for a sample, and for a pixel of what is made of them
    factor: u32,
    target_factor: u32,
    // Cosine at and below which normals do not agree
    normal_agreement: f32,
    // Distance from the receiver's plane that counts as off it, in receiver-to-sample distances as seen on the screen
    plane_distance: f32,
    // Difference of samples, over their mean, above which what lies between them is marked
    disagreement: f32,
    // 1: pixels are marked
    is_marking: u32,
}

// Misfits of samples without a surface, and of those whose misfit is no number.
const UNSEEN: f32 = 3e38;
const WORST: f32 = 1e38;
// Where the samples that fit weigh less than this together, of 1, they lie to one side.
const LEAST_FIT: f32 = 0.25;

// What a sample says, and how well it fits a receiver.
struct Sample {
    irradiance: vec3f,
    // Factor on its screen-space weight, 0 where it does not fit
    fit: f32,
    // 0 on the same plane; orders the samples where none fits
    misfit: f32,
}

struct Mean {
    value: vec3f,
    weight: f32,
}

// Updated, not summed and divided: equal values stay what they are to the bit.
fn mean_with(mean: Mean, value: vec3f, weight: f32) -> Mean {
    if !(weight > 0.0) {
        return mean;
    }
    if mean.weight <= 0.0 {
        return Mean(value, weight);
    }
    let total = mean.weight + weight;
    // A quotient that is rounded up must not overshoot: irradiance would turn negative.
    return Mean(mean.value + min(1.0, weight / total) * (value - mean.value), total);
}

// The sample of this index as the receiver sees it.
fn sample_for(receiver: BilateralReceiver, index: vec2u) -> Sample {
    let pixel = subsampling_pixel(index, interpolation.factor, view.size);
    if !bilateral_is_surface(pixel) {
        return Sample(vec3f(0.0), 0.0, UNSEEN);
    }
    let fit = bilateral_fit(receiver, pixel, interpolation.normal_agreement, interpolation.plane_distance);
    return Sample(textureLoad(coarse, index, 0).rgb, fit.x, select(WORST, fit.y, fit.y < WORST));
}

struct Estimate {
    irradiance: vec3f,
    // 1 where samples fit
    fits: f32,
    is_marked: bool,
}

// Whether four samples leave open what lies between them: too few fit, or they say too different things.
fn is_in_doubt(total: f32, low: f32, high: f32) -> bool {
    return total < LEAST_FIT || high - low > 0.5 * interpolation.disagreement * (low + high);
}

fn estimate_at(id: vec2u) -> Estimate {
    let pixel_at = subsampling_pixel(id, interpolation.target_factor, view.size);
    if !bilateral_is_surface(pixel_at) {
        return Estimate(vec3f(0.0), 0.0, false);
    }
    let receiver = bilateral_receiver(pixel_at);
    let factor = i32(interpolation.factor);
    let last = vec2i(min(subsampling_size(view.size, interpolation.factor), textureDimensions(coarse))) - 1;
    // The four samples around the pixel. The last ones of an axis may stand closer; outside the outermost, they count alone.
    let pixel = vec2i(pixel_at);
    let low = clamp((pixel - factor / 2 + factor) / factor - 1, vec2i(0), last);
    let high = min(low + 1, last);
    let start = vec2i(subsampling_pixel(vec2u(low), interpolation.factor, view.size));
    let end = vec2i(subsampling_pixel(vec2u(high), interpolation.factor, view.size));
    let t = clamp(vec2f(pixel - start) / vec2f(max(end - start, vec2i(1))), vec2f(0.0), vec2f(1.0));
    var mean = Mean();
    // Sum of the channels: the least and the most that a sample says.
    var least = 3e38;
    var most = 0.0;
    for (var i = 0; i < 4; i++) {
        let right_or_below = vec2<bool>((i & 1) == 1, (i & 2) == 2);
        let share = select(1.0 - t, t, right_or_below);
        if share.x * share.y > 0.0 {
            let s = sample_for(receiver, vec2u(select(low, high, right_or_below)));
            let weight = share.x * share.y * s.fit;
            mean = mean_with(mean, s.irradiance, weight);
            if weight > 0.0 {
                let light = s.irradiance.r + s.irradiance.g + s.irradiance.b;
                least = min(least, light);
                most = max(most, light);
            }
        }
    }
    if mean.weight > 0.0 {
        return Estimate(mean.value, 1.0, is_in_doubt(mean.weight, least, most));
    }
    // None of them fits: the sixteen around, falling off linearly to twice the distance between samples.
    var best = Sample(vec3f(0.0), 0.0, UNSEEN);
    for (var i = 0; i < 16; i++) {
        let index = low + vec2i(i % 4, i / 4) - 1;
        if any(index < vec2i(0)) || any(index > last) {
            continue;
        }
        let s = sample_for(receiver, vec2u(index));
        let at = vec2i(subsampling_pixel(vec2u(index), interpolation.factor, view.size));
        let share = max(vec2f(0.0), 2.0 - vec2f(abs(pixel - at)) / f32(factor));
        mean = mean_with(mean, s.irradiance, share.x * share.y * s.fit);
        if s.misfit < best.misfit {
            best = s;
        }
    }
    if mean.weight > 0.0 {
        return Estimate(mean.value, 1.0, true);
    }
    return Estimate(best.irradiance, 0.0, true);
}
