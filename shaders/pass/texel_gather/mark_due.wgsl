// Texels of surfaces whose indirect light has changed by more than a threshold are due, the more so the more it has changed for
// their area. What has changed less is kept, and adds up.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> lights: array<SurfaceLight>;
@group(0) @binding(2) var<storage, read> surface_changes: array<u32>;
@group(0) @binding(3) var<storage, read> surface_areas: array<f32>;
@group(0) @binding(4) var<storage, read_write> changes: array<vec2u>;
@group(0) @binding(5) var<storage, read> gathered: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> due: array<u32>;

// Priorities count change in such parts.
const DUE_STEPS: f32 = 1024.0;

@compute @workgroup_size(64)
fn mark_due(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= params.texel_count {
        return;
    }
    // What was never gathered is due; and what waits gains on what changes again.
    var own = max(due[id.x], select(0u, 1u, gathered[id.x].a == 0.0));
    own += select(0u, 1u + own / 16u, due[id.x] > 0u);
    let surface = lights[id.x].surface;
    let change = params.change_scale * f32(surface_changes[surface]) / max(surface_areas[surface], 0x1p-60);
    if surface_changes[surface] > 0u && change >= params.threshold {
        own = max(own, 1u + u32(min(DUE_STEPS * change, 0x1p28)));
        changes[id.x] = vec2u(0u);
    }
    due[id.x] = min(own, 1u << 30u);
}
