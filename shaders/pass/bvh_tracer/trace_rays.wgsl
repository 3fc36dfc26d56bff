// A list of rays: what each hits first, or whether it hits anything.

struct Params {
    ray_count: u32,
    row: u32,
}

// Twin of `resource::Ray`.
struct Ray {
    origin: vec3f,
    furthest: f32,
    direction: vec3f,
    mask: u32,
}

// Twin of `resource::RayHit`.
struct RayHit {
    distance: f32,
    instance: u32,
    triangle: u32,
    is_front: u32,
    barycentric: vec2f,
    nodes_visited: u32,
    triangles_visited: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> rays: array<Ray>;
@group(0) @binding(2) var<storage, read_write> hits: array<RayHit>;

// Weights of the second and third corner in the mesh's own order, of those of the stored order.
fn mesh_barycentric(triangle: u32, stored: vec2f) -> vec2f {
    let order = bvh_attributes[triangle].order;
    var weights = vec3f(0.0);
    // The other two may sum to a little more than one.
    weights[order & 3u] = max(0.0, 1.0 - stored.x - stored.y);
    weights[(order >> 2u) & 3u] = stored.x;
    weights[(order >> 4u) & 3u] = stored.y;
    return weights.yz;
}

fn trace(id: vec3u, first_will_do: bool) {
    let index = id.y * params.row + id.x;
    if id.x >= params.row || index >= params.ray_count {
        return;
    }
    let ray = rays[index];
    let hit = bvh_traverse(ray.origin, ray.direction, ray.furthest, ray.mask, first_will_do);
    var found = RayHit(
        hit.distance, hit.instance, BVH_NONE, 0u, vec2f(0.0), hit.nodes_visited, hit.triangles_visited,
    );
    if hit.instance != BVH_NONE {
        found.triangle = bvh_attributes[hit.triangle].triangle;
        found.is_front = u32(dot(bvh_surface(hit).geometric_normal, ray.direction) < 0.0);
        found.barycentric = mesh_barycentric(hit.triangle, hit.barycentric);
    }
    hits[index] = found;
}

@compute @workgroup_size(64)
fn trace_closest(@builtin(global_invocation_id) id: vec3u) {
    trace(id, false);
}

@compute @workgroup_size(64)
fn trace_any(@builtin(global_invocation_id) id: vec3u) {
    trace(id, true);
}
