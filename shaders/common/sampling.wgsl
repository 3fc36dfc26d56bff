// Directions and points from uniform numbers u in [0, 1)^2. Each sampler's pdf stands in its comment.

const SAMPLING_PI: f32 = 3.14159265;

// A right-handed frame with the given z axis (Duff et al. 2017).
fn sampling_frame(z: vec3f) -> mat3x3f {
    let s = select(-1.0, 1.0, z.z >= 0.0);
    let a = -1.0 / (s + z.z);
    let b = z.x * z.y * a;
    return mat3x3f(vec3f(1.0 + s * z.x * z.x * a, s * b, -s * z.x), vec3f(b, s + z.y * z.y * a, -z.y), z);
}

// 1 - cos of the angle between unit vectors. As half their squared distance it keeps its digits at small angles.
fn sampling_one_minus_cos(a: vec3f, b: vec3f) -> f32 {
    return 0.5 * dot(a - b, a - b);
}

// Uniform on the sphere: pdf 1/(4 pi).
fn sampling_sphere(u: vec2f) -> vec3f {
    let z = 1.0 - 2.0 * u.x;
    let r = sqrt(max(0.0, 1.0 - z * z));
    let phi = 2.0 * SAMPLING_PI * u.y;
    return vec3f(r * cos(phi), r * sin(phi), z);
}

// Cosine-weighted about +z: pdf cos/pi.
fn sampling_cosine(u: vec2f) -> vec3f {
    let r = sqrt(u.x);
    let phi = 2.0 * SAMPLING_PI * u.y;
    return vec3f(r * cos(phi), r * sin(phi), sqrt(1.0 - u.x));
}

// The numbers that make a direction of it.
fn sampling_cosine_inverse(direction: vec3f) -> vec2f {
    let turn = atan2(direction.y, direction.x) / (2.0 * SAMPLING_PI);
    return vec2f(1.0 - direction.z * direction.z, turn - floor(turn));
}

// Uniform on the unit disc: pdf 1/pi.
fn sampling_disc(u: vec2f) -> vec2f {
    let r = sqrt(u.x);
    let phi = 2.0 * SAMPLING_PI * u.y;
    return r * vec2f(cos(phi), sin(phi));
}

// Uniform in the cone about +z, given 1 - cos of its half angle: pdf 1/(2 pi one_minus_cos).
fn sampling_cone(u: vec2f, one_minus_cos: f32) -> vec3f {
    let down = u.x * one_minus_cos;
    let r = sqrt(max(0.0, down * (2.0 - down)));
    let phi = 2.0 * SAMPLING_PI * u.y;
    return vec3f(r * cos(phi), r * sin(phi), 1.0 - down);
}

// About +z in proportion to the intensity of a spot, given 1 - cos of its inner and outer half angle:
// with v = 1 - cos(theta), f(v) = 1 up to inner and ((outer - v) / (outer - inner))^2 beyond; pdf f / (2 pi F),
// F = inner + (outer - inner)/3.
fn sampling_spot(u: vec2f, inner: f32, outer: f32) -> vec3f {
    let penumbra = (outer - inner) / 3.0;
    let target_flux = u.x * (inner + penumbra);
    var v = target_flux;
    if target_flux > inner {
        let remaining = max(0.0, 1.0 - (target_flux - inner) / penumbra);
        v = outer - (outer - inner) * pow(remaining, 1.0 / 3.0);
    }
    let r = sqrt(max(0.0, v * (2.0 - v)));
    let phi = 2.0 * SAMPLING_PI * u.y;
    return vec3f(r * cos(phi), r * sin(phi), 1.0 - v);
}

// The spot's falloff at 1 - cos(theta) = v, in [0, 1].
fn sampling_spot_falloff(v: f32, inner: f32, outer: f32) -> f32 {
    if v <= inner {
        return 1.0;
    }
    let f = max(0.0, outer - v) / (outer - inner);
    return select(f * f, 0.0, v >= outer);
}
