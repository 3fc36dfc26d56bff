// Density estimation by blending: a quad in the surface plane of each photon (Yao et al., soft shadows and image-space
// photon mapping, section 3.3), added up by the raster units.

struct Params {
    bandwidth: Bandwidth,
    // From clip space of the G-buffer to that of the irradiance
    clip_scale: vec2f,
    clip_shift: vec2f,
    // First slot of the photon buffer to read
    first_slot: u32,
    // Largest radius in pixels of the G-buffer
    max_radius: f32,
    // Pixels of the G-buffer for each one of the irradiance, along each axis
    factor: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<storage, read> photons: array<Photon>;
@group(0) @binding(3) var depth_texture: texture_2d<f32>;
@group(0) @binding(4) var normal_texture: texture_2d<f32>;
@group(0) @binding(5) var base_color_texture: texture_2d<f32>;

struct Quad {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) position: vec3f,
    @location(1) @interpolate(flat) radius: f32,
    @location(2) @interpolate(flat) flux: vec3f,
    @location(3) @interpolate(flat) normal: vec3f,
}

// A quad in the tangent plane, a little larger than the disc: receivers in the slab project beside it.
const QUAD_MARGIN: f32 = 1.1;

@vertex
fn vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) index: u32) -> Quad {
    let photon = photons[params.first_slot + index];
    if (photon.state & (PHOTON_STATE_MASK | PHOTON_FIRST_HIT)) != PHOTON_STORED {
        // All four corners in one point: nothing is drawn.
        return Quad(vec4f(0.0, 0.0, 0.0, 1.0), vec3f(0.0), 1.0, vec3f(0.0), vec3f(0.0, 0.0, 1.0));
    }
    let normal = octahedral_unpack(photon.normal);
    let m = view.view_projection;
    let w = m[0][3] * photon.position.x + m[1][3] * photon.position.y + m[2][3] * photon.position.z + m[3][3];
    let x_scale = length(vec3f(m[0][0], m[1][0], m[2][0])) * f32(view.size.x);
    let y_scale = length(vec3f(m[0][1], m[1][1], m[2][1])) * f32(view.size.y);
    let limit = max(0.0, params.max_radius * w / (0.5 * max(x_scale, y_scale)));
    let radius = min(splat_bandwidth(params.bandwidth, photon.density), limit);
    let side = vec2f(f32(corner & 1u), f32(corner >> 1u)) * 2.0 - 1.0;
    let frame = sampling_frame(normal);
    let p = photon.position + QUAD_MARGIN * radius * (side.x * frame[0] + side.y * frame[1]);
    var clip = m * vec4f(p, 1.0);
    clip = vec4f(params.clip_scale * clip.xy + params.clip_shift * clip.w, clip.zw);
    // The near plane must not cut a quad whose receivers it cannot cut.
    clip.z = 0.5 * clip.w;
    return Quad(clip, photon.position, radius, photon.flux, normal);
}

@fragment
fn fragment(quad: Quad) -> @location(0) vec4f {
    let pixel = subsampling_pixel(vec2u(quad.clip.xy), params.factor, view.size);
    let at = pixel + view.origin;
    if textureLoad(base_color_texture, at, 0).a <= 0.0 || quad.radius <= 0.0 {
        discard;
    }
    let p = splat_position(view, vec2i(pixel));
    let shading = g_buffer_normal(view, textureLoad(normal_texture, at, 0));
    let n = splat_receiver_normal(view, vec2i(pixel), p, shading);
    let splat = splat_prepare(quad.position, quad.normal, quad.radius, quad.flux);
    let d = p - splat.position;
    let q = dot(d, d) * splat.inverse_radius_squared;
    let weight = splat_weight(vec4f(q), vec4f(abs(dot(d, splat.normal))), vec4f(dot(n, splat.normal)), splat.slab);
    return vec4f(splat.strength * weight.x, 0.0);
}
