// Visibility of each pixel of the listed tiles, gathered over a disc.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var<storage, read> lights: array<Light>;
@group(0) @binding(5) var<storage, read> list: TileList;
@group(0) @binding(6) var radii: texture_2d<f32>;
@group(0) @binding(7) var occlusion: texture_2d<f32>;
@group(0) @binding(8) var visibility: texture_storage_2d<r32float, write>;

fn searched_radius(light: Light, receiver: Receiver, id: vec2u) -> f32 {
    return textureLoad(radii, id, 0).r;
}

fn source_at(pixel: vec2u) -> f32 {
    return occlusion_visibility(textureLoad(occlusion, pixel, 0).r);
}

@compute @workgroup_size(8, 8)
fn gather_pixels(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_id) local: vec3u,
) {
    let id = tile_list_pixel(group, groups, local);
    if any(id >= view.size) {
        return;
    }
    let own = source_at(id);
    var seen = 0.0;
    if own != NO_RECEIVER {
        seen = clamp(gathered(lights[params.light], id, own), 0.0, 1.0);
    }
    textureStore(visibility, id, vec4f(seen));
}
