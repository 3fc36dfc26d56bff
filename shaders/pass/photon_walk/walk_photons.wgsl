// The photon walk: scatter, trace, store, hop after hop (Yao et al. 2010, section 3). One invocation a path. The tracer
// brings `trace_ray`, and what it reads as group 1.

@group(0) @binding(0) var<uniform> walk: WalkParams;
@group(0) @binding(1) var<storage, read_write> photons: array<Photon>;
// Where paths go on to from diffuse surfaces
@group(0) @binding(2) var<storage, read> reflection_tables: array<ReflectionTable>;

// Random dimensions of Russian roulette start here, above those of directions.
const WALK_ROULETTE_DIMENSION: u32 = 1024u;
// And those of whether glass reflects or transmits.
const WALK_FRESNEL_DIMENSION: u32 = 2048u;
const WALK_INVERSE_PI: f32 = 0.318309886;
// A hop counts as no shorter than this, unit frame, so that its density is finite.
const WALK_SHORTEST: f32 = 0x1p-20;

// What survives a scattering: flux times reflectance, or zero. From `roulette_from` on a path survives with the
// probability of its largest factor, and is then worth that much more.
fn scatter_flux(photon: Photon, reflectance: vec3f, bounce: u32, sequence_index: u32) -> vec3f {
    let scattered = photon.flux * reflectance;
    if bounce < walk.roulette_from {
        return scattered;
    }
    let survival = min(max(reflectance.x, max(reflectance.y, reflectance.z)), 1.0);
    if random_unit(sequence_index, WALK_ROULETTE_DIMENSION + bounce) >= survival {
        return vec3f(0.0);
    }
    return scattered / survival;
}

// How densely photons arrive that leave in a direction.
struct Spread {
    // Per solid angle, from a point; 0: from a footprint
    density: f32,
    // Radius of the footprint at the start, and what it grows by in a unit of length
    radius: f32,
    growth: f32,
}

fn spread_from_point(density: f32) -> Spread {
    return Spread(density, 0.0, inverseSqrt(max(density, 1e-20)));
}

// What a hop arrives as that left `origin` in this direction.
fn arrived(origin: Photon, flux: vec3f, direction: vec3f, spread: Spread, hit: Hit) -> Photon {
    let light = photon_light(origin.light_and_surface) | photon_lobe_light(hit.lobe);
    let kept = origin.state & PHOTON_GUIDING;
    if hit.kind != HIT_SURFACE && hit.kind != HIT_TENTATIVE {
        let fate = select(PHOTON_LOST, PHOTON_ESCAPED, hit.kind == HIT_ESCAPED);
        return photon_gone(fate | kept, flux, direction, light);
    }
    let cosine = max(0.0, -dot(hit.normal, direction));
    let distance = max(hit.distance, WALK_SHORTEST);
    return Photon(
        hit.position,
        select(PHOTON_STORED, PHOTON_STORED | PHOTON_TENTATIVE, hit.kind == HIT_TENTATIVE) | kept | photon_lobe_state(hit.lobe),
        flux * hit.adjoint,
        arrived_density(spread, cosine, distance, hit.lobe),
        octahedral_pack(hit.normal),
        octahedral_pack(direction),
        reflectance_pack(hit.reflectance),
        light | (hit.surface << 16u),
    );
}

fn arrived_density(spread: Spread, cosine: f32, distance: f32, lobe: u32) -> f32 {
    let radius = spread.radius + spread.growth * distance;
    if lobe_is_specular(lobe) {
        return photon_footprint(radius, spread.growth);
    }
    if spread.density > 0.0 {
        return spread.density * cosine / (distance * distance);
    }
    return cosine / (radius * radius);
}

// How a photon leaves a specular surface: the direction, with density per solid angle (0: the only one), and the share of flux.
fn scatter_specular(photon: Photon, lobe: u32, bounce: u32, sequence_index: u32) -> Scattering {
    let is_front = (photon.state & PHOTON_BACK) == 0u;
    let color = reflectance_unpack(photon.reflectance);
    let scatterer = scatter_by_lobe(lobe, octahedral_unpack(photon.normal), is_front, color);
    let u = random_pair(sequence_index, 2u * bounce);
    let chance = random_unit(sequence_index, WALK_FRESNEL_DIMENSION + bounce);
    var scattering = scatter_sample(scatterer, -octahedral_unpack(photon.direction), vec4f(u, chance, 0.0));
    // Flux is not squeezed as radiance is.
    scattering.weight *= scattering.squeeze;
    return scattering;
}

