// Candidates' maps in their atlas: tile 6 c + f, row by row, holds face f of candidate c. The file that uses it binds
// `atlas` and `centers` and has `params.columns`.

// Texels along a face. Twin of `CANDIDATE_SIZE`.
const CANDIDATE_SIZE: u32 = 32u;
const CANDIDATE_TEXELS: u32 = 6u * CANDIDATE_SIZE * CANDIDATE_SIZE;
// A texel's true footprint is finite though its plane be grazed: the cosine at which it is seen counts as at least half
// the angle that the texel spans.
const CANDIDATE_LEAST_COSINE: f32 = 1.0 / f32(CANDIDATE_SIZE);

struct CandidateTexel {
    surface: SurfaceTexel,
    // Unit
    direction: vec3f,
    // Cosine of the direction to the face's forward axis
    cos_forward: f32,
}

fn candidate_load(candidate: u32, face: u32, at: vec2u) -> SurfaceTexel {
    let tile = 6u * candidate + face;
    let corner = vec2u(tile % params.columns, tile / params.columns) * CANDIDATE_SIZE;
    return surface_texel_unpack(textureLoad(atlas, corner + at, 0));
}

fn candidate_texel(candidate: u32, index: u32) -> CandidateTexel {
    let face = index / (CANDIDATE_SIZE * CANDIDATE_SIZE);
    let at = vec2u(index % CANDIDATE_SIZE, index / CANDIDATE_SIZE % CANDIDATE_SIZE);
    let d = cube_face_direction(face, (vec2f(at) + 0.5) / f32(CANDIDATE_SIZE));
    let cos_forward = inverseSqrt(dot(d, d));
    return CandidateTexel(candidate_load(candidate, face, at), d * cos_forward, cos_forward);
}

// Area of the surface that the texel shows (Yao et al. 2010, Eq. 1): its solid angle (4 / N) cos^3 over the face's N
// texels, times squared distance, over the cosine at which the surface is seen. The backs of surfaces count nothing.
fn candidate_area(texel: CandidateTexel) -> f32 {
    let surface = texel.surface;
    if surface.distance <= 0.0 || (surface.flags & SURFACE_TEXEL_BACK_FACE) != 0u {
        return 0.0;
    }
    let cos_surface = max(-dot(surface.normal, texel.direction), CANDIDATE_LEAST_COSINE);
    let solid_angle = 4.0 / f32(CANDIDATE_SIZE * CANDIDATE_SIZE) * texel.cos_forward * texel.cos_forward * texel.cos_forward;
    return solid_angle * surface.distance * surface.distance / cos_surface;
}

// Whether a candidate's map shows the front of a surface at p: it turns towards the candidate, and the texel in its
// direction holds a surface in whose plane p lies or before it.
fn candidate_sees(candidate: u32, p: vec3f, normal: vec3f) -> bool {
    let to_p = p - centers[candidate].xyz;
    if dot(normal, to_p) >= 0.0 {
        return false;
    }
    let point = cube_face_point(to_p);
    let at = cube_face_texel(point.uv, CANDIDATE_SIZE);
    let surface = candidate_load(candidate, point.face, at);
    if surface.distance <= 0.0 {
        return false;
    }
    let direction = normalize(cube_face_direction(point.face, (vec2f(at) + 0.5) / f32(CANDIDATE_SIZE)));
    return dot(surface.normal, to_p - direction * surface.distance) >= -params.tolerance;
}
