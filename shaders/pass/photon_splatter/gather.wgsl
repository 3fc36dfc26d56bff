// Adding up photons, for as many receivers at once as `Receivers` and `Surfaces` hold. The module brings `params.bandwidth` and the sorted
// photons: `splats`, `first_splats`, `reach`.

// Receivers by coordinate, and what they have gathered.
struct Gathered {
    x: Receivers,
    y: Receivers,
    z: Receivers,
    normal_x: Receivers,
    normal_y: Receivers,
    normal_z: Receivers,
    surface: Surfaces,
    red: Receivers,
    green: Receivers,
    blue: Receivers,
    // Red, green and blue by the radii of the kernels that brought them
    radius: Receivers,
}

fn gather_splat(g: ptr<function, Gathered>, index: u32, last: u32) {
    let splat = splats[min(index, last)];
    let n = octahedral_unpack(splat.normal);
    let dx = (*g).x - splat.position.x;
    let dy = (*g).y - splat.position.y;
    let dz = (*g).z - splat.position.z;
    let inverse = splat_inverse(splat);
    let q = (dx * dx + dy * dy + dz * dz) * inverse;
    let off_plane = abs(dx * n.x + dy * n.y + dz * n.z);
    let agreement = (*g).normal_x * n.x + (*g).normal_y * n.y + (*g).normal_z * n.z;
    let radius = inverseSqrt(inverse);
    let is_one = f32(index <= last);
    var weight = is_one * splat_weight(q, off_plane, agreement, splat_slab(radius));
    if splat_keeps_to_surfaces {
        let own = Surfaces(splat.inverse_radius_squared & SPLAT_SURFACE_BITS);
        let is_shared = (own == (*g).surface) | (own == Surfaces(0u)) | ((*g).surface == Surfaces(0u));
        weight = select(Receivers(0.0), weight, is_shared);
    }
    let strength = splat.strength;
    (*g).red += strength.x * weight;
    (*g).green += strength.y * weight;
    (*g).blue += strength.z * weight;
    (*g).radius += (strength.x + strength.y + strength.z) * radius * weight;
}

fn gather_four(g: ptr<function, Gathered>, index: u32, last: u32) {
    gather_splat(g, index, last);
    gather_splat(g, index + 1u, last);
    gather_splat(g, index + 2u, last);
    gather_splat(g, index + 3u, last);
}

fn gather_sixteen(g: ptr<function, Gathered>, index: u32, last: u32) {
    gather_four(g, index, last);
    gather_four(g, index + 4u, last);
    gather_four(g, index + 8u, last);
    gather_four(g, index + 12u, last);
}

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
// Those of the bins of a row lie one behind the other. Sixty-four a turn while there are as many: adapters may end a shader's
// loops after 65 535 turns in all. Twin of `MOST_SPLATS`.
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
        var i = first_splats[y * grid.x + left];
        let count = first_splats[y * grid.x + right];
        for (; i + 64u <= count; i += 64u) {
            gather_sixteen(g, i, count - 1u);
            gather_sixteen(g, i + 16u, count - 1u);
            gather_sixteen(g, i + 32u, count - 1u);
            gather_sixteen(g, i + 48u, count - 1u);
        }
        for (; i < count; i += 16u) {
            gather_sixteen(g, i, count - 1u);
        }
    }
}
