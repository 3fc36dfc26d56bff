// Virtual surface lights: points that stand for the light that the surface around them sends on.

// Twin of `resource::SurfaceLights`' record. Each point has two, one for either side.
struct SurfaceLight {
    position: vec3f,
    // Of the surface that it stands for; 0: it is a point
    area: f32,
    normal: vec3f,
    pad: u32,
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

// Irradiance at a point from a light of flux 1, if nothing is in the way: of its disc, on whose axis this is exact where the
// receiver faces it, or of a point.
fn surface_light_factor(light: SurfaceLight, p: vec3f, n: vec3f) -> f32 {
    let away = light.position - p;
    let distance_squared = dot(away, away);
    let cosines = max(dot(n, away), 0.0) * max(-dot(light.normal, away), 0.0);
    let spread = SURFACE_LIGHT_PI * distance_squared + light.area;
    // Both cosines lack their distance.
    return cosines / max(distance_squared * spread, 0x1p-60);
}
