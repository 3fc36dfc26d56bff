// The uniform of all forms, and what a light gives a receiver.

struct Params {
    // Pixels of the G-buffer along each axis for one of the irradiance
    factor: u32,
    light_count: u32,
    // Unit-frame flux of a step
    flux_of_step: f32,
    // 1: lights are discs of the surface that they stand for; 0: points
    are_discs: u32,
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

// Irradiance that it gives, if nothing is in the way.
fn irradiance_of(index: u32, p: vec3f, n: vec3f) -> vec3f {
    var light = lights[index];
    light.area *= f32(params.are_discs);
    return light_flux(index) * surface_light_factor(light, p, n);
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
