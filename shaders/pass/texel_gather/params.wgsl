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
    // Photons that the light of a texel is taken from, if there are as many around
    least_photons: u32,
    // Share of the rays that go where indirect light comes from
    guided: f32,
    // 1: texels stay due until they are gathered
    keeps_due: u32,
    // Impacts in the pool, and invocations in a row of the dispatch over them
    slot_count: u32,
    slot_row: u32,
}
