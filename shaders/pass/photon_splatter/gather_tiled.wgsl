// The gather of the tiled shape: what all photons give to each pixel of the irradiance.

@group(0) @binding(0) var<uniform> params: TiledParams;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<storage, read> splats: array<Splat>;
@group(0) @binding(3) var<storage, read> first_splats: array<u32>;
@group(0) @binding(4) var<storage, read> reach: array<u32>;
@group(0) @binding(5) var receivers: texture_2d<u32>;
// A layer for each part of the photons
@group(0) @binding(6) var sums: texture_storage_2d_array<rgba32float, write>;

// Pixels along the side of what a workgroup gathers: 2 x 2 blocks of 8 x 8, of which each invocation has 2 x 2.
const TILE: u32 = 16u;
const BLOCK: u32 = 8u;
// Photons added up in a turn of the loop. Twin of `SPLATS_A_TURN`.
const SPLATS_A_TURN: u32 = 16u;

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

fn add_splat(g: ptr<function, Gathered>, index: u32, last: u32) {
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

fn add_four(g: ptr<function, Gathered>, index: u32, last: u32) {
    add_splat(g, index, last);
    add_splat(g, index + 1u, last);
    add_splat(g, index + 2u, last);
    add_splat(g, index + 3u, last);
}

// Pixels between a block that begins here and bins along one axis; bins count from beyond the rim.
fn gap(corner: u32, bin: i32) -> i32 {
    let start = (bin - i32(BORDER)) * i32(BIN);
    return max(max(start - i32(corner + BLOCK), i32(corner) - start - i32(BIN)), 0);
}

@compute @workgroup_size(64)
fn gather_tiles(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let block = lane / 16u;
    let corner = TILE * group.xy + BLOCK * vec2u(block % 2u, block / 2u);
    let own = corner + 2u * vec2u(lane % 4u, (lane / 4u) % 4u);
    let size = subsampling_size(view.size, params.bandwidth.factor);
    var g = Gathered();
    for (var i = 0u; i < 4u; i++) {
        let receiver = receiver_unpack(textureLoad(receivers, min(own + vec2u(i % 2u, i / 2u), size - 1u), 0));
        g.x[i] = receiver.position.x;
        g.y[i] = receiver.position.y;
        g.z[i] = receiver.position.z;
        // No normal agrees with one of no length.
        let normal = select(vec3f(0.0), receiver.normal, receiver.is_seen);
        g.normal_x[i] = normal.x;
        g.normal_y[i] = normal.y;
        g.normal_z[i] = normal.z;
    }
    let grid = vec2i(bin_grid(params.bandwidth));
    let widest = i32((reach[grid.x * grid.y] + BIN - 1u) / BIN);
    let first = vec2i(corner / BIN + BORDER) - widest;
    let end = vec2i(corner / BIN + BLOCK / BIN + BORDER) + widest;
    for (var y = max(first.y, 0); y < min(end.y, grid.y); y++) {
        for (var x = max(first.x, 0); x < min(end.x, grid.x); x++) {
            let bin = u32(y * grid.x + x);
            let gap = max(gap(corner.x, x), gap(corner.y, y));
            if i32(reach[bin]) <= gap {
                continue;
            }
            // This workgroup's part of the bin.
            let count = first_splats[bin + 1u] - first_splats[bin];
            let last = first_splats[bin] + count * (group.z + 1u) / groups.z;
            for (var i = first_splats[bin] + count * group.z / groups.z; i < last; i += SPLATS_A_TURN) {
                add_four(&g, i, last - 1u);
                add_four(&g, i + 4u, last - 1u);
                add_four(&g, i + 8u, last - 1u);
                add_four(&g, i + 12u, last - 1u);
            }
        }
    }
    for (var i = 0u; i < 4u; i++) {
        let pixel = own + vec2u(i % 2u, i / 2u);
        if all(pixel < size) {
            textureStore(sums, pixel, group.z, vec4f(g.red[i], g.green[i], g.blue[i], g.radius[i]));
        }
    }
}
