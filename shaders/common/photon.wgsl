// Twin of `resource::Photon`: 48 bytes, three 16-byte loads.

const PHOTON_EMPTY: u32 = 0u;
const PHOTON_STORED: u32 = 1u;
const PHOTON_ESCAPED: u32 = 2u;
const PHOTON_LOST: u32 = 3u;
const PHOTON_STATE_MASK: u32 = 3u;
const PHOTON_FIRST_HIT: u32 = 256u;
const PHOTON_TENTATIVE: u32 = 512u;

struct Photon {
    position: vec3f,
    state: u32,
    flux: vec3f,
    density: f32,
    normal: u32,
    direction: u32,
    reflectance: u32,
    light: u32,
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
