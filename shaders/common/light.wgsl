// Twin of `resource::lights::gpu::LightRecord`, and how a light's shadow-map layers are addressed.

const LIGHT_POINT: u32 = 0u;
const LIGHT_SPOT: u32 = 1u;
const LIGHT_DIRECTIONAL: u32 = 2u;
// Flat: made of polygons, which shine from their fronts
const LIGHT_AREA: u32 = 3u;

struct Light {
    position: vec3f,
    kind: u32,
    // Unit axis along which the light looks
    direction: vec3f,
    // 1 - cos of the spot's inner half angle; area: 1 if all of it lies in one plane; directional: LIGHT_OF_ENVIRONMENT or not
    inner: f32,
    // Radiant intensity, irradiance on a perpendicular plane (directional), or mean radiance (area)
    intensity: vec3f,
    // 1 - cos of the spot's outer half angle
    outer: f32,
    right: vec3f,
    first_layer: u32,
    up: vec3f,
    layer_count: u32,
    photon_flux: vec3f,
    // Tangent of the single layer's half angle, or its half width (directional)
    half_extent: f32,
    first_photon: u32,
    photon_count: u32,
    // 1 / solid angle of full intensity (point, spot), 1 / area of the disc (directional), or 1 / pi (area)
    density: f32,
    disc_radius: f32,
    // Radius of the lamp (point, spot, area), or tangent of the half angle that it subtends (directional); 0: hard shadows
    extent: f32,
    // Of an area light: direct light is that of the first so many polygons, photons start on those behind them, or on the
    // same ones where there are no others
    first_polygon: u32,
    direct_polygons: u32,
    polygon_count: u32,
}

// A ray of light: where it starts, its unit direction, and the layer and place where the shadow map holds it.
struct LightRay {
    origin: vec3f,
    direction: vec3f,
    layer: u32,
    uv: vec2f,
}

// A sun that stands for a part of the environment.
const LIGHT_OF_ENVIRONMENT: f32 = 0.0;

// Whether rays can run into it, or into what it stands for.
fn light_is_met(light: Light) -> bool {
    return light.kind == LIGHT_AREA || (light.kind == LIGHT_DIRECTIONAL && light.inner == LIGHT_OF_ENVIRONMENT);
}

// Tangent of a sun's half angle up to which a series is more exact than the formula.
const LIGHT_SMALL_DISC: f32 = 0.25;

// Sine of a sun's half angle.
fn light_disc_sine(light: Light) -> f32 {
    return light.extent * inverseSqrt(1.0 + light.extent * light.extent);
}

// Irradiance of a surface by a sun, over that across the sun: the cosine of the angle between normal and the way to its middle
// while all of its disc stands over the surface's horizon, else of the part that does (Snyder 1996, "Area Light Sources for
// Real-Time Graphics"; the form of Lagarde and de Rousiers 2014).
fn light_sun_cosine(light: Light, cosine: f32) -> f32 {
    let disc_sine = light_disc_sine(light);
    if cosine >= disc_sine || cosine <= -disc_sine {
        return max(0.0, cosine);
    }
    let t = light.extent;
    let sine = sqrt(1.0 - cosine * cosine);
    let y = clamp(-cosine / (t * sine), -1.0, 1.0);
    let s = sine * sqrt(1.0 - y * y);
    let z = s * t;
    var rest = atan(z) / (disc_sine * disc_sine) - s / t;
    if t < LIGHT_SMALL_DISC {
        // The same by the arc tangent's series, without the digits that cancel.
        rest = z * (1.0 - (1.0 + t * t) * s * s * (1.0 / 3.0 - z * z / 5.0 + z * z * z * z / 7.0));
    }
    return max(0.0, (cosine * acos(y) + rest) / 3.14159265);
}

fn light_layer_uv(x: f32, y: f32) -> vec2f {
    return vec2f(0.5 + 0.5 * x, 0.5 - 0.5 * y);
}

// The ray along a direction from the light; `offset` is where it crosses the disc of parallel rays, (right, up).
fn light_ray(light: Light, direction: vec3f, offset: vec2f) -> LightRay {
    if light.kind == LIGHT_DIRECTIONAL {
        let origin = light.right * offset.x + light.up * offset.y - SURFACE_TEXEL_PARALLEL_START * light.direction;
        let uv = light_layer_uv(offset.x / light.half_extent, offset.y / light.half_extent);
        return LightRay(origin, light.direction, light.first_layer, uv);
    }
    if light.layer_count == 1u {
        let scale = 1.0 / (dot(direction, light.direction) * light.half_extent);
        let uv = light_layer_uv(dot(direction, light.right) * scale, dot(direction, light.up) * scale);
        return LightRay(light.position, direction, light.first_layer, uv);
    }
    let point = cube_face_point(direction);
    return LightRay(light.position, direction, light.first_layer + point.face, point.uv);
}

// The ray of light that would reach a point.
fn light_ray_to(light: Light, p: vec3f) -> LightRay {
    if light.kind == LIGHT_DIRECTIONAL {
        return light_ray(light, light.direction, vec2f(dot(p, light.right), dot(p, light.up)));
    }
    return light_ray(light, normalize(p - light.position), vec2f(0.0));
}

// The ray through a texel's centre, near which `ray` passes.
fn light_texel_ray(light: Light, ray: LightRay, texel: vec2u, size: u32) -> LightRay {
    let uv = (vec2f(texel) + 0.5) / f32(size);
    let x = (2.0 * uv.x - 1.0) * light.half_extent;
    let y = (1.0 - 2.0 * uv.y) * light.half_extent;
    if light.kind == LIGHT_DIRECTIONAL {
        return light_ray(light, light.direction, vec2f(x, y));
    }
    var direction = light.direction + x * light.right + y * light.up;
    if light.layer_count != 1u {
        direction = cube_face_direction(ray.layer - light.first_layer, uv);
    }
    return LightRay(light.position, normalize(direction), ray.layer, uv);
}

// Distance along `ray` to the plane of the surface that the texel around `texel_ray` holds. A plane seen at a grazing
// angle could lie anywhere, so the answer stays within a factor of two of the texel's own distance.
fn light_texel_distance(ray: LightRay, texel_ray: LightRay, texel: SurfaceTexel) -> f32 {
    let toward = dot(texel.normal, ray.direction);
    let offset = texel_ray.origin + texel_ray.direction * texel.distance - ray.origin;
    let distance = dot(texel.normal, offset) / min(toward, -1e-6);
    return clamp(distance, 0.5 * texel.distance, 2.0 * texel.distance);
}
