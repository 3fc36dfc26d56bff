// The gather of the tiled shape: what all photons give to each pixel of the irradiance.

@group(0) @binding(0) var<uniform> params: TiledParams;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<storage, read> splats: array<Splat>;
@group(0) @binding(3) var<storage, read> first_splats: array<u32>;
@group(0) @binding(4) var<storage, read> reach: array<u32>;
@group(0) @binding(5) var receivers: texture_2d<u32>;
@group(0) @binding(6) var sums: texture_storage_2d<rgba32float, write>;

// Pixels along the side of what a workgroup gathers: each invocation has 2 x 2.
const TILE: u32 = 16u;

alias Receivers = vec4f;
alias Surfaces = vec4u;

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
    g.surface = vec4u(r[0].surface, r[1].surface, r[2].surface, r[3].surface);
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

@compute @workgroup_size(64)
fn gather_tiles(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    // Invocations next to each other have pixels close to each other.
    let block = vec2u(lane / 16u % 2u, lane / 32u);
    let own = TILE * group.xy + 8u * block + 2u * vec2u(lane % 4u, lane / 4u % 4u);
    let b = params.bandwidth;
    let size = subsampling_size(view.size, b.factor);
    if any(own >= size) {
        return;
    }
    var seen: array<Receiver, 4>;
    for (var i = 0u; i < 4u; i++) {
        let pixel = min(own + vec2u(i % 2u, i / 2u), size - 1u);
        seen[i] = receiver_unpack(textureLoad(receivers, pixel, 0), subsampling_pixel(pixel, b.factor, view.size));
    }
    var g = gather_start(seen);
    // Where they stand: the last ones of an axis may stand closer than one pixel of the irradiance.
    let low = irradiance_place(b, vec2f(subsampling_pixel(own, b.factor, view.size)) + 0.5);
    let high = irradiance_place(b, vec2f(subsampling_pixel(min(own + 1u, size - 1u), b.factor, view.size)) + 0.5);
    gather_photons(&g, low, high);
    var found = gather_sums(g);
    for (var i = 0u; i < 4u; i++) {
        let pixel = own + vec2u(i % 2u, i / 2u);
        if all(pixel < size) {
            textureStore(sums, pixel, found[i]);
        }
    }
}
