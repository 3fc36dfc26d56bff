// Paths from the specular surfaces that the eye sees: one invocation a pixel.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var base_color_texture: texture_2d<f32>;
@group(0) @binding(5) var surface_texture: texture_2d<u32>;
@group(0) @binding(6) var<storage, read_write> rays: array<SurfaceRay>;
@group(0) @binding(7) var<storage, read_write> paths: array<SpecularPath>;
@group(0) @binding(8) var<storage, read> lights: array<Light>;
@group(0) @binding(9) var<storage, read> polygons: array<Polygon>;
@group(0) @binding(10) var shadow_maps: texture_2d_array<u32>;

@compute @workgroup_size(8, 8)
fn begin_paths(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= params.width || id.y >= params.row_count {
        return;
    }
    let index = id.y * params.width + id.x;
    let pixel = vec2u(id.x, params.first_row + id.y);
    let at = pixel + view.origin;
    rays[index] = specular_no_ray();
    var before = vec3f(0.0);
    if params.round > 0u {
        before = paths[index].radiance;
    }
    paths[index] = SpecularPath(vec3f(0.0), 0u, before);
    let bits = textureLoad(surface_texture, at, 0).r >> 16u;
    let lobe = bits & LOBE_BITS;
    if !lobe_is_specular(lobe) {
        return;
    }
    let receiver = receiver_at(pixel);
    if !receiver.is_seen {
        return;
    }
    var outgoing = -view.eye.xyz;
    if view.eye.w > 0.0 {
        outgoing = normalize(view.eye.xyz - receiver.position);
    }
    // An interpolated normal may turn away from the eye where the surface does not.
    let shading = g_buffer_normal(view, textureLoad(normal_texture, at, 0));
    let normal = select(receiver.normal, shading, dot(shading, outgoing) > SPECULAR_GRAZING);
    let color = textureLoad(base_color_texture, at, 0).rgb;
    let scatterer = scatter_by_lobe(lobe, normal, (bits & HIT_BACK) == 0u, color);
    before += params.direct_weight * specular_punctual(scatterer, receiver.position, outgoing);
    paths[index].radiance = before;
    let scattering = scatter_sample(scatterer, outgoing, specular_random(pixel, 0u));
    if all(scattering.weight == vec3f(0.0)) {
        return;
    }
    rays[index] = specular_ray(receiver.position, normal, scattering.direction);
    paths[index] = SpecularPath(scattering.weight, 1u, before);
}

// Cosine below which an interpolated normal is not trusted.
const SPECULAR_GRAZING: f32 = 0.01;
