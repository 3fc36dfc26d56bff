// The gather of the tiled shape: what all photons give to each pixel of the irradiance.

@group(0) @binding(0) var<uniform> params: TiledParams;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<storage, read> splats: array<Splat>;
@group(0) @binding(3) var<storage, read> first_splats: array<u32>;
@group(0) @binding(4) var<storage, read> reach: array<u32>;
@group(0) @binding(5) var receivers: texture_2d<u32>;
@group(0) @binding(6) var sums: texture_storage_2d<rgba32float, write>;

// Pixels along the side of what a workgroup gathers: 2 x 2 blocks of 8 x 8, of which each invocation has 2 x 2.
const TILE: u32 = 16u;
const BLOCK: u32 = 8u;

@compute @workgroup_size(64)
fn gather_tiles(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let block = lane / 16u;
    let corner = TILE * group.xy + BLOCK * vec2u(block % 2u, block / 2u);
    let own = corner + 2u * vec2u(lane % 4u, (lane / 4u) % 4u);
    let size = subsampling_size(view.size, params.bandwidth.factor);
    var seen: array<Receiver, 4>;
    for (var i = 0u; i < 4u; i++) {
        let pixel = min(own + vec2u(i % 2u, i / 2u), size - 1u);
        seen[i] = receiver_unpack(textureLoad(receivers, pixel, 0));
    }
    var g = gather_start(seen);
    gather_photons(&g, vec2i(corner), vec2i(corner + BLOCK));
    var found = gather_sums(g);
    for (var i = 0u; i < 4u; i++) {
        let pixel = own + vec2u(i % 2u, i / 2u);
        if all(pixel < size) {
            textureStore(sums, pixel, found[i]);
        }
    }
}
