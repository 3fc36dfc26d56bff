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

struct CubePoint {
    face: u32,
    uv: vec2f,
}

// Where a direction of any length above zero leaves the cube.
fn cube_face_point(d: vec3f) -> CubePoint {
    let a = abs(d);
    var face: u32;
    var st: vec2f;
    var major: f32;
    if a.x >= a.y && a.x >= a.z {
        face = select(0u, 1u, d.x < 0.0);
        st = vec2f(select(d.z, -d.z, d.x < 0.0), d.y);
        major = a.x;
    } else if a.y >= a.z {
        face = select(2u, 3u, d.y < 0.0);
        st = vec2f(select(d.x, -d.x, d.y < 0.0), d.z);
        major = a.y;
    } else {
        face = select(4u, 5u, d.z < 0.0);
        st = vec2f(select(-d.x, d.x, d.z < 0.0), d.y);
        major = a.z;
    }
    return CubePoint(face, vec2f(0.5, 0.5) + vec2f(0.5, -0.5) * st / major);
}

// The same point as seen through a given face; meaningful in front of it.
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
