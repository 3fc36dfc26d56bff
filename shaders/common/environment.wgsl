// Light from infinitely far away. The module brings `environment` and `environment_image`.

// Twin of `resource::environment::gpu::Environment`.
struct Environment {
    // Unit frame, times that of the image; zero where there is none
    radiance: vec3f,
    rotation: f32,
    // Of the image; 0: the same radiance from everywhere
    size: vec2u,
}

// Radiance from a direction away from the scene.
fn environment_radiance(direction: vec3f) -> vec3f {
    if environment.size.x == 0u {
        return environment.radiance;
    }
    let texel = environment_texel(direction, environment.rotation, environment.size);
    return environment.radiance * textureLoad(environment_image, texel, 0).rgb;
}
