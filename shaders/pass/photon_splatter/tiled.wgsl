// Density estimation by tiles: photons are projected, binned to screen tiles, and each pixel gathers its tile's list.
//
// Lists fill in arrival order, so sums are taken in integers, which do not care: each contribution is rounded to a
// multiple of 2^-30 of an upper bound of the tile's brightest contribution and added in 64 bits: each is off by at most
// 2^-31 of the brightest in its tile, and the same frame gives the same bits.

struct Params {
    bandwidth: Bandwidth,
    // Slots of the photon buffer to read: from, how many
    first_slot: u32,
    slot_count: u32,
    tile_columns: u32,
    tile_rows: u32,
    row: u32,
    // Largest radius in pixels of the G-buffer
    max_radius: f32,
    // Capacity of the tile lists
    capacity: u32,
    // Pixels of the G-buffer for each one of the irradiance, along each axis
    factor: u32,
}

struct Splat {
    position: vec3f,
    radius: f32,
    flux: vec3f,
    normal: u32,
}

struct Tile {
    count: atomic<u32>,
    first: u32,
    filled: atomic<u32>,
    // f32 bits: positive floats order as integers do
    brightest: atomic<u32>,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<storage, read> photons: array<Photon>;
@group(0) @binding(3) var<storage, read_write> splats: array<Splat>;
// Pixels that a splat may touch: first and last, x in the low 16 bits, y in the high; all ones first: none
@group(0) @binding(4) var<storage, read_write> rectangles: array<vec2u>;
@group(0) @binding(5) var<storage, read_write> tiles: array<Tile>;
@group(0) @binding(6) var<storage, read_write> list: array<u32>;
@group(0) @binding(7) var depth_texture: texture_2d<f32>;
@group(0) @binding(8) var normal_texture: texture_2d<f32>;
@group(0) @binding(9) var base_color_texture: texture_2d<f32>;
@group(0) @binding(10) var irradiance: texture_storage_2d<rgba32float, write>;

// Twin of `TILE`.
const TILE: u32 = 16u;
// A splat may touch this many tiles a side; its radius shrinks until it does. Twin of `TILES_A_SIDE`.
const TILES_A_SIDE: i32 = 4;

fn matrix_row(i: u32) -> vec4f {
    let m = view.view_projection;
    return vec4f(m[0][i], m[1][i], m[2][i], m[3][i]);
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

fn irradiance_size() -> vec2u {
    return subsampling_size(view.size, params.factor);
}

// First and last pixel of the irradiance that the ball touches: x0, y0, x1, y1; x1 < x0 or y1 < y0 where it touches none.
fn pixel_range(c: vec3f, h: f32) -> vec4i {
    let x = projected_range(matrix_row(0u), matrix_row(3u), c, h);
    let y = projected_range(matrix_row(1u), matrix_row(3u), c, h);
    let full = vec2f(view.size);
    // The centre of pixel i of the irradiance, i + 1/2, is that of pixel factor i + factor / 2, rounded down, of the
    // G-buffer.
    let factor = f32(params.factor);
    let shift = f32(params.factor / 2u) + 0.5 - 0.5 * factor;
    // A pixel of slack for rounding, and for the last ones, which the rim holds back by less than that: one too many
    // costs nothing but time.
    let low = (vec2f(0.5 + 0.5 * x.x, 0.5 - 0.5 * y.y) * full - shift) / factor - 1.0;
    let high = (vec2f(0.5 + 0.5 * x.y, 0.5 - 0.5 * y.x) * full - shift) / factor + 1.0;
    let size = vec2f(irradiance_size());
    return vec4i(vec4f(clamp(floor(low), vec2f(0.0), size), clamp(floor(high), vec2f(-1.0), size - 1.0)));
}

fn is_empty(range: vec4i) -> bool {
    return any(range.zw < range.xy);
}

// Largest radius at a point whose kernel covers `max_radius` pixels; 0 behind the eye.
fn radius_limit(p: vec3f) -> f32 {
    let w = dot(matrix_row(3u), vec4f(p, 1.0));
    let x_scale = length(matrix_row(0u).xyz) * f32(view.size.x);
    let y_scale = length(matrix_row(1u).xyz) * f32(view.size.y);
    return max(0.0, params.max_radius * w / (0.5 * max(x_scale, y_scale)));
}

const NO_PIXELS: u32 = 0xffffffffu;

fn pack_pixel(p: vec2i) -> u32 {
    return u32(p.x) | (u32(p.y) << 16u);
}

fn unpack_pixels(packed: vec2u) -> vec4i {
    return vec4i(vec4u(packed.x & 65535u, packed.x >> 16u, packed.y & 65535u, packed.y >> 16u));
}

// Tiles of a range of pixels, no more than `TILES_A_SIDE` a side.
fn tiles_of(range: vec4i) -> vec4u {
    let first = vec2u(range.xy) / TILE;
    return vec4u(first, min(vec2u(range.zw) / TILE, first + u32(TILES_A_SIDE) - 1u));
}

fn slot_of(id: vec3u) -> u32 {
    return select(id.y * params.row + id.x, 0xffffffffu, id.x >= params.row);
}

// Photons to splats, and how many of them each tile holds.
@compute @workgroup_size(64)
fn project_photons(@builtin(global_invocation_id) id: vec3u) {
    let index = slot_of(id);
    if index >= params.slot_count {
        return;
    }
    rectangles[index] = vec2u(NO_PIXELS);
    let photon = photons[params.first_slot + index];
    if (photon.state & (PHOTON_STATE_MASK | PHOTON_FIRST_HIT)) != PHOTON_STORED {
        return;
    }
    var h = min(splat_bandwidth(params.bandwidth, photon.density), radius_limit(photon.position));
    if !(h > 0.0) {
        return;
    }
    var range = pixel_range(photon.position, h);
    for (var i = 0u; i < 8u && any((range.zw >> vec2u(4u)) - (range.xy >> vec2u(4u)) >= vec2i(TILES_A_SIDE)); i++) {
        h *= 0.75;
        range = pixel_range(photon.position, h);
    }
    if is_empty(range) {
        return;
    }
    let tile_range = tiles_of(range);
    splats[index] = Splat(photon.position, h, photon.flux, photon.normal);
    rectangles[index] = vec2u(pack_pixel(range.xy), pack_pixel(range.zw));
    let peak = max(photon.flux.x, max(photon.flux.y, photon.flux.z)) * splat_kernel(vec4f(0.0)).x / (h * h);
    for (var y = tile_range.y; y <= tile_range.w; y++) {
        for (var x = tile_range.x; x <= tile_range.z; x++) {
            let tile = y * params.tile_columns + x;
            atomicAdd(&tiles[tile].count, 1u);
            atomicMax(&tiles[tile].brightest, bitcast<u32>(peak));
        }
    }
}

var<workgroup> scan_sums: array<u32, 256>;

// Where each tile's list starts: an exclusive sum over the counts, 256 tiles at a time.
@compute @workgroup_size(256)
fn scan_tiles(@builtin(local_invocation_index) lane: u32) {
    let tile_count = params.tile_columns * params.tile_rows;
    var base = 0u;
    for (var start = 0u; start < tile_count; start += 256u) {
        let tile = start + lane;
        var count = 0u;
        if tile < tile_count {
            count = atomicLoad(&tiles[tile].count);
        }
        scan_sums[lane] = count;
        workgroupBarrier();
        for (var step = 1u; step < 256u; step *= 2u) {
            var left = 0u;
            if lane >= step {
                left = scan_sums[lane - step];
            }
            workgroupBarrier();
            scan_sums[lane] += left;
            workgroupBarrier();
        }
        if tile < tile_count {
            tiles[tile].first = base + scan_sums[lane] - count;
        }
        base += scan_sums[255];
        workgroupBarrier();
    }
}

// Splats into the lists of their tiles.
@compute @workgroup_size(64)
fn bin_splats(@builtin(global_invocation_id) id: vec3u) {
    let index = slot_of(id);
    if index >= params.slot_count {
        return;
    }
    if rectangles[index].x == NO_PIXELS {
        return;
    }
    let range = tiles_of(unpack_pixels(rectangles[index]));
    for (var y = range.y; y <= range.w; y++) {
        for (var x = range.x; x <= range.z; x++) {
            let tile = y * params.tile_columns + x;
            let at = tiles[tile].first + atomicAdd(&tiles[tile].filled, 1u);
            if at < params.capacity {
                list[at] = index;
            }
        }
    }
}

// Four unsigned 64-bit sums, one for each pixel of an invocation.
struct Sums {
    low: vec4u,
    high: vec4u,
}

fn add_64(sums: Sums, value: vec4u) -> Sums {
    let low = sums.low + value;
    return Sums(low, sums.high + select(vec4u(0u), vec4u(1u), low < value));
}

fn f32_from_64(sums: Sums) -> vec4f {
    return vec4f(sums.high) * 0x1p32 + vec4f(sums.low);
}

// 2^e, for e within the exponents of normal floats.
fn power_of_two(e: i32) -> f32 {
    return bitcast<f32>(u32(clamp(e, -126, 127) + 127) << 23u);
}

// A batch of the tile's splats, and for each block of 8 x 8 pixels one bit for each splat that may touch it: a splat
// misses most pixels of a tile, and a block need not look at those that miss it. An invocation serves 2 x 2 pixels, so
// that it reads a splat once for four of them.
const BATCH: u32 = 256u;
const LANES: u32 = 64u;
const BLOCK: i32 = 8;
const BLOCKS_A_SIDE: i32 = 2;
const WORDS_A_BLOCK: u32 = BATCH / 32u;

var<workgroup> batch: array<Kernel, BATCH>;
var<workgroup> block_masks: array<atomic<u32>, 32>;
// First, count and brightest of the workgroup's tile
var<workgroup> tile_list: vec3u;

// Sets a splat's bit in every block of the tile that its pixels touch.
fn mark_blocks(tile_corner: vec2i, range: vec4i, place: u32) {
    let first = max(range.xy - tile_corner, vec2i(0)) / BLOCK;
    let last = min((range.zw - tile_corner) / BLOCK, vec2i(BLOCKS_A_SIDE - 1));
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            let word = u32(BLOCKS_A_SIDE * y + x) * WORDS_A_BLOCK + place / 32u;
            atomicOr(&block_masks[word], 1u << (place % 32u));
        }
    }
}

