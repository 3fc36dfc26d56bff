// Mean visibility over the penumbra's ellipse on the receiver, by points spread over all of it.

// Of a point by its place along both axes.
fn plane_pixel(lines: array<Line, 2>, at: vec2f) -> vec2i {
    return line_pixel(Line(lines[0].start + at.x * lines[0].step, lines[1].step), at.y);
}

fn gathered(light: Light, id: vec2u, own: f32) -> f32 {
    let receiver = receiver_at(light, id);
    let radius_across = penumbra_found(light, receiver, id);
    if radius_across <= 0.0 {
        return own;
    }
    let axes = receiver_axes(receiver);
    let lines = array(line_along(receiver.position, axes[0]), line_along(receiver.position, axes[1]));
    let radius = vec2f(
        line_radius(lines[0], radius_across, params.max_radius),
        line_radius(lines[1], radius_across, params.max_radius),
    );
    let turn = pixel_phase(id);
    var sum = 0.0;
    var is_whole = true;
    for (var i = 0u; i < params.disc_taps; i++) {
        let pixel = plane_pixel(lines, radius * disc_point(i, params.disc_taps, turn));
        if is_shown(receiver, radius_across, pixel, id) {
            sum += source_at(vec2u(pixel));
        } else {
            is_whole = false;
        }
    }
    for (var i = select(0u, params.disc_taps, is_whole); i < params.disc_taps; i++) {
        let at = radius * disc_point(i, params.disc_taps, turn);
        if !is_shown(receiver, radius_across, plane_pixel(lines, at), id) {
            let p = receiver_point(receiver, at.x * axes[0] + at.y * axes[1]);
            sum += visibility_by_maps(light, receiver, p);
        }
    }
    return sum / f32(params.disc_taps);
}
