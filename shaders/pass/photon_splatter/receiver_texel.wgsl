// A receiver as one texel: the bits of its depth, its geometric normal, octahedral, and the number of its surface. The module
// brings `view`.

fn receiver_pack(receiver: Receiver, depth: f32) -> vec4u {
    return vec4u(bitcast<u32>(depth), octahedral_pack(receiver.normal), receiver.surface, u32(receiver.is_seen));
}

// `pixel` of the G-buffer that the texel was made at.
fn receiver_unpack(texel: vec4u, pixel: vec2u) -> Receiver {
    if texel.w == 0u {
        return receiver_nowhere();
    }
    let position = g_buffer_position(view, vec2f(pixel), bitcast<f32>(texel.x));
    return Receiver(position, octahedral_unpack(texel.y), texel.z, true);
}
