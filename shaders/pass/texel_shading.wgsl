// Irradiance at a pixel from that of the texels around it: a plane is laid through them, by least squares that weigh near ones
// more (moving least squares), for at the edges of surfaces all texels lie to one side.

struct Params {
    // Pixels of the G-buffer along each axis for one of the irradiance
    factor: u32,
    // How far texels count, in cells
    reach: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var base_color_texture: texture_2d<f32>;
@group(0) @binding(5) var surface_texture: texture_2d<u32>;
@group(0) @binding(6) var<uniform> grid: SurfaceLightGrid;
@group(0) @binding(7) var<storage, read> lights: array<SurfaceLight>;
@group(0) @binding(8) var<storage, read> cells: array<u32>;
@group(0) @binding(9) var<storage, read> texels: array<vec4f>;
@group(0) @binding(10) var irradiance: texture_storage_2d<rgba32float, write>;

// Cosine of the largest angle between the normals of a pixel and of a texel, and how much more distance off the plane counts,
// squared.
const TEXEL_SAME_WAY: f32 = 0.5;
const TEXEL_OFF_PLANE: f32 = 30.0;
// Share of what a texel sees that must not be backs, or it stands inside of something and does not count.
const TEXEL_OPEN: f32 = 0.5;
// Of what the texels around are, no pixel is more.
const TEXEL_MOST: f32 = 2.0;
// Weight that keeps the plane level where few texels say how it slopes.
const TEXEL_LEVEL: f32 = 0.02;

// Sums over texels, of weight w at (x, y) on the tangent plane, in parts of the reach.
struct Fit {
    w: f32,
    first: vec2f,
    // xx, xy, yy
    second: vec3f,
    light: vec3f,
    light_x: vec3f,
    light_y: vec3f,
    brightest: vec3f,
    // The nearest of all, if none counts
    nearest: vec3f,
    nearest_squared: f32,
}

fn fit_cell(found: Fit, cell: vec3u, p: vec3f, frame: mat3x3f, reach: f32) -> Fit {
    var fit = found;
    let index = (cell.z * grid.cells.y + cell.y) * grid.cells.x + cell.x;
    let entries = grid.cells.x * grid.cells.y * grid.cells.z + 1u;
    for (var i = cells[index]; i < cells[index + 1u]; i++) {
        let texel = cells[entries + i];
        let cosine = dot(lights[texel].normal, frame[2]);
        let light = texels[texel];
        if cosine < TEXEL_SAME_WAY || light.a < TEXEL_OPEN {
            continue;
        }
        let away = (lights[texel].position - p) * frame / reach;
        let squared = dot(away, away) + TEXEL_OFF_PLANE * away.z * away.z;
        if squared < fit.nearest_squared {
            fit.nearest = light.rgb;
            fit.nearest_squared = squared;
        }
        if squared >= 1.0 {
            continue;
        }
        let w = (1.0 - squared) * (1.0 - squared) * (cosine - TEXEL_SAME_WAY);
        fit.w += w;
        fit.first += w * away.xy;
        fit.second += w * vec3f(away.x * away.x, away.x * away.y, away.y * away.y);
        fit.light += w * light.rgb;
        fit.light_x += w * away.x * light.rgb;
        fit.light_y += w * away.y * light.rgb;
        fit.brightest = max(fit.brightest, light.rgb);
    }
    return fit;
}

// The plane's height at the pixel.
fn fitted(fit: Fit) -> vec3f {
    if fit.w <= 0.0 {
        return fit.nearest;
    }
    let mean = fit.light / fit.w;
    let middle = fit.first / fit.w;
    // Covariances.
    let a = fit.second.x / fit.w - middle.x * middle.x + TEXEL_LEVEL;
    let b = fit.second.y / fit.w - middle.x * middle.y;
    let c = fit.second.z / fit.w - middle.y * middle.y + TEXEL_LEVEL;
    let dx = fit.light_x / fit.w - middle.x * mean;
    let dy = fit.light_y / fit.w - middle.y * mean;
    let determinant = a * c - b * b;
    let slope_x = (c * dx - b * dy) / determinant;
    let slope_y = (a * dy - b * dx) / determinant;
    return clamp(mean - slope_x * middle.x - slope_y * middle.y, vec3f(0.0), TEXEL_MOST * fit.brightest);
}

@compute @workgroup_size(8, 8)
fn shade_texels(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= subsampling_size(view.size, params.factor)) {
        return;
    }
    let receiver = receiver_at(subsampling_pixel(id.xy, params.factor, view.size));
    if !receiver.is_seen {
        textureStore(irradiance, id.xy, vec4f(0.0));
        return;
    }
    let reach = params.reach * grid.cell;
    let last = vec3i(grid.cells) - 1;
    let own = (receiver.position - grid.origin) / grid.cell;
    let low = clamp(vec3i(floor(own - params.reach)), vec3i(0), last);
    let high = clamp(vec3i(floor(own + params.reach)), vec3i(0), last);
    let frame = sampling_frame(receiver.normal);
    var fit = Fit();
    fit.nearest_squared = 3e38;
    for (var z = low.z; z <= high.z; z++) {
        for (var y = low.y; y <= high.y; y++) {
            for (var x = low.x; x <= high.x; x++) {
                fit = fit_cell(fit, vec3u(vec3i(x, y, z)), receiver.position, frame, reach);
            }
        }
    }
    textureStore(irradiance, id.xy, vec4f(fitted(fit), 1.0));
}
