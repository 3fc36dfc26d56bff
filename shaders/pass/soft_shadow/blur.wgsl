// What the blurs share. The module brings `searched_radius`, the penumbra's radius that occluders give, and `source_at`, which is
// visibility or a mark.

// Visibility, or a mark, of a distance to an occluder, or a mark.
fn occlusion_visibility(gap: f32) -> f32 {
    return select(max(-gap, 0.0), NO_RECEIVER, gap == NO_RECEIVER);
}

// The penumbra's radius at a receiver.
fn penumbra_found(light: Light, receiver: Receiver, id: vec2u) -> f32 {
    if params.search == 0u {
        return receiver_one_radius(light, receiver);
    }
    return searched_radius(light, receiver, id);
}

// Whether a pixel shows the point of the receiver's plane that lies there, to a receiver of this penumbra's radius.
fn is_shown(receiver: Receiver, radius: f32, pixel: vec2i, id: vec2u) -> bool {
    if pixel.x < 0 || pixel_distance(id, pixel) > params.max_radius || source_at(vec2u(pixel)) == NO_RECEIVER {
        return false;
    }
    return receiver_is_coplanar(receiver, receiver_position(vec2u(pixel)), radius);
}

// What the shadow maps say of a point that is hidden or off the screen.
fn visibility_by_maps(light: Light, receiver: Receiver, p: vec3f) -> f32 {
    return select(0.0, 1.0, gap_by_maps(light, p, receiver.normal) < 0.0);
}
