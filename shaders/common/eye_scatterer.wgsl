// How the surface that a pixel shows scatters light towards the eye. The module brings `view` and the G-buffer's textures.

// Cosine below which an interpolated normal is not trusted.
const EYE_GRAZING: f32 = 0.01;

fn eye_outgoing(p: vec3f) -> vec3f {
    if view.eye.w > 0.0 {
        return normalize(view.eye.xyz - p);
    }
    return -view.eye.xyz;
}

// `bits`: the lobe, and HIT_BACK.
fn eye_scatterer(receiver: Receiver, at: vec2u, bits: u32, outgoing: vec3f) -> Scatterer {
    // An interpolated normal may turn away from the eye where the surface does not.
    let shading = g_buffer_normal(view, textureLoad(normal_texture, at, 0));
    let normal = select(receiver.normal, shading, dot(shading, outgoing) > EYE_GRAZING);
    let color = textureLoad(base_color_texture, at, 0).rgb;
    return scatter_by_lobe(bits & LOBE_BITS, normal, (bits & HIT_BACK) == 0u, color);
}
