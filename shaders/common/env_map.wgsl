// Look-ups in environment maps. The file that uses it binds `env_maps` (texture_2d_array<u32>).

// A texel and the ray from the map's centre through its middle.
struct EnvMapTexel {
    surface: SurfaceTexel,
    // Unit
    direction: vec3f,
    face: u32,
    // Position of the middle, in texels of the face
    middle: vec2f,
}

// Texels fetched so far by this invocation.
var<private> env_map_fetches: u32;

fn env_map_load(map: u32, face: u32, at: vec2u) -> vec4u {
    env_map_fetches++;
    return textureLoad(env_maps, at, 6u * map + face, 0);
}

// Distance stored in direction d (any length above zero); 0: nothing there.
fn env_map_distance(map: u32, d: vec3f, size: u32) -> f32 {
    let point = cube_face_point(d);
    return bitcast<f32>(env_map_load(map, point.face, cube_face_texel(point.uv, size)).x);
}

fn env_map_texel(map: u32, d: vec3f, size: u32) -> EnvMapTexel {
    let point = cube_face_point(d);
    let at = cube_face_texel(point.uv, size);
    let middle = vec2f(at) + 0.5;
    let direction = normalize(cube_face_direction(point.face, middle / f32(size)));
    return EnvMapTexel(surface_texel_unpack(env_map_load(map, point.face, at)), direction, point.face, middle);
}

// A vector in the frame of a face: right, down, forward. x / z and y / z run from -1 to 1 over the face, as texels do.
fn env_map_face_frame(face: u32, v: vec3f) -> vec3f {
    return vec3f(dot(v, cube_face_right(face)), -dot(v, cube_face_up(face)), dot(v, cube_face_forward(face)));
}

// Inverse depth of a texel's plane over its face, (x, y) in [-1, 1]^2: dot(result, vec3f(x, y, 1)). n . p = n . s over
// z (n . s), with s the stored point. Seen at less than this cosine it counts as facing the map: depth would be anything.
const ENV_MAP_LEAST_COSINE: f32 = 0.002;

fn env_map_plane(surface: SurfaceTexel, face: u32, middle: vec2f) -> vec3f {
    let toward = vec3f(middle, 1.0);
    let s = normalize(toward) * surface.distance;
    let n = env_map_face_frame(face, surface.normal);
    let height = dot(n, s);
    if height > -ENV_MAP_LEAST_COSINE * surface.distance {
        return vec3f(0.0, 0.0, 1.0 / s.z);
    }
    return n / height;
}
