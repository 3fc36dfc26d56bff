// What is shown goes towards what was gathered last (Larsen 2004, section 11.1: no popping): one invocation a texel.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> gathered: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> shown: array<vec4f>;

@compute @workgroup_size(64)
fn blend_texels(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= params.texel_count {
        return;
    }
    // Where nothing was before, all of it at once.
    let is_first = shown[id.x].a == 0.0;
    shown[id.x] = mix(shown[id.x], gathered[id.x], select(params.blend, 1.0, is_first));
}
