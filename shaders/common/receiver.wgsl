// A point that irradiance is estimated at.

struct Receiver {
    position: vec3f,
    normal: vec3f,
    // 0: none in particular
    surface: u32,
    is_seen: bool,
}

fn receiver_nowhere() -> Receiver {
    return Receiver(vec3f(0.0), vec3f(0.0), 0u, false);
}
