// The finest level of the hierarchy: between which inverse depths the surface of each texel lies.
//
// Depth is measured along the face's axis; its inverse is linear over the face wherever the surface is a plane. A texel
// stands for its plane (stored distance and normal) over the texel's square. Where planes are grazed they would reach
// anywhere, so a texel's range is kept within what it and its eight neighbours show, and a little more.

@group(0) @binding(0) var env_maps: texture_2d_array<u32>;
@group(0) @binding(1) var ranges: texture_storage_2d_array<r32uint, write>;
@group(0) @binding(2) var<storage, read> maps: array<u32>;

// A texel's plane may leave the range of its neighbours by this share.
const BEYOND: f32 = 0.02;
// Neighbours show the same surface if they lie this near to the texel's plane, as a share of inverse depth.
const AGREEMENT: f32 = 0.01;
// Cosine of the angle, 10 degrees, within which they face the same way.
const ALIKE: f32 = 0.985;
// Least depth, unit frame.
const NEAREST: f32 = 0x1p-14;

struct Neighbour {
    // As the face sees it, in [-1, 1]^2
    place: vec2f,
    // Inverse depth; 0: there is no surface
    w: f32,
    normal: vec3f,
}

// A texel of a face, or one beyond its border, which another face shows.
fn neighbour(map: u32, face: u32, at: vec2i, size: u32) -> Neighbour {
    let middle = 2.0 * (vec2f(at) + 0.5) / f32(size) - 1.0;
    if all(at >= vec2i(0)) && all(at < vec2i(i32(size))) {
        let bits = env_map_load(map, face, vec2u(at));
        let distance = bitcast<f32>(bits.x);
        let w = select(0.0, length(vec3f(middle, 1.0)) / distance, distance > 0.0);
        return Neighbour(middle, w, octahedral_unpack(bits.y));
    }
    let point = cube_face_point(cube_face_direction(face, 0.5 + 0.5 * middle));
    let texel = cube_face_texel(point.uv, size);
    let bits = env_map_load(map, point.face, texel);
    let distance = bitcast<f32>(bits.x);
    if distance <= 0.0 {
        return Neighbour(middle, 0.0, vec3f(0.0));
    }
    let direction = normalize(cube_face_direction(point.face, (vec2f(texel) + 0.5) / f32(size)));
    let p = env_map_face_frame(face, direction * distance);
    // At or behind the plane of the face's centre it is beside the face, as near as one likes.
    let w = 1.0 / max(p.z, NEAREST);
    return Neighbour(p.xy * w, w, octahedral_unpack(bits.y));
}

@compute @workgroup_size(8, 8)
fn measure_texels(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(env_maps).x;
    if any(id.xy >= vec2u(size)) {
        return;
    }
    let map = maps[id.z / 6u];
    let face = id.z % 6u;
    let layer = 6u * map + face;
    let surface = surface_texel_unpack(env_map_load(map, face, id.xy));
    if surface.distance <= 0.0 {
        textureStore(ranges, id.xy, layer, vec4u(0u));
        return;
    }
    let middle = 2.0 * (vec2f(id.xy) + 0.5) / f32(size) - 1.0;
    let plane = env_map_plane(surface, face, middle);
    let own = dot(plane, vec3f(middle, 1.0));
    var seen = DepthRange(own, own);
    // Bit by quadrant, then one for normals; a neighbour that disagrees clears those it belongs to.
    var agreeing = 31u;
    for (var i = 0; i < 9; i++) {
        let offset = vec2i(i % 3 - 1, i / 3 - 1);
        let n = neighbour(map, face, vec2i(id.xy) + offset, size);
        seen = DepthRange(min(seen.least, n.w), max(seen.greatest, n.w));
        if n.w <= 0.0 || dot(n.normal, surface.normal) < ALIKE {
            agreeing &= 15u;
        }
        if n.w <= 0.0 || abs(dot(plane, vec3f(n.place, 1.0)) - n.w) > AGREEMENT * n.w {
            let left = offset.x <= 0;
            let right = offset.x >= 0;
            let above = offset.y <= 0;
            let below = offset.y >= 0;
            let quadrants = vec4<bool>(left && above, right && above, left && below, right && below);
            agreeing &= ~dot(select(vec4u(0u), vec4u(1u, 2u, 4u, 8u), quadrants), vec4u(1u));
        }
    }
    let half_texel = 1.0 / f32(size);
    let tilt = half_texel * (abs(plane.x) + abs(plane.y));
    let limits = vec2f(seen.least * (1.0 - BEYOND), seen.greatest * (1.0 + BEYOND));
    let range = DepthRange(max(own - tilt, limits.x), min(own + tilt, limits.y));
    textureStore(ranges, id.xy, layer, vec4u(depth_range_pack(range, agreeing)));
}
