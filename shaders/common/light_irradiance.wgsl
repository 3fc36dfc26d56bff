// Irradiance that an unoccluded light gives a surface element. The module brings `polygons`.
fn light_irradiance(light: Light, p: vec3f, n: vec3f) -> vec3f {
    if light.kind == LIGHT_DIRECTIONAL {
        return light.intensity * light_sun_cosine(light, -dot(n, light.direction));
    }
    if light.kind == LIGHT_AREA {
        var sum = vec3f(0.0);
        for (var i = 0u; i < light.direct_polygons; i++) {
            let polygon = polygons[light.first_polygon + i];
            sum += polygon.radiance * polygon_irradiance(polygon, p, n);
        }
        return sum;
    }
    let to_light = light.position - p;
    let distance_squared = max(dot(to_light, to_light), 0x1p-60);
    let l = to_light * inverseSqrt(distance_squared);
    var falloff = 1.0;
    if light.kind == LIGHT_SPOT {
        falloff = sampling_spot_falloff(sampling_one_minus_cos(-l, light.direction), light.inner, light.outer);
    }
    return light.intensity * (falloff * max(0.0, dot(n, l)) / distance_squared);
}
