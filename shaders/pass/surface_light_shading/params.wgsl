// The uniform of all forms, and what a light gives a receiver.

struct Params {
    // Pixels of the G-buffer along each axis for one of the irradiance
    factor: u32,
    light_count: u32,
    // Unit-frame flux of a step
    flux_of_step: f32,
    // A `SHAPE_`
    shape: u32,
    // Irradiance below which a light does not count
    least: f32,
    // Of a pixel, where shadows are traced
    ray_count: u32,
    // Rows of the irradiance: from, how many
    first_row: u32,
    row_count: u32,
    // A `SHADOWS_`
    shadows: u32,
    // How far ambient occlusion reaches, unit frame
    reach: f32,
    sample_offset: u32,
}

fn light_flux(index: u32) -> vec3f {
    return vec3f(flux[index].xyz) * params.flux_of_step;
}

// Numbers of `LightShape`.
const SHAPE_POINT: u32 = 0u;
const SHAPE_DISC: u32 = 1u;
const SHAPE_SQUARE: u32 = 2u;

// Beyond so many of its sides a square is as good as a point, to some hundredths where it grazes.
const SQUARE_NEAR: f32 = 5.0;

// Irradiance at a point from a light of flux 1, if nothing is in the way.
fn light_factor(light: SurfaceLight, p: vec3f, n: vec3f) -> f32 {
    let away = light.position - p;
    let distance_squared = dot(away, away);
    if params.shape == SHAPE_SQUARE && distance_squared < SQUARE_NEAR * SQUARE_NEAR * light.area {
        let frame = sampling_frame(light.normal);
        let half_side = 0.5 * sqrt(light.area);
        let corner = light.position - half_side * (frame[0] + frame[1]);
        let sides = 2.0 * half_side * mat2x3f(frame[0], frame[1]);
        let square = Polygon(corner, 4u, sides[0], 1.0, sides[1], light.area, vec3f(1.0));
        return polygon_irradiance(square, p, n) / (SURFACE_LIGHT_PI * light.area);
    }
    let cosines = max(dot(n, away), 0.0) * max(-dot(light.normal, away), 0.0);
    let spread = SURFACE_LIGHT_PI * distance_squared + select(0.0, light.area, params.shape == SHAPE_DISC);
    // Both cosines lack their distance.
    return cosines / max(distance_squared * spread, 0x1p-60);
}

// Irradiance that it gives, if nothing is in the way.
fn irradiance_of(index: u32, p: vec3f, n: vec3f) -> vec3f {
    return light_flux(index) * light_factor(lights[index], p, n);
}

// A ball outside of which a light does not count: its irradiance, wherever the receiver faces, is at most
// F cos / (pi r^2), which is above the least within r = r0 sqrt(cos) of it, with r0 = sqrt(F / (pi least)). That region lies
// in a ball of radius 0.6204 r0 whose middle stands 0.4387 r0 along the normal.
struct Ball {
    center: vec3f,
    radius: f32,
}

fn influence(index: u32) -> Ball {
    let f = light_flux(index);
    let strongest = max(f.x, max(f.y, f.z));
    if strongest <= 0.0 {
        return Ball(vec3f(0.0), -1.0);
    }
    let reach = min(sqrt(strongest / (SURFACE_LIGHT_PI * max(params.least, 0x1p-100))), 0x1p20);
    return Ball(lights[index].position + 0.4387 * reach * lights[index].normal, 0.6204 * reach);
}
