// What rays bring back: a workgroup a texel adds it up, in a fixed order.
//   E = mean of B / d over rays that are d times as dense as the cosine, B = pi L of the texel nearest to where a ray ends.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> grid: SurfaceLightGrid;
@group(0) @binding(2) var<storage, read> lights: array<SurfaceLight>;
@group(0) @binding(3) var<storage, read> cells: array<u32>;
@group(0) @binding(4) var<storage, read> radiosity: array<vec4f>;
@group(0) @binding(5) var<storage, read> chosen: PathList;
@group(0) @binding(6) var<storage, read> rays: array<SurfaceRay>;
@group(0) @binding(7) var<storage, read> hits: array<SurfaceHit>;
@group(0) @binding(8) var<storage, read_write> gathered: array<vec4f>;

const LANES: u32 = 64u;

// Light, and how many rays meet backs
var<workgroup> sums: array<vec4f, LANES>;

// Alpha of a texel that was gathered, at least.
const LEAST_ALPHA: f32 = 0x1p-10;

// What a ray brings. What is lost brings nothing, nor do metal and glass, which hold no light.
fn brought(index: u32) -> vec4f {
    let hit = hits[index];
    let is_hit = hit.kind == HIT_SURFACE || hit.kind == HIT_TENTATIVE;
    let is_back = is_hit && (hit.lobe & HIT_BACK) != 0u;
    let ray = rays[index];
    let weight = bitcast<f32>(ray.tag);
    let nothing = vec4f(vec3f(0.0), select(0.0, weight, is_back));
    if !is_hit || lobe_is_specular(hit.lobe) {
        return nothing;
    }
    let light = nearest_light(ray.position + hit.distance * ray.direction, octahedral_unpack(hit.normal));
    if light == NO_LIGHT {
        return nothing;
    }
    return vec4f(weight * radiosity[light].rgb, nothing.a);
}

@compute @workgroup_size(64)
fn sum_hits(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let first = params.ray_count * group.x;
    var sum = vec4f(0.0);
    for (var i = lane; i < params.ray_count; i += LANES) {
        sum += brought(first + i);
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
        let mean = sums[0] / f32(params.ray_count);
        gathered[chosen.paths[group.x]] = vec4f(mean.rgb, max(1.0 - mean.a, LEAST_ALPHA));
    }
}
