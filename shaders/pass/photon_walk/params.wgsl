// The uniform of a walk.

struct WalkParams {
    photon_count: u32,
    // Walked are these hops and those between them; hop 0 only where photons start at their lights
    first_hop: u32,
    last_hop: u32,
    // First scattering that Russian roulette may end
    roulette_from: u32,
    sample_offset: u32,
    // Invocations in a row of the dispatch over all paths
    row: u32,
    // 1: another tracer walks again what is lost or not certain
    is_shared: u32,
    // PHOTON_MAP_...
    map: u32,
    // Share of the paths that go on as `reflection_tables` say
    guided: f32,
}

// What is kept of paths: all of them; all, but what comes to a diffuse surface by way of specular ones alone is marked as the
// business of a caustic map; only that.
const PHOTON_MAP_ALL: u32 = 0u;
const PHOTON_MAP_GLOBAL: u32 = 1u;
const PHOTON_MAP_CAUSTIC: u32 = 2u;
