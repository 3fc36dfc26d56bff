// Numbers for the photon walk, a function of (sequence index, dimension) alone: the Halton sequence where its low bases
// are still evenly spread, hashing beyond base 13.

fn random_unit(sequence_index: u32, dimension: u32) -> f32 {
    if dimension < 6u {
        return halton(sequence_index, dimension);
    }
    return hash_unit(sequence_index, dimension);
}

// To round by chance what guides the hop that leaves the b-th surface, the light being the 0-th: dimensions above those of the walk.
fn random_guidance(sequence_index: u32, bounce: u32) -> f32 {
    return hash_unit(sequence_index, 3072u + bounce);
}

// A pair that is evenly spread by itself and beside the Halton sequence: an additive recurrence by powers of the plastic
// number's inverse (Roberts 2018), in integer arithmetic.
fn random_recurrence(sequence_index: u32) -> vec2f {
    let bits = vec2u(sequence_index) * vec2u(3242174889u, 2447445414u);
    return vec2f(bits >> vec2u(8u)) * 0x1p-24;
}

fn random_pair(sequence_index: u32, dimension: u32) -> vec2f {
    return vec2f(random_unit(sequence_index, dimension), random_unit(sequence_index, dimension + 1u));
}
