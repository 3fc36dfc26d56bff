// Where emitted photons first land: in the light's reflective shadow map. Or they only set out, from any point of a light with an
// extent, as those of flat lights do from their surface, and the walk traces their first hop.

struct Params {
    photon_count: u32,
    light_count: u32,
    sample_offset: u32,
    shadow_map_size: u32,
    row: u32,
    // 1: photons only set out
    traces_first: u32,
    // Share of the photons that start as `emission_tables` say
    guided: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> lights: array<Light>;
@group(0) @binding(2) var shadow_maps: texture_2d_array<u32>;
@group(0) @binding(3) var<storage, read_write> photons: array<Photon>;
@group(0) @binding(4) var<storage, read> polygons: array<Polygon>;

// A place on a light's surface.
struct SurfaceStart {
    position: vec3f,
    normal: vec3f,
    // Of one photon, if directions go by the cosine
    flux: vec3f,
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

// Whether photons start on a surface, flat or round, with a cosine's spread.
fn starts_on_surface(light: Light) -> bool {
    return light.kind == LIGHT_AREA || (light.kind == LIGHT_POINT && light.extent > 0.0 && params.traces_first == 1u);
}

// One of the points that a spot's disc, or of the directions that a sun's, is made of; it sends out what all of them do. A shadow
// map knows their middle alone.
fn light_within(light: Light, sequence_index: u32) -> Light {
    var own = light;
    if light.extent <= 0.0 || params.traces_first == 0u {
        return own;
    }
    let place = random_recurrence(sequence_index);
    if light.kind == LIGHT_SPOT {
        let at = light.extent * sampling_disc(place);
        own.position += at.x * light.right + at.y * light.up;
    }
    if light.kind == LIGHT_DIRECTIONAL {
        // 1 - cos of the half angle.
        let cosine = inverseSqrt(1.0 + light.extent * light.extent);
        let until = light.extent * cosine * light.extent * cosine / (1.0 + cosine);
        let local = sampling_cone(place, until);
        let axes = sampling_frame(normalize(mat3x3f(light.right, light.up, light.direction) * local));
        own.right = axes[0];
        own.up = axes[1];
        own.direction = axes[2];
        // Light of irradiance E across the middle: of radiance E / (pi sin^2), from 2 pi (1 - cos) of directions.
        own.photon_flux *= 2.0 / (1.0 + cosine);
    }
    return own;
}

// On the sphere of a point light.
fn sphere_start(light: Light, sequence_index: u32, photon_count: u32) -> SurfaceStart {
    let normal = sampling_sphere(random_recurrence(sequence_index));
    let all = light.photon_flux * f32(max(light.photon_count, 1u));
    return SurfaceStart(light.position + light.extent * normal, normal, all / f32(photon_count));
}

// On the surface of a flat light, in proportion to the flux of its polygons: two of the four numbers that such a photon is
// made of, from an additive recurrence.
fn surface_start(light: Light, sequence_index: u32, photon_count: u32) -> SurfaceStart {
    if light.kind != LIGHT_AREA {
        return sphere_start(light, sequence_index, photon_count);
    }
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
    return SurfaceStart(
        polygon.corner + at.x * polygon.u + at.y * polygon.v,
        normalize(cross(polygon.u, polygon.v)),
        polygon.radiance * (POLYGON_PI * polygon.area / (share * f32(photon_count))),
    );
}

// A photon there, whose first hop is still to be traced; `boost`: how much more densely photons leave this way than by the
// cosine.
fn photon_started(start: SurfaceStart, light_index: u32, direction: vec3f, boost: f32, kept: u32) -> Photon {
    return Photon(
        start.position,
        PHOTON_EMPTY | PHOTON_STARTED | select(0u, PHOTON_OF_FLAT, lights[light_index].kind == LIGHT_AREA) | kept,
        start.flux / boost,
        boost,
        octahedral_pack(start.normal),
        octahedral_pack(direction),
        0u,
        light_index,
    );
}

// On a ray of a light that is not flat; `pdf`: of photons along it, per solid angle or per perpendicular area (directional).
fn photon_on_ray(light_index: u32, ray: LightRay, pdf: f32, flux: vec3f, kept: u32) -> Photon {
    if pdf > 0.0 && params.traces_first == 0u {
        return photon_landed(light_index, ray, pdf, flux, kept);
    }
    let direction = octahedral_pack(ray.direction);
    let is_parallel = lights[light_index].kind == LIGHT_DIRECTIONAL;
    let state = PHOTON_EMPTY | PHOTON_STARTED | select(0u, PHOTON_PARALLEL, is_parallel) | kept;
    let density = pdf * select(POLYGON_PI, 1.0, is_parallel);
    return Photon(ray.origin, state, flux, density, direction, direction, 0u, light_index);
}

// Where such a ray lands.
fn photon_landed(light_index: u32, ray: LightRay, pdf: f32, flux: vec3f, kept: u32) -> Photon {
    let light = lights[light_index];
    let at = cube_face_texel(ray.uv, params.shadow_map_size);
    let texel = surface_texel_unpack(textureLoad(shadow_maps, at, ray.layer, 0));
    if texel.distance <= 0.0 {
        return photon_gone(PHOTON_ESCAPED | kept, flux, ray.direction, light_index);
    }
    let distance = light_texel_distance(ray, light_texel_ray(light, ray, at, params.shadow_map_size), texel);
    let cosine = abs(dot(texel.normal, ray.direction));
    let spread = select(1.0 / (distance * distance), 1.0, light.kind == LIGHT_DIRECTIONAL);
    let back = select(0u, HIT_BACK, (texel.flags & SURFACE_TEXEL_BACK_FACE) != 0u);
    let lobe = surface_texel_lobe(texel) | back;
    var density = pdf * cosine * spread;
    if lobe_is_specular(lobe) {
        let radius = inverseSqrt(max(pdf * spread, 1e-20));
        let growth = select(radius / distance, 0.0, light.kind == LIGHT_DIRECTIONAL);
        density = photon_footprint(radius, growth);
    }
    return Photon(
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
