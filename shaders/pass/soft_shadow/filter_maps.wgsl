// Visibility by the shadow maps alone: percentage-closer filtering over the ellipse that a penumbra covers on the receiver (Reeves,
// Salesin and Cook 1987), of one radius, or of that of the occluders found around (Fernando 2005).

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var base_color_texture: texture_2d<f32>;
@group(0) @binding(5) var<storage, read> lights: array<Light>;
@group(0) @binding(6) var<storage, read> nearest: array<f32>;
@group(0) @binding(7) var visibility: texture_storage_2d<r32float, write>;

// The penumbra's radius across the light, from occluders whose own penumbra reaches the receiver; 0 without any.
fn radius_found(light: Light, receiver: Receiver, axes: array<vec3f, 2>, turn: f32) -> f32 {
    let reach = reach_radius(light, receiver);
    let count = 4u * params.search_taps;
    // Gap times weight, weight
    var sum = vec2f(0.0);
    for (var i = 0u; i < count; i++) {
        // Denser in the middle: taps are as dense as penumbrae are narrow.
        let share = (f32(i) + 0.5) / f32(count);
        let at = sqrt(share) * disc_point(i, count, turn);
        let p = receiver_point(receiver, reach * (at.x * axes[0] + at.y * axes[1]));
        let point_gap = gap_by_maps(light, p, receiver.normal);
        // Of the same occluder from the receiver; one beyond it hides nothing.
        let gap = point_gap + receiver.distance - receiver_distance(light, p);
        if point_gap < 0.0 || gap <= 0.0 {
            continue;
        }
        let radius = max(shadow_penumbra_radius(light, receiver.distance, gap), 0x1p-60);
        sum += vec2f(gap, 1.0) * max(1.0 - share * reach / radius, 0.0);
    }
    return select(0.0, shadow_penumbra_radius(light, receiver.distance, sum.x / sum.y), sum.y > 0.0);
}

fn filtered(light: Light, receiver: Receiver, id: vec2u) -> f32 {
    let axes = receiver_axes(receiver);
    let turn = pixel_phase(id);
    var radius = receiver_one_radius(light, receiver);
    if params.search == 1u {
        radius = radius_found(light, receiver, axes, turn);
    }
    if radius <= 0.0 {
        return select(0.0, 1.0, occluder_gap(light, receiver) < 0.0);
    }
    var seen = 0.0;
    for (var i = 0u; i < params.disc_taps; i++) {
        let at = radius * disc_point(i, params.disc_taps, turn);
        let p = receiver_point(receiver, at.x * axes[0] + at.y * axes[1]);
        seen += select(0.0, 1.0, gap_by_maps(light, p, receiver.normal) < 0.0);
    }
    return seen / f32(params.disc_taps);
}

@compute @workgroup_size(8, 8)
fn filter_pixels(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= view.size) {
        return;
    }
    let light = lights[params.light];
    let receiver = receiver_at(light, id.xy);
    let is_seen = textureLoad(base_color_texture, id.xy + view.origin, 0).a > 0.0;
    var seen = 0.0;
    if is_seen && receiver_faces(light, receiver) {
        seen = filtered(light, receiver, id.xy);
    }
    textureStore(visibility, id.xy, vec4f(seen));
}
