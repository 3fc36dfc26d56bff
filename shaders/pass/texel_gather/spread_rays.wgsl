// Rays from the chosen texels, as dense as the cosine: one invocation a ray.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> lights: array<SurfaceLight>;
@group(0) @binding(2) var<storage, read> chosen: PathList;
@group(0) @binding(3) var<storage, read_write> rays: array<SurfaceRay>;

// A ray that asks nothing: it starts where nothing is.
const NOWHERE: vec3f = vec3f(0.0, 0.0, 64.0);

@compute @workgroup_size(64)
fn spread_rays(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * params.row + id.x;
    if id.x >= params.row || index >= params.budget * params.ray_count {
        return;
    }
    let place = index / params.ray_count;
    if place >= chosen.count {
        rays[index] = SurfaceRay(NOWHERE, octahedral_pack(vec3f(0.0, 0.0, 1.0)), vec3f(0.0, 0.0, 1.0), 0u);
        return;
    }
    let texel = chosen.paths[place];
    let i = index % params.ray_count;
    let own = hash_u32(texel ^ hash_u32(params.sample_offset));
    let shift = vec2f(hash_unit(own, 0u), hash_unit(own, 1u));
    let normal = lights[texel].normal;
    let direction = cosine_direction(sampling_frame(normal), i, params.ray_count, shift);
    rays[index] = SurfaceRay(lights[texel].position, octahedral_pack(normal), direction, 0u);
}
