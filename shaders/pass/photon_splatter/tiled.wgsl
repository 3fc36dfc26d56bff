// Density estimation by gathering: photons are sorted by the bin of the screen that they project to, in the order of their
// slots, and each pixel adds up the photons of the bins around it (Mara et al. 2013, tiled photon gathering). The
// order of additions is fixed: the same photons give the same bits.

@group(0) @binding(0) var<uniform> params: TiledParams;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<storage, read> photons: array<Photon>;
// By slot before they are sorted, by bin after
@group(0) @binding(3) var<storage, read_write> keys: array<u32>;
@group(0) @binding(4) var<storage, read_write> slots: array<u32>;
@group(0) @binding(5) var<storage, read_write> splats: array<Splat>;
// Of each bin the first of its splats, and where those of the last end
@group(0) @binding(6) var<storage, read_write> first_splats: array<u32>;
// Of each bin, and behind them of all: how far beyond the bin a photon of it reaches, in parts of a pixel
@group(0) @binding(7) var<storage, read_write> reach: array<atomic<u32>>;

// Pixels beyond its bin that a photon reaches at most: twice what a ball in the middle of the view may.
const MOST_REACH: f32 = 48.0;

fn bin_total() -> u32 {
    let grid = bin_grid(params.bandwidth);
    return grid.x * grid.y;
}

fn slot_of(id: vec3u) -> u32 {
    return select(id.y * params.row + id.x, 0xffffffffu, id.x >= params.row);
}

// Range of a normalised device coordinate over the ball (c, h): the planes (row - t w) through the eye that touch it,
//     (a - t w)^2 = h^2 |A - t W|^2,  a = row.(c,1), w = w_row.(c,1), A and W the rows' linear parts.
fn projected_range(row: vec4f, w_row: vec4f, c: vec3f, h: f32) -> vec2f {
    let a = dot(row, vec4f(c, 1.0));
    let w = dot(w_row, vec4f(c, 1.0));
    let h2 = h * h;
    let qa = w * w - h2 * dot(w_row.xyz, w_row.xyz);
    let qb = a * w - h2 * dot(row.xyz, w_row.xyz);
    if qa <= 0.0 {
        // The ball holds the eye or reaches its plane: it may be seen anywhere.
        return vec2f(-1e6, 1e6);
    }
    let qc = a * a - h2 * dot(row.xyz, row.xyz);
    let root = sqrt(max(0.0, qb * qb - qa * qc));
    return vec2f(qb - root, qb + root) / qa;
}

// The pixels of the irradiance that a ball may touch: from, to.
fn ball_pixels(c: vec3f, h: f32) -> vec4f {
    let x = projected_range(g_buffer_row(view, 0u), g_buffer_row(view, 3u), c, h);
    let y = projected_range(g_buffer_row(view, 1u), g_buffer_row(view, 3u), c, h);
    let low = irradiance_point(params.bandwidth, vec2f(x.x, y.y));
    let high = irradiance_point(params.bandwidth, vec2f(x.y, y.x));
    let size = vec2f(subsampling_size(view.size, params.bandwidth.factor));
    return vec4f(max(low, vec2f(0.0)), min(high, size));
}

// How far they lie beyond a bin.
fn reach_beyond(bin: u32, pixels: vec4f) -> f32 {
    let columns = bin_grid(params.bandwidth).x;
    let start = f32(BIN) * (vec2f(vec2u(bin % columns, bin / columns)) - f32(BORDER));
    let beyond = max(start - pixels.xy, pixels.zw - start - f32(BIN));
    return max(max(beyond.x, beyond.y), 0.0);
}

// Each photon's bin.
@compute @workgroup_size(64)
fn find_bins(@builtin(global_invocation_id) id: vec3u) {
    let index = slot_of(id);
    if index >= params.slot_count {
        return;
    }
    let photon = photons[params.first_slot + index];
    var bin = bin_total();
    let pixels = ball_pixels(photon.position, splat_widest(params.bandwidth, photon));
    if photon_is_splatted(photon.state) && all(pixels.xy < pixels.zw) {
        bin = nearest_bin(params.bandwidth, photon.position);
    }
    keys[index] = bin;
    slots[index] = index;
}

// Where the photons of each bin begin, once they are sorted. One invocation a bin, and one
// for where those of the last end.
@compute @workgroup_size(64)
fn find_first(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let bin = 64u * (group.y * groups.x + group.x) + lane;
    if bin > bin_total() {
        return;
    }
    first_splats[bin] = first_of_key(bin, params.slot_count);
}

fn bin_count(bin: u32) -> u32 {
    return first_splats[bin + 1u] - first_splats[bin];
}

// Sorted photons to splats.
@compute @workgroup_size(64)
fn prepare_splats(@builtin(global_invocation_id) id: vec3u) {
    let index = slot_of(id);
    let bins = bin_total();
    if index >= params.slot_count || keys[index] >= bins {
        return;
    }
    let photon = photons[params.first_slot + slots[index]];
    var h = splat_radius(params.bandwidth, photon);
    var beyond = reach_beyond(keys[index], ball_pixels(photon.position, h));
    // Near the eye a ball is wider on the screen than its radius at its depth.
    for (var i = 0u; i < 8u && beyond > MOST_REACH; i++) {
        h *= 0.75;
        beyond = reach_beyond(keys[index], ball_pixels(photon.position, h));
    }
    if !(h > 0.0) || beyond > MOST_REACH {
        splats[index] = splat_nothing();
        return;
    }
    splats[index] = splat_record(photon, h);
    // A step of slack for rounding.
    let steps = u32(ceil(f32(REACH_STEPS) * beyond)) + 1u;
    atomicMax(&reach[keys[index]], steps);
    atomicMax(&reach[bins], steps);
}
