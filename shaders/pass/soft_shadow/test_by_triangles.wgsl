// The hard shadow test by a ray to the light's middle: exact, and the occluder nearest to the receiver.

fn occluder_gap(light: Light, receiver: Receiver) -> f32 {
    let start = receiver.position + SHADOW_BIAS * receiver.normal;
    let is_turned = light.kind == LIGHT_AREA && light.inner != 0.0 && dot(receiver.to_light, light.direction) >= 0.0;
    if is_turned || dot(receiver.to_light, receiver.normal) <= 0.0 {
        // Of a flat lamp's light as well: from behind there is none, and where its middle is below the horizon nothing hides it.
        return NO_OCCLUDER;
    }
    let met = bvh_closest(start, receiver.to_light, receiver.distance, BVH_CASTS_SHADOW);
    return select(met.distance, NO_OCCLUDER, met.instance == BVH_NONE);
}