// Positions and geometric normals at an invocation's four pixels of the irradiance, by coordinate; `seen` where there is
// a surface.
struct Receivers {
    x: vec4f,
    y: vec4f,
    z: vec4f,
    normal_x: vec4f,
    normal_y: vec4f,
    normal_z: vec4f,
    seen: vec4<bool>,
}

fn receiver_pixel(corner: vec2u, i: u32) -> vec2u {
    return corner + vec2u(i % 2u, i / 2u);
}

fn receivers_at(corner: vec2u) -> Receivers {
    var receivers: Receivers;
    for (var i = 0u; i < 4u; i++) {
        let index = receiver_pixel(corner, i);
        let pixel = subsampling_pixel(index, params.factor, view.size);
        if any(index >= irradiance_size()) || textureLoad(base_color_texture, pixel + view.origin, 0).a <= 0.0 {
            continue;
        }
        let p = splat_position(view, vec2i(pixel));
        let shading = g_buffer_normal(view, textureLoad(normal_texture, pixel + view.origin, 0));
        let n = splat_receiver_normal(view, vec2i(pixel), p, shading);
        receivers.x[i] = p.x;
        receivers.y[i] = p.y;
        receivers.z[i] = p.z;
        receivers.normal_x[i] = n.x;
        receivers.normal_y[i] = n.y;
        receivers.normal_z[i] = n.z;
        receivers.seen[i] = true;
    }
    return receivers;
}

