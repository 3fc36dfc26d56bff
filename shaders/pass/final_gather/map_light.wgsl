// The light on a point of a surface, from environment maps whose texels are lit. The module brings `env_maps`, `centers` and
// `map_light`, the irradiance of their texels.

// A map shows a point if it lies no further off the plane of the texel there than this, unit frame, plus a texel's width.
const MAP_LIGHT_OFF_PLANE: f32 = 0x1p-8;
const MAP_LIGHT_AGREEMENT: f32 = 0.7;

// Whether the surface that a texel shows is the one that a point lies on, p from the map's centre.
fn map_light_shows(texel: EnvMapTexel, p: vec3f, n: vec3f, map_size: u32) -> bool {
    let offset = p - texel.direction * texel.surface.distance;
    let allowed = MAP_LIGHT_OFF_PLANE + 2.0 * length(p) / f32(map_size);
    let is_near = abs(dot(texel.surface.normal, offset)) <= allowed;
    return texel.surface.distance > 0.0 && is_near && dot(texel.surface.normal, n) >= MAP_LIGHT_AGREEMENT;
}

// Whether what a texel shows lies next to a point, on whatever surface.
fn map_light_is_beside(texel: EnvMapTexel, p: vec3f, map_size: u32) -> bool {
    let offset = p - texel.direction * texel.surface.distance;
    return length(offset) <= MAP_LIGHT_OFF_PLANE + 4.0 * length(p) / f32(map_size);
}

// The map that shows a point in most detail. In the tip of a corner, where a texel may show one wall where the point is on
// another, none may: then one that shows what is beside it. The number of maps if there is none.
fn map_light_map(p: vec3f, n: vec3f, map_count: u32, map_size: u32) -> u32 {
    var best = map_count;
    var least = 1e30;
    var is_shown = false;
    for (var map = 0u; map < map_count; map++) {
        let d = p - centers[map].xyz;
        let distance_squared = dot(d, d);
        let cosine = -dot(d, n) * inverseSqrt(max(distance_squared, 1e-20));
        if !(centers[map].w > 0.0 && cosine > 0.0) {
            continue;
        }
        // Area of the surface that a texel shows.
        let area = distance_squared / max(cosine, 0.02);
        let texel = env_map_texel(map, d, map_size);
        let shows = map_light_shows(texel, d, n, map_size);
        if !shows && !map_light_is_beside(texel, d, map_size) {
            continue;
        }
        if (shows && !is_shown) || (shows == is_shown && area < least) {
            best = map;
            least = area;
            is_shown = shows;
        }
    }
    return best;
}

// Irradiance at a point of a surface, unit frame; 0 where no map shows it. Of the four texels of light around it those on the
// same surface count.
fn map_light_at(p: vec3f, n: vec3f, map_count: u32, map_size: u32) -> vec3f {
    let map = map_light_map(p, n, map_count, map_size);
    if map == map_count {
        return vec3f(0.0);
    }
    let d = p - centers[map].xyz;
    let size = textureDimensions(map_light).x;
    let point = cube_face_point(d);
    let place = point.uv * f32(size) - 0.5;
    let low = floor(place);
    let part = place - low;
    let last = vec2i(i32(size) - 1);
    var sum = vec4f(0.0);
    for (var i = 0; i < 4; i++) {
        let right_or_below = vec2<bool>((i & 1) == 1, (i & 2) == 2);
        let at = clamp(vec2i(low) + select(vec2i(0), vec2i(1), right_or_below), vec2i(0), last);
        let share = select(1.0 - part, part, right_or_below);
        let lit = cube_face_direction(point.face, (vec2f(at) + 0.5) / f32(size));
        if map_light_shows(env_map_texel(map, lit, map_size), d, n, map_size) {
            sum += share.x * share.y * textureLoad(map_light, at, 6u * map + point.face, 0);
        }
    }
    return sum.rgb / max(sum.a, 1e-20);
}
