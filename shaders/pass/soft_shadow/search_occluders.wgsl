// The penumbra's radius at each receiver, from the occluders that shade the surface around it.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var<storage, read> lights: array<Light>;
@group(0) @binding(5) var<storage, read> nearest: array<f32>;
@group(0) @binding(6) var occlusion: texture_2d<f32>;
@group(0) @binding(7) var<storage, read> list: TileList;
@group(0) @binding(8) var radii: texture_storage_2d<r32float, write>;

// Weight of a tap from which no penumbra reaches the receiver, but from the same shadow's edge between its arm's stretch
// and the next arm one may: it decides where nothing better was found, and changes nothing where something was.
const STRETCH_WEIGHT: f32 = 0x1p-7;

// The penumbra's radius across the light, or 0 where no occluder's penumbra reaches the receiver. A tap's occluder hides
// part of the lamp from the receiver exactly if the tap lies within its own penumbra's radius (Eq. 5) of the receiver, so
// that a search too wide takes in nothing that does not matter.
fn penumbra_radius(light: Light, receiver: Receiver, own_gap: f32, id: vec2u) -> f32 {
    let reach = reach_radius(light, receiver);
    // Gap times weight, weight
    var sum = select(vec2f(0.0), vec2f(own_gap, 1.0), own_gap >= 0.0);
    let axes = receiver_axes(receiver);
    // A quarter turn brings the cross back onto itself.
    let turn = 0.5 * SAMPLING_PI * hash_unit(id.x + 65536u * id.y, 0u);
    let phase = hash_unit(id.x + 65536u * id.y, 1u);
    for (var arm = 0u; arm < 4u; arm++) {
        let angle = turn + 0.5 * SAMPLING_PI * f32(arm);
        let line = line_along(receiver.position, cos(angle) * axes[0] + sin(angle) * axes[1]);
        let length = line_radius(line, reach, reach_most_pixels());
        let arm_phase = fract(phase + 0.25 * f32(arm));
        for (var i = 0u; i < params.search_taps; i++) {
            // Taps are as dense as penumbrae are narrow: the arm's stretches grow linearly. Where in its stretch a tap
            // lies differs by pixel and arm, but the last one closes the arm, so that no edge within reach is missed.
            let count = f32(params.search_taps);
            let back = arm_phase * (count - 1.0 - f32(i)) / count;
            let share = vec2f(f32(i), f32(i) + 1.0 - back) / count;
            let along = length * share * share;
            let pixel = line_pixel(line, along.y);
            if pixel.x < 0 || pixel_distance(id, pixel) > reach_most_pixels() {
                continue;
            }
            let gap = textureLoad(occlusion, pixel, 0).r;
            if gap < 0.0 {
                continue;
            }
            let radius = max(shadow_penumbra_radius(light, receiver.distance, gap), 0x1p-60);
            if along.x > ARM_LENGTH * radius {
                continue;
            }
            let near = max(1.0 - along.y / radius, STRETCH_WEIGHT);
            let weight = near * receiver_range_weight(receiver, vec2u(pixel), radius);
            sum += vec2f(gap, 1.0) * weight;
        }
    }
    if sum.y <= 0.0 {
        return 0.0;
    }
    return shadow_penumbra_radius(light, receiver.distance, sum.x / sum.y);
}

@compute @workgroup_size(8, 8)
fn search_pixels(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_id) local: vec3u,
) {
    let id = tile_list_pixel(group, groups, local);
    if any(id >= view.size) {
        return;
    }
    let gap = textureLoad(occlusion, id, 0).r;
    if gap == NO_RECEIVER {
        textureStore(radii, id, vec4f(0.0));
        return;
    }
    let light = lights[params.light];
    textureStore(radii, id, vec4f(penumbra_radius(light, receiver_at(light, id), gap, id)));
}
