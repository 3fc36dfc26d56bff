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
    paths[index] = SpecularPath(vec3f(0.0), SPECULAR_ENDED, before);
    let bits = textureLoad(surface_texture, at, 0).r >> 16u;
    let lobe = bits & LOBE_BITS;
    if !lobe_is_specular(lobe) || (params.skips_glossy == 1u && lobe_is_glossy(lobe)) {
        return;
    }
    let receiver = receiver_at(pixel);
    if !receiver.is_seen {
        return;
    }
    let outgoing = eye_outgoing(receiver.position);
    let scatterer = eye_scatterer(receiver, at, bits, outgoing);
    let punctual =
        punctual_light(scatterer, receiver.position, outgoing, params.light_count, params.shadow_map_size, false);
    before += params.direct_weight * punctual;
    paths[index].radiance = before;
    let scattering = scatter_sample(scatterer, outgoing, specular_random(pixel, 0u));
    if all(scattering.weight == vec3f(0.0)) {
        return;
    }
    rays[index] = specular_ray(receiver.position, scatterer.frame[2], scattering.direction);
    paths[index] = SpecularPath(scattering.weight, specular_state(scatterer), before);
}
