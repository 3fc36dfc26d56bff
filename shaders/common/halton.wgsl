// Radical inverse in integer arithmetic; values lie strictly below 1.
// Each base uses as many digits as fit 32 bits; beyond that many samples it repeats.

// The largest f32 below 1.
const HALTON_BELOW_ONE: f32 = 0.99999994;

fn halton_digits(index: u32, base: u32, digit_count: u32) -> f32 {
    var i = index;
    var reversed = 0u;
    var power = 1u;
    for (var d = 0u; d < digit_count; d++) {
        reversed = reversed * base + i % base;
        power *= base;
        i /= base;
    }
    return min(f32(reversed) / f32(power), HALTON_BELOW_ONE);
}

// Dimensions 0 to 5 of the Halton sequence: bases 2, 3, 5, 7, 11, 13.
fn halton(index: u32, dimension: u32) -> f32 {
    switch dimension {
        case 0u: { return f32(reverseBits(index) >> 8u) * 0x1p-24; }
        case 1u: { return halton_digits(index, 3u, 20u); }
        case 2u: { return halton_digits(index, 5u, 13u); }
        case 3u: { return halton_digits(index, 7u, 11u); }
        case 4u: { return halton_digits(index, 11u, 9u); }
        default: { return halton_digits(index, 13u, 8u); }
    }
}
