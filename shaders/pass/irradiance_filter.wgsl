// Irradiance evened out along surfaces: a joint bilateral filter over the pixels around, each weighing less the further it is
// on the screen, the more its normal turns and the further it lies off the tangent plane.

struct Params {
    // Pixels of the G-buffer for each one of the irradiance, along each axis
    factor: u32,
    // Pixels of the irradiance to each side
    radius: u32,
    normal_agreement: f32,
    plane_distance: f32,
    // What is added is multiplied by that
    plus_factor: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var base_color_texture: texture_2d<f32>;
@group(0) @binding(5) var surface_texture: texture_2d<u32>;
@group(0) @binding(6) var estimate: texture_2d<f32>;
@group(0) @binding(7) var plus: texture_2d<f32>;
@group(0) @binding(8) var irradiance: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn filter_pixels(@builtin(global_invocation_id) id: vec3u) {
    let size = subsampling_size(view.size, params.factor);
    if any(id.xy >= size) {
        return;
    }
    let own = textureLoad(estimate, id.xy, 0);
    var added = vec3f(0.0);
    if params.plus_factor > 0.0 {
        added = params.plus_factor * textureLoad(plus, id.xy, 0).rgb;
    }
    let pixel = subsampling_pixel(id.xy, params.factor, view.size);
    if !bilateral_is_surface(pixel) {
        textureStore(irradiance, id.xy, vec4f(own.rgb + added, own.a));
        return;
    }
    let receiver = bilateral_receiver(pixel);
    let radius = i32(params.radius);
    let reach = f32((radius + 1) * (radius + 1));
    var sum = vec4f(own.rgb, 1.0);
    for (var y = -radius; y <= radius; y++) {
        for (var x = -radius; x <= radius; x++) {
            let index = vec2i(id.xy) + vec2i(x, y);
            let share = 1.0 - f32(x * x + y * y) / reach;
            if share <= 0.0 || share == 1.0 || any(index < vec2i(0)) || any(index >= vec2i(size)) {
                continue;
            }
            let other = subsampling_pixel(vec2u(index), params.factor, view.size);
            if bilateral_is_surface(other) {
                let weight = share * bilateral_fit(receiver, other, params.normal_agreement, params.plane_distance).x;
                if weight > 0.0 {
                    sum += weight * vec4f(textureLoad(estimate, index, 0).rgb, 1.0);
                }
            }
        }
    }
    textureStore(irradiance, id.xy, vec4f(sum.rgb / sum.a + added, own.a));
}
