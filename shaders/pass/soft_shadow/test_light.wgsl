// Whether one light's middle is seen, how far before each shadowed receiver its occluder stands, and what each tile of pixels
// holds. The module brings `occluder_gap`.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var base_color_texture: texture_2d<f32>;
@group(0) @binding(5) var<storage, read> lights: array<Light>;
@group(0) @binding(6) var<storage, read> nearest: array<f32>;
// Visibility, or for a later pass the distance to an occluder or a mark
@group(0) @binding(7) var visibility: texture_storage_2d<r32float, write>;
// Distance from receiver to occluder, or a mark
@group(0) @binding(8) var occlusion: texture_storage_2d<r32float, write>;
// Visibility, or a mark: what the blur along the second axis finds where none along the first was needed
@group(0) @binding(9) var across: texture_storage_2d<r32float, write>;
@group(0) @binding(10) var<storage, read_write> tiles: array<u32>;

var<workgroup> holds: atomic<u32>;
var<workgroup> reach_bits: atomic<u32>;

fn is_receiver(light: Light, receiver: Receiver, id: vec2u) -> bool {
    return textureLoad(base_color_texture, id + view.origin, 0).a > 0.0 && receiver_faces(light, receiver);
}

// How far the receivers of a tile reach, by eight of its pixels, one in each row and column: between them a surface has little
// room to reach further than the search's arms have to spare.
fn sample_reach(light: Light, tile: vec2u, sample: u32) {
    let id = 8u * tile + vec2u(sample, (5u * sample + 2u) % 8u);
    if any(id >= view.size) {
        return;
    }
    let receiver = receiver_at(light, id);
    if is_receiver(light, receiver, id) {
        atomicMax(&reach_bits, bitcast<u32>(reach_pixels(light, receiver, id)));
    }
}

// How far the search and the blur of this receiver go, in pixels: no end of the ellipse that they stay within is further away. A
// step of a length along any direction changes clip coordinates by no more than the length of their row of the matrix.
fn reach_pixels(light: Light, receiver: Receiver, id: vec2u) -> f32 {
    let cosine = max(dot(receiver.normal, receiver.to_light), LEAST_COSINE);
    let longest = reach_radius(light, receiver) / cosine;
    let rows = vec3f(
        length(g_buffer_row(view, 0u).xyz),
        length(g_buffer_row(view, 1u).xyz),
        length(g_buffer_row(view, 3u).xyz),
    );
    let w = dot(g_buffer_row(view, 3u), vec4f(receiver.position, 1.0)) - longest * rows.z;
    let ndc = abs(2.0 * (vec2f(id) + 0.5) / vec2f(view.size) - 1.0);
    let away = longest * (rows.xy + ndc * rows.z) * 0.5 * vec2f(view.size);
    // Not beyond what taps are taken from, nor where the eye's plane may be within reach.
    return select(reach_most_pixels(), min(max(away.x, away.y) / w, reach_most_pixels()), w > 0.0);
}

@compute @workgroup_size(8, 8)
fn test_pixels(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) tile: vec3u,
    @builtin(num_workgroups) tile_counts: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let light = lights[params.light];
    if all(id.xy < view.size) {
        let receiver = receiver_at(light, id.xy);
        var gap = NO_RECEIVER;
        if is_receiver(light, receiver, id.xy) {
            gap = occluder_gap(light, receiver);
        }
        let is_lit = gap == NO_OCCLUDER;
        let seen = select(0.0, 1.0, is_lit);
        textureStore(visibility, id.xy, vec4f(select(seen, gap, params.gathered == GATHERED_LATER)));
        if params.gathered == GATHERED_BY_STEPS {
            textureStore(occlusion, id.xy, vec4f(gap));
            textureStore(across, id.xy, vec4f(select(seen, NO_RECEIVER, gap == NO_RECEIVER)));
        }
        if gap != NO_RECEIVER {
            atomicOr(&holds, select(TILE_HOLDS_SHADOW, TILE_HOLDS_LIGHT, is_lit));
        }
    }
    if lane < 8u && params.gathered != GATHERED_NOT {
        sample_reach(light, tile.xy, lane);
    }
    workgroupBarrier();
    if lane == 0u && params.gathered != GATHERED_NOT {
        let reach = tile_steps(bitcast<f32>(atomicLoad(&reach_bits)));
        tiles[tile.y * tile_counts.x + tile.x] = tile_pack(atomicLoad(&holds), reach);
    }
}
