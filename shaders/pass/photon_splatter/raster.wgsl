// What a blended shape gives to the pixels it covers: shared by quads and volumes, which bring the vertices.

@group(0) @binding(0) var<uniform> params: RasterParams;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var<storage, read> photons: array<Photon>;
@group(0) @binding(3) var<storage, read> bins: array<u32>;
@group(0) @binding(4) var receivers: texture_2d<u32>;

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) position: vec3f,
    @location(1) @interpolate(flat) radius: f32,
    @location(2) @interpolate(flat) flux: vec3f,
    @location(3) @interpolate(flat) normal: vec3f,
    @location(4) @interpolate(flat) surface: u32,
}

fn bin_count(bin: u32) -> u32 {
    return bins[bin];
}

// A corner of a photon's shape, `offset` from its middle.
fn raster_corner(photon: Photon, radius: f32, normal: vec3f, offset: vec3f) -> Corner {
    var clip = view.view_projection * vec4f(photon.position + offset, 1.0);
    clip = vec4f(params.clip_scale * clip.xy + params.clip_shift * clip.w, clip.zw);
    // The near plane must not cut a shape whose receivers it cannot cut.
    clip.z = 0.5 * clip.w;
    return Corner(clip, photon.position, radius, photon.flux, normal, photon_surface(photon.light_and_surface));
}

// All corners of a shape in one point: nothing is drawn.
fn raster_nothing() -> Corner {
    return Corner(vec4f(0.0, 0.0, 0.0, 1.0), vec3f(0.0), 1.0, vec3f(0.0), vec3f(0.0, 0.0, 1.0), 0u);
}

alias Receivers = f32;

@fragment
fn fragment(corner: Corner) -> @location(0) vec4f {
    let at = vec2u(corner.clip.xy);
    let pixel = subsampling_pixel(at, params.bandwidth.factor, view.size);
    let receiver = receiver_unpack(textureLoad(receivers, at, 0), pixel);
    if !receiver.is_seen || !splat_shares(receiver.surface, corner.surface) {
        discard;
    }
    let d = receiver.position - corner.position;
    let inverse = 1.0 / (corner.radius * corner.radius);
    let off_plane = abs(dot(d, corner.normal));
    let agreement = dot(receiver.normal, corner.normal);
    let weight = splat_weight(dot(d, d) * inverse, off_plane, agreement, splat_slab(corner.radius));
    let strength = corner.flux * inverse * weight;
    return vec4f(strength, (strength.x + strength.y + strength.z) * corner.radius);
}
