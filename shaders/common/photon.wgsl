// Twin of `resource::Photon`: 48 bytes, three 16-byte loads.

const PHOTON_EMPTY: u32 = 0u;
const PHOTON_STORED: u32 = 1u;
const PHOTON_ESCAPED: u32 = 2u;
const PHOTON_LOST: u32 = 3u;
const PHOTON_STATE_MASK: u32 = 3u;
const PHOTON_FIRST_HIT: u32 = 256u;
const PHOTON_TENTATIVE: u32 = 512u;
// At its light, before its first hop: position, normal and direction are those of its start, the density is how much more
// densely photons start this way than by the cosine; with PHOTON_PARALLEL it is one of parallel rays, and the density that per
// area across them. Stays on a first hop that is lost or, while another tracer follows, not certain.
const PHOTON_STARTED: u32 = 1024u;
const PHOTON_PARALLEL: u32 = 8192u;
// How the surface scatters (lobe.wgsl): bits 2 to 7 are bits 0 to 5 of the lobe, the kind among them; bits 8 to 15 of
// `light_and_surface` are the others. And whether its back was hit.
const PHOTON_LOBE_SHIFT: u32 = 2u;
const PHOTON_LOBE_KIND: u32 = 12u;
const PHOTON_BACK: u32 = 2048u;
// It came by way of specular surfaces alone, and photons of a caustic map stand for it.
const PHOTON_CAUSTIC: u32 = 4096u;
// It came straight from a flat light: set beside PHOTON_STARTED and PHOTON_FIRST_HIT.
const PHOTON_OF_FLAT: u32 = 16384u;
// While some photons are guided: bit 15 whether this one is, bits 16 to 23 the cell that the path started in, bits 24 to 31 how many
// times as densely guided ones come this way as those that are spread evenly, in eighths of a doubling. Else 0.
const PHOTON_GUIDING: u32 = 0xffff8000u;
const PHOTON_IS_GUIDED: u32 = 0x8000u;
const PHOTON_GUIDANCE_STEPS: f32 = 8.0;
const PHOTON_GUIDANCE_ONE: f32 = 128.0;
// Beyond these eight bits might not hold what comes of one more table: such paths go on evenly.
const PHOTON_LEAST_GUIDANCE: f32 = 0x1p-12;
const PHOTON_MOST_GUIDANCE: f32 = 0x1p11;

struct Photon {
    position: vec3f,
    state: u32,
    flux: vec3f,
    // On a specular surface photon_footprint instead: its radius here, and how much it grows in a unit of length
    density: f32,
    normal: u32,
    direction: u32,
    reflectance: u32,
    // Bits 0 to 7 the light that the path began at, 16 to 31 the surface, 0: none in particular
    light_and_surface: u32,
}

// Guidance is rounded up or down by chance, so that the mean of its inverse is right; that of the inverse of a boost is low by up
// to 0.04 %.
fn photon_guiding(is_guided: bool, cell: u32, guidance: f32, chance: f32) -> u32 {
    let steps = clamp(PHOTON_GUIDANCE_ONE + PHOTON_GUIDANCE_STEPS * log2(guidance), 1.0, 254.0);
    let above = steps - floor(steps);
    let is_up = chance * (1.0 - exp2(-1.0 / PHOTON_GUIDANCE_STEPS)) < 1.0 - exp2(-above / PHOTON_GUIDANCE_STEPS);
    return select(0u, PHOTON_IS_GUIDED, is_guided) | (cell << 16u) | ((u32(steps) + u32(is_up)) << 24u);
}

fn photon_light(light_and_surface: u32) -> u32 {
    return light_and_surface & 0xffu;
}

// Bits of `state`, and of `light_and_surface`, of a hit's lobe.
fn photon_lobe_state(lobe: u32) -> u32 {
    return ((lobe & 63u) << PHOTON_LOBE_SHIFT) | select(0u, PHOTON_BACK, (lobe & 0x4000u) != 0u);
}

fn photon_lobe_light(lobe: u32) -> u32 {
    return ((lobe >> 6u) & 0xffu) << 8u;
}

fn photon_lobe(state: u32, light_and_surface: u32) -> u32 {
    return ((state >> PHOTON_LOBE_SHIFT) & 63u) | (((light_and_surface >> 8u) & 0xffu) << 6u);
}

fn photon_surface(light_and_surface: u32) -> u32 {
    return light_and_surface >> 16u;
}

fn photon_cell(state: u32) -> u32 {
    return (state >> 16u) & 255u;
}

fn photon_guidance(state: u32) -> f32 {
    let steps = f32(state >> 24u) - PHOTON_GUIDANCE_ONE;
    return select(exp2(steps / PHOTON_GUIDANCE_STEPS), 1.0, (state >> 24u) == 0u);
}

// Whether it goes on from a diffuse surface as a table says, if it is guided, and is weighed as if it did, if not.
fn photon_goes_by_tables(state: u32) -> bool {
    let guidance = photon_guidance(state);
    return (state >> 24u) != 0u && guidance > PHOTON_LEAST_GUIDANCE && guidance < PHOTON_MOST_GUIDANCE;
}

// How many times as densely photons of which a share is guided come this way as if all were spread evenly.
fn photon_boost(state: u32, share: f32) -> f32 {
    return mix(1.0, photon_guidance(state), share);
}

// The footprint of a photon, both numbers as the upper halves of their bits: within 0.4 %. Its own number is finite, for its
// upper half is that of the radius.
fn photon_footprint(radius: f32, growth: f32) -> f32 {
    let halves = bitcast<vec2u>(clamp(vec2f(radius, growth), vec2f(0x1p-20), vec2f(0x1p20))) + vec2u(0x8000u);
    return bitcast<f32>((halves.x & 0xffff0000u) | (halves.y >> 16u));
}

// Radius, growth.
fn photon_footprint_of(density: f32) -> vec2f {
    let bits = bitcast<u32>(density);
    return vec2f(bitcast<f32>(bits & 0xffff0000u), bitcast<f32>(bits << 16u));
}

// A hop that met no surface.
fn photon_gone(state: u32, flux: vec3f, direction: vec3f, light: u32) -> Photon {
    return Photon(vec3f(0.0), state, flux, 0.0, 0u, octahedral_pack(direction), 0u, light);
}

// Whether it is indirect light: it arrived at a diffuse surface, and not straight from its light.
fn photon_is_indirect(state: u32) -> bool {
    return (state & (PHOTON_STATE_MASK | PHOTON_FIRST_HIT | PHOTON_LOBE_KIND)) == PHOTON_STORED;
}

// Whether it counts in density estimation on the screen.
fn photon_is_splatted(state: u32) -> bool {
    return photon_is_indirect(state) && (state & PHOTON_CAUSTIC) == 0u;
}

// Whether a surer tracer should walk the hop again.
fn photon_is_unresolved(state: u32) -> bool {
    return (state & PHOTON_STATE_MASK) == PHOTON_LOST || (state & PHOTON_TENTATIVE) != 0u;
}
