// The hard shadow test by shadow maps.

@group(1) @binding(0) var shadow_maps: texture_2d_array<u32>;

fn occluder_gap(light: Light, receiver: Receiver) -> f32 {
    return gap_by_maps(light, receiver.position, receiver.normal);
}
