// Reflection at the boundary of two dielectrics, without polarisation.

// Share of light that is reflected, and the cosine of the refracted direction (0 where all is reflected), for the cosine
// of the incoming direction (> 0) and the index of refraction of the far side over that of the near side.
fn fresnel_dielectric(cosine: f32, eta: f32) -> vec2f {
    // Snell: sin^2 t = sin^2 i / eta^2.
    let squared = 1.0 - (1.0 - cosine * cosine) / (eta * eta);
    if squared <= 0.0 {
        return vec2f(1.0, 0.0);
    }
    let refracted = sqrt(squared);
    let parallel = (eta * cosine - refracted) / (eta * cosine + refracted);
    let perpendicular = (cosine - eta * refracted) / (cosine + eta * refracted);
    return vec2f(0.5 * (parallel * parallel + perpendicular * perpendicular), refracted);
}
