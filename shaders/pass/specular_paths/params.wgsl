// The uniform of all steps, and what is kept of a path from step to step.

struct Params {
    // Pixels in a row of the G-buffer; of the rows, from, how many
    width: u32,
    first_row: u32,
    row_count: u32,
    // Surfaces met before this step, the one that the eye sees not counted
    step: u32,
    // Steps in all
    steps: u32,
    // Paths of each pixel before this one, and in all
    round: u32,
    rounds: u32,
    sample_offset: u32,
    light_count: u32,
    shadow_map_size: u32,
    // Factors of light that comes straight from a source, and of all other light
    direct_weight: f32,
    indirect_weight: f32,
    // 1: what is glossy to the eye is left out
    skips_glossy: u32,
}

// What is next for a path: nothing, or a ray that a rough surface scattered, or one that a mirror or smooth glass sent on.
const SPECULAR_ENDED: u32 = 0u;
const SPECULAR_FROM_ROUGH: u32 = 1u;
const SPECULAR_FROM_SMOOTH: u32 = 2u;

struct SpecularPath {
    // What radiance from further on is worth at the eye
    throughput: vec3f,
    // SPECULAR_ENDED, SPECULAR_FROM_ROUGH or SPECULAR_FROM_SMOOTH
    state: u32,
    // Of all of the pixel's paths so far
    radiance: vec3f,
}

// Four numbers in [0, 1) for each pixel, path and surface on it.
fn specular_random(pixel: vec2u, surface: u32) -> vec4f {
    let word = hash_pcg4d(vec4u(pixel, params.sample_offset, 0x5bec0000u + 64u * params.round + surface));
    return vec4f(word >> vec4u(8u)) * 0x1p-24;
}

fn specular_state(scatterer: Scatterer) -> u32 {
    return select(SPECULAR_FROM_ROUGH, SPECULAR_FROM_SMOOTH, scatter_is_smooth(scatterer));
}

// The ray of a path that has ended: it leaves the region at once.
fn specular_no_ray() -> SurfaceRay {
    let away = vec3f(0.57735027);
    return SurfaceRay(8.0 * away, octahedral_pack(away), away, 0u);
}

// The ray that goes on from a surface.
fn specular_ray(position: vec3f, normal: vec3f, direction: vec3f) -> SurfaceRay {
    let side = select(-normal, normal, dot(normal, direction) > 0.0);
    return SurfaceRay(position, octahedral_pack(side), direction, 0u);
}
