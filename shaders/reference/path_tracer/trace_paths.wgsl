// One path for each pixel (Kajiya 1986): from the eye through the scene, with a light sampled at every vertex and both
// ways of finding it weighted by the power heuristic (Veach 1997, section 9.2.4).

struct Params {
    // Where the eye is, and the middle, right and upper border of its image plane at distance 1 (or of parallel rays)
    eye: vec3f,
    is_parallel: u32,
    forward: vec3f,
    bounces: u32,
    right: vec3f,
    roulette_from: u32,
    up: vec3f,
    component: u32,
    size: vec2u,
    emitter_count: u32,
    // Emitters 0 up to this are lamps that rays cross
    crossed_count: u32,
    // Probability, per area and unit radiance, with which an emissive surface is picked
    pick_per_area: f32,
    // Probability of picking the environment
    environment_pick: f32,
    // 1 / integral over the sphere of the mean of its channels
    environment_norm: f32,
    environment_rotation: f32,
    environment_size: vec2u,
    // 1: paths begin all over a pixel; 0: in its middle
    spans_pixel: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> emitters: array<Emitter>;
// Radiance, and the part of a row's light up to and with a texel; in the last column the part of all rows up to a row
@group(0) @binding(2) var environment: texture_2d<f32>;
// For each pixel the mean of its samples (w: their number) and the sum of their squared distances from it
@group(0) @binding(3) var<storage, read_write> moments: array<vec4f>;

// Twins of `reference::PathComponent`.
const COMPONENT_ALL: u32 = 0u;
const COMPONENT_DIRECT: u32 = 1u;
const COMPONENT_INDIRECT: u32 = 2u;
const COMPONENT_CAUSTIC: u32 = 3u;
const COMPONENT_SPECULAR: u32 = 4u;

// A path so far.
struct Path {
    origin: vec3f,
    direction: vec3f,
    throughput: vec3f,
    // Square of the index of refraction of the medium that it is in: what radiance there is squeezed by
    squeeze: f32,
    radiance: vec3f,
    // Of the direction that the last surface sampled, per solid angle; 0 where no light can be sampled that way
    pdf: f32,
    // Surfaces that scattered it
    scatterings: u32,
    // Whether the first of them is diffuse, and whether all others are not
    begins_diffuse: bool,
    goes_on_specular: bool,
}

// Numbers in [0, 1), four at a time, a function of pixel, sample and how many were drawn.
struct PathRandom {
    pixel: vec2u,
    sample: u32,
    drawn: u32,
}

fn path_random(state: ptr<function, PathRandom>) -> vec4f {
    let bits = hash_pcg4d(vec4u((*state).pixel, (*state).sample, (*state).drawn));
    (*state).drawn++;
    return vec4f(bits >> vec4u(8u)) * 0x1p-24;
}

// Whether light that reaches the path now is part of what is asked for.
fn path_counts(path: Path, scatterings: u32) -> bool {
    switch params.component {
        case COMPONENT_DIRECT: { return scatterings < 2u; }
        case COMPONENT_INDIRECT: { return scatterings >= 2u; }
        case COMPONENT_CAUSTIC: { return scatterings >= 2u && path.begins_diffuse && path.goes_on_specular; }
        case COMPONENT_SPECULAR: { return scatterings >= 1u && !path.begins_diffuse; }
        default: { return true; }
    }
}

// Weight of a sample drawn with density `own` where another technique would have drawn it with `other`.
fn path_heuristic(own: f32, other: f32) -> f32 {
    if own <= 0.0 {
        return 0.0;
    }
    let ratio = other / own;
    return 1.0 / (1.0 + ratio * ratio);
}

// Weight of a light that a scattered ray ran into: all of it where no light could have been sampled.
fn path_found_weight(path: Path, light_pdf: f32) -> f32 {
    return select(path_heuristic(path.pdf, light_pdf), 1.0, path.pdf == 0.0);
}

// Light of lamps that the ray crosses before `distance`; they block nothing. The eye does not see them.
fn path_cross_lamps(path: ptr<function, Path>, distance: f32) {
    if (*path).scatterings == 0u || !path_counts(*path, (*path).scatterings) {
        return;
    }
    for (var i = 0u; i < params.crossed_count; i++) {
        let crossed = emitter_crossed(i, (*path).origin, (*path).direction, distance);
        if crossed.pdf > 0.0 {
            let weight = path_found_weight(*path, crossed.pdf);
            (*path).radiance += weight * (*path).throughput * crossed.radiance;
        }
    }
}

fn path_see_environment(path: ptr<function, Path>) {
    if params.environment_pick == 0.0 || !path_counts(*path, (*path).scatterings) {
        return;
    }
    let seen = environment_radiance((*path).direction);
    let weight = path_found_weight(*path, params.environment_pick * environment_pdf(seen));
    (*path).radiance += weight * (*path).throughput * seen;
}

fn path_see_emission(path: ptr<function, Path>, surface: BvhSurface, distance: f32) {
    let cosine = -dot(surface.geometric_normal, (*path).direction);
    if cosine <= 0.0 || !path_counts(*path, (*path).scatterings) {
        return;
    }
    let emission = bvh_emission(surface);
    if all(emission == vec3f(0.0)) {
        return;
    }
    let factor = bvh_materials[surface.material].emission;
    let light_pdf = params.pick_per_area * (factor.x + factor.y + factor.z) * distance * distance / cosine;
    (*path).radiance += path_found_weight(*path, light_pdf) * (*path).throughput * emission;
}

// A ray leaves a surface on the side that it goes to.
fn path_leave(surface: BvhSurface, direction: vec3f) -> vec3f {
    let n = surface.geometric_normal;
    return bvh_leave(surface, select(-n, n, dot(n, direction) > 0.0));
}

// Light of one emitter, picked by its power.
fn path_sample_light(path: ptr<function, Path>, surface: BvhSurface, scatterer: Scatterer, random: vec4f) {
    if params.emitter_count == 0u || !path_counts(*path, (*path).scatterings + 1u) {
        return;
    }
    let light = emitter_sample(surface.position, random);
    if all(light.radiance == vec3f(0.0)) {
        return;
    }
    let scattered = scatter_evaluate(scatterer, -(*path).direction, light.direction);
    if all(scattered.rgb == vec3f(0.0)) {
        return;
    }
    let origin = path_leave(surface, light.direction);
    // Towards a point, not along a direction, so that grazing light is blocked by what stands before it alone.
    let reaches = select(light.position - origin, light.direction, light.is_infinite);
    let furthest = select(1.0, BVH_FURTHEST, light.is_infinite);
    if !bvh_is_free(origin, reaches, furthest, BVH_ALL) {
        return;
    }
    let weight = select(1.0, path_heuristic(light.pdf, scattered.w), light.can_be_met);
    (*path).radiance += weight * (*path).throughput * scattered.rgb * light.radiance / light.pdf;
}

// The ray through a pixel; `u` says where in it.
fn path_begin(pixel: vec2u, u: vec2f) -> Path {
    let at = (vec2f(pixel) + u) / vec2f(params.size);
    let across = (2.0 * at.x - 1.0) * params.right + (1.0 - 2.0 * at.y) * params.up;
    var origin = params.eye;
    var direction = params.forward + across;
    if params.is_parallel == 1u {
        origin += across;
        direction = params.forward;
    }
    return Path(origin, normalize(direction), vec3f(1.0), 1.0, vec3f(0.0), 0.0, 0u, false, true);
}

fn path_trace(pixel: vec2u, sample: u32) -> vec3f {
    var random = PathRandom(pixel, sample, 0u);
    let within = path_random(&random).xy;
    var path = path_begin(pixel, select(vec2f(0.5), within, params.spans_pixel == 1u));
    loop {
        let hit = bvh_closest(path.origin, path.direction, BVH_FURTHEST, BVH_ALL);
        path_cross_lamps(&path, hit.distance);
        if hit.instance == BVH_NONE {
            path_see_environment(&path);
            break;
        }
        let surface = bvh_surface(hit);
        path_see_emission(&path, surface, hit.distance);
        if path.scatterings > params.bounces {
            break;
        }
        let scatterer = scatter_at(surface, path.direction);
        let is_diffuse = scatterer.kind == SCATTER_DIFFUSE;
        if path.scatterings == 0u {
            path.begins_diffuse = is_diffuse;
        } else {
            path.goes_on_specular = path.goes_on_specular && !is_diffuse;
        }
        if scatter_is_smooth(scatterer) {
            path_random(&random);
        } else {
            path_sample_light(&path, surface, scatterer, path_random(&random));
        }
        let next = scatter_sample(scatterer, -path.direction, path_random(&random));
        path.throughput *= next.weight;
        path.squeeze *= next.squeeze;
        path.scatterings++;
        // What light will be worth once it has left the glass that it is in.
        let worth = path.squeeze * path.throughput;
        let survival = min(1.0, max(worth.x, max(worth.y, worth.z)));
        if survival <= 0.0 {
            break;
        }
        if path.scatterings >= params.roulette_from {
            if path_random(&random).x >= survival {
                break;
            }
            path.throughput /= survival;
        }
        path.origin = path_leave(surface, next.direction);
        path.direction = next.direction;
        path.pdf = next.pdf;
    }
    return path.radiance;
}

@compute @workgroup_size(8, 8)
fn trace_paths(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let at = 2u * (id.y * params.size.x + id.x);
    let before = moments[at];
    let radiance = path_trace(id.xy, u32(before.w));
    // Welford 1962: no sum grows until samples are lost in its rounding.
    let count = before.w + 1.0;
    let distance = radiance - before.rgb;
    moments[at] = vec4f(before.rgb + distance / count, count);
    moments[at + 1u] += vec4f(distance * distance * (before.w / count), 0.0);
}
