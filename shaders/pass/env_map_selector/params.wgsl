// The uniform of the selection.

struct Params {
    candidate_count: u32,
    // Tiles in a row of the atlas
    columns: u32,
    // Most maps to select
    limit: u32,
    // Handed back with the result
    tag: u32,
    back_face_limit: f32,
    // Unit frame
    clearance: f32,
    // How far behind a texel's plane a point may lie and still be seen, unit frame
    tolerance: f32,
    coverage_target: f32,
    // 0: by area
    sample_count: u32,
    // What gains less, as a share of all there is to be seen, is not worth a map, nor its moving
    least_gain: f32,
    // Slots of the photons that samples are taken from
    slot_count: u32,
}

// What one candidate sees.
struct Sight {
    surfaces: u32,
    back_faces: u32,
    // f32 bits of the nearest distance; all ones if there is none
    nearest: u32,
    is_valid: u32,
    // A(v | nothing): area, or worth of samples, seen
    area: f32,
    // Part of it that no selected map sees
    unseen: f32,
    // Part of it that no selected map but this one sees
    own: f32,
    // By samples: what the best exchange of a selected map for this candidate gains
    exchange: f32,
}
