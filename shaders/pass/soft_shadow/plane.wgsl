// The way from the receiver's plane to pixels, and whether they show it: what the gather in image space shares.

// In the textures of occluder distances and of visibility: not a surface, or one that faces away from the light.
const NO_RECEIVER: f32 = -2.0;
// In the texture of occluder distances: nothing is in the way.
const NO_OCCLUDER: f32 = -1.0;

// Surfaces this near to the receiver's plane lie in it, unit frame: the 11 bits of a G-buffer's normals over a penumbra of
// ordinary width, and depth.
const PLANE_TOLERANCE: f32 = 0x1p-14;

// A line on the receiver's plane in clip space.
struct Line {
    start: vec4f,
    step: vec4f,
}

fn line_along(p: vec3f, axis: vec3f) -> Line {
    return Line(view.view_projection * vec4f(p, 1.0), view.view_projection * vec4f(axis, 0.0));
}

// Pixels per step where the line starts. Without perspective all w are 1 and 0, and there is no division by depth.
fn line_pixels(line: Line) -> f32 {
    let slope = (line.step.xy - line.start.xy * (line.step.w / line.start.w)) / line.start.w;
    return length(slope * 0.5 * vec2f(view.size));
}

// The radius, in steps of the line, no longer than so many pixels.
fn line_radius(line: Line, radius: f32, max_pixels: f32) -> f32 {
    return min(radius, max_pixels / max(line_pixels(line), 0x1p-60));
}

// The pixel that the line crosses after so many steps; negative off the screen.
fn line_pixel(line: Line, steps: f32) -> vec2i {
    let clip = line.start + steps * line.step;
    let ndc = clip.xy / clip.w;
    // Also false where a division by zero was.
    if !(clip.w > 0.0 && all(abs(ndc) < vec2f(1.0))) {
        return vec2i(-1);
    }
    // A coordinate just below 1 may round up to the size.
    return min(vec2i((vec2f(0.5, 0.5) + vec2f(0.5, -0.5) * ndc) * vec2f(view.size)), vec2i(view.size) - 1);
}

// The larger of the distances in columns and in rows.
fn pixel_distance(a: vec2u, b: vec2i) -> f32 {
    let away = abs(vec2f(b) - vec2f(a));
    return max(away.x, away.y);
}

// Whether a point is on the receiver's plane, as far as this length allows.
fn receiver_is_coplanar(receiver: Receiver, tap: vec3f, length: f32) -> bool {
    return abs(dot(receiver.normal, tap - receiver.position)) <= params.range_scale * length + PLANE_TOLERANCE;
}

// A number in [0, 1) for each pixel that is spread evenly over the pixels around any (Jimenez 2014, interleaved gradient
// noise).
fn pixel_phase(id: vec2u) -> f32 {
    return fract(52.9829189 * fract(dot(vec2f(id), vec2f(0.06711056, 0.00583715))));
}
