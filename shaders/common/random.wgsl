// Numbers for the photon walk, a function of (sequence index, dimension) alone: the Halton sequence where its low bases
// are still evenly spread, hashing beyond base 13.

fn random_unit(sequence_index: u32, dimension: u32) -> f32 {
    if dimension < 6u {
        return halton(sequence_index, dimension);
    }
    return hash_unit(sequence_index, dimension);
}

fn random_pair(sequence_index: u32, dimension: u32) -> vec2f {
    return vec2f(random_unit(sequence_index, dimension), random_unit(sequence_index, dimension + 1u));
}
