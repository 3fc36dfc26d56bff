// Radiance of rough metal from the photons around what a pixel shows, each by the BRDF (Jensen 1996): one invocation a pixel.
//   L(x, o) = sum over photons of f(o, i_p) * flux * K(|x - x_p| / h) / h^2, and light of single directions.

struct Params {
    light_count: u32,
    shadow_map_size: u32,
    // Factors of light that comes straight from a source, and of all other light
    direct_weight: f32,
    indirect_weight: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var base_color_texture: texture_2d<f32>;
@group(0) @binding(5) var surface_texture: texture_2d<u32>;
@group(0) @binding(6) var<uniform> grid: GridParams;
// The normal is the direction that light came along
@group(0) @binding(7) var<storage, read> splats: array<Splat>;
@group(0) @binding(8) var<storage, read> first_splats: array<u32>;
@group(0) @binding(9) var<storage, read> lights: array<Light>;
@group(0) @binding(10) var<storage, read> polygons: array<Polygon>;
@group(0) @binding(11) var shadow_maps: texture_2d_array<u32>;
@group(0) @binding(12) var radiance: texture_storage_2d<rgba32float, write>;

alias Receivers = f32;

// Cosine below which a BRDF is that of this one: its irradiance is next to none.
const GLOSSY_GRAZING: f32 = 1e-3;

// What a photon gives.
fn glossy_photon(splat: Splat, scatterer: Scatterer, p: vec3f, n: vec3f, outgoing: vec3f) -> vec3f {
    let inverse = bitcast<f32>(splat.inverse_radius_squared & ~SPLAT_STRAIGHT);
    let offset = p - splat.position;
    let q = dot(offset, offset) * inverse;
    if q >= 1.0 || abs(dot(offset, n)) > splat_slab(inverseSqrt(inverse)) {
        return vec3f(0.0);
    }
    let incoming = -octahedral_unpack(splat.normal);
    let cosine = dot(scatterer.frame[2], incoming);
    if cosine <= 0.0 {
        return vec3f(0.0);
    }
    let is_straight = (splat.inverse_radius_squared & SPLAT_STRAIGHT) != 0u;
    let weight = select(params.indirect_weight, params.direct_weight, is_straight);
    let brdf = scatter_evaluate(scatterer, outgoing, incoming).rgb / max(cosine, GLOSSY_GRAZING);
    return weight * splat_kernel(q) * brdf * splat.strength;
}

fn glossy_photons(scatterer: Scatterer, p: vec3f, n: vec3f, outgoing: vec3f) -> vec3f {
    var sum = vec3f(0.0);
    let cell = grid_cell(p);
    let first = max(cell - 1, vec3i(0));
    let last = min(cell + 1, vec3i(i32(grid.cells) - 1));
    for (var z = first.z; z <= last.z; z++) {
        for (var y = first.y; y <= last.y; y++) {
            // Those of a row of cells lie one behind the other.
            let start = first_splats[grid_index(vec3i(first.x, y, z))];
            let end = first_splats[grid_index(vec3i(last.x, y, z)) + 1u];
            // Four a turn: adapters may end a shader's loops after 65 535 turns.
            for (var i = start; i < end; i += 4u) {
                for (var k = 0u; k < min(4u, end - i); k++) {
                    sum += glossy_photon(splats[i + k], scatterer, p, n, outgoing);
                }
            }
        }
    }
    return sum;
}

@compute @workgroup_size(8, 8)
fn light_pixels(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= view.size) {
        return;
    }
    let at = id.xy + view.origin;
    let bits = textureLoad(surface_texture, at, 0).r >> 16u;
    if !lobe_is_glossy(bits & LOBE_BITS) {
        return;
    }
    let receiver = receiver_at(id.xy);
    if !receiver.is_seen {
        return;
    }
    let p = receiver.position;
    let outgoing = eye_outgoing(p);
    let scatterer = eye_scatterer(receiver, at, bits, outgoing);
    let punctual = punctual_light(scatterer, p, outgoing, params.light_count, params.shadow_map_size, true);
    let sum = params.direct_weight * punctual + glossy_photons(scatterer, p, receiver.normal, outgoing);
    textureStore(radiance, id.xy, vec4f(sum, 1.0));
}
