// What the eye sees, read by pixel of the part in use. Twin of `GBuffer`.

struct View {
    view_projection: mat4x4f,
    inverse_view_projection: mat4x4f,
    // w = 1: eye position; w = 0: view direction
    eye: vec4f,
    size: vec2u,
    origin: vec2u,
    normal_encoding: u32,
}

// Unit-frame position of a pixel's centre at this depth.
fn g_buffer_position(view: View, pixel: vec2f, depth: f32) -> vec3f {
    let uv = (pixel + 0.5) / vec2f(view.size);
    let p = view.inverse_view_projection * vec4f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, depth, 1.0);
    return p.xyz / p.w;
}

// Unit normal from a host's texel.
fn g_buffer_normal(view: View, texel: vec4f) -> vec3f {
    let half_offset = (view.normal_encoding & 1u) == 1u;
    let v = select(texel.xyz, 2.0 * texel.xyz - 1.0, half_offset);
    if view.normal_encoding >= 2u {
        return octahedral_decode(v.xy);
    }
    let length_squared = dot(v, v);
    return select(vec3f(0.0, 1.0, 0.0), v * inverseSqrt(length_squared), length_squared > 0.0);
}
