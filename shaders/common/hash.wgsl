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

// Four random words from four (Jarzynski and Olano 2020, "Hash Functions for GPU Rendering", pcg4d).
fn hash_pcg4d(value: vec4u) -> vec4u {
    let mixed = hash_pcg4d_mix(value * 1664525u + 1013904223u);
    return hash_pcg4d_mix(mixed ^ (mixed >> vec4u(16u)));
}

fn hash_pcg4d_mix(value: vec4u) -> vec4u {
    var v = value;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}
