// The surface point that a pixel of the G-buffer shows. The module brings `view` and the textures.

fn receiver_depth(pixel: vec2u) -> f32 {
    return textureLoad(depth_texture, pixel + view.origin, 0).r;
}

fn receiver_position(pixel: vec2i) -> vec3f {
    return g_buffer_position(view, vec2f(pixel), receiver_depth(vec2u(pixel)));
}

fn receiver_at(pixel: vec2u) -> Receiver {
    let at = pixel + view.origin;
    if textureLoad(base_color_texture, at, 0).a <= 0.0 {
        return receiver_nowhere();
    }
    let p = vec2i(pixel);
    let position = receiver_position(p);
    let limit = vec2i(view.size) - 1;
    let around = Neighbours(
        receiver_position(vec2i(max(p.x - 1, 0), p.y)),
        receiver_position(vec2i(min(p.x + 1, limit.x), p.y)),
        receiver_position(vec2i(p.x, max(p.y - 1, 0))),
        receiver_position(vec2i(p.x, min(p.y + 1, limit.y))),
    );
    let shading = g_buffer_normal(view, textureLoad(normal_texture, at, 0));
    let normal = g_buffer_geometric_normal(view, p, position, around, shading);
    return Receiver(position, normal, textureLoad(surface_texture, at, 0).r & 0xffffu, true);
}
