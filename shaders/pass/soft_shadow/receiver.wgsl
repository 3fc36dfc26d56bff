// What all ways to a soft shadow share: the receiver at a pixel, and the ellipse that a penumbra covers on it. Each step's file
// binds `params`, `view`, `depth_texture` and `normal_texture`.

// A receiver that is tilted further than this counts as tilted this much: the pixels of its penumbra are many, and its
// light is an eighth.
const LEAST_COSINE: f32 = 0.125;

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

// Along the light's ray.
fn receiver_distance(light: Light, p: vec3f) -> f32 {
    if light.kind == LIGHT_DIRECTIONAL {
        return dot(p, light.direction) + SURFACE_TEXEL_PARALLEL_START;
    }
    return length(light.position - p);
}

fn receiver_at(light: Light, id: vec2u) -> Receiver {
    let n = g_buffer_normal(view, textureLoad(normal_texture, id + view.origin, 0));
    return receiver_of(light, receiver_position(id), n);
}

fn receiver_of(light: Light, p: vec3f, n: vec3f) -> Receiver {
    let distance = receiver_distance(light, p);
    let to_light = (light.position - p) / max(distance, 0x1p-60);
    return Receiver(p, n, select(to_light, -light.direction, light.kind == LIGHT_DIRECTIONAL), distance);
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

// What a G-buffer's normals may be off by, radians: the half of a step of 11 bits, twice over.
const NORMAL_ERROR: f32 = 0x1p-10;

// A point of the receiver's plane, lifted by as much as its normal may be off, or the plane's own surface would shade it where
// light grazes.
fn receiver_point(receiver: Receiver, offset: vec3f) -> vec3f {
    return receiver.position + offset + (NORMAL_ERROR * length(offset)) * receiver.normal;
}

// Whether any of a light may reach the receiver: of a flat lamp, or a wide sun, a part may stand above the horizon where its
// middle does not.
fn receiver_faces(light: Light, receiver: Receiver) -> bool {
    let lowest = select(0.0, -light_disc_sine(light), light.kind == LIGHT_DIRECTIONAL);
    return light.kind == LIGHT_AREA || dot(receiver.normal, receiver.to_light) > lowest;
}

// The penumbra's radius where none is searched for: occluders tend to stand nearer to what they shade than to the lamp, so that
// of one a quarter of the way from receiver to lamp, or through the region.
fn receiver_one_radius(light: Light, receiver: Receiver) -> f32 {
    let way = select(receiver.distance, 2.0 * light.disc_radius, light.kind == LIGHT_DIRECTIONAL);
    return shadow_penumbra_radius(light, receiver.distance, 0.25 * way);
}
