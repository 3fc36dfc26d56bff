// What the search left for the blur. The module brings `radii`.

// Visibility, or a mark, of a distance to an occluder, or a mark.
fn occlusion_visibility(gap: f32) -> f32 {
    return select(max(-gap, 0.0), NO_RECEIVER, gap == NO_RECEIVER);
}

// The penumbra's radius at a receiver.
fn penumbra_found(light: Light, receiver: Receiver, id: vec2u) -> f32 {
    if params.search == 0u {
        return receiver_one_radius(light, receiver);
    }
    return textureLoad(radii, id, 0).r;
}
