// Weighs the hops of guided paths that arrive where the eye sees by how much of their part of the image they stand for: first those of each
// tile of the view are counted, then each hop brings its share of its tile to all cells that its path came by.

@group(0) @binding(0) var<uniform> params: CountParams;
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
// What a photon counts in its tile where guided photons are as dense as others: four million fit 32 bits.
const EVEN_PHOTON: f32 = 1024.0;
// What all hops of a tile bring together: the tiles of fifteen views fit 32 bits.
const TILE_WEIGHT: f32 = 0x1p18;
// Random dimension of rounding.
const ROUNDING_DIMENSION: u32 = 3584u;
// A photon is seen if it lies no further from what its pixel shows than this share of its depth, or of the region of a parallel view.
const TOLERANCE: f32 = 0.02;

// The tile that a hop is seen in, if its path is guided. Tables made from paths that are not, the same in every frame, would fit these and
// weigh them too low.
fn tile_of(photon: Photon) -> u32 {
    if !photon_is_splatted(photon.state) || (photon.state & PHOTON_IS_GUIDED) == 0u {
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
    // Nothing lies where there is no surface.
    if !(distance(surface, photon.position) <= TOLERANCE * abs(clip.w)) {
        return NO_TILE;
    }
    let tile = min(vec2u(place * f32(TILES)), vec2u(TILES - 1u));
    return tile.y * TILES + tile.x;
}

// As how much it counts in its tile: the less, the more densely guided photons come its way.
fn part_of(photon: Photon) -> u32 {
    return u32(max(1.0, round(EVEN_PHOTON / photon_guidance(photon.state))));
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
        atomicAdd(&tiles[tile], part_of(photon));
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
    let share = f32(part_of(photon)) / f32(atomicLoad(&tiles[tile]));
    let weight = u32(TILE_WEIGHT * share + hash_unit(slot, ROUNDING_DIMENSION));
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
