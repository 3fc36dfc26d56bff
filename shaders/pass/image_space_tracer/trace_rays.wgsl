// A list of rays that leave surfaces: what the maps say of each.

struct ListParams {
    ray_count: u32,
    row: u32,
}

@group(0) @binding(0) var<uniform> list: ListParams;
@group(0) @binding(1) var<storage, read> rays: array<SurfaceRay>;
@group(0) @binding(2) var<storage, read_write> hits: array<SurfaceHit>;

@compute @workgroup_size(64)
fn trace_rays(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * list.row + id.x;
    if id.x >= list.row || index >= list.ray_count {
        return;
    }
    let ray = rays[index];
    let hit = trace_ray(ray.position, octahedral_unpack(ray.normal), ray.direction);
    var normal = 0u;
    if hit.kind == HIT_SURFACE || hit.kind == HIT_TENTATIVE {
        normal = octahedral_pack(hit.normal);
    }
    hits[index] = SurfaceHit(
        hit.distance, hit.kind, normal, reflectance_pack(hit.reflectance), env_map_fetches, trace_maps, trace_steps, hit.lobe,
    );
}
