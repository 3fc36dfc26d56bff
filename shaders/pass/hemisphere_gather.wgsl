// The light that hemispheres show: a workgroup a tile adds it up, in a fixed order.
//   E = sum of B F over sum of F, B = pi L of the texel nearest to what a pixel shows, F the pixel's share of the hemisphere
// Larsen 2004, chapter 11, where pi is missing.

struct Params {
    size: u32,
    // Pixels of a tile
    pixel_count: u32,
    half_side: f32,
}

struct Hemisphere {
    eye: vec3f,
    // Where its irradiance goes
    texel: u32,
    // Of the face above, whose forward is the normal
    right: vec3f,
    // Of the tile's corner
    column: u32,
    up: vec3f,
    row: u32,
    normal: vec3f,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> grid: SurfaceLightGrid;
@group(0) @binding(2) var<storage, read> lights: array<SurfaceLight>;
@group(0) @binding(3) var<storage, read> cells: array<u32>;
@group(0) @binding(4) var<storage, read> radiosity: array<vec4f>;
@group(0) @binding(5) var<storage, read> hemispheres: array<Hemisphere>;
// Shares of a tile's pixels, 1 in all
@group(0) @binding(6) var<storage, read> weights: array<f32>;
@group(0) @binding(7) var image: texture_2d<u32>;
@group(0) @binding(8) var<storage, read_write> gathered: array<vec4f>;
@group(0) @binding(9) var<storage, read_write> due: array<u32>;

const LANES: u32 = 256u;

// Light, and the share of backs
var<workgroup> sums: array<vec4f, LANES>;

// Alpha of a texel that was gathered, at least.
const LEAST_ALPHA: f32 = 0x1p-10;

// Where a pixel of a tile looks.
fn pixel_direction(hemisphere: Hemisphere, pixel: u32) -> vec3f {
    let size = f32(params.size);
    let x = 2.0 * (f32(pixel % params.size) + 0.5) / size - 1.0;
    let row = pixel / params.size;
    if row < params.size {
        let y = 1.0 - 2.0 * (f32(row) + 0.5) / size;
        return normalize(params.half_side * (x * hemisphere.right + y * hemisphere.up) + hemisphere.normal);
    }
    let half = params.size / 2u;
    let side = (row - params.size) / half;
    let height = 1.0 - 2.0 * (f32((row - params.size) % half) + 0.5) / size;
    // Along right and up, to both sides.
    let axis = select(hemisphere.right, hemisphere.up, side >= 2u);
    let forward = select(axis, -axis, (side & 1u) == 1u);
    return normalize(forward + x * cross(forward, hemisphere.normal) + height * hemisphere.normal);
}

// What a pixel shows. Metal and glass bring nothing, for they hold no light.
fn shown(hemisphere: Hemisphere, pixel: u32) -> vec4f {
    let at = vec2u(hemisphere.column + pixel % params.size, hemisphere.row + pixel / params.size);
    let texel = surface_texel_unpack(textureLoad(image, at, 0));
    if texel.distance <= 0.0 {
        return vec4f(0.0);
    }
    let nothing = vec4f(vec3f(0.0), f32((texel.flags & SURFACE_TEXEL_BACK_FACE) != 0u));
    if lobe_is_specular(surface_texel_lobe(texel)) {
        return nothing;
    }
    let p = hemisphere.eye + texel.distance * pixel_direction(hemisphere, pixel);
    let light = nearest_light(p, texel.normal);
    if light == NO_LIGHT {
        return nothing;
    }
    return vec4f(radiosity[light].rgb, nothing.a);
}

@compute @workgroup_size(256)
fn gather_hemispheres(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let hemisphere = hemispheres[group.x];
    var sum = vec4f(0.0);
    for (var pixel = lane; pixel < params.pixel_count; pixel += LANES) {
        sum += weights[pixel] * shown(hemisphere, pixel);
    }
    sums[lane] = sum;
    workgroupBarrier();
    for (var half = LANES / 2u; half > 0u; half /= 2u) {
        if lane < half {
            sums[lane] += sums[lane + half];
        }
        workgroupBarrier();
    }
    if lane == 0u {
        // What sees backs stands inside of something.
        gathered[hemisphere.texel] = vec4f(sums[0].rgb, max(1.0 - sums[0].a, LEAST_ALPHA));
        due[hemisphere.texel] = 0u;
    }
}
