// Cube faces addressed by hand. Twin of `resource::cube_face`: face order +X -X +Y -Y +Z -Z, each a right-handed camera;
// u runs right, v runs down, both in [0, 1].

fn cube_face_forward(face: u32) -> vec3f {
    let s = select(1.0, -1.0, (face & 1u) == 1u);
    return select(select(vec3f(s, 0.0, 0.0), vec3f(0.0, s, 0.0), face >= 2u), vec3f(0.0, 0.0, s), face >= 4u);
}

fn cube_face_up(face: u32) -> vec3f {
    return select(vec3f(0.0, 1.0, 0.0), vec3f(0.0, 0.0, 1.0), face == 2u || face == 3u);
}

fn cube_face_right(face: u32) -> vec3f {
    return cross(cube_face_forward(face), cube_face_up(face));
}

// The face that a direction of any length above zero points through.
fn cube_face_of(d: vec3f) -> u32 {
    let a = abs(d);
    if a.x >= a.y && a.x >= a.z {
        return select(0u, 1u, d.x < 0.0);
    }
    if a.y >= a.z {
        return select(2u, 3u, d.y < 0.0);
    }
    return select(4u, 5u, d.z < 0.0);
}

fn cube_face_uv(face: u32, d: vec3f) -> vec2f {
    let scaled = d / dot(d, cube_face_forward(face));
    return vec2f(0.5 + 0.5 * dot(scaled, cube_face_right(face)), 0.5 - 0.5 * dot(scaled, cube_face_up(face)));
}

// Direction of length at least 1 through a point of a face.
fn cube_face_direction(face: u32, uv: vec2f) -> vec3f {
    return cube_face_forward(face) + (2.0 * uv.x - 1.0) * cube_face_right(face) + (1.0 - 2.0 * uv.y) * cube_face_up(face);
}

fn cube_face_texel(uv: vec2f, size: u32) -> vec2u {
    return min(vec2u(max(uv, vec2f(0.0)) * f32(size)), vec2u(size - 1u));
}