// One hop from a photon on a specular surface. Its footprint grows on as behind a flat mirror, and at least as the lobe
// spreads.
fn next_specular(photon: Photon, flux: vec3f, scattering: Scattering) -> Photon {
    let direction = scattering.direction;
    let normal = octahedral_unpack(photon.normal);
    let side = select(-normal, normal, dot(normal, direction) > 0.0);
    let footprint = photon_footprint_of(photon.density);
    var growth = footprint.y;
    if scattering.pdf > 0.0 {
        growth = max(growth, inverseSqrt(scattering.pdf));
    }
    let hit = trace_ray(photon.position, side, direction);
    return arrived(photon, flux, direction, Spread(0.0, footprint.x, growth), hit);
}

// One hop from a stored photon.
fn next_photon(photon: Photon, flux: vec3f, bounce: u32, sequence_index: u32) -> Photon {
    let normal = octahedral_unpack(photon.normal);
    var u = random_pair(sequence_index, 2u * bounce);
    var boost = 1.0;
    var origin = photon;
    if photon_goes_by_tables(photon.state) && walk.guided > 0.0 {
        let table = reflection_table(photon.position, normal);
        let is_guided = (photon.state & PHOTON_IS_GUIDED) != 0u;
        if is_guided {
            u = reflection_place(table, u);
        }
        let guidance = photon_guidance(photon.state) * reflection_guidance(table, reflection_cell_at(u));
        let chance = random_guidance(sequence_index, bounce);
        let guiding = photon_guiding(is_guided, photon_cell(photon.state), guidance, chance);
        origin.state = (photon.state & ~PHOTON_GUIDING) | guiding;
        boost = photon_boost(origin.state, walk.guided) / photon_boost(photon.state, walk.guided);
    }
    let local = sampling_cosine(u);
    let direction = normalize(sampling_frame(normal) * local);
    let hit = trace_ray(photon.position, normal, direction);
    return arrived(origin, flux / boost, direction, spread_from_point(WALK_INVERSE_PI * local.z), hit);
}

// The first hop of a photon that stands at its light.
fn first_photon(start: Photon) -> Photon {
    let normal = octahedral_unpack(start.normal);
    let direction = octahedral_unpack(start.direction);
    let hit = trace_ray(start.position, normal, direction);
    if hit.kind == HIT_LOST || (hit.kind == HIT_TENTATIVE && walk.is_shared == 1u) {
        // Where it started is not forgotten: another tracer sets out from there.
        var lost = start;
        lost.state = (start.state & ~PHOTON_STATE_MASK) | PHOTON_LOST;
        return lost;
    }
    var spread = spread_from_point(start.density * WALK_INVERSE_PI * max(0.0, dot(normal, direction)));
    if (start.state & PHOTON_PARALLEL) != 0u {
        spread = Spread(0.0, inverseSqrt(max(start.density, 1e-20)), 0.0);
    }
    var photon = arrived(start, start.flux, direction, spread, hit);
    photon.state |= PHOTON_FIRST_HIT | (start.state & PHOTON_OF_FLAT);
    return photon;
}

// The hops of one path. A hop depends on the one before it alone, so that walking them one at a time is the same.
fn walk_path(index: u32) {
    let sequence_index = walk.sample_offset + index;
    let scattered_from = max(walk.first_hop, 1u);
    let last = min(walk.last_hop, arrayLength(&photons) / walk.photon_count - 1u);
    var photon = photons[(scattered_from - 1u) * walk.photon_count + index];
    if (photon.state & PHOTON_STARTED) != 0u && walk.first_hop == 0u {
        photon = first_photon(photon);
        photons[index] = photon;
    }
    for (var bounce = scattered_from; bounce <= last; bounce++) {
        let slot = bounce * walk.photon_count + index;
        let lobe = photon_lobe(photon.state, photon.light_and_surface);
        let is_specular = lobe_is_specular(lobe);
        var flux = vec3f(0.0);
        var scattering: Scattering;
        let goes_on = is_specular || walk.map != PHOTON_MAP_CAUSTIC;
        if goes_on && (photon.state & PHOTON_STATE_MASK) == PHOTON_STORED {
            var share = reflectance_unpack(photon.reflectance);
            if is_specular {
                scattering = scatter_specular(photon, lobe, bounce, sequence_index);
                share = scattering.weight;
            }
            flux = scatter_flux(photon, share, bounce, sequence_index);
        }
        if all(flux == vec3f(0.0)) {
            photon.state = PHOTON_EMPTY;
            photons[slot].state = PHOTON_EMPTY;
            continue;
        }
        if is_specular {
            let is_caustic = (photon.state & (PHOTON_FIRST_HIT | PHOTON_CAUSTIC)) != 0u && walk.map == PHOTON_MAP_GLOBAL;
            photon = next_specular(photon, flux, scattering);
            photon.state |= select(0u, PHOTON_CAUSTIC, is_caustic);
        } else {
            photon = next_photon(photon, flux, bounce, sequence_index);
        }
        photons[slot] = photon;
    }
}

@compute @workgroup_size(64)
fn walk_photons(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * walk.row + id.x;
    if id.x < walk.row && index < walk.photon_count {
        walk_path(index);
    }
}
