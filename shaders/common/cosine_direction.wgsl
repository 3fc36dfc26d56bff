// Directions from a surface, as dense as the cosine.

// The i-th of so many, by Hammersley's points on the square shifted by two numbers of the point's own. `frame` has the normal
// as its third axis.
fn cosine_direction(frame: mat3x3f, i: u32, count: u32, shift: vec2f) -> vec3f {
    let u = fract(vec2f((f32(i) + 0.5) / f32(count), halton(i, 0u)) + shift);
    return normalize(frame * sampling_cosine(min(u, vec2f(HALTON_BELOW_ONE))));
}
