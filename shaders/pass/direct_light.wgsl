// Direct irradiance with hard shadows: sum over lights of I cos / r^2, where the shadow map agrees.

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

// A receiver may lie behind its texel's plane by this share of a texel's width before it counts as shadowed: the map's
// 16-bit normals and curved surfaces within a texel.
const BIAS_TEXELS: f32 = 0.75;
// And by this much in any case, unit frame: depth and distance are 24-bit numbers near 1.
const BIAS: f32 = 0x1p-14;

// Whether light reaches the point p of a surface with normal n, which faces the light.
fn is_lit(light: Light, p: vec3f, n: vec3f) -> bool {
    let ray = light_ray_to(light, p);
    if any(ray.uv < vec2f(0.0)) || any(ray.uv > vec2f(1.0)) {
        return true;
    }
    let size = params.shadow_map_size;
    let at = cube_face_texel(ray.uv, size);
    let texel = surface_texel_unpack(textureLoad(shadow_maps, at, ray.layer, 0));
    if texel.distance <= 0.0 {
        return true;
    }
    let distance = dot(p - ray.origin, ray.direction);
    let texel_ray = light_texel_ray(light, ray, at, size);
    let spread = select(distance, 1.0, light.kind == LIGHT_DIRECTIONAL);
    let texel_width = 2.0 * light.half_extent / f32(size) * spread;
    if distance <= light_texel_distance(ray, texel_ray, texel) + BIAS + BIAS_TEXELS * texel_width {
        return true;
    }
    // All of the way to the light lies before the receiver's own plane, so nothing behind that plane is in the way: just
    // past a convex edge the texel's middle may see the edge's other side.
    let seen = texel_ray.origin + texel.distance * texel_ray.direction;
    return dot(seen - p, n) <= 0.0;
}

// Irradiance that an unoccluded light gives a surface element.
fn unoccluded(light: Light, p: vec3f, n: vec3f) -> vec3f {
    if light.kind == LIGHT_DIRECTIONAL {
        return light.intensity * max(0.0, -dot(n, light.direction));
    }
    let to_light = light.position - p;
    let distance_squared = max(dot(to_light, to_light), 0x1p-60);
    let l = to_light * inverseSqrt(distance_squared);
    var falloff = 1.0;
    if light.kind == LIGHT_SPOT {
        falloff = sampling_spot_falloff(sampling_one_minus_cos(-l, light.direction), light.inner, light.outer);
    }
    return light.intensity * (falloff * max(0.0, dot(n, l)) / distance_squared);
}

@compute @workgroup_size(8, 8)
fn light_pixels(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= view.size) {
        return;
    }
    let pixel = id.xy + view.origin;
    if textureLoad(base_color_texture, pixel, 0).a <= 0.0 {
        textureStore(irradiance, id.xy, vec4f(0.0));
        return;
    }
    let p = g_buffer_position(view, vec2f(id.xy), textureLoad(depth_texture, pixel, 0).r);
    let n = g_buffer_normal(view, textureLoad(normal_texture, pixel, 0));
    var sum = vec3f(0.0);
    for (var i = 0u; i < params.light_count; i++) {
        let e = unoccluded(lights[i], p, n);
        if any(e > vec3f(0.0)) && is_lit(lights[i], p, n) {
            sum += e;
        }
    }
    textureStore(irradiance, id.xy, vec4f(sum, 1.0));
}
