// The uniform of all steps.

struct Params {
    texel_count: u32,
    // Texels that may be gathered
    budget: u32,
    ray_count: u32,
    // Of the frame: what turns
    round: u32,
    // Change of indirect light from which on a surface is due, over that of all light spread over all surfaces
    threshold: f32,
    // Flux of a step of change over what all light gives a unit of area
    change_scale: f32,
    // Unit-frame flux of a step
    flux_of_step: f32,
    // Share of the way that shown light goes to what was gathered last
    blend: f32,
    // Invocations in a row of the dispatch over rays
    row: u32,
    sample_offset: u32,
}
