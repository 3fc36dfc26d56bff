// All that shines, sampled from a point: lights without geometry, emissive triangles, the environment. Reads emitters,
// environment and params, which trace_paths.wgsl declares.

// Twins of `reference::emitters::gpu`.
const EMITTER_POINT: u32 = 0u;
const EMITTER_SPOT: u32 = 1u;
const EMITTER_DIRECTIONAL: u32 = 2u;
const EMITTER_RECTANGLE: u32 = 3u;
const EMITTER_TRIANGLE: u32 = 4u;
const EMITTER_ENVIRONMENT: u32 = 5u;

// A lamp that is set into a surface stands before it, though rounding may say otherwise.
const EMITTER_BEFORE: f32 = 1.0 - 0x1p-16;
const EMITTER_PI: f32 = 3.14159265;

struct Emitter {
    // Where a point, spot or rectangle has its middle, a triangle its first corner
    position: vec3f,
    kind: u32,
    // Axis of a spot, way of directional light, half an edge of a rectangle, an edge of a triangle
    u: vec3f,
    // Probability of picking this one or one before it
    pick_until: f32,
    v: vec3f,
    // Probability of picking this one
    pick: f32,
    // Radiant intensity, irradiance on a perpendicular plane, or radiance
    strength: vec3f,
    // Radius of a point or spot, half angle of directional light, area of a rectangle or triangle
    extent: f32,
    // 1 - cos of a spot's half angles
    inner: f32,
    outer: f32,
    material: u32,
    tex_coords: array<vec2f, 3>,
}

// Light from one point of an emitter.
struct EmitterSample {
    // Radiance times the solid angle's share, or what stands for it where light comes from a single direction
    radiance: vec3f,
    // To be divided by: probability of the pick times density per solid angle
    pdf: f32,
    direction: vec3f,
    is_infinite: bool,
    // Where a shadow ray ends: before the emitter's own surface
    position: vec3f,
    // Whether a scattered ray could have met it
    can_be_met: bool,
}

fn emitter_dark() -> EmitterSample {
    return EmitterSample(vec3f(0.0), 1.0, vec3f(0.0, 0.0, 1.0), true, vec3f(0.0), false);
}

