// A cell of a depth hierarchy: the least and the greatest inverse depth of the surfaces in it, 13 bits each (5 of
// exponent, 8 of mantissa), rounded apart so that nothing is left out; 0 is infinitely far.
//   bits 0-12   least
//   bits 13-25  greatest
//   bits 26-29  finest level only: in each quadrant around the texel's middle, whether its neighbours there show the same
//               surface; quadrant = (right of the middle) + 2 (below it)
//   bit 30      finest level only: whether all its neighbours face the same way

// The smallest inverse depth that is told from none is just above 2^-4: further than any ray goes.
const DEPTH_RANGE_BASE: u32 = 123u << 23u;
const DEPTH_RANGE_SHIFT: u32 = 15u;
const DEPTH_RANGE_BITS: u32 = 13u;
const DEPTH_RANGE_MASK: u32 = 0x1fffu;
const DEPTH_RANGE_FLAT: u32 = 0x40000000u;

struct DepthRange {
    least: f32,
    greatest: f32,
}

fn depth_range_code_below(w: f32) -> u32 {
    let bits = max(bitcast<u32>(max(w, 0.0)), DEPTH_RANGE_BASE) - DEPTH_RANGE_BASE;
    return min(bits >> DEPTH_RANGE_SHIFT, DEPTH_RANGE_MASK);
}

fn depth_range_code_above(w: f32) -> u32 {
    if w <= 0.0 {
        return 0u;
    }
    let bits = max(bitcast<u32>(w), DEPTH_RANGE_BASE) - DEPTH_RANGE_BASE;
    return min((bits >> DEPTH_RANGE_SHIFT) + 1u, DEPTH_RANGE_MASK);
}

fn depth_range_decode(code: u32) -> f32 {
    return select(bitcast<f32>(DEPTH_RANGE_BASE + (code << DEPTH_RANGE_SHIFT)), 0.0, code == 0u);
}

// `agreeing`: a bit for each quadrant, then one for the normals.
fn depth_range_pack(range: DepthRange, agreeing: u32) -> u32 {
    let greatest = depth_range_code_above(range.greatest) << DEPTH_RANGE_BITS;
    return depth_range_code_below(range.least) | greatest | (agreeing << (2u * DEPTH_RANGE_BITS));
}

fn depth_range_unpack(bits: u32) -> DepthRange {
    return DepthRange(
        depth_range_decode(bits & DEPTH_RANGE_MASK),
        depth_range_decode((bits >> DEPTH_RANGE_BITS) & DEPTH_RANGE_MASK),
    );
}

// Of two cells: codes are in the order of what they stand for. Quadrants are dropped.
fn depth_range_join(a: u32, b: u32) -> u32 {
    let least = min(a & DEPTH_RANGE_MASK, b & DEPTH_RANGE_MASK);
    let greatest = max((a >> DEPTH_RANGE_BITS) & DEPTH_RANGE_MASK, (b >> DEPTH_RANGE_BITS) & DEPTH_RANGE_MASK);
    return least | (greatest << DEPTH_RANGE_BITS);
}

fn depth_range_agrees(bits: u32, quadrant: u32) -> bool {
    return ((bits >> (2u * DEPTH_RANGE_BITS + quadrant)) & 1u) == 1u;
}

fn depth_range_is_flat(bits: u32) -> bool {
    return (bits & DEPTH_RANGE_FLAT) != 0u;
}
