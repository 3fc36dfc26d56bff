// Penumbrae gathered, indirect light interpolated, direct light and the sum: all that follows the hard shadow tests, of each pixel
// at once.

struct Counts {
    lights: u32,
    // Lights that something was found of beforehand; those beyond are tested here
    layers: u32,
    shadow_map_size: u32,
}

@group(0) @binding(0) var<uniform> parts: Parts;
@group(0) @binding(1) var<uniform> interpolation: Interpolation;
@group(0) @binding(2) var<uniform> counts: Counts;
@group(0) @binding(3) var<uniform> view: View;
@group(0) @binding(4) var depth_texture: texture_2d<f32>;
@group(0) @binding(5) var normal_texture: texture_2d<f32>;
@group(0) @binding(6) var base_color_texture: texture_2d<f32>;
@group(0) @binding(7) var emission_texture: texture_2d<f32>;
@group(0) @binding(8) var surface_texture: texture_2d<u32>;
// Indirect irradiance at a part of the pixels, or at all of them
@group(0) @binding(9) var coarse: texture_2d<f32>;
@group(0) @binding(10) var caustic_irradiance: texture_2d<f32>;
@group(0) @binding(11) var specular_radiance: texture_2d<f32>;
@group(0) @binding(12) var<uniform> environment: Environment;
@group(0) @binding(13) var environment_image: texture_2d<f32>;
@group(0) @binding(14) var<storage, read> lights: array<Light>;
@group(0) @binding(15) var<storage, read> polygons: array<Polygon>;
@group(0) @binding(16) var shadow_maps: texture_2d_array<u32>;
// Of each light visibility, or the distance to an occluder or a mark
@group(0) @binding(17) var visibility: texture_2d_array<f32>;
@group(0) @binding(18) var<storage, read> shadows: array<Params>;
@group(0) @binding(19) var<storage, read> nearest: array<f32>;
@group(0) @binding(20) var<storage, read> flags: array<u32>;

// Whether anything was found of lights beforehand.
override HAS_PENUMBRAE: bool;

// Of the light in hand.
var<private> params: Params;

fn occlusion_at(pixel: vec2u) -> f32 {
    return textureLoad(visibility, pixel, params.light, 0).r;
}

fn source_at(pixel: vec2u) -> f32 {
    return occlusion_visibility(occlusion_at(pixel));
}

fn searched_radius(light: Light, receiver: Receiver, id: vec2u) -> f32 {
    return penumbra_radius(light, receiver, occlusion_at(id), id);
}

// How much of the light of a layer is seen.
fn visibility_of(index: u32, at: vec2u) -> f32 {
    params = shadows[index];
    if params.gathered != GATHERED_LATER {
        return textureLoad(visibility, at, index, 0).r;
    }
    let own = source_at(at);
    let may_hold_penumbra = (flags[tile_flag_word(at / 8u, index)] & tile_flag(index)) != 0u;
    if own == NO_RECEIVER || !may_hold_penumbra {
        return max(own, 0.0);
    }
    return clamp(gathered(lights[index], at, own), 0.0, 1.0);
}

fn direct_at(at: vec2u) -> vec3f {
    let p = receiver_position(at);
    let n = g_buffer_normal(view, textureLoad(normal_texture, at + view.origin, 0));
    var sum = vec3f(0.0);
    for (var i = 0u; i < counts.lights; i++) {
        let e = light_irradiance(lights[i], p, n);
        if !any(e > vec3f(0.0)) {
            continue;
        }
        if HAS_PENUMBRAE && i < counts.layers {
            sum += e * visibility_of(i, at);
        } else if is_lit(lights[i], p, n, counts.shadow_map_size) {
            sum += e;
        }
    }
    return sum;
}

fn indirect_at(at: vec2u) -> vec3f {
    if interpolation.factor == 1u {
        return textureLoad(coarse, at, 0).rgb;
    }
    return estimate_at(at).irradiance;
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let at = vec2u(position.xy);
    let base_color = textureLoad(base_color_texture, at + view.origin, 0);
    if base_color.a <= 0.0 {
        return background_radiance(at);
    }
    return surface_radiance(at, base_color.rgb, direct_at(at), indirect_at(at));
}
