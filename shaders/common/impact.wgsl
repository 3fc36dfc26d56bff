// What the pool knows of an impact.
struct Impact {
    light: u32,
    red: u32,
    green: u32,
    blue: u32,
    // From the light's place when it arrived
    offset: vec3f,
    pad: u32,
}

// Whether it is one.
fn impact_counts(impact: Impact) -> bool {
    return (impact.red | impact.green | impact.blue) != 0u;
}