@compute @workgroup_size(64)
fn gather_tiles(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let tile = group.y * params.tile_columns + group.x;
    if lane == 0u {
        tile_list = vec3u(tiles[tile].first, atomicLoad(&tiles[tile].count), atomicLoad(&tiles[tile].brightest));
    }
    let listed = workgroupUniformLoad(&tile_list);
    // The bound is below 2^(exponent + 1), so a contribution is below 2^31 quanta.
    let exponent = i32(listed.z >> 23u) - 127;
    let to_quanta = power_of_two(30 - exponent);

    // Sixteen neighbouring lanes share a block.
    let block = lane / 16u;
    let tile_corner = group.xy * TILE;
    let corner = tile_corner + 8u * vec2u(block % 2u, block / 2u) + 2u * vec2u(lane % 4u, (lane / 4u) % 4u);
    let receivers = receivers_at(corner);
    let any_seen = any(receivers.seen);

    var red = Sums();
    var green = Sums();
    var blue = Sums();
    for (var start = 0u; start < listed.y; start += BATCH) {
        if lane < 32u {
            atomicStore(&block_masks[lane], 0u);
        }
        workgroupBarrier();
        for (var place = lane; place < min(BATCH, listed.y - start); place += LANES) {
            let index = list[listed.x + start + place];
            let splat = splats[index];
            // In quanta, so that a receiver has only to weight and round.
            let flux = splat.flux * to_quanta;
            batch[place] = splat_prepare(splat.position, octahedral_unpack(splat.normal), splat.radius, flux);
            mark_blocks(vec2i(tile_corner), unpack_pixels(rectangles[index]), place);
        }
        workgroupBarrier();
        for (var word = 0u; word < WORDS_A_BLOCK; word++) {
            var mask = atomicLoad(&block_masks[block * WORDS_A_BLOCK + word]);
            while any_seen && mask != 0u {
                let i = 32u * word + countTrailingZeros(mask);
                mask &= mask - 1u;
                let dx = receivers.x - batch[i].position.x;
                let dy = receivers.y - batch[i].position.y;
                let dz = receivers.z - batch[i].position.z;
                let q = (dx * dx + dy * dy + dz * dz) * batch[i].inverse_radius_squared;
                if !any(q < vec4f(1.0)) {
                    continue;
                }
                let splat = batch[i];
                let n = splat.normal;
                let off_plane = abs(dx * n.x + dy * n.y + dz * n.z);
                let agreement = receivers.normal_x * n.x + receivers.normal_y * n.y + receivers.normal_z * n.z;
                let weight = splat_weight(q, off_plane, agreement, splat.slab) * vec4f(receivers.seen);
                red = add_64(red, vec4u(round(splat.strength.x * weight)));
                green = add_64(green, vec4u(round(splat.strength.y * weight)));
                blue = add_64(blue, vec4u(round(splat.strength.z * weight)));
            }
        }
        workgroupBarrier();
    }
    let from_quanta = power_of_two(exponent - 30);
    let r = f32_from_64(red) * from_quanta;
    let g = f32_from_64(green) * from_quanta;
    let b = f32_from_64(blue) * from_quanta;
    for (var i = 0u; i < 4u; i++) {
        let pixel = receiver_pixel(corner, i);
        if all(pixel < irradiance_size()) {
            textureStore(irradiance, pixel, vec4f(r[i], g[i], b[i], 1.0));
        }
    }
}
