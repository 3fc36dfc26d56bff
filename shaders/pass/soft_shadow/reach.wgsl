// How far around a receiver anything may matter to its penumbra. The module brings `lights` and `nearest`.

const TILES: u32 = 8u;
// No direction is further than 45 degrees from one of a cross's four arms. An arm this much longer than the search's
// radius crosses every straight edge within the radius.
const ARM_LENGTH: f32 = 1.41421356;
// Distance from the lamp of the nearest thing that may shade the receiver, or beyond the receiver where there is none.
fn nearest_occluder(light: Light, receiver: Receiver) -> f32 {
    let ray = light_ray_to(light, receiver.position);
    if any(ray.uv < vec2f(0.0)) || any(ray.uv > vec2f(1.0)) {
        return receiver.distance;
    }
    let tile = cube_face_texel(ray.uv, TILES);
    return nearest[((params.layer_count + ray.layer) * TILES + tile.y) * TILES + tile.x];
}

// How far from the receiver, across the light, a shadow may begin or end that reaches it.
fn reach_radius(light: Light, receiver: Receiver) -> f32 {
    if params.search == 0u {
        // The blur covers a square around the ellipse.
        return ARM_LENGTH * receiver_one_radius(light, receiver);
    }
    let far_gap = receiver.distance - nearest_occluder(light, receiver);
    return ARM_LENGTH * shadow_penumbra_radius(light, receiver.distance, far_gap);
}

// No tap is further away.
fn reach_most_pixels() -> f32 {
    return ARM_LENGTH * params.max_radius;
}
