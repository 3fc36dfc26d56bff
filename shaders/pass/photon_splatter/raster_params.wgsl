// The uniform of the blended shapes.

struct RasterParams {
    bandwidth: Bandwidth,
    // From clip space of the G-buffer to that of the irradiance
    clip_scale: vec2f,
    clip_shift: vec2f,
    // Slots of the photon buffer to read: from, how many
    first_slot: u32,
    slot_count: u32,
    // Invocations in a row of a dispatch over them
    row: u32,
}
