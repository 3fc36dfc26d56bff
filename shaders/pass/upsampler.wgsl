// Irradiance at more pixels from samples at a part of them: joint bilateral interpolation (Yao et al., soft shadows and
// image-space photon mapping, section 3.5), with the distance from the receiver's tangent plane in the place of depth.

struct Params {
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

// `MarkedPixels` while it is filled.
struct Marking {
    workgroups: array<u32, 3>,
    count: atomic<u32>,
    pixels: array<u32>,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var base_color_texture: texture_2d<f32>;
@group(0) @binding(5) var surface_texture: texture_2d<u32>;
@group(0) @binding(6) var coarse: texture_2d<f32>;
@group(0) @binding(7) var irradiance: texture_storage_2d<rgba32float, write>;
@group(0) @binding(8) var<storage, read_write> marked: Marking;

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
    let pixel = subsampling_pixel(index, params.factor, view.size);
    if !bilateral_is_surface(pixel) {
        return Sample(vec3f(0.0), 0.0, UNSEEN);
    }
    let fit = bilateral_fit(receiver, pixel, params.normal_agreement, params.plane_distance);
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
    return total < LEAST_FIT || high - low > 0.5 * params.disagreement * (low + high);
}

fn estimate_at(id: vec2u) -> Estimate {
    let pixel_at = subsampling_pixel(id, params.target_factor, view.size);
    if !bilateral_is_surface(pixel_at) {
        return Estimate(vec3f(0.0), 0.0, false);
    }
    let receiver = bilateral_receiver(pixel_at);
    let factor = i32(params.factor);
    let last = vec2i(min(subsampling_size(view.size, params.factor), textureDimensions(coarse))) - 1;
    // The four samples around the pixel. The last ones of an axis may stand closer; outside the outermost, they count alone.
    let pixel = vec2i(pixel_at);
    let low = clamp((pixel - factor / 2 + factor) / factor - 1, vec2i(0), last);
    let high = min(low + 1, last);
    let start = vec2i(subsampling_pixel(vec2u(low), params.factor, view.size));
    let end = vec2i(subsampling_pixel(vec2u(high), params.factor, view.size));
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
        let at = vec2i(subsampling_pixel(vec2u(index), params.factor, view.size));
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

// Of a workgroup's pixels: a bit for each that is marked, and where they go in the list.
var<workgroup> marks: array<atomic<u32>, 2>;
var<workgroup> first_mark: u32;

@compute @workgroup_size(8, 8)
fn upsample_pixels(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) lane: u32) {
    var is_marked = false;
    if all(id.xy < min(subsampling_size(view.size, params.target_factor), textureDimensions(irradiance))) {
        let estimate = estimate_at(id.xy);
        textureStore(irradiance, id.xy, vec4f(estimate.irradiance, estimate.fits));
        is_marked = estimate.is_marked && params.is_marking == 1u;
    }
    if is_marked {
        atomicOr(&marks[lane / 32u], 1u << (lane % 32u));
    }
    workgroupBarrier();
    let words = vec2u(atomicLoad(&marks[0]), atomicLoad(&marks[1]));
    let counts = countOneBits(words);
    if lane == 0u && counts.x + counts.y > 0u {
        first_mark = atomicAdd(&marked.count, counts.x + counts.y);
    }
    workgroupBarrier();
    if is_marked {
        let before = countOneBits(words[lane / 32u] & ((1u << (lane % 32u)) - 1u));
        let rank = select(0u, counts.x, lane >= 32u) + before;
        marked.pixels[first_mark + rank] = id.x | id.y << 16u;
    }
}

// What an indirect dispatch needs.
@compute @workgroup_size(1)
fn count_marks() {
    marked.workgroups = lost_rays_workgroups(atomicLoad(&marked.count));
}
