// What rays bring back: a workgroup a pixel adds it up, in a fixed order.
//   E = pi times the mean of L over rays as dense as the cosine, L = rho / pi times the irradiance where a ray ends.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var base_color_texture: texture_2d<f32>;
@group(0) @binding(3) var<storage, read> rays: array<SurfaceRay>;
@group(0) @binding(4) var<storage, read> hits: array<SurfaceHit>;
@group(0) @binding(5) var env_maps: texture_2d_array<u32>;
// w: 1 where the map is in use
@group(0) @binding(6) var<storage, read> centers: array<vec4f>;
@group(0) @binding(7) var map_light: texture_2d_array<f32>;
@group(0) @binding(8) var irradiance: texture_storage_2d<rgba32float, write>;

const LANES: u32 = 64u;

var<workgroup> sums: array<vec3f, LANES>;

// What a ray brings. What is lost brings nothing, as lost photons do: that rays are lost where others bring light says nothing
// of what they would have met. Nor does metal or glass, where maps hold no light.
fn brought(index: u32) -> vec3f {
    let hit = hits[index];
    let is_hit = hit.kind == HIT_SURFACE || hit.kind == HIT_TENTATIVE;
    if !is_hit || lobe_is_specular(hit.lobe) {
        return vec3f(0.0);
    }
    let ray = rays[index];
    let light = map_light_at(
        ray.position + hit.distance * ray.direction, octahedral_unpack(hit.normal), params.map_count, params.map_size,
    );
    return light * reflectance_unpack(hit.reflectance);
}

@compute @workgroup_size(64)
fn sum_hits(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let width = subsampling_size(view.size, params.factor).x;
    let own = vec2u(group.x, params.first_row + group.y);
    let pixel = subsampling_pixel(own, params.factor, view.size) + view.origin;
    let is_seen = textureLoad(base_color_texture, pixel, 0).a > 0.0;
    let first = params.ray_count * (group.y * width + group.x);
    var sum = vec3f(0.0);
    for (var i = lane; i < params.ray_count && is_seen; i += LANES) {
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
        textureStore(irradiance, own, vec4f(sums[0] / max(f32(params.ray_count), 1.0), f32(is_seen)));
    }
}
