// All light that leaves the surface at a texel, per area: B = flux / area, pi times the radiance. Of a texel that few photons
// point to, that of its surroundings on the same surface, as far as it takes to have as many (Larsen 2004, section 10.1, whose
// texels look for the nearest photons). One invocation a texel.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> grid: SurfaceLightGrid;
@group(0) @binding(2) var<storage, read> lights: array<SurfaceLight>;
@group(0) @binding(3) var<storage, read> cells: array<u32>;
@group(0) @binding(4) var<storage, read> flux: array<vec4u>;
@group(0) @binding(5) var<storage, read_write> radiosity: array<vec4f>;

// How far it is looked for photons, in cells, at first, at most, and by how much further each time.
const FIRST_REACH: f32 = 1.0;
const MOST_REACH: f32 = 3.5;
const NEXT_REACH: f32 = 1.5;
// Cosine of the largest angle between the normals of a texel and of one that counts for it.
const SAME_WAY: f32 = 0.5;

struct Sum {
    flux: vec3f,
    area: f32,
    photons: f32,
}

fn sum_around(texel: u32, reach: f32) -> Sum {
    let own = lights[texel];
    let last = vec3i(grid.cells) - 1;
    let place = (own.position - grid.origin) / grid.cell;
    let low = clamp(vec3i(floor(place - reach)), vec3i(0), last);
    let high = clamp(vec3i(floor(place + reach)), vec3i(0), last);
    let entries = grid.cells.x * grid.cells.y * grid.cells.z + 1u;
    let most = reach * grid.cell * reach * grid.cell;
    var sum = Sum();
    for (var z = low.z; z <= high.z; z++) {
        for (var y = low.y; y <= high.y; y++) {
            for (var x = low.x; x <= high.x; x++) {
                let cell = vec3u(vec3i(x, y, z));
                let index = (cell.z * grid.cells.y + cell.y) * grid.cells.x + cell.x;
                for (var i = cells[index]; i < cells[index + 1u]; i++) {
                    let other = cells[entries + i];
                    let away = lights[other].position - own.position;
                    let is_same = lights[other].surface == own.surface && dot(lights[other].normal, own.normal) >= SAME_WAY;
                    if is_same && dot(away, away) <= most {
                        sum.flux += vec3f(flux[other].xyz);
                        sum.area += lights[other].area;
                        sum.photons += f32(flux[other].w);
                    }
                }
            }
        }
    }
    return sum;
}

@compute @workgroup_size(64)
fn sum_radiosity(@builtin(global_invocation_id) id: vec3u) {
    let texel = id.x;
    if texel >= params.texel_count {
        return;
    }
    var sum = Sum(vec3f(flux[texel].xyz), lights[texel].area, f32(flux[texel].w));
    var reach = FIRST_REACH;
    while sum.photons < f32(params.least_photons) && reach <= MOST_REACH {
        sum = sum_around(texel, reach);
        reach *= NEXT_REACH;
    }
    let is_lit = sum.area > 0.0 && lights[texel].area > 0.0;
    let light = select(vec3f(0.0), sum.flux * (params.flux_of_step / max(sum.area, 0x1p-60)), is_lit);
    radiosity[texel] = vec4f(light, sum.photons);
}
