// Weighs the hops that arrive where the eye sees by how much of their part of the image they stand for: first the photons of each
// tile of the view are counted, then each hop brings its share of its tile to all cells that its path came by.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> photons: array<Photon>;
@group(0) @binding(2) var<storage, read_write> emission_counts: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read_write> reflection_counts: array<atomic<u32>>;
@group(0) @binding(4) var<uniform> view: View;
@group(0) @binding(5) var depth_texture: texture_2d<f32>;
@group(0) @binding(6) var<storage, read_write> tiles: array<atomic<u32>, TILE_TOTAL>;

// Tiles along each axis of the view. Twin of `TILES`.
const TILES: u32 = 32u;
const TILE_TOTAL: u32 = TILES * TILES;
const NO_TILE: u32 = TILE_TOTAL;
// What a photon counts in its tile that started as densely as if all were spread evenly.
const EVEN_PHOTON: f32 = 64.0;
// What all hops of a tile bring together.
const TILE_WEIGHT: f32 = 0x1p18;
// A photon is seen if it lies no further from what its pixel shows than this share of the distance to the eye.
const TOLERANCE: f32 = 0.02;

// The tile that a hop is seen in.
fn tile_of(photon: Photon) -> u32 {
    if !photon_is_splatted(photon.state) {
        return NO_TILE;
    }
    let clip = view.view_projection * vec4f(photon.position, 1.0);
    let ndc = clip.xyz / clip.w;
    if clip.w <= 0.0 || any(abs(ndc.xy) >= vec2f(1.0)) {
        return NO_TILE;
    }
    let place = vec2f(0.5, -0.5) * ndc.xy + 0.5;
    let at = min(vec2u(place * vec2f(view.size)), view.size - 1u);
    let depth = textureLoad(depth_texture, view.origin + at, 0).x;
    let surface = g_buffer_position(view, vec2f(at), depth);
    if distance(surface, photon.position) > TOLERANCE * abs(clip.w) {
        return NO_TILE;
    }
    let tile = min(vec2u(place * f32(TILES)), vec2u(TILES - 1u));
    return tile.y * TILES + tile.x;
}

// In how many parts of EVEN_PHOTON it counts: as many as it has flux.
fn photon_count(photon: Photon) -> u32 {
    return u32(max(1.0, round(EVEN_PHOTON / photon_boost(photon.state, params.share))));
}

fn slot_of(id: vec3u) -> u32 {
    return select(id.y * params.row + id.x, params.slot_count, id.x >= params.row);
}

@compute @workgroup_size(64)
fn count_tiles(@builtin(global_invocation_id) id: vec3u) {
    let slot = slot_of(id);
    if slot >= params.slot_count {
        return;
    }
    let photon = photons[slot];
    let tile = tile_of(photon);
    if tile != NO_TILE {
        atomicAdd(&tiles[tile], photon_count(photon));
    }
}

@compute @workgroup_size(64)
fn count_visible(@builtin(global_invocation_id) id: vec3u) {
    let slot = slot_of(id);
    if slot >= params.slot_count {
        return;
    }
    let photon = photons[slot];
    let light = photon_light(photon.light_and_surface);
    let tile = tile_of(photon);
    if tile == NO_TILE || light >= params.light_count {
        return;
    }
    let weight = u32(TILE_WEIGHT * f32(photon_count(photon)) / f32(atomicLoad(&tiles[tile])));
    let emission = EMISSION_COUNTS * (light * EMISSION_CELL_TOTAL + photon_cell(photon.state));
    atomicAdd(&emission_counts[emission], weight);
    atomicAdd(&emission_counts[emission + 1u], 1u);
    for (var before = slot % params.path_count; before < slot; before += params.path_count) {
        let hop = photons[before];
        if !lobe_is_specular(photon_lobe(hop.state, hop.light_and_surface)) {
            let normal = octahedral_unpack(hop.normal);
            let direction = octahedral_unpack(photons[before + params.path_count].direction);
            let reflection = REFLECTION_COUNTS * reflection_table(hop.position, normal);
            atomicAdd(&reflection_counts[reflection], 1u);
            atomicAdd(&reflection_counts[reflection + 1u + reflection_cell(normal, direction)], weight);
        }
    }
}
