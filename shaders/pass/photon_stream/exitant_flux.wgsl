// What an impact counts for. The module brings `grid`.

// Flux that an impact's surface sends on, if it is diffuse.
fn exitant_flux(photon: Photon) -> vec3f {
    let is_diffuse = (photon.state & (PHOTON_STATE_MASK | PHOTON_LOBE_KIND)) == PHOTON_STORED;
    return select(vec3f(0.0), photon.flux * reflectance_unpack(photon.reflectance), is_diffuse);
}

// In whole steps, rounded up or down by chance, which is the same for the same slot of the pool: then the same photon in the
// same place counts the same.
fn flux_steps(flux: vec3f, slot: u32) -> vec3u {
    let chance = vec3f(hash_unit(slot, 0u), hash_unit(slot, 1u), hash_unit(slot, 2u));
    return vec3u(min(flux * grid.steps + chance, vec3f(0x1p30)));
}
