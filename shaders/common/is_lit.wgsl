// The hard shadow test. The module brings `shadow_maps`.

// Whether light reaches the point p of a surface with normal n, which faces the light.
fn is_lit(light: Light, p: vec3f, n: vec3f, map_size: u32) -> bool {
    let probe = shadow_probe(light, p, map_size);
    if !probe.is_inside {
        return true;
    }
    let texel = surface_texel_unpack(textureLoad(shadow_maps, probe.texel, probe.ray.layer, 0));
    return shadow_is_lit(light, probe, texel, p, n, map_size);
}
