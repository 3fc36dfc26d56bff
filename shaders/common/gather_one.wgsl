// Adding up photons for one receiver: `Receivers` is f32.

// Nothing gathered yet.
fn gathered_nothing(receiver: Receiver) -> Gathered {
    var g = Gathered();
    g.x = receiver.position.x;
    g.y = receiver.position.y;
    g.z = receiver.position.z;
    g.normal_x = receiver.normal.x;
    g.normal_y = receiver.normal.y;
    g.normal_z = receiver.normal.z;
    g.surface = receiver.surface;
    return g;
}
