// A counter-based random number: a function of its arguments alone.

// PCG output permutation (O'Neill 2014) of one LCG step.
fn hash_u32(value: u32) -> u32 {
    let state = value * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

// In [0, 1).
fn hash_unit(index: u32, dimension: u32) -> f32 {
    return f32(hash_u32(index ^ hash_u32(dimension)) >> 8u) * 0x1p-24;
}
