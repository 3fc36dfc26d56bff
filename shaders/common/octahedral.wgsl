// Unit vectors as points of the unit square (Meyer et al. 2010), 16 bits a coordinate.

fn octahedral_sign(v: vec2f) -> vec2f {
    return select(vec2f(-1.0), vec2f(1.0), v >= vec2f(0.0));
}

// Unit vector to [-1, 1]^2.
fn octahedral_encode(n: vec3f) -> vec2f {
    let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    return select((1.0 - abs(p.yx)) * octahedral_sign(p), p, n.z >= 0.0);
}

// [-1, 1]^2 to unit vector.
fn octahedral_decode(e: vec2f) -> vec3f {
    let z = 1.0 - abs(e.x) - abs(e.y);
    let xy = select((1.0 - abs(e.yx)) * octahedral_sign(e), e, z >= 0.0);
    return normalize(vec3f(xy, z));
}

fn octahedral_pack(n: vec3f) -> u32 {
    return pack2x16snorm(octahedral_encode(n));
}

fn octahedral_unpack(bits: u32) -> vec3f {
    return octahedral_decode(unpack2x16snorm(bits));
}
