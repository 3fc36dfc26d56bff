// A list of rays that leave surfaces: what the triangles say of each.

struct Params {
    ray_count: u32,
    row: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> rays: array<SurfaceRay>;
@group(0) @binding(2) var<storage, read_write> hits: array<SurfaceHit>;

@compute @workgroup_size(64)
fn trace_surface_rays(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * params.row + id.x;
    if id.x >= params.row || index >= params.ray_count {
        return;
    }
    let ray = rays[index];
    let hit = trace_ray(ray.position, octahedral_unpack(ray.normal), ray.direction);
    var normal = 0u;
    if hit.kind == HIT_SURFACE {
        normal = octahedral_pack(hit.normal);
    }
    hits[index] = SurfaceHit(hit.distance, hit.kind, normal, reflectance_pack(hit.reflectance), 0u, 0u, 0u, hit.lobe);
}
