// Adding up photons, for four receivers at once. The module brings `params.bandwidth` and the sorted photons: `splats`,
// `first_splats`, `reach`.

// Four receivers by coordinate, and what they have gathered.
struct Gathered {
    x: vec4f,
    y: vec4f,
    z: vec4f,
    normal_x: vec4f,
    normal_y: vec4f,
    normal_z: vec4f,
    red: vec4f,
    green: vec4f,
    blue: vec4f,
    // Red, green and blue by the radii of the kernels that brought them
    radius: vec4f,
}

// Nothing gathered yet. Indices are constants here and in `gather_sums`: what is indexed otherwise lives in memory.
fn gather_start(r: array<Receiver, 4>) -> Gathered {
    var g = Gathered();
    g.x = vec4f(r[0].position.x, r[1].position.x, r[2].position.x, r[3].position.x);
    g.y = vec4f(r[0].position.y, r[1].position.y, r[2].position.y, r[3].position.y);
    g.z = vec4f(r[0].position.z, r[1].position.z, r[2].position.z, r[3].position.z);
    // No normal agrees with one of no length.
    let seen = vec4f(f32(r[0].is_seen), f32(r[1].is_seen), f32(r[2].is_seen), f32(r[3].is_seen));
    g.normal_x = seen * vec4f(r[0].normal.x, r[1].normal.x, r[2].normal.x, r[3].normal.x);
    g.normal_y = seen * vec4f(r[0].normal.y, r[1].normal.y, r[2].normal.y, r[3].normal.y);
    g.normal_z = seen * vec4f(r[0].normal.z, r[1].normal.z, r[2].normal.z, r[3].normal.z);
    return g;
}

// What each has gathered: irradiance, and its channels by the radii.
fn gather_sums(g: Gathered) -> array<vec4f, 4> {
    return array<vec4f, 4>(
        vec4f(g.red.x, g.green.x, g.blue.x, g.radius.x),
        vec4f(g.red.y, g.green.y, g.blue.y, g.radius.y),
        vec4f(g.red.z, g.green.z, g.blue.z, g.radius.z),
        vec4f(g.red.w, g.green.w, g.blue.w, g.radius.w),
    );
}

fn gather_splat(g: ptr<function, Gathered>, index: u32, last: u32) {
    let splat = splats[min(index, last)];
    let n = octahedral_unpack(splat.normal);
    let dx = (*g).x - splat.position.x;
    let dy = (*g).y - splat.position.y;
    let dz = (*g).z - splat.position.z;
    let q = (dx * dx + dy * dy + dz * dz) * splat.inverse_radius_squared;
    let off_plane = abs(dx * n.x + dy * n.y + dz * n.z);
    let agreement = (*g).normal_x * n.x + (*g).normal_y * n.y + (*g).normal_z * n.z;
    let radius = inverseSqrt(splat.inverse_radius_squared);
    let is_one = f32(index <= last);
    let weight = is_one * splat_weight(q, off_plane, agreement, splat_slab(radius));
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

// Pixels between [low, high) and a bin along one axis; bins count from beyond the rim.
fn gather_gap(low: i32, high: i32, bin: i32) -> i32 {
    let start = (bin - i32(BORDER)) * i32(BIN);
    return max(max(start - high, low - start - i32(BIN)), 0);
}

fn gather_reaches(low: vec2i, high: vec2i, bin: vec2i, columns: i32) -> bool {
    let gap = max(gather_gap(low.x, high.x, bin.x), gather_gap(low.y, high.y, bin.y));
    return i32(reach[bin.y * columns + bin.x]) > gap;
}

// Adds up all photons that may reach the pixels [low, high) of the irradiance that photons were sorted for. Those of the bins
// of a row lie one behind the other. Sixty-four a turn while there are as many: adapters may end a shader's loops after
// 65 535 turns in all. Twin of `MOST_SPLATS`.
fn gather_photons(g: ptr<function, Gathered>, low: vec2i, high: vec2i) {
    let grid = vec2i(bin_grid(params.bandwidth));
    let widest = i32((reach[grid.x * grid.y] + BIN - 1u) / BIN);
    let first = max(vec2i(floor(vec2f(low) / f32(BIN))) + i32(BORDER) - widest, vec2i(0));
    let end = min(vec2i(ceil(vec2f(high) / f32(BIN))) + i32(BORDER) + widest, grid);
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
