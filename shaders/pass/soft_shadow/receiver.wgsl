// What the steps of the soft shadow share: the receiver at a pixel, the ellipse that a penumbra covers on it, and the way
// from a line on its surface to pixels. Each step's file binds `params`, `view`, `depth_texture` and `normal_texture`.

struct Params {
    // Index of the light
    light: u32,
    shadow_map_size: u32,
    layer_count: u32,
    // 0: no search, one radius for all
    search: u32,
    search_taps: u32,
    blur_taps: u32,
    max_radius: f32,
    range_scale: f32,
}

// In the textures of occluder distances and of visibility: not a surface, or one that faces away from the light.
const NO_RECEIVER: f32 = -2.0;
// In the texture of occluder distances: nothing is in the way.
const NO_OCCLUDER: f32 = -1.0;

// A receiver that is tilted further than this counts as tilted this much: the pixels of its penumbra are many, and its
// light is an eighth.
const LEAST_COSINE: f32 = 0.125;
// Surfaces this near to the receiver's plane lie in it, unit frame: the 11 bits of a G-buffer's normals over a penumbra of
// ordinary width, and depth.
const PLANE_TOLERANCE: f32 = 0x1p-14;

struct Receiver {
    position: vec3f,
    normal: vec3f,
    // Unit, to the lamp's centre
    to_light: vec3f,
    // Along the light's ray
    distance: f32,
}

fn receiver_position(id: vec2u) -> vec3f {
    return g_buffer_position(view, vec2f(id), textureLoad(depth_texture, id + view.origin, 0).r);
}

fn receiver_at(light: Light, id: vec2u) -> Receiver {
    let p = receiver_position(id);
    let n = g_buffer_normal(view, textureLoad(normal_texture, id + view.origin, 0));
    if light.kind == LIGHT_DIRECTIONAL {
        return Receiver(p, n, -light.direction, dot(p, light.direction) + SURFACE_TEXEL_PARALLEL_START);
    }
    let to_light = light.position - p;
    let distance = length(to_light);
    return Receiver(p, n, to_light / max(distance, 0x1p-60), distance);
}

// Where the penumbra's radius across the light points on the receiver's plane: unchanged across the tilt, stretched along
// it, because the cone of light is cut at an angle.
fn receiver_axes(receiver: Receiver) -> array<vec3f, 2> {
    let tilt_axis = cross(receiver.normal, receiver.to_light);
    let sine_squared = dot(tilt_axis, tilt_axis);
    // Light from straight above: any axis will do.
    var u = sampling_frame(receiver.normal)[0];
    // Below this sine the cross product is rounding.
    if sine_squared > 0x1p-20 {
        u = tilt_axis * inverseSqrt(sine_squared);
    }
    let cosine = max(dot(receiver.normal, receiver.to_light), LEAST_COSINE);
    return array(u, cross(receiver.normal, u) / cosine);
}

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

// Weight of the surface at another pixel: how far it lies from the receiver's plane, against the penumbra's radius. Zero
// distance on a plane, however wide the penumbra, so that only other surfaces are left out.
fn receiver_range_weight(receiver: Receiver, tap: vec2u, radius: f32) -> f32 {
    let off_plane = dot(receiver.normal, receiver_position(tap) - receiver.position);
    let width = params.range_scale * radius + PLANE_TOLERANCE;
    return exp(-off_plane * off_plane / (width * width));
}

// A number in [0, 1) for each pixel that is spread evenly over the pixels around any (Jimenez 2014, interleaved gradient
// noise).
fn pixel_phase(id: vec2u) -> f32 {
    return fract(52.9829189 * fract(dot(vec2f(id), vec2f(0.06711056, 0.00583715))));
}
