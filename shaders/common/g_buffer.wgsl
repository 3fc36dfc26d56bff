// What the eye sees, read by pixel of the part in use. Twin of `GBuffer`.

struct View {
    view_projection: mat4x4f,
    inverse_view_projection: mat4x4f,
    // w = 1: eye position; w = 0: view direction
    eye: vec4f,
    size: vec2u,
    origin: vec2u,
    normal_encoding: u32,
}

// Row i of the matrix that takes positions to clip space.
fn g_buffer_row(view: View, i: u32) -> vec4f {
    let m = view.view_projection;
    return vec4f(m[0][i], m[1][i], m[2][i], m[3][i]);
}

// Pixels that a unit of length at w = 1 covers.
fn g_buffer_pixels_a_length(view: View) -> f32 {
    let x_scale = length(g_buffer_row(view, 0u).xyz) * f32(view.size.x);
    let y_scale = length(g_buffer_row(view, 1u).xyz) * f32(view.size.y);
    return 0.5 * max(x_scale, y_scale);
}

// Unit-frame position of a pixel's centre at this depth.
fn g_buffer_position(view: View, pixel: vec2f, depth: f32) -> vec3f {
    let uv = (pixel + 0.5) / vec2f(view.size);
    let p = view.inverse_view_projection * vec4f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, depth, 1.0);
    return p.xyz / p.w;
}

// Cosine of the largest angle between geometric and shading normal: beyond it, the neighbours that gave the geometric
// one do not lie on the pixel's surface.
const G_BUFFER_NORMAL_AGREEMENT: f32 = 0.7;

// Positions of the pixels next to one; its own beyond the rim.
struct Neighbours {
    left: vec3f,
    right: vec3f,
    above: vec3f,
    below: vec3f,
}

// Sine of the largest angle between the shading normal's plane and a neighbour that lies on the pixel's surface for sure.
const G_BUFFER_ON_SURFACE: f32 = 0.02;

// Of two neighbours along an axis, by what leads from one pixel to the next: whether the second is to be taken. Across a
// crease seen at a grazing angle the nearer one need not be the one on the surface.
fn g_buffer_takes_second(first: vec3f, second: vec3f, shading: vec3f) -> bool {
    let lengths = vec2f(dot(first, first), dot(second, second));
    let heights = vec2f(dot(first, shading), dot(second, shading));
    let on_surface = heights * heights <= G_BUFFER_ON_SURFACE * G_BUFFER_ON_SURFACE * lengths;
    return select(lengths.y < lengths.x, on_surface.y, on_surface.x != on_surface.y);
}

// Geometric normal at a pixel: from depth where its neighbours lie on one surface, else the shading normal.
fn g_buffer_geometric_normal(view: View, pixel: vec2i, p: vec3f, around: Neighbours, shading: vec3f) -> vec3f {
    let limit = vec2i(view.size) - 1;
    let x0 = p - around.left;
    let x1 = around.right - p;
    let y0 = p - around.above;
    let y1 = around.below - p;
    let use_x1 = pixel.x == 0 || (pixel.x < limit.x && g_buffer_takes_second(x0, x1, shading));
    let use_y1 = pixel.y == 0 || (pixel.y < limit.y && g_buffer_takes_second(y0, y1, shading));
    let n = cross(select(x0, x1, use_x1), select(y0, y1, use_y1));
    let length_squared = dot(n, n);
    let unit = n * inverseSqrt(max(length_squared, 0x1p-126));
    let facing = select(-unit, unit, dot(unit, shading) > 0.0);
    return select(shading, facing, length_squared > 0x1p-120 && dot(facing, shading) > G_BUFFER_NORMAL_AGREEMENT);
}

// Unit normal from a host's texel.
fn g_buffer_normal(view: View, texel: vec4f) -> vec3f {
    let half_offset = (view.normal_encoding & 1u) == 1u;
    let v = select(texel.xyz, 2.0 * texel.xyz - 1.0, half_offset);
    let length_squared = dot(v, v);
    let direction = select(vec3f(0.0, 1.0, 0.0), v * inverseSqrt(length_squared), length_squared > 0.0);
    return select(direction, octahedral_decode(v.xy), view.normal_encoding >= 2u);
}
