// Rays that leave surfaces, and what they meet.

// Twin of `resource::SurfaceRay`.
struct SurfaceRay {
    position: vec3f,
    normal: u32,
    direction: vec3f,
    // For whoever made it
    tag: u32,
}

// Twin of `resource::SurfaceHit`.
struct SurfaceHit {
    distance: f32,
    kind: u32,
    normal: u32,
    reflectance: u32,
    fetches: u32,
    maps: u32,
    steps: u32,
    // As in Hit
    lobe: u32,
}
