// A point that irradiance is estimated at, as one texel: the bits of its position in the unit frame, and its geometric
// normal, octahedral.

struct Receiver {
    position: vec3f,
    normal: vec3f,
    is_seen: bool,
}

// No normal packs to this.
const RECEIVER_NOWHERE: u32 = 0x80008000u;

fn receiver_pack(receiver: Receiver) -> vec4u {
    let normal = select(RECEIVER_NOWHERE, octahedral_pack(receiver.normal), receiver.is_seen);
    return vec4u(bitcast<vec3u>(receiver.position), normal);
}

fn receiver_unpack(texel: vec4u) -> Receiver {
    return Receiver(bitcast<vec3f>(texel.xyz), octahedral_unpack(texel.w), texel.w != RECEIVER_NOWHERE);
}
