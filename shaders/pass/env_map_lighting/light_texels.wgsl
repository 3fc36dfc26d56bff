// Irradiance at the surface points that texels of environment maps show: what lights give directly, and the photons around.

struct Params {
    map_size: u32,
    // Texels of the irradiance along a face
    size: u32,
    light_count: u32,
    shadow_map_size: u32,
    // 1: kernels count by the part of them that lies on the surface
    is_corrected: u32,
    sample_offset: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var env_maps: texture_2d_array<u32>;
// w: 1 where the map is in use
@group(0) @binding(2) var<storage, read> centers: array<vec4f>;
@group(0) @binding(3) var<storage, read> splats: array<Splat>;
@group(0) @binding(4) var<storage, read> first_splats: array<u32>;
@group(0) @binding(5) var<storage, read> lights: array<Light>;
@group(0) @binding(6) var shadow_maps: texture_2d_array<u32>;
@group(0) @binding(7) var irradiance: texture_storage_2d_array<rgba32float, write>;
@group(0) @binding(8) var<storage, read> polygons: array<Polygon>;
@group(0) @binding(9) var<uniform> grid: GridParams;

// Random dimension of the turn of the points that look for rims: none that the walk uses.
const LIGHTING_DIMENSION: u32 = 4097u;

// The map whose texel this invocation lights.
var<private> own_map: u32;

fn boundary_goes_on(receiver: Receiver, y: vec3f, slab: f32) -> bool {
    let center = centers[own_map].xyz;
    let texel = env_map_texel(own_map, y - center, params.map_size);
    if texel.surface.distance <= 0.0 {
        return false;
    }
    let seen = texel.direction * texel.surface.distance;
    let surface = surface_texel_surface(texel.surface);
    return boundary_says_on(receiver, y, BoundarySight(center + seen, texel.surface.normal, surface, seen), slab);
}

fn indirect_light(receiver: Receiver) -> vec3f {
    let g = grid_light(receiver);
    let sum = vec3f(g.red, g.green, g.blue);
    let light = sum.x + sum.y + sum.z;
    if params.is_corrected == 0u || !(light > 0.0) {
        return sum;
    }
    let start = 6.283185307 * random_unit(params.sample_offset, LIGHTING_DIMENSION);
    return sum / boundary_share(receiver, g.radius / light, start);
}

@compute @workgroup_size(8, 8)
fn light_texels(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= vec2u(params.size)) {
        return;
    }
    own_map = id.z / 6u;
    let uv = (vec2f(id.xy) + 0.5) / f32(params.size);
    let texel = env_map_texel(own_map, cube_face_direction(id.z % 6u, uv), params.map_size);
    if centers[own_map].w <= 0.0 || texel.surface.distance <= 0.0 {
        textureStore(irradiance, id.xy, id.z, vec4f(0.0));
        return;
    }
    let p = centers[own_map].xyz + texel.direction * texel.surface.distance;
    let n = texel.surface.normal;
    let indirect = indirect_light(Receiver(p, n, surface_texel_surface(texel.surface), true));
    textureStore(irradiance, id.xy, id.z, vec4f(direct_irradiance(p, n, params.light_count, params.shadow_map_size) + indirect, 1.0));
}
