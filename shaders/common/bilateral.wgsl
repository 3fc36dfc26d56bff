// How well what a pixel of the G-buffer sees fits what another one sees, for interpolation along surfaces and not across their
// edges. The module brings `view` and the textures of the G-buffer.

// Positions come from f32 depths through an f32 matrix: some ten roundings of 2^-24 of the numbers involved, which are of
// the order of the region's radius (at most 1) or of the distance to the eye.
const BILATERAL_ROUNDING: f32 = 0x1p-20;
// What a sample of another surface is worse by: taken only where there is none of the pixel's own.
const BILATERAL_OTHER_SURFACE: f32 = 1e6;

// A pixel and the surface element that it sees.
struct BilateralReceiver {
    pixel: vec2u,
    position: vec3f,
    shading: vec3f,
    // Geometric normal
    normal: vec3f,
    // Clip space w: distance along the axis of a perspective, else 1
    w: f32,
    // Width of a pixel at its distance
    pixel_width: f32,
    // Number of its surface, 0: none in particular
    surface: u32,
}

fn bilateral_position(pixel: vec2u) -> vec3f {
    return g_buffer_position(view, vec2f(pixel), textureLoad(depth_texture, pixel + view.origin, 0).r);
}

fn bilateral_normal(pixel: vec2u) -> vec3f {
    return g_buffer_normal(view, textureLoad(normal_texture, pixel + view.origin, 0));
}

fn bilateral_surface(pixel: vec2u) -> u32 {
    return textureLoad(surface_texture, pixel + view.origin, 0).r;
}

fn bilateral_is_surface(pixel: vec2u) -> bool {
    return textureLoad(base_color_texture, pixel + view.origin, 0).a > 0.0;
}

fn bilateral_receiver(pixel: vec2u) -> BilateralReceiver {
    let limit = view.size - 1u;
    let p = bilateral_position(pixel);
    let shading = bilateral_normal(pixel);
    let around = Neighbours(
        bilateral_position(vec2u(max(pixel.x, 1u) - 1u, pixel.y)),
        bilateral_position(vec2u(min(pixel.x + 1u, limit.x), pixel.y)),
        bilateral_position(vec2u(pixel.x, max(pixel.y, 1u) - 1u)),
        bilateral_position(vec2u(pixel.x, min(pixel.y + 1u, limit.y))),
    );
    let normal = g_buffer_geometric_normal(view, vec2i(pixel), p, around, shading);
    let w = dot(g_buffer_row(view, 3u), vec4f(p, 1.0));
    return BilateralReceiver(pixel, p, shading, normal, w, w / g_buffer_pixels_a_length(view), bilateral_surface(pixel));
}

// Of another pixel: the factor on its screen-space weight, 0 where it does not fit, and its misfit, 0 on the same plane, which
// orders pixels of which none fits.
//   normal_agreement  cosine at and below which normals do not agree
//   plane_distance    distance from the receiver's plane that counts as off it, in distances between both as seen on the screen
fn bilateral_fit(receiver: BilateralReceiver, pixel: vec2u, normal_agreement: f32, plane_distance: f32) -> vec2f {
    let p = bilateral_position(pixel);
    let turned = (1.0 - dot(bilateral_normal(pixel), receiver.shading)) / (1.0 - normal_agreement);
    // Not in units of the distance between both points: seen at a grazing angle, that is long where the plane is left by
    // little, as from the top of a box to the floor behind it. On the plane itself the angle of view cancels out.
    let distance = receiver.pixel_width * length(vec2f(pixel) - vec2f(receiver.pixel));
    // The geometric normal is right where normals are mapped, the shading normal where a crease runs between a pixel's
    // neighbours.
    let apart = p - receiver.position;
    let off_plane = min(abs(dot(apart, receiver.normal)), abs(dot(apart, receiver.shading)));
    let lifted = off_plane / (plane_distance * distance + BILATERAL_ROUNDING * (1.0 + receiver.w));
    let surface = bilateral_surface(pixel);
    let is_other = surface != receiver.surface && surface != 0u && receiver.surface != 0u;
    let misfit = turned + lifted + select(0.0, BILATERAL_OTHER_SURFACE, is_other);
    // What is linear on a plane in space is linear on the screen only over w: weights of 1 / w interpolate it exactly.
    let perspective = receiver.w / dot(g_buffer_row(view, 3u), vec4f(p, 1.0));
    let fit = perspective * max(0.0, 1.0 - turned) * max(0.0, 1.0 - lifted);
    return vec2f(select(fit, 0.0, is_other), misfit);
}