// The first emitter whose picks reach beyond u.
fn emitter_pick(u: f32) -> u32 {
    var low = 0u;
    var high = params.emitter_count - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if emitters[middle].pick_until > u {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    return low;
}

fn emitter_sample(p: vec3f, random: vec4f) -> EmitterSample {
    let index = emitter_pick(random.w);
    switch emitters[index].kind {
        case EMITTER_POINT: { return emitter_sample_point(index, p, random.xy); }
        case EMITTER_SPOT: { return emitter_sample_spot(index, p, random.xy); }
        case EMITTER_DIRECTIONAL: { return emitter_sample_directional(index, random.xy); }
        case EMITTER_RECTANGLE: { return emitter_sample_rectangle(index, p, random.xy); }
        case EMITTER_TRIANGLE: { return emitter_sample_triangle(index, p, random.xy); }
        default: { return environment_sample(index, random); }
    }
}

// 1 - cos of the half angle that a sphere of this radius fills, without cancellation.
fn emitter_sphere_cone(radius: f32, distance: f32) -> f32 {
    let sine_squared = (radius / distance) * (radius / distance);
    return sine_squared / (1.0 + sqrt(1.0 - sine_squared));
}

// Density per solid angle of directions that are uniform in a cone.
fn emitter_cone_pdf(pick: f32, one_minus_cos: f32) -> f32 {
    return pick / (2.0 * EMITTER_PI * one_minus_cos);
}

fn emitter_sphere_radiance(e: Emitter) -> vec3f {
    return e.strength / (EMITTER_PI * e.extent * e.extent);
}

// A point, or a sphere of radiance I / (pi R^2), from which every point outside sees a disc: uniform in its cone.
fn emitter_sample_point(index: u32, p: vec3f, u: vec2f) -> EmitterSample {
    let e = emitters[index];
    let way = e.position - p;
    let squared = dot(way, way);
    if squared == 0.0 {
        return emitter_dark();
    }
    let distance = sqrt(squared);
    let axis = way / distance;
    if distance <= e.extent || e.extent == 0.0 {
        return EmitterSample(e.strength / squared, e.pick, axis, false, e.position, false);
    }
    let one_minus_cos = emitter_sphere_cone(e.extent, distance);
    let local = sampling_cone(u, one_minus_cos);
    let direction = normalize(sampling_frame(axis) * local);
    // Up to the sphere: the nearer crossing.
    let along = distance * local.z;
    let until = along - sqrt(max(0.0, e.extent * e.extent - squared * (1.0 - local.z * local.z)));
    let pdf = emitter_cone_pdf(e.pick, one_minus_cos);
    return EmitterSample(emitter_sphere_radiance(e), pdf, direction, false, p + until * direction, true);
}

// Density per solid angle with which a flat emitter's point is sampled.
fn emitter_flat_pdf(pick: f32, area: f32, squared: f32, cosine: f32) -> f32 {
    return pick * squared / (area * cosine);
}

// A spot, or a disc of which every point shines like one.
fn emitter_sample_spot(index: u32, p: vec3f, u: vec2f) -> EmitterSample {
    let e = emitters[index];
    let on_disc = e.extent * sampling_disc(u);
    let frame = sampling_frame(e.u);
    let position = e.position + on_disc.x * frame[0] + on_disc.y * frame[1];
    let way = position - p;
    let squared = dot(way, way);
    if squared == 0.0 {
        return emitter_dark();
    }
    let direction = way / sqrt(squared);
    let intensity = emitter_spot_intensity(e, direction);
    let cosine = -dot(e.u, direction);
    if e.extent == 0.0 || cosine <= 0.0 {
        return EmitterSample(intensity / squared, e.pick, direction, false, position, false);
    }
    let area = EMITTER_PI * e.extent * e.extent;
    let pdf = emitter_flat_pdf(e.pick, area, squared, cosine);
    return EmitterSample(intensity / (area * cosine), pdf, direction, false, position, true);
}

// Against the way that its light goes.
fn emitter_spot_intensity(e: Emitter, direction: vec3f) -> vec3f {
    return sampling_spot_falloff(sampling_one_minus_cos(-direction, e.u), e.inner, e.outer) * e.strength;
}

// 1 - cos of a sun's half angle.
fn emitter_sun_cone(e: Emitter) -> f32 {
    let half_sine = sin(0.5 * e.extent);
    return 2.0 * half_sine * half_sine;
}

fn emitter_sun_radiance(e: Emitter) -> vec3f {
    let sine = sin(e.extent);
    return e.strength / (EMITTER_PI * sine * sine);
}

// Parallel light, or a disc in the sky of radiance E / (pi sin^2): uniform in its cone.
fn emitter_sample_directional(index: u32, u: vec2f) -> EmitterSample {
    let e = emitters[index];
    if e.extent == 0.0 {
        return EmitterSample(e.strength, e.pick, -e.u, true, vec3f(0.0), false);
    }
    let one_minus_cos = emitter_sun_cone(e);
    let direction = normalize(sampling_frame(-e.u) * sampling_cone(u, one_minus_cos));
    let pdf = emitter_cone_pdf(e.pick, one_minus_cos);
    return EmitterSample(emitter_sun_radiance(e), pdf, direction, true, vec3f(0.0), true);
}

fn emitter_sample_rectangle(index: u32, p: vec3f, u: vec2f) -> EmitterSample {
    let e = emitters[index];
    let position = e.position + (2.0 * u.x - 1.0) * e.u + (2.0 * u.y - 1.0) * e.v;
    let way = position - p;
    let squared = dot(way, way);
    let direction = way / sqrt(max(squared, 1e-30));
    let normal = normalize(cross(e.u, e.v));
    let cosine = -dot(normal, direction);
    if squared == 0.0 || cosine <= 0.0 {
        return emitter_dark();
    }
    let pdf = emitter_flat_pdf(e.pick, e.extent, squared, cosine);
    // Before a surface that the lamp may be set into.
    return EmitterSample(e.strength, pdf, direction, false, bvh_offset(position, normal), true);
}

// What a ray crosses.
struct EmitterCrossed {
    radiance: vec3f,
    // Density with which `emitter_sample` finds the crossing, per solid angle; 0 if the ray crosses nothing
    pdf: f32,
}

// A lamp that is neither a surface nor the environment, where a ray crosses its front before `furthest`.
fn emitter_crossed(index: u32, origin: vec3f, direction: vec3f, furthest: f32) -> EmitterCrossed {
    switch emitters[index].kind {
        case EMITTER_POINT: { return emitter_crossed_sphere(index, origin, direction, furthest); }
        case EMITTER_SPOT: { return emitter_crossed_disc(index, origin, direction, furthest); }
        case EMITTER_DIRECTIONAL: { return emitter_crossed_sun(index, direction, furthest); }
        default: { return emitter_crossed_rectangle(index, origin, direction, furthest); }
    }
}

fn emitter_crossed_sphere(index: u32, origin: vec3f, direction: vec3f, furthest: f32) -> EmitterCrossed {
    let e = emitters[index];
    let way = e.position - origin;
    let along = dot(way, direction);
    let off = way - along * direction;
    let inside = e.extent * e.extent - dot(off, off);
    let squared = dot(way, way);
    if along <= 0.0 || inside <= 0.0 || squared <= e.extent * e.extent || along - sqrt(inside) >= furthest {
        return EmitterCrossed(vec3f(0.0), 0.0);
    }
    let pdf = emitter_cone_pdf(e.pick, emitter_sphere_cone(e.extent, sqrt(squared)));
    return EmitterCrossed(emitter_sphere_radiance(e), pdf);
}

fn emitter_crossed_disc(index: u32, origin: vec3f, direction: vec3f, furthest: f32) -> EmitterCrossed {
    let e = emitters[index];
    let cosine = -dot(e.u, direction);
    let t = dot(e.u, e.position - origin) / dot(e.u, direction);
    let off = origin + t * direction - e.position;
    if cosine <= 0.0 || t <= 0.0 || t * EMITTER_BEFORE >= furthest || dot(off, off) > e.extent * e.extent {
        return EmitterCrossed(vec3f(0.0), 0.0);
    }
    let area = EMITTER_PI * e.extent * e.extent;
    let radiance = emitter_spot_intensity(e, direction) / (area * cosine);
    return EmitterCrossed(radiance, emitter_flat_pdf(e.pick, area, t * t, cosine));
}

fn emitter_crossed_sun(index: u32, direction: vec3f, furthest: f32) -> EmitterCrossed {
    let e = emitters[index];
    let one_minus_cos = emitter_sun_cone(e);
    if furthest < BVH_FURTHEST || sampling_one_minus_cos(direction, -e.u) > one_minus_cos {
        return EmitterCrossed(vec3f(0.0), 0.0);
    }
    return EmitterCrossed(emitter_sun_radiance(e), emitter_cone_pdf(e.pick, one_minus_cos));
}

fn emitter_crossed_rectangle(index: u32, origin: vec3f, direction: vec3f, furthest: f32) -> EmitterCrossed {
    let nothing = EmitterCrossed(vec3f(0.0), 0.0);
    let e = emitters[index];
    let across = cross(e.u, e.v);
    let cosine = -dot(normalize(across), direction);
    if cosine <= 0.0 {
        return nothing;
    }
    let t = dot(across, e.position - origin) / dot(across, direction);
    if t <= 0.0 || t * EMITTER_BEFORE >= furthest {
        return nothing;
    }
    // Coordinates along u and v, which need not be perpendicular (Cramer).
    let at = origin + t * direction - e.position;
    let scale = 1.0 / dot(across, across);
    let a = dot(cross(at, e.v), across) * scale;
    let b = dot(cross(e.u, at), across) * scale;
    if max(abs(a), abs(b)) > 1.0 {
        return nothing;
    }
    return EmitterCrossed(e.strength, emitter_flat_pdf(e.pick, e.extent, t * t, cosine));
}

fn emitter_sample_triangle(index: u32, p: vec3f, u: vec2f) -> EmitterSample {
    let e = emitters[index];
    // Uniform: the square folded along its diagonal.
    let folded = select(u, 1.0 - u, u.x + u.y > 1.0);
    let position = e.position + folded.x * e.u + folded.y * e.v;
    let way = position - p;
    let squared = dot(way, way);
    let direction = way / sqrt(max(squared, 1e-30));
    let normal = normalize(cross(e.u, e.v));
    let cosine = -dot(normal, direction);
    if squared == 0.0 || cosine <= 0.0 {
        return emitter_dark();
    }
    let coords = e.tex_coords;
    let tex_coord = coords[0] + folded.x * (coords[1] - coords[0]) + folded.y * (coords[2] - coords[0]);
    let base = bvh_texture(bvh_materials[e.material].base_color_texture, tex_coord);
    if base.a < bvh_materials[e.material].alpha_cutoff {
        // A hole, through which rays pass.
        return emitter_dark();
    }
    let texel = bvh_texture(bvh_materials[e.material].emission_texture, tex_coord).rgb;
    let pdf = emitter_flat_pdf(e.pick, e.extent, squared, cosine);
    return EmitterSample(e.strength * texel, pdf, direction, false, bvh_offset(position, normal), true);
}

fn environment_radiance(direction: vec3f) -> vec3f {
    return textureLoad(environment, environment_texel(direction, params.environment_rotation, params.environment_size), 0).rgb;
}

// Twin of `reference::emitters::mean_of_channels`: what the environment is sampled in proportion to.
fn environment_mean(radiance: vec3f) -> f32 {
    return (radiance.x + radiance.y + radiance.z) / 3.0;
}

// Density per solid angle of directions of this radiance.
fn environment_pdf(radiance: vec3f) -> f32 {
    return environment_mean(radiance) * params.environment_norm;
}

// A texel by its share of the light, then uniform within it.
fn environment_sample(index: u32, random: vec4f) -> EmitterSample {
    let size = params.environment_size;
    var low = 0u;
    var high = size.y - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if textureLoad(environment, vec2u(size.x, middle), 0).w > random.x {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    let row = low;
    low = 0u;
    high = size.x - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if textureLoad(environment, vec2u(middle, row), 0).w > random.y {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    let column = low;
    let within = hash_pcg4d(vec4u(bitcast<u32>(random.x), bitcast<u32>(random.y), bitcast<u32>(random.z), column));
    let u = vec2f(random.z, f32(within.x >> 8u) * 0x1p-24);
    // Uniform in solid angle: uniform in cos(theta) between the texel's upper and lower edge.
    let upper = cos(EMITTER_PI * f32(row) / f32(size.y));
    let lower = cos(EMITTER_PI * f32(row + 1u) / f32(size.y));
    let y = mix(upper, lower, u.y);
    let phi = (((f32(column) + u.x) / f32(size.x)) - 0.5) * 2.0 * EMITTER_PI - params.environment_rotation;
    let r = sqrt(max(0.0, 1.0 - y * y));
    let direction = vec3f(r * sin(phi), y, -r * cos(phi));
    let radiance = textureLoad(environment, vec2u(column, row), 0).rgb;
    let pdf = emitters[index].pick * environment_pdf(radiance);
    if pdf <= 0.0 {
        return emitter_dark();
    }
    return EmitterSample(radiance, pdf, direction, true, vec3f(0.0), true);
}
