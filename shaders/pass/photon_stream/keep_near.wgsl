// Of each new path the photon that is kept for what discs lose near by, or none. A disc of area A gives pi r^2 / (pi r^2 + A)
// of what its points do at the distance r: a photon that came so far is kept by the chance of the rest. What comes by way of
// metal or glass no light brings: all of it is kept.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> photons: array<Photon>;
@group(0) @binding(2) var<storage, read> lights: array<SurfaceLight>;
@group(0) @binding(3) var<storage, read> pool: array<Impact>;
@group(0) @binding(4) var<storage, read_write> near: array<Photon>;

// A number of `hash_unit` that fluxes of the pool's slots are not rounded by.
const NEAR_DIMENSION: u32 = 3u;

// What lights do not bring of the photon of a hop, as a share.
fn kept_share(hop: u32, index: u32, path: u32) -> f32 {
    let photon = photons[hop * params.path_count + index];
    if !photon_is_splatted(photon.state) {
        return 0.0;
    }
    let before = photons[(hop - 1u) * params.path_count + index];
    if (before.state & PHOTON_LOBE_KIND) != 0u {
        return 1.0;
    }
    let impact = pool[(hop - 1u) * params.pool_count + path];
    if !impact_counts(impact) {
        return 0.0;
    }
    let area = lights[impact.light].area;
    let way = photon.position - before.position;
    return area / (area + SURFACE_LIGHT_PI * dot(way, way));
}

@compute @workgroup_size(64)
fn keep_near(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * params.row + id.x;
    if id.x >= params.row || index >= params.path_count {
        return;
    }
    let path = (params.first_path + index) % params.pool_count;
    var all = 0.0;
    for (var hop = 1u; hop <= params.hop_count; hop++) {
        all += kept_share(hop, index, path);
    }
    // One of them, as often as it is to be kept; all of them together at most always, and then for more.
    let place = hash_unit(path, NEAR_DIMENSION) * max(all, 1.0);
    near[path] = Photon();
    var passed = 0.0;
    for (var hop = 1u; hop <= params.hop_count; hop++) {
        let before = passed;
        passed += kept_share(hop, index, path);
        if place >= before && place < passed {
            near[path] = photons[hop * params.path_count + index];
            near[path].flux *= params.share * max(all, 1.0);
        }
    }
}
