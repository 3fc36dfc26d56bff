// What the rays of paths have met: a diffuse surface ends a path with the light that it sends out, a specular one lets it go on.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read_write> rays: array<SurfaceRay>;
@group(0) @binding(2) var<storage, read> hits: array<SurfaceHit>;
@group(0) @binding(3) var<storage, read_write> paths: array<SpecularPath>;
@group(0) @binding(4) var<uniform> grid: GridParams;
@group(0) @binding(5) var<storage, read> splats: array<Splat>;
@group(0) @binding(6) var<storage, read> first_splats: array<u32>;
@group(0) @binding(7) var<storage, read> lights: array<Light>;
@group(0) @binding(8) var<storage, read> polygons: array<Polygon>;
@group(0) @binding(9) var shadow_maps: texture_2d_array<u32>;
@group(0) @binding(10) var radiance: texture_storage_2d<rgba32float, write>;
@group(0) @binding(11) var<uniform> environment: Environment;
@group(0) @binding(12) var environment_image: texture_2d<f32>;

const SPECULAR_INVERSE_PI: f32 = 0.318309886;
// A lamp that is set into a surface stands before it, though rounding may say otherwise.
const SPECULAR_BEFORE: f32 = 1.0 - 0x1p-12;

// Radiance of a point light, a spot or a sun of some extent, where a ray runs into it before `furthest`, or where it escapes.
// Parts of the environment are seen as such.
fn extent_crossed(light: Light, ray: SurfaceRay, furthest: f32, escapes: bool) -> vec3f {
    let axial = -dot(light.direction, ray.direction);
    let way = light.position - ray.position;
    let along = dot(way, ray.direction);
    let off = way - along * ray.direction;
    let squared_radius = light.extent * light.extent;
    switch light.kind {
        case LIGHT_POINT: {
            // A sphere of radiance I / (pi R^2); a point to who is within it.
            let within = squared_radius - dot(off, off);
            let is_before = along > 0.0 && dot(way, way) > squared_radius;
            if within > 0.0 && is_before && along - sqrt(within) < furthest {
                return light.intensity * (SPECULAR_INVERSE_PI / squared_radius);
            }
        }
        case LIGHT_SPOT: {
            // A disc of which every point shines like a spot.
            let distance = -dot(way, light.direction) / axial;
            let on_disc = way - distance * ray.direction;
            let is_within = dot(on_disc, on_disc) < squared_radius;
            if axial > 0.0 && distance > 0.0 && is_within && distance * SPECULAR_BEFORE < furthest {
                let falls = sampling_one_minus_cos(-ray.direction, light.direction);
                let falloff = sampling_spot_falloff(falls, light.inner, light.outer);
                return light.intensity * (falloff * SPECULAR_INVERSE_PI / (squared_radius * axial));
            }
        }
        default: {
            // A disc in the sky.
            let across = cross(light.direction, ray.direction);
            let is_within = axial > 0.0 && dot(across, across) < squared_radius * axial * axial;
            if is_within && escapes && !light_is_met(light) {
                let sine = light_disc_sine(light);
                return light.intensity * (SPECULAR_INVERSE_PI / (sine * sine));
            }
        }
    }
    return vec3f(0.0);
}

// Radiance of the lamps that a ray runs into before `furthest`: of the fronts of flat ones, and `from_smooth` surfaces, of all
// that have an extent; those light rough surfaces by their middles. They block nothing.
fn lamps_crossed(ray: SurfaceRay, furthest: f32, escapes: bool, from_smooth: bool) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < params.light_count; i++) {
        if lights[i].kind != LIGHT_AREA {
            if from_smooth && lights[i].extent > 0.0 {
                sum += extent_crossed(lights[i], ray, furthest, escapes);
            }
            continue;
        }
        // Of many triangles the rectangle that stands for them.
        let first = lights[i].first_polygon;
        for (var k = first; k < first + lights[i].direct_polygons; k++) {
            if polygon_crossed(polygons[k], ray.position, ray.direction) * SPECULAR_BEFORE < furthest {
                sum += polygons[k].radiance;
            }
        }
    }
    return sum;
}

// What a path is after its ray.
fn advanced(before: SpecularPath, index: u32, pixel: vec2u) -> SpecularPath {
    var path = before;
    let ray = rays[index];
    let hit = hits[index];
    let is_hit = hit.kind == HIT_SURFACE || hit.kind == HIT_TENTATIVE;
    let furthest = select(1e30, hit.distance, is_hit);
    let from_smooth = before.state == SPECULAR_FROM_SMOOTH;
    let weight = select(params.indirect_weight, params.direct_weight, params.step == 0u);
    path.radiance += weight * path.throughput * lamps_crossed(ray, furthest, hit.kind == HIT_ESCAPED, from_smooth);
    if hit.kind == HIT_ESCAPED {
        path.radiance += weight * path.throughput * environment_radiance(ray.direction);
    }
    path.state = SPECULAR_ENDED;
    rays[index] = specular_no_ray();
    if !is_hit {
        return path;
    }
    let p = ray.position + hit.distance * ray.direction;
    let n = octahedral_unpack(hit.normal);
    let color = reflectance_unpack(hit.reflectance);
    let lobe = hit.lobe & LOBE_BITS;
    if !lobe_is_specular(lobe) {
        let g = grid_light(Receiver(p, n, 0u, true));
        let irradiance = direct_irradiance(p, n, params.light_count, params.shadow_map_size) + vec3f(g.red, g.green, g.blue);
        path.radiance += params.indirect_weight * path.throughput * color * SPECULAR_INVERSE_PI * irradiance;
        return path;
    }
    let scatterer = scatter_by_lobe(lobe, n, (hit.lobe & HIT_BACK) == 0u, color);
    let punctual = punctual_light(scatterer, p, -ray.direction, params.light_count, params.shadow_map_size, false);
    path.radiance += params.indirect_weight * path.throughput * punctual;
    if params.step + 1u == params.steps {
        return path;
    }
    let scattering = scatter_sample(scatterer, -ray.direction, specular_random(pixel, params.step + 1u));
    path.throughput *= scattering.weight;
    if any(path.throughput > vec3f(0.0)) {
        path.state = specular_state(scatterer);
        rays[index] = specular_ray(p, n, scattering.direction);
    }
    return path;
}

@compute @workgroup_size(8, 8)
fn advance_paths(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= params.width || id.y >= params.row_count {
        return;
    }
    let index = id.y * params.width + id.x;
    let pixel = vec2u(id.x, params.first_row + id.y);
    var path = paths[index];
    if path.state != SPECULAR_ENDED {
        path = advanced(path, index, pixel);
        paths[index] = path;
    }
    if params.step + 1u == params.steps && params.round + 1u == params.rounds {
        textureStore(radiance, pixel, vec4f(path.radiance / f32(params.rounds), 1.0));
    }
}
