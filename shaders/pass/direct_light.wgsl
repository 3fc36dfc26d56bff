// Direct irradiance: sum over lights of I cos / r^2, or of Lambert's formula for flat ones, where the shadow map agrees, or times how much of the light is seen.

struct Params {
    light_count: u32,
    shadow_map_size: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var base_color_texture: texture_2d<f32>;
@group(0) @binding(5) var<storage, read> lights: array<Light>;
@group(0) @binding(6) var shadow_maps: texture_2d_array<u32>;
@group(0) @binding(7) var irradiance: texture_storage_2d<rgba32float, write>;
@group(0) @binding(8) var<storage, read> polygons: array<Polygon>;
@group(1) @binding(0) var visibility: texture_2d_array<f32>;

struct Surface {
    is_seen: bool,
    position: vec3f,
    normal: vec3f,
}

fn surface_at(id: vec2u) -> Surface {
    let pixel = id + view.origin;
    let is_seen = textureLoad(base_color_texture, pixel, 0).a > 0.0;
    let p = g_buffer_position(view, vec2f(id), textureLoad(depth_texture, pixel, 0).r);
    return Surface(is_seen, p, g_buffer_normal(view, textureLoad(normal_texture, pixel, 0)));
}

// Tests the shadow maps itself.
@compute @workgroup_size(8, 8)
fn light_pixels(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= view.size) {
        return;
    }
    let surface = surface_at(id.xy);
    if !surface.is_seen {
        textureStore(irradiance, id.xy, vec4f(0.0));
        return;
    }
    let sum = direct_irradiance(surface.position, surface.normal, params.light_count, params.shadow_map_size);
    textureStore(irradiance, id.xy, vec4f(sum, 1.0));
}

// Takes what was found beforehand, one layer a light and a spare one; tests lights that have none.
@compute @workgroup_size(8, 8)
fn light_pixels_by_visibility(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= view.size) {
        return;
    }
    let surface = surface_at(id.xy);
    if !surface.is_seen {
        textureStore(irradiance, id.xy, vec4f(0.0));
        return;
    }
    let layers = textureNumLayers(visibility) - 1u;
    var sum = vec3f(0.0);
    for (var i = 0u; i < params.light_count; i++) {
        let e = light_irradiance(lights[i], surface.position, surface.normal);
        if !any(e > vec3f(0.0)) {
            continue;
        }
        if i < layers {
            sum += e * textureLoad(visibility, id.xy, i, 0).r;
        } else if is_lit(lights[i], surface.position, surface.normal, params.shadow_map_size) {
            sum += e;
        }
    }
    textureStore(irradiance, id.xy, vec4f(sum, 1.0));
}
