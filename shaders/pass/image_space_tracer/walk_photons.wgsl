// The photon walk: scatter, trace, store, up to `bounces` times (Yao et al. 2010, section 3). One invocation a path.

struct Params {
    photon_count: u32,
    bounces: u32,
    // First scattering that Russian roulette may end
    roulette_from: u32,
    sample_offset: u32,
    map_count: u32,
    map_size: u32,
    iterations: u32,
    // 1 - cos of the largest angle that the paper's test accepts
    epsilon: f32,
    row: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var env_maps: texture_2d_array<u32>;
// w: 1 where the map is to be asked, 0 where it is switched off
@group(0) @binding(2) var<storage, read> centers: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> photons: array<Photon>;

// Rays leave a surface from this far above it, along its geometric normal, unit frame.
const WALK_OFFSET: f32 = 0x1p-12;
// Random dimensions of Russian roulette start here, above those of directions.
const WALK_ROULETTE_DIMENSION: u32 = 1024u;
const WALK_INVERSE_PI: f32 = 0.318309886;

// What survives a scattering: flux times reflectance, or zero. From `roulette_from` on a path survives with the
// probability of its largest factor, and is then worth that much more.
fn scatter_flux(photon: Photon, bounce: u32, sequence_index: u32) -> vec3f {
    let reflectance = reflectance_unpack(photon.reflectance);
    let scattered = photon.flux * reflectance;
    if bounce < params.roulette_from {
        return scattered;
    }
    let survival = max(reflectance.x, max(reflectance.y, reflectance.z));
    if random_unit(sequence_index, WALK_ROULETTE_DIMENSION + bounce) >= survival {
        return vec3f(0.0);
    }
    return scattered / survival;
}

// One hop from a stored photon.
fn next_photon(photon: Photon, flux: vec3f, bounce: u32, sequence_index: u32) -> Photon {
    let normal = octahedral_unpack(photon.normal);
    let local = sampling_cosine(random_pair(sequence_index, 2u * bounce));
    let direction = normalize(sampling_frame(normal) * local);
    let hit = trace_ray(photon.position + WALK_OFFSET * normal, normal, direction);
    if hit.kind != TRACE_HIT {
        return photon_gone(select(PHOTON_LOST, PHOTON_ESCAPED, hit.kind == TRACE_ESCAPED), flux, direction, photon.light);
    }
    let cosines = local.z * max(0.0, -dot(hit.normal, direction));
    return Photon(
        hit.position,
        PHOTON_STORED,
        flux,
        WALK_INVERSE_PI * cosines / (hit.distance * hit.distance),
        octahedral_pack(hit.normal),
        octahedral_pack(direction),
        reflectance_pack(hit.reflectance),
        photon.light,
    );
}

@compute @workgroup_size(64)
fn walk_photons(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * params.row + id.x;
    if id.x >= params.row || index >= params.photon_count {
        return;
    }
    let sequence_index = params.sample_offset + index;
    var photon = photons[index];
    for (var bounce = 1u; bounce <= params.bounces; bounce++) {
        let slot = bounce * params.photon_count + index;
        var flux = vec3f(0.0);
        if (photon.state & PHOTON_STATE_MASK) == PHOTON_STORED {
            flux = scatter_flux(photon, bounce, sequence_index);
        }
        if all(flux == vec3f(0.0)) {
            photon.state = PHOTON_EMPTY;
            photons[slot].state = PHOTON_EMPTY;
            continue;
        }
        photon = next_photon(photon, flux, bounce, sequence_index);
        photons[slot] = photon;
    }
}
