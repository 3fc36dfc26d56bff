// Twin of `resource::Photon`: 48 bytes, three 16-byte loads.

const PHOTON_EMPTY: u32 = 0u;
const PHOTON_STORED: u32 = 1u;
const PHOTON_ESCAPED: u32 = 2u;
const PHOTON_LOST: u32 = 3u;
const PHOTON_STATE_MASK: u32 = 3u;
const PHOTON_FIRST_HIT: u32 = 256u;
const PHOTON_TENTATIVE: u32 = 512u;
// On the surface of a light, before its first hop: position, normal and direction are those of its start, the density is how
// much more densely photons start this way. Stays on a first hop that is lost or, while another tracer follows, not certain.
const PHOTON_STARTED: u32 = 1024u;
// What a path keeps from its emission: bits 16 to 23 the cell that it started in, bits 24 to 31 how much more densely photons
// start there than if they were spread evenly, 0 if they are.
const PHOTON_EMISSION: u32 = 0xffff0000u;
const PHOTON_BOOST_STEPS: f32 = 16.0;
const PHOTON_BOOST_ONE: f32 = 128.0;

struct Photon {
    position: vec3f,
    state: u32,
    flux: vec3f,
    density: f32,
    normal: u32,
    direction: u32,
    reflectance: u32,
    // Bits 0 to 15 the light that the path began at, 16 to 31 the surface, 0: none in particular
    light_and_surface: u32,
}

fn photon_emission(cell: u32, boost: f32) -> u32 {
    return (cell << 16u) | (u32(clamp(PHOTON_BOOST_ONE + round(PHOTON_BOOST_STEPS * log2(boost)), 1.0, 255.0)) << 24u);
}

fn photon_light(light_and_surface: u32) -> u32 {
    return light_and_surface & 0xffffu;
}

fn photon_surface(light_and_surface: u32) -> u32 {
    return light_and_surface >> 16u;
}

fn photon_cell(state: u32) -> u32 {
    return (state >> 16u) & 255u;
}

fn photon_boost(state: u32) -> f32 {
    let steps = f32(state >> 24u) - PHOTON_BOOST_ONE;
    return select(exp2(steps / PHOTON_BOOST_STEPS), 1.0, (state >> 24u) == 0u);
}

// A hop that met no surface.
fn photon_gone(state: u32, flux: vec3f, direction: vec3f, light: u32) -> Photon {
    return Photon(vec3f(0.0), state, flux, 0.0, 0u, octahedral_pack(direction), 0u, light);
}

// Whether it counts in density estimation: it arrived at a surface, and not straight from its light.
fn photon_is_splatted(state: u32) -> bool {
    return (state & (PHOTON_STATE_MASK | PHOTON_FIRST_HIT)) == PHOTON_STORED;
}

// Whether a surer tracer should walk the hop again.
fn photon_is_unresolved(state: u32) -> bool {
    return (state & PHOTON_STATE_MASK) == PHOTON_LOST || (state & PHOTON_TENTATIVE) != 0u;
}
