// Visibility blurred along one axis of the penumbra's ellipse on the receiver; the other axis follows.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var<storage, read> lights: array<Light>;
@group(0) @binding(5) var<storage, read> list: TileList;
@group(0) @binding(6) var radii: texture_2d<f32>;
// Of the first axis distances to occluders, of the second visibility along the first; and marks
@group(0) @binding(7) var source: texture_2d<f32>;
@group(0) @binding(8) var target_texture: texture_storage_2d<r32float, write>;

// 0: across the tilt, the first to run; 1: along it
override AXIS: u32;

fn searched_radius(light: Light, receiver: Receiver, id: vec2u) -> f32 {
    return textureLoad(radii, id, 0).r;
}

// Visibility, or a mark.
fn source_at(pixel: vec2u) -> f32 {
    let value = textureLoad(source, pixel, 0).r;
    return select(value, occlusion_visibility(value), AXIS == 0u);
}

// Mean of the visibility along an axis, weighted by the width of a disc: an occluder's straight edge across the axis then
// shows as much of a disc-shaped lamp as is seen past it.
fn blurred(light: Light, id: vec2u, own: f32) -> f32 {
    if own == NO_RECEIVER {
        return own;
    }
    let receiver = receiver_at(light, id);
    let radius_across = penumbra_found(light, receiver, id);
    if radius_across <= 0.0 {
        return own;
    }
    let axes = receiver_axes(receiver);
    let line = line_along(receiver.position, axes[AXIS]);
    let radius = line_radius(line, radius_across, params.max_radius);
    let taps = 2u * params.blur_taps + 1u;
    let step = 2.0 / f32(taps);
    // Taps a pixel or more apart would show as so many copies of an edge: each pixel takes another place in each step.
    let dither = clamp(2.0 * radius * line_pixels(line) * step - 1.0, 0.0, 1.0);
    let noise = pixel_phase(select(id, id.yx, AXIS == 1u));
    let phase = dither * (noise - 0.5);
    // Visibility times weight, weight
    var sum = vec2f(0.0);
    var is_whole = true;
    for (var i = 0u; i < taps; i++) {
        let x = (f32(i) + 0.5 + phase) * step - 1.0;
        let weight = sqrt(max(1.0 - x * x, 0.0));
        let pixel = line_pixel(line, x * radius);
        sum.y += weight;
        if is_shown(receiver, radius_across, pixel, id) {
            sum.x += source_at(vec2u(pixel)) * weight;
        } else {
            is_whole = false;
        }
    }
    for (var i = select(0u, taps, is_whole); i < taps; i++) {
        let x = (f32(i) + 0.5 + phase) * step - 1.0;
        if is_shown(receiver, radius_across, line_pixel(line, x * radius), id) {
            continue;
        }
        let weight = sqrt(max(1.0 - x * x, 0.0));
        var offset = x * radius * axes[AXIS];
        if AXIS == 1u {
            // Nothing was blurred there: any point across will do, so that all of them together are the disc.
            offset += (2.0 * fract(f32(i) * DISC_GOLDEN + noise) - 1.0) * weight * radius_across * axes[0];
        }
        sum.x += visibility_by_maps(light, receiver, receiver_point(receiver, offset)) * weight;
    }
    return sum.x / sum.y;
}

@compute @workgroup_size(8, 8)
fn blur_pixels(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_id) local: vec3u,
) {
    let id = tile_list_pixel(group, groups, local);
    if any(id >= view.size) {
        return;
    }
    var visibility = blurred(lights[params.light], id, source_at(id));
    if AXIS == 1u {
        // Marks end here, and so does what rounding left outside.
        visibility = clamp(visibility, 0.0, 1.0);
    }
    textureStore(target_texture, id, vec4f(visibility));
}
