// A point of a surface.

struct SurfaceSample {
    // Unit frame; x beyond SURFACE_SAMPLE_NOWHERE: there is none
    position: vec3f,
    // Octahedral
    normal: u32,
}

const SURFACE_SAMPLE_NOWHERE: f32 = 1e29;
