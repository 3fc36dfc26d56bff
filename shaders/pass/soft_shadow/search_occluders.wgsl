// The penumbra's radius at each receiver, from the occluders that shade the surface around it.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var<storage, read> lights: array<Light>;
@group(0) @binding(5) var<storage, read> nearest: array<f32>;
@group(0) @binding(6) var occlusion: texture_2d<f32>;
@group(0) @binding(7) var<storage, read> list: TileList;
@group(0) @binding(8) var radii: texture_storage_2d<r32float, write>;

fn occlusion_at(pixel: vec2u) -> f32 {
    return textureLoad(occlusion, pixel, 0).r;
}

@compute @workgroup_size(8, 8)
fn search_pixels(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_id) local: vec3u,
) {
    let id = tile_list_pixel(group, groups, local);
    if any(id >= view.size) {
        return;
    }
    let gap = occlusion_at(id);
    if gap == NO_RECEIVER {
        textureStore(radii, id, vec4f(0.0));
        return;
    }
    let light = lights[params.light];
    textureStore(radii, id, vec4f(penumbra_radius(light, receiver_at(light, id), gap, id)));
}
