// Whether one light's middle is seen, how far before each shadowed receiver its occluder stands, and what each tile of pixels
// holds. The module brings `occluder_gap`.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var base_color_texture: texture_2d<f32>;
@group(0) @binding(5) var<storage, read> lights: array<Light>;
@group(0) @binding(6) var<storage, read> nearest: array<f32>;
@group(0) @binding(7) var visibility: texture_storage_2d<r32float, write>;
// Distance from receiver to occluder, or a mark
@group(0) @binding(8) var occlusion: texture_storage_2d<r32float, write>;
// Visibility, or a mark: what the blur along the second axis finds where none along the first was needed
@group(0) @binding(9) var across: texture_storage_2d<r32float, write>;
@group(0) @binding(10) var<storage, read_write> tiles: array<u32>;

var<workgroup> holds: atomic<u32>;
var<workgroup> reach_bits: atomic<u32>;

// Distance from receiver to occluder, or a mark.
fn gap_at(light: Light, receiver: Receiver, id: vec2u) -> f32 {
    let is_seen = textureLoad(base_color_texture, id + view.origin, 0).a > 0.0;
    if !is_seen || !receiver_faces(light, receiver) {
        return NO_RECEIVER;
    }
    return occluder_gap(light, receiver);
}

// How far the search, and the blur, of this receiver go: the corners of what they stay within.
fn reach_pixels(light: Light, receiver: Receiver, id: vec2u) -> f32 {
    let radius = reach_radius(light, receiver);
    let axes = receiver_axes(receiver);
    var most = 0.0;
    for (var corner = 0u; corner < 4u; corner++) {
        let signs = vec2f(select(-1.0, 1.0, (corner & 1u) == 0u), select(-1.0, 1.0, corner < 2u));
        let at = receiver.position + radius * (signs.x * axes[0] + signs.y * axes[1]);
        let clip = view.view_projection * vec4f(at, 1.0);
        if !(clip.w > 0.0) {
            return reach_most_pixels();
        }
        let pixel = (vec2f(0.5, 0.5) + vec2f(0.5, -0.5) * (clip.xy / clip.w)) * vec2f(view.size);
        let away = abs(pixel - vec2f(id) - 0.5);
        most = max(most, max(away.x, away.y));
    }
    return min(most, reach_most_pixels());
}

@compute @workgroup_size(8, 8)
fn test_pixels(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) tile: vec3u,
    @builtin(num_workgroups) tile_counts: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    if all(id.xy < view.size) {
        let light = lights[params.light];
        let receiver = receiver_at(light, id.xy);
        let gap = gap_at(light, receiver, id.xy);
        let is_lit = gap == NO_OCCLUDER;
        textureStore(visibility, id.xy, vec4f(select(0.0, 1.0, is_lit)));
        if params.is_gathered == 1u {
            let marked = select(select(0.0, 1.0, is_lit), NO_RECEIVER, gap == NO_RECEIVER);
            textureStore(occlusion, id.xy, vec4f(gap));
            textureStore(across, id.xy, vec4f(marked));
            if gap != NO_RECEIVER {
                atomicOr(&holds, select(TILE_HOLDS_SHADOW, TILE_HOLDS_LIGHT, is_lit));
                atomicMax(&reach_bits, bitcast<u32>(reach_pixels(light, receiver, id.xy)));
            }
        }
    }
    workgroupBarrier();
    if lane == 0u && params.is_gathered == 1u {
        let reach = tile_steps(bitcast<f32>(atomicLoad(&reach_bits)));
        tiles[tile.y * tile_counts.x + tile.x] = tile_pack(atomicLoad(&holds), reach);
    }
}
