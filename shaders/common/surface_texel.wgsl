// One texel of an environment map or a shadow map: 16 bytes, one rgba32uint fetch.
//   x  distance along the texel's ray, unit frame, f32 bits; 0: nothing is there
//   y  normal on the side that is seen, octahedral: the geometric one, of metal and glass the shading normal
//   z  reflectance, 11-11-10
//   w  bits 0-7 and 9-14 how it scatters (lobe.wgsl), bit 8 the back of a triangle is seen, bits 16-31 the surface, 0: none in
//      particular
// The capture functions are what a host calls from its own fragment shader.

const SURFACE_TEXEL_BACK_FACE: u32 = 256u;
const SURFACE_TEXEL_SURFACE_SHIFT: u32 = 16u;
// A directional view's rays start this far before the region's centre, unit frame.
const SURFACE_TEXEL_PARALLEL_START: f32 = 2.0;

struct SurfaceTexel {
    distance: f32,
    normal: vec3f,
    reflectance: vec3f,
    flags: u32,
}

fn surface_texel_unpack(bits: vec4u) -> SurfaceTexel {
    return SurfaceTexel(bitcast<f32>(bits.x), octahedral_unpack(bits.y), reflectance_unpack(bits.z), bits.w);
}

fn surface_texel_pack(texel: SurfaceTexel) -> vec4u {
    return vec4u(
        bitcast<u32>(texel.distance), octahedral_pack(texel.normal), reflectance_pack(texel.reflectance), texel.flags,
    );
}

// The texel on a surface of this number, 1 to 65535: light is spread over the points of a surface, and no others. 0: on none
// in particular.
fn surface_texel_on(texel: SurfaceTexel, surface: u32) -> SurfaceTexel {
    return SurfaceTexel(
        texel.distance, texel.normal, texel.reflectance, (texel.flags & 0xffffu) | (surface << SURFACE_TEXEL_SURFACE_SHIFT),
    );
}

// The texel of a surface that scatters this way: `lobe_metal` or `lobe_glass`; else it is diffuse.
fn surface_texel_scattering(texel: SurfaceTexel, lobe: u32) -> SurfaceTexel {
    let bits = (lobe & 0xffu) | ((lobe & 0x3f00u) << 1u);
    return SurfaceTexel(texel.distance, texel.normal, texel.reflectance, (texel.flags & 0xffff0100u) | bits);
}

fn surface_texel_lobe(texel: SurfaceTexel) -> u32 {
    return (texel.flags & 0xffu) | ((texel.flags >> 1u) & 0x3f00u);
}

fn surface_texel_surface(texel: SurfaceTexel) -> u32 {
    return texel.flags >> SURFACE_TEXEL_SURFACE_SHIFT;
}

// The texel of a surface point, on none in particular. `eye` is CaptureView::eye: w = 1 a position, w = 0 the direction of parallel rays.
fn surface_texel_at(position: vec3f, normal: vec3f, reflectance: vec3f, eye: vec4f, front_facing: bool) -> SurfaceTexel {
    var ray = eye.xyz;
    var distance = dot(position, eye.xyz) + SURFACE_TEXEL_PARALLEL_START;
    if eye.w > 0.0 {
        ray = position - eye.xyz;
        distance = length(ray);
    }
    let seen_side = select(normal, -normal, dot(normal, ray) > 0.0);
    return SurfaceTexel(distance, seen_side, reflectance, select(SURFACE_TEXEL_BACK_FACE, 0u, front_facing));
}
