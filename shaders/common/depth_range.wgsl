// A cell of a depth hierarchy: the least and the greatest inverse depth of the surfaces in it, 14 bits each (5 of
// exponent, 9 of mantissa), rounded apart so that nothing is left out; 0 is infinitely far.
//   bits 0-13   least
//   bits 14-27  greatest
//   bits 28-31  finest level only: in each quadrant around the texel's middle, whether its neighbours there show the same
//               surface; quadrant = (right of the middle) + 2 (below it)

// The smallest inverse depth that is told from none is just above 2^-4: further than any ray goes.
const DEPTH_RANGE_BASE: u32 = 123u << 23u;
const DEPTH_RANGE_SHIFT: u32 = 14u;
const DEPTH_RANGE_MASK: u32 = 0x3fffu;

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

fn depth_range_pack(range: DepthRange, agreeing: u32) -> u32 {
    return depth_range_code_below(range.least) | (depth_range_code_above(range.greatest) << 14u) | (agreeing << 28u);
}

fn depth_range_unpack(bits: u32) -> DepthRange {
    return DepthRange(
        depth_range_decode(bits & DEPTH_RANGE_MASK),
        depth_range_decode((bits >> 14u) & DEPTH_RANGE_MASK),
    );
}

// Of two cells: codes are in the order of what they stand for. Quadrants are dropped.
fn depth_range_join(a: u32, b: u32) -> u32 {
    let least = min(a & DEPTH_RANGE_MASK, b & DEPTH_RANGE_MASK);
    return least | (max((a >> 14u) & DEPTH_RANGE_MASK, (b >> 14u) & DEPTH_RANGE_MASK) << 14u);
}

fn depth_range_agrees(bits: u32, quadrant: u32) -> bool {
    return ((bits >> (28u + quadrant)) & 1u) == 1u;
}
