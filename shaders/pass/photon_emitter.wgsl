// Emits photons from every light and finds where they first land, in the light's reflective shadow map. Those of flat lights
// start on their surface instead, and the walk traces their first hop.

struct Params {
    photon_count: u32,
    light_count: u32,
    sample_offset: u32,
    shadow_map_size: u32,
    row: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> lights: array<Light>;
@group(0) @binding(2) var shadow_maps: texture_2d_array<u32>;
@group(0) @binding(3) var<storage, read_write> photons: array<Photon>;
@group(0) @binding(4) var<storage, read> polygons: array<Polygon>;
@group(1) @binding(0) var<storage, read> emission_tables: array<EmissionTable>;

struct Emission {
    ray: LightRay,
    // Per solid angle, or per perpendicular area (directional)
    pdf: f32,
}

fn emit(light: Light, u: vec2f) -> Emission {
    switch light.kind {
        case LIGHT_DIRECTIONAL: {
            let offset = light.disc_radius * sampling_disc(u);
            return Emission(light_ray(light, light.direction, offset), light.density);
        }
        case LIGHT_SPOT: {
            let local = sampling_spot(u, light.inner, light.outer);
            let direction = mat3x3f(light.right, light.up, light.direction) * local;
            let v = sampling_one_minus_cos(local, vec3f(0.0, 0.0, 1.0));
            let falloff = sampling_spot_falloff(v, light.inner, light.outer);
            return Emission(light_ray(light, normalize(direction), vec2f(0.0)), light.density * falloff);
        }
        default: {
            return Emission(light_ray(light, sampling_sphere(u), vec2f(0.0)), light.density);
        }
    }
}

fn light_of(photon: u32) -> u32 {
    var index = 0u;
    while index + 1u < params.light_count && photon >= lights[index].first_photon + lights[index].photon_count {
        index++;
    }
    return index;
}

// Evenly spread.
@compute @workgroup_size(64)
fn emit_photons(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * params.row + id.x;
    if id.x < params.row && index < params.photon_count {
        emit_photon(index, EmissionStart(random_pair(params.sample_offset + index, 0u), 0u, 1.0), 0u);
    }
}

// As the tables say.
@compute @workgroup_size(64)
fn emit_photons_by_cells(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * params.row + id.x;
    if id.x < params.row && index < params.photon_count {
        let start = emission_start(light_of(index), random_pair(params.sample_offset + index, 0u));
        emit_photon(index, start, photon_emission(start.cell, start.boost));
    }
}

// The first polygon of a flat light that photons start on.
fn first_polygon(light: Light) -> u32 {
    let is_for_both = light.polygon_count == light.direct_polygons;
    return light.first_polygon + select(light.direct_polygons, 0u, is_for_both);
}

// The polygon whose share of the light's photons u lies in.
fn polygon_of(light: Light, u: f32) -> u32 {
    var low = first_polygon(light);
    var high = light.first_polygon + light.polygon_count - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if polygons[middle].until > u {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    return low;
}

// On the surface of a flat light, in proportion to the flux of its polygons, in directions by the cosine: four numbers, two
// of them from an additive recurrence.
fn emit_from_surface(light: Light, light_index: u32, sequence_index: u32, start: EmissionStart, kept: u32) -> Photon {
    let place = random_recurrence(sequence_index);
    let index = polygon_of(light, place.x);
    let polygon = polygons[index];
    var before = 0.0;
    if index > first_polygon(light) {
        before = polygons[index - 1u].until;
    }
    let share = polygon.until - before;
    var at = vec2f(clamp((place.x - before) / share, 0.0, 1.0), place.y);
    if polygon.corners == 3u && at.x + at.y > 1.0 {
        at = 1.0 - at;
    }
    let normal = normalize(cross(polygon.u, polygon.v));
    let direction = normalize(sampling_frame(normal) * sampling_cosine(start.u));
    let flux = polygon.radiance * (POLYGON_PI * polygon.area / (share * f32(light.photon_count)));
    return Photon(
        polygon.corner + at.x * polygon.u + at.y * polygon.v,
        PHOTON_EMPTY | PHOTON_STARTED | kept,
        flux / start.boost,
        start.boost,
        octahedral_pack(normal),
        octahedral_pack(direction),
        0u,
        light_index,
    );
}

// `kept`: bits of the state that the path carries on.
fn emit_photon(index: u32, start: EmissionStart, kept: u32) {
    let light_index = light_of(index);
    let light = lights[light_index];
    if index < light.first_photon || index >= light.first_photon + light.photon_count {
        photons[index] = photon_gone(PHOTON_EMPTY, vec3f(0.0), vec3f(0.0, 0.0, 1.0), 0u);
        return;
    }
    if light.kind == LIGHT_AREA {
        photons[index] = emit_from_surface(light, light_index, params.sample_offset + index, start, kept);
        return;
    }
    let emission = emit(light, start.u);
    let ray = emission.ray;
    let flux = light.photon_flux / start.boost;
    let at = cube_face_texel(ray.uv, params.shadow_map_size);
    let texel = surface_texel_unpack(textureLoad(shadow_maps, at, ray.layer, 0));
    if texel.distance <= 0.0 {
        photons[index] = photon_gone(PHOTON_ESCAPED | kept, flux, ray.direction, light_index);
        return;
    }
    let distance = light_texel_distance(ray, light_texel_ray(light, ray, at, params.shadow_map_size), texel);
    let cosine = abs(dot(texel.normal, ray.direction));
    let spread = select(1.0 / (distance * distance), 1.0, light.kind == LIGHT_DIRECTIONAL);
    let back = select(0u, HIT_BACK, (texel.flags & SURFACE_TEXEL_BACK_FACE) != 0u);
    let lobe = surface_texel_lobe(texel) | back;
    var density = start.boost * emission.pdf * cosine * spread;
    if lobe_is_specular(lobe) {
        let radius = inverseSqrt(max(start.boost * emission.pdf * spread, 1e-20));
        let growth = select(radius / distance, 0.0, light.kind == LIGHT_DIRECTIONAL);
        density = photon_footprint(radius, growth);
    }
    photons[index] = Photon(
        ray.origin + distance * ray.direction,
        PHOTON_STORED | PHOTON_FIRST_HIT | kept | photon_lobe_state(lobe),
        flux,
        density,
        octahedral_pack(texel.normal),
        octahedral_pack(ray.direction),
        reflectance_pack(texel.reflectance),
        light_index | photon_lobe_light(lobe) | (surface_texel_surface(texel) << 16u),
    );
}
