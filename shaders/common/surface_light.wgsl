// Virtual surface lights: points that stand for the light that the surface around them sends on.

// Twin of `resource::SurfaceLights`' record. Each point has two, one for either side.
struct SurfaceLight {
    position: vec3f,
    // Of the surface that it stands for; 0: it is a point
    area: f32,
    normal: vec3f,
    // Of its place, and the side
    surface: u32,
}

// Where they stand, by cells, and what their flux is counted in.
struct SurfaceLightGrid {
    // Of the first cell
    origin: vec3f,
    // Side of a cell
    cell: f32,
    cells: vec3u,
    // Lights
    count: u32,
    // Steps of flux in one unit-frame flux
    steps: f32,
}

const SURFACE_LIGHT_PI: f32 = 3.14159265;
