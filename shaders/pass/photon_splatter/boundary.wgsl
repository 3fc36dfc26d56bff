// The rim of a surface as the image shows it. The module brings `view`, the textures of the G-buffer, and in `params`
// `is_corrected` and `sample_offset`, which turns the points that are looked at, so that their error averages out over frames.

// Random dimension of their turn: none that the walk uses.
const BOUNDARY_DIMENSION: u32 = 4096u;

// Number of the surface at a texel of the G-buffer.
fn boundary_surface(at: vec2u) -> u32 {
    if splat_keeps_to_surfaces {
        return textureLoad(surface_texture, at, 0).r & 0xffffu;
    }
    return 0u;
}

// As far as the image tells. What it does not show is taken to go on.
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
    let to_seen = select(view.eye.xyz, seen - view.eye.xyz * view.eye.w, view.eye.w > 0.0);
    return boundary_says_on(receiver, y, BoundarySight(seen, normal, boundary_surface(at), to_seen), slab);
}

// Irradiance from a sum and its channels by the radii of the kernels that brought it.
fn boundary_corrected(receiver: Receiver, sum: vec4f) -> vec3f {
    let light = sum.x + sum.y + sum.z;
    if params.is_corrected == 1u && receiver.is_seen && light > 0.0 {
        let start = 6.283185307 * random_unit(params.sample_offset, BOUNDARY_DIMENSION);
        return sum.rgb / boundary_share(receiver, sum.w / light, start);
    }
    return sum.rgb;
}
