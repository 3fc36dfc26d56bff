// RGB in [0, 1] as 11, 11 and 10 bits: eight would be 2 % off at the reflectance of a dark wall.

fn reflectance_pack(rgb: vec3f) -> u32 {
    let q = vec3u(round(clamp(rgb, vec3f(0.0), vec3f(1.0)) * vec3f(2047.0, 2047.0, 1023.0)));
    return q.x | (q.y << 11u) | (q.z << 22u);
}

fn reflectance_unpack(bits: u32) -> vec3f {
    return vec3f(vec3u(bits & 2047u, (bits >> 11u) & 2047u, bits >> 22u)) / vec3f(2047.0, 2047.0, 1023.0);
}
