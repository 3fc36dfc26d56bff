// How much indirect light has changed on each surface (Larsen 2004, section 11.1): one invocation a texel.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> lights: array<SurfaceLight>;
@group(0) @binding(2) var<storage, read> changes: array<vec2u>;
@group(0) @binding(3) var<storage, read_write> surface_changes: array<atomic<u32>>;

@compute @workgroup_size(64)
fn sum_changes(@builtin(global_invocation_id) id: vec3u) {
    if id.x < params.texel_count && changes[id.x].y > 0u {
        atomicAdd(&surface_changes[lights[id.x].surface], changes[id.x].y);
    }
}
