// The hard shadow test of one light, and how far before each shadowed receiver its occluder stands.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var base_color_texture: texture_2d<f32>;
@group(0) @binding(5) var<storage, read> lights: array<Light>;
@group(0) @binding(6) var shadow_maps: texture_2d_array<u32>;
@group(0) @binding(7) var visibility: texture_storage_2d<r32float, write>;
// Distance from receiver to occluder, or a mark; without a search, the penumbra's radius
@group(0) @binding(8) var occlusion: texture_storage_2d<r32float, write>;

struct Test {
    is_lit: bool,
    gap: f32,
}

fn test(light: Light, receiver: Receiver) -> Test {
    let size = params.shadow_map_size;
    let probe = shadow_probe(light, receiver.position, size);
    if !probe.is_inside {
        return Test(true, NO_OCCLUDER);
    }
    let texel = surface_texel_unpack(textureLoad(shadow_maps, probe.texel, probe.ray.layer, 0));
    let is_lit = shadow_is_lit(light, probe, texel, receiver.position, receiver.normal, size);
    return Test(is_lit, select(max(probe.distance - texel.distance, 0.0), NO_OCCLUDER, is_lit));
}

@compute @workgroup_size(8, 8)
fn test_pixels(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= view.size) {
        return;
    }
    let light = lights[params.light];
    let receiver = receiver_at(light, id.xy);
    let is_seen = textureLoad(base_color_texture, id.xy + view.origin, 0).a > 0.0;
    // Of a flat lamp, or a wide sun, a part may stand above the horizon where its middle does not.
    let lowest = select(0.0, -light_disc_sine(light), light.kind == LIGHT_DIRECTIONAL);
    let is_turned_away = light.kind != LIGHT_AREA && dot(receiver.normal, receiver.to_light) <= lowest;
    if !is_seen || is_turned_away {
        // The blur takes the mark out again; for a light without extent this is the end.
        let mark = select(NO_RECEIVER, 0.0, light.extent <= 0.0);
        textureStore(visibility, id.xy, vec4f(mark));
        textureStore(occlusion, id.xy, vec4f(select(NO_RECEIVER, 0.0, params.search == 0u)));
        return;
    }
    let result = test(light, receiver);
    textureStore(visibility, id.xy, vec4f(select(0.0, 1.0, result.is_lit)));
    // Occluders tend to stand nearer to what they shade than to the lamp: a quarter of the way from receiver to lamp, or
    // through the region.
    let way = select(receiver.distance, 2.0 * light.disc_radius, light.kind == LIGHT_DIRECTIONAL);
    let one_radius = shadow_penumbra_radius(light, receiver.distance, 0.25 * way);
    textureStore(occlusion, id.xy, vec4f(select(result.gap, one_radius, params.search == 0u)));
}
