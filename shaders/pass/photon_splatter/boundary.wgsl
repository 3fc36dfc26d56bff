// What hangs over the rim of a surface, as far as the image shows the rim. The module brings `view`, the textures of the
// G-buffer, and in `params` `is_corrected` and `sample_offset`, which turns the points that are looked at, so that their error
// averages out over frames.

// Points of the disc that are looked at, as densely as the kernel weighs.
const BOUNDARY_POINTS: u32 = 64u;
// Random dimension of their turn: none that the walk uses.
const BOUNDARY_DIMENSION: u32 = 4096u;
const BOUNDARY_GOLDEN_ANGLE: f32 = 2.399963230;
// No kernel counts for less than this: in the tip of a corner of 30 degrees a twelfth of it is on the surface.
const BOUNDARY_LEAST: f32 = 0.08;

// Number of the surface at a texel of the G-buffer.
fn boundary_surface(at: vec2u) -> u32 {
    if splat_keeps_to_surfaces {
        return textureLoad(surface_texture, at, 0).r;
    }
    return 0u;
}

// Whether the receiver's surface goes on at y, a point of its tangent plane, as far as the image tells. What it does not show
// is taken to go on.
fn boundary_goes_on(receiver: Receiver, y: vec3f, slab: f32) -> bool {
    let clip = view.view_projection * vec4f(y, 1.0);
    let ndc = clip.xy / clip.w;
    if !(clip.w > 0.0) || !all(abs(ndc) < vec2f(1.0)) {
        return true;
    }
    let pixel = min(vec2u((vec2f(0.5, 0.5) + vec2f(0.5, -0.5) * ndc) * vec2f(view.size)), view.size - 1u);
    let at = pixel + view.origin;
    if textureLoad(base_color_texture, at, 0).a <= 0.0 {
        return false;
    }
    // Where the pixel's ray meets what it sees, and where it would meet the plane: at the pixel's middle, not at y, for
    // seen at a grazing angle that is far from it.
    let seen = g_buffer_position(view, vec2f(pixel), textureLoad(depth_texture, at, 0).r);
    let normal = g_buffer_normal(view, textureLoad(normal_texture, at, 0));
    let off_plane = dot(seen - receiver.position, receiver.normal);
    if abs(off_plane) <= slab && dot(normal, receiver.normal) >= SPLAT_NORMAL_AGREEMENT {
        return splat_shares(receiver.surface, boundary_surface(at));
    }
    let ray = seen - view.eye.xyz * view.eye.w;
    let to_seen = select(view.eye.xyz, ray, view.eye.w > 0.0);
    if dot(to_seen, receiver.normal) * off_plane > 0.0 {
        // What is seen lies beyond the plane: nothing of the plane was in the way.
        return false;
    }
    // Something is before the plane. If the receiver is on its outer side and y on its inner one, the surface ends
    // against it.
    let is_before = dot(receiver.position - seen, normal) > 0.0;
    let is_within = dot(y - seen, normal) <= 0.0;
    return !(is_before && is_within);
}

// Share of a kernel of this radius around the receiver that lies on its surface.
fn boundary_share(receiver: Receiver, radius: f32) -> f32 {
    let frame = sampling_frame(receiver.normal);
    let slab = splat_slab(radius);
    let start = 6.283185307 * random_unit(params.sample_offset, BOUNDARY_DIMENSION);
    var on = 0u;
    for (var i = 0u; i < BOUNDARY_POINTS; i++) {
        let distance = radius * splat_kernel_radius((f32(i) + 0.5) / f32(BOUNDARY_POINTS));
        let turn = start + BOUNDARY_GOLDEN_ANGLE * f32(i);
        let y = receiver.position + distance * (cos(turn) * frame[0] + sin(turn) * frame[1]);
        on += u32(boundary_goes_on(receiver, y, slab));
    }
    return max(f32(on) / f32(BOUNDARY_POINTS), BOUNDARY_LEAST);
}

// Irradiance from a sum and its channels by the radii of the kernels that brought it.
fn boundary_corrected(receiver: Receiver, sum: vec4f) -> vec3f {
    let light = sum.x + sum.y + sum.z;
    if params.is_corrected == 1u && receiver.is_seen && light > 0.0 {
        return sum.rgb / boundary_share(receiver, sum.w / light);
    }
    return sum.rgb;
}
