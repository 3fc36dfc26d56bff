const ENVIRONMENT_PI: f32 = 3.14159265;

// Twin of `EnvironmentImage::texel_at`: the texel that shines from a direction away from the scene.
fn environment_texel(direction: vec3f, rotation: f32, size: vec2u) -> vec2u {
    let turn = (rotation + atan2(direction.x, -direction.z)) / (2.0 * ENVIRONMENT_PI) + 0.5;
    let uv = vec2f(turn - floor(turn), atan2(length(direction.xz), direction.y) / ENVIRONMENT_PI);
    return min(vec2u(uv * vec2f(size)), size - 1u);
}
