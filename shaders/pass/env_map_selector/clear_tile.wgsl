// Empties a tile of the atlas before it is drawn anew; the vertex stage puts it infinitely far away.

@fragment
fn fragment() -> @location(0) vec4u {
    return vec4u(0u);
}
