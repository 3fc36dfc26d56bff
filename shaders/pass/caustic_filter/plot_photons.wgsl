// Photons as points of the screen (Larsen 2004, section 12.1): each adds its flux to the pixel that sees where it arrived, and
// lists the tiles that the filter spreads it over. Sums are whole numbers: their order does not matter.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var base_color_texture: texture_2d<f32>;
@group(0) @binding(5) var surface_texture: texture_2d<u32>;
@group(0) @binding(6) var<storage, read> photons: array<Photon>;
// Of each pixel red, green, blue
@group(0) @binding(7) var<storage, read_write> sums: array<atomic<u32>>;
// Of each tile, 1 where it is listed
@group(0) @binding(8) var<storage, read_write> flags: array<atomic<u32>>;
@group(0) @binding(9) var<storage, read_write> tiles: TileList;

struct TileList {
    // Of an indirect dispatch with a workgroup for each
    workgroups: array<atomic<u32>, 3>,
    count: atomic<u32>,
    tiles: array<u32>,
}

// Workgroups in a row of that dispatch.
const TILE_ROW: u32 = 256u;
// Pixels off the plane that a pixel sees up to which a photon lies on it, and cosine of the largest angle between their
// normals.
const OFF_PLANE: f32 = 2.0;
const SAME_WAY: f32 = 0.5;

fn list_tile(tile: vec2u) {
    let index = tile.y * tile_counts().x + tile.x;
    if atomicExchange(&flags[index], 1u) == 1u {
        return;
    }
    let place = atomicAdd(&tiles.count, 1u);
    tiles.tiles[place] = index;
    atomicMax(&tiles.workgroups[0], min(place + 1u, TILE_ROW));
    atomicMax(&tiles.workgroups[1], place / TILE_ROW + 1u);
    atomicMax(&tiles.workgroups[2], 1u);
}

@compute @workgroup_size(64)
fn plot_photons(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * params.row + id.x;
    if id.x >= params.row || index >= params.slot_count {
        return;
    }
    let photon = photons[params.first_slot + index];
    if !photon_is_splatted(photon.state) {
        return;
    }
    let clip = view.view_projection * vec4f(photon.position, 1.0);
    let ndc = clip.xy / clip.w;
    if !(clip.w > 0.0) || !all(abs(ndc) < vec2f(1.0)) {
        return;
    }
    let pixel = min(vec2u((vec2f(0.5) + vec2f(0.5, -0.5) * ndc) * vec2f(view.size)), view.size - 1u);
    if !bilateral_is_surface(pixel) {
        return;
    }
    let receiver = bilateral_receiver(pixel);
    let off_plane = abs(dot(photon.position - receiver.position, receiver.normal));
    let is_seen = off_plane <= OFF_PLANE * receiver.pixel_width
        && dot(octahedral_unpack(photon.normal), receiver.normal) >= SAME_WAY;
    if !is_seen {
        return;
    }
    let flux = vec3u(min(photon.flux * params.share * params.steps + 0.5, vec3f(0x1p30)));
    let first = 3u * (pixel.y * view.size.x + pixel.x);
    atomicAdd(&sums[first], flux.x);
    atomicAdd(&sums[first + 1u], flux.y);
    atomicAdd(&sums[first + 2u], flux.z);
    // Pixels around have a filter as wide as this one's, or nearly.
    let reach = u32(filter_pixels(receiver.pixel_width)) + 1u;
    let low = (max(pixel, vec2u(reach)) - reach) / TILE;
    let high = min(pixel + reach, view.size - 1u) / TILE;
    for (var y = low.y; y <= high.y; y++) {
        for (var x = low.x; x <= high.x; x++) {
            list_tile(vec2u(x, y));
        }
    }
}
