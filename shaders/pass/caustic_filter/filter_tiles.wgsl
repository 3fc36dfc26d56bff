// Irradiance from the flux in the pixels around, those on the same surface: a workgroup a tile.
//   E = sum of w flux / sum of w area,  w = sqrt(1 + 2 k^2 - x^2 - y^2), k pixels to each side
// (Larsen 2004, Eq. 12.1, but that pixels of other surfaces are left out below the line, too, and each has its own area).

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var base_color_texture: texture_2d<f32>;
@group(0) @binding(5) var surface_texture: texture_2d<u32>;
@group(0) @binding(6) var<storage, read> sums: array<u32>;
@group(0) @binding(7) var<storage, read> tiles: TileList;
@group(0) @binding(8) var irradiance: texture_storage_2d<rgba32float, write>;

struct TileList {
    workgroups: array<u32, 3>,
    count: u32,
    tiles: array<u32>,
}

// As in `bilateral_fit`.
const NORMAL_AGREEMENT: f32 = 0.7;
const PLANE_DISTANCE: f32 = 1.0;
// No surface is seen at a more grazing angle.
const LEAST_COSINE: f32 = 0.02;

// What a pixel covers of the surface that it sees:
//   a w^2 cos(beta) / |n . d|, a its area at w = 1, d its ray, beta the angle between that and the view's axis.
fn pixel_area(position: vec3f, normal: vec3f) -> f32 {
    let axis = g_buffer_row(view, 3u);
    let w = dot(axis, vec4f(position, 1.0));
    let across = length(g_buffer_row(view, 0u).xyz) * f32(view.size.x);
    let along = length(g_buffer_row(view, 1u).xyz) * f32(view.size.y);
    let flat = 4.0 * w * w / (across * along);
    let ray = select(view.eye.xyz, normalize(position - view.eye.xyz), view.eye.w > 0.0);
    let beta = select(1.0, dot(ray, normalize(axis.xyz)), view.eye.w > 0.0);
    return flat * beta / max(abs(dot(normal, ray)), LEAST_COSINE);
}

fn flux_at(pixel: vec2u) -> vec3f {
    let first = 3u * (pixel.y * view.size.x + pixel.x);
    return vec3f(vec3u(sums[first], sums[first + 1u], sums[first + 2u])) / params.steps;
}

@compute @workgroup_size(8, 8)
fn filter_tiles(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_id) local: vec3u,
) {
    let place = group.y * groups.x + group.x;
    if place >= tiles.count {
        return;
    }
    let tile = tiles.tiles[place];
    let columns = tile_counts().x;
    let pixel = TILE * vec2u(tile % columns, tile / columns) + local.xy;
    if any(pixel >= view.size) || !bilateral_is_surface(pixel) {
        return;
    }
    let receiver = bilateral_receiver(pixel);
    let k = filter_pixels(receiver.pixel_width);
    var flux = vec3f(0.0);
    var area = 0.0;
    for (var y = -k; y <= k; y++) {
        for (var x = -k; x <= k; x++) {
            let at = vec2i(pixel) + vec2i(x, y);
            if any(at < vec2i(0)) || any(at >= vec2i(view.size)) || !bilateral_is_surface(vec2u(at)) {
                continue;
            }
            let is_own = x == 0 && y == 0;
            if !is_own && bilateral_fit(receiver, vec2u(at), NORMAL_AGREEMENT, PLANE_DISTANCE).x <= 0.0 {
                continue;
            }
            let w = sqrt(f32(1 + 2 * k * k - x * x - y * y));
            flux += w * flux_at(vec2u(at));
            area += w * pixel_area(bilateral_position(vec2u(at)), receiver.normal);
        }
    }
    textureStore(irradiance, pixel, vec4f(flux / area, 1.0));
}
