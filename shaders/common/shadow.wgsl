// The hard shadow test against one texel of a shadow map, and how wide a penumbra is. What is fetched is handed in.

// A receiver may lie behind its texel's plane by this share of a texel's width before it counts as shadowed: the map's
// 16-bit normals and curved surfaces within a texel.
const SHADOW_BIAS_TEXELS: f32 = 0.75;
// And by this much in any case, unit frame: depth and distance are 24-bit numbers near 1.
const SHADOW_BIAS: f32 = 0x1p-14;
// No occluder counts as nearer to the lamp than this, unit frame: the near plane of the views that fill shadow maps.
const SHADOW_NEAREST: f32 = 0x1p-24;

// Where a receiver lies in a light's shadow map.
struct ShadowProbe {
    ray: LightRay,
    // Of the receiver, along the ray
    distance: f32,
    texel: vec2u,
    // False: no texel looks there, or light does not come that way; nothing is in the way
    is_inside: bool,
}

fn shadow_probe(light: Light, p: vec3f, map_size: u32) -> ShadowProbe {
    let ray = light_ray_to(light, p);
    var is_inside = all(ray.uv >= vec2f(0.0)) && all(ray.uv <= vec2f(1.0));
    // Behind a flat lamp there is no light that anything could be in the way of, but the lamp itself is seen.
    let is_before = light.kind != LIGHT_AREA || light.inner == 0.0 || dot(ray.direction, light.direction) > 0.0;
    is_inside = is_inside && is_before;
    return ShadowProbe(ray, dot(p - ray.origin, ray.direction), cube_face_texel(ray.uv, map_size), is_inside);
}

// Whether light reaches the point p of a surface with normal n, which faces the light, past what its texel holds.
fn shadow_is_lit(light: Light, probe: ShadowProbe, texel: SurfaceTexel, p: vec3f, n: vec3f, map_size: u32) -> bool {
    if texel.distance <= 0.0 {
        return true;
    }
    let texel_ray = light_texel_ray(light, probe.ray, probe.texel, map_size);
    let spread = select(probe.distance, 1.0, light.kind == LIGHT_DIRECTIONAL);
    let texel_width = 2.0 * light.half_extent / f32(map_size) * spread;
    let surface = light_texel_distance(probe.ray, texel_ray, texel);
    if probe.distance <= surface + SHADOW_BIAS + SHADOW_BIAS_TEXELS * texel_width {
        return true;
    }
    // All of the way to the light lies before the receiver's own plane, so nothing behind that plane is in the way: just
    // past a convex edge the texel's middle may see the edge's other side.
    let seen = texel_ray.origin + texel.distance * texel_ray.direction;
    return dot(seen - p, n) <= 0.0;
}

// Radius of the penumbra around the hard edge of an occluder's shadow, across the light's direction: by similar triangles
// R d / (D - d), the receiver D from the lamp's centre and the occluder d before the receiver. A lamp infinitely far away
// has the tangent of its half angle for R / (D - d).
fn shadow_penumbra_radius(light: Light, receiver_distance: f32, gap: f32) -> f32 {
    if light.kind == LIGHT_DIRECTIONAL {
        return light.extent * max(gap, 0.0);
    }
    return light.extent * max(gap, 0.0) / max(receiver_distance - gap, SHADOW_NEAREST);
}
