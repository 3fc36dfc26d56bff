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

fn env_map_load(map: u32, face: u32, at: vec2u) -> vec4u {
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
