// Lights that no ray can run into, on rough surfaces. The module brings `lights`, `polygons` and `shadow_maps`.

// Radiance that a rough surface sends towards the eye of point lights, spots and suns; those that stand for an environment, which
// rays can meet, only `with_environment`.
fn punctual_light(
    scatterer: Scatterer, p: vec3f, outgoing: vec3f, light_count: u32, map_size: u32, with_environment: bool,
) -> vec3f {
    var sum = vec3f(0.0);
    if scatter_is_smooth(scatterer) {
        return sum;
    }
    for (var i = 0u; i < light_count; i++) {
        if lights[i].kind == LIGHT_AREA || (light_is_met(lights[i]) && !with_environment) {
            continue;
        }
        var incoming = -lights[i].direction;
        if lights[i].kind != LIGHT_DIRECTIONAL {
            incoming = normalize(lights[i].position - p);
        }
        let scattered = scatter_evaluate(scatterer, outgoing, incoming).rgb;
        // Irradiance of a surface across the light.
        let e = light_irradiance(lights[i], p, incoming);
        let n = scatterer.frame[2];
        let side = select(-n, n, dot(n, incoming) > 0.0);
        if any(scattered * e > vec3f(0.0)) && is_lit(lights[i], p, side, map_size) {
            sum += scattered * e;
        }
    }
    return sum;
}
