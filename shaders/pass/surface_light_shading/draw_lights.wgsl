// A rectangle around each light's ball of influence, added up by the raster units.

struct Corner {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) light: u32,
}

// The corners of what a ball covers, in normalised device coordinates: low, high. All of it where a part may lie behind the eye.
fn covered(ball: Ball) -> vec4f {
    var low = vec2f(1.0);
    var high = vec2f(-1.0);
    for (var i = 0u; i < 8u; i++) {
        let side = vec3f(f32(i & 1u), f32((i >> 1u) & 1u), f32(i >> 2u)) * 2.0 - 1.0;
        let clip = view.view_projection * vec4f(ball.center + ball.radius * side, 1.0);
        if clip.w <= 0x1p-20 {
            return vec4f(-1.0, -1.0, 1.0, 1.0);
        }
        low = min(low, clip.xy / clip.w);
        high = max(high, clip.xy / clip.w);
    }
    // Samples stand in the middle of their blocks, and the last ones closer: a block and a half more.
    let margin = 3.0 * f32(params.factor) / vec2f(view.size);
    return vec4f(low - margin, high + margin);
}

@vertex
fn vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) light: u32) -> Corner {
    let ball = influence(light);
    if ball.radius < 0.0 {
        return Corner(vec4f(0.0, 0.0, 0.0, 1.0), light);
    }
    let rectangle = covered(ball);
    let at = select(rectangle.xy, rectangle.zw, vec2<bool>((corner & 1u) == 1u, corner >= 2u));
    return Corner(vec4f(at, 0.5, 1.0), light);
}

@fragment
fn fragment(corner: Corner) -> @location(0) vec4f {
    let receiver = receiver_of(vec2u(corner.clip.xy));
    if !receiver.is_seen {
        discard;
    }
    return vec4f(irradiance_of(corner.light, receiver.position, receiver.normal), 0.0);
}
