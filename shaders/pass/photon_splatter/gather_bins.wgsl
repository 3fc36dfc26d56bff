// Which photons may reach a pixel: those of the bins around it. The module brings `params.bandwidth`, `first_splats` and `reach`.

// Pixels between [low, high] and a bin along one axis; bins count from beyond the rim.
fn gather_gap(low: f32, high: f32, bin: i32) -> f32 {
    let start = f32(BIN) * f32(bin - i32(BORDER));
    return max(start - high, low - start - f32(BIN));
}

fn gather_reaches(low: vec2f, high: vec2f, bin: vec2i, columns: i32) -> bool {
    let gap = max(gather_gap(low.x, high.x, bin.x), gather_gap(low.y, high.y, bin.y));
    // No photon reaches 0 steps.
    let steps = reach[bin.y * columns + bin.x];
    return steps > 0u && f32(steps) >= f32(REACH_STEPS) * gap;
}

// Adds up all photons that may reach receivers within [low, high], in pixels of the irradiance that photons were sorted for.
// Those of the bins of a row lie one behind the other.
fn gather_photons(g: ptr<function, Gathered>, low: vec2f, high: vec2f) {
    let grid = vec2i(bin_grid(params.bandwidth));
    let widest = f32(reach[grid.x * grid.y]) / f32(REACH_STEPS);
    let first = max(vec2i(floor((low - widest) / f32(BIN))) + i32(BORDER), vec2i(0));
    let end = min(vec2i(floor((high + widest) / f32(BIN))) + i32(BORDER) + 1, grid);
    for (var y = first.y; y < end.y; y++) {
        var left = first.x;
        var right = end.x;
        while left < right && !gather_reaches(low, high, vec2i(left, y), grid.x) {
            left++;
        }
        while left < right && !gather_reaches(low, high, vec2i(right - 1, y), grid.x) {
            right--;
        }
        gather_range(g, first_splats[y * grid.x + left], first_splats[y * grid.x + right]);
    }
}
