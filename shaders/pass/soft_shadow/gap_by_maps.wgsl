// How far something in the shadow maps stands before a point. The module brings `shadow_maps`.

// Distance from a point on the receiver's plane to what hides the light's middle from it, or NO_OCCLUDER.
fn gap_by_maps(light: Light, p: vec3f, normal: vec3f) -> f32 {
    let size = params.shadow_map_size;
    let probe = shadow_probe(light, p, size);
    if !probe.is_inside {
        return NO_OCCLUDER;
    }
    let texel = surface_texel_unpack(textureLoad(shadow_maps, probe.texel, probe.ray.layer, 0));
    let is_lit = shadow_is_lit(light, probe, texel, p, normal, size);
    return select(max(probe.distance - texel.distance, 0.0), NO_OCCLUDER, is_lit);
}
