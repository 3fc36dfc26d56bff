// Direct light with hard shadows. The module brings `lights`, `polygons` and `shadow_maps`.

// Irradiance that all lights give the point p of a surface with normal n, as far as shadow maps say that they reach it.
fn direct_irradiance(p: vec3f, n: vec3f, light_count: u32, map_size: u32) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < light_count; i++) {
        let e = light_irradiance(lights[i], p, n);
        if any(e > vec3f(0.0)) && is_lit(lights[i], p, n, map_size) {
            sum += e;
        }
    }
    return sum;
}
