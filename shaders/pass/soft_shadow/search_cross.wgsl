// The penumbra's radius at a receiver, from the occluders that shade the surface on the arms of a cross around it. The module
// brings `occlusion_at`, the distance to an occluder, or a mark.

// Weight of a tap from which no penumbra reaches the receiver, but from the same shadow's edge between its arm's stretch
// and the next arm one may: it decides where nothing better was found, and changes nothing where something was.
const STRETCH_WEIGHT: f32 = 0x1p-7;

// A tap of the search: where it lies, and the nearer end of its stretch of the arm.
struct Tap {
    p: vec3f,
    pixel: vec2i,
    along: vec2f,
}

// The four arms of a receiver's cross.
struct Cross {
    axes: array<vec3f, 2>,
    reach: f32,
    // Of the first arm, radians; a quarter turn brings the cross back onto itself
    turn: f32,
    phase: f32,
}

fn cross_tap(receiver: Receiver, cross: Cross, index: u32) -> Tap {
    let arm = index % 4u;
    let i = f32(index / 4u);
    let angle = cross.turn + 0.5 * SAMPLING_PI * f32(arm);
    let axis = cos(angle) * cross.axes[0] + sin(angle) * cross.axes[1];
    let line = line_along(receiver.position, axis);
    let length = line_radius(line, cross.reach, reach_most_pixels());
    // Taps are as dense as penumbrae are narrow: the arm's stretches grow linearly. Where in its stretch a tap lies differs by
    // pixel and arm, but the last one closes the arm, so that no edge within reach is missed.
    let count = f32(params.search_taps);
    let back = fract(cross.phase + 0.25 * f32(arm)) * (count - 1.0 - i) / count;
    let share = vec2f(i, i + 1.0 - back) / count;
    let along = length * share * share;
    return Tap(receiver_point(receiver, along.y * axis), line_pixel(line, along.y), along);
}

// Whether a tap's pixel shows its point.
fn tap_is_shown(receiver: Receiver, tap: Tap, id: vec2u) -> bool {
    if tap.pixel.x < 0 || pixel_distance(id, tap.pixel) > reach_most_pixels() {
        return false;
    }
    let is_receiver = occlusion_at(vec2u(tap.pixel)) != NO_RECEIVER;
    return is_receiver && receiver_is_coplanar(receiver, receiver_position(vec2u(tap.pixel)), tap.along.y);
}

// Gap times weight, and weight, of the occluder this far before a tap's point `at`. It hides part of the lamp from the receiver
// exactly if the tap lies within its own penumbra's radius (Eq. 5) of the receiver, so that a search too wide takes in nothing
// that does not matter.
fn tap_weighed(light: Light, receiver: Receiver, tap: Tap, at: vec3f, tap_gap: f32) -> vec2f {
    // Of the same occluder from the receiver; one beyond it hides nothing.
    let gap = tap_gap + receiver.distance - receiver_distance(light, at);
    let radius = max(shadow_penumbra_radius(light, receiver.distance, gap), 0x1p-60);
    if tap_gap < 0.0 || gap <= 0.0 || tap.along.x > ARM_LENGTH * radius {
        return vec2f(0.0);
    }
    return vec2f(gap, 1.0) * max(1.0 - tap.along.y / radius, STRETCH_WEIGHT);
}

// The penumbra's radius across the light, or 0 where no occluder's penumbra reaches the receiver.
fn penumbra_radius(light: Light, receiver: Receiver, own_gap: f32, id: vec2u) -> f32 {
    let seed = id.x + 65536u * id.y;
    let turn = 0.5 * SAMPLING_PI * hash_unit(seed, 0u);
    let cross = Cross(receiver_axes(receiver), reach_radius(light, receiver), turn, hash_unit(seed, 1u));
    var sum = select(vec2f(0.0), vec2f(own_gap, 1.0), own_gap >= 0.0);
    let taps = 4u * params.search_taps;
    var is_whole = true;
    for (var i = 0u; i < taps; i++) {
        let tap = cross_tap(receiver, cross, i);
        if tap_is_shown(receiver, tap, id) {
            let gap = occlusion_at(vec2u(tap.pixel));
            sum += tap_weighed(light, receiver, tap, receiver_position(vec2u(tap.pixel)), gap);
        } else {
            is_whole = false;
        }
    }
    // What is hidden or off the screen, the shadow maps are asked about.
    for (var i = select(0u, taps, is_whole); i < taps; i++) {
        let tap = cross_tap(receiver, cross, i);
        if !tap_is_shown(receiver, tap, id) {
            sum += tap_weighed(light, receiver, tap, tap.p, gap_by_maps(light, tap.p, receiver.normal));
        }
    }
    if sum.y <= 0.0 {
        return 0.0;
    }
    return shadow_penumbra_radius(light, receiver.distance, sum.x / sum.y);
}
