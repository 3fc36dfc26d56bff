// The gather of marked pixels alone, at another sub-sampling than the one that photons were sorted for.

struct MarkedParams {
    bandwidth: Bandwidth,
    // Pixels of the G-buffer for each one that may be marked, along each axis
    factor: u32,
    // 1: kernels count by the part of them that lies on the surface
    is_corrected: u32,
    sample_offset: u32,
}

@group(0) @binding(0) var<uniform> params: MarkedParams;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<storage, read> splats: array<Splat>;
@group(0) @binding(3) var<storage, read> first_splats: array<u32>;
@group(0) @binding(4) var<storage, read> reach: array<u32>;
@group(0) @binding(5) var depth_texture: texture_2d<f32>;
@group(0) @binding(6) var normal_texture: texture_2d<f32>;
@group(0) @binding(7) var base_color_texture: texture_2d<f32>;
@group(0) @binding(8) var<storage, read> marked: array<u32>;
@group(0) @binding(9) var irradiance: texture_storage_2d<rgba32float, write>;

// Pixels along the side of what a workgroup looks through: 2 x 2 blocks of marks.
const TILE: u32 = 16u;

// Marked pixels of the tile, one behind the other: those that an invocation adds up for are close to each other.
var<workgroup> listed: array<u32, 256>;

// Marks of the tile's blocks, two words each.
fn marks_of(tile: vec2u, size: vec2u) -> array<u32, 8> {
    let blocks = marked_blocks(size);
    var words: array<u32, 8>;
    for (var i = 0u; i < 4u; i++) {
        let block = 2u * tile + vec2u(i % 2u, i / 2u);
        if all(block < blocks) {
            let word = marked_word(block, blocks);
            words[2u * i] = marked[word];
            words[2u * i + 1u] = marked[word + 1u];
        }
    }
    return words;
}

// Where in the tile a mark stands.
fn marked_pixel_of(mark: u32) -> vec2u {
    let block = vec2u(mark / 64u % 2u, mark / 128u);
    return 8u * block + vec2u(mark % 8u, mark / 8u % 8u);
}

@compute @workgroup_size(64)
fn gather_marked(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let size = subsampling_size(view.size, params.factor);
    var words = marks_of(group.xy, size);
    var total = 0u;
    for (var i = 0u; i < 8u; i++) {
        // Each invocation lists the marked ones of four pixels.
        let shift = 4u * (lane % 8u);
        if i == lane / 8u {
            var rank = total + countOneBits(words[i] & ((1u << shift) - 1u));
            for (var bit = shift; bit < shift + 4u; bit++) {
                if (words[i] >> bit & 1u) == 1u {
                    listed[rank] = 32u * i + bit;
                    rank++;
                }
            }
        }
        total += countOneBits(words[i]);
    }
    workgroupBarrier();
    if 4u * lane >= total {
        return;
    }
    var pixels: array<vec2u, 4>;
    var seen: array<Receiver, 4>;
    for (var i = 0u; i < 4u; i++) {
        let mark = listed[min(4u * lane + i, total - 1u)];
        pixels[i] = TILE * group.xy + marked_pixel_of(mark);
        seen[i] = receiver_at(subsampling_pixel(pixels[i], params.factor, view.size));
    }
    // The tile among the pixels that photons were sorted for, rounded outwards.
    let corner = vec2f(params.factor * TILE * group.xy);
    let low = irradiance_place(params.bandwidth, corner);
    let high = irradiance_place(params.bandwidth, corner + f32(params.factor * TILE));
    var g = gather_start(seen);
    gather_photons(&g, vec2i(floor(low)), vec2i(ceil(high)));
    var found = gather_sums(g);
    for (var i = 0u; i < 4u && 4u * lane + i < total; i++) {
        textureStore(irradiance, pixels[i], vec4f(boundary_corrected(seen[i], found[i]), 1.0));
    }
}
