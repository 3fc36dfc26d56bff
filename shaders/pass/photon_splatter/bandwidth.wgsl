// How wide a photon's kernel is on the screen. The shape brings `bin_count(bin) -> u32`.

// Bins to each side of a photon's that its density is taken from.
const BINS_AROUND: i32 = 5;

// Photons per area in the bins around a photon, by the area that the bins cover on its plane.
fn bin_density(b: Bandwidth, photon: Photon) -> f32 {
    let grid = bin_grid(b);
    let bin = bin_of(b, photon.position);
    if bin >= grid.x * grid.y {
        return 0.0;
    }
    let at = vec2i(vec2u(bin % grid.x, bin / grid.x));
    let first = max(at - BINS_AROUND, vec2i(0));
    let last = min(at + BINS_AROUND, vec2i(grid) - 1);
    var count = 0u;
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            count += bin_count(u32(y) * grid.x + u32(x));
        }
    }
    let pixels = f32(BIN * b.factor) * vec2f(last - first + 1);
    let w = dot(g_buffer_row(view, 3u), vec4f(photon.position, 1.0));
    let side = w / g_buffer_pixels_a_length(view);
    let to_eye = normalize(view.eye.xyz - view.eye.w * photon.position);
    let cosine = max(abs(dot(to_eye, octahedral_unpack(photon.normal))), 0.05);
    return f32(count) * cosine / (pixels.x * pixels.y * side * side);
}

// So many pixels at a photon's distance as a length; 0 behind the eye.
fn splat_pixels(pixels: f32, photon: Photon) -> f32 {
    let w = dot(g_buffer_row(view, 3u), vec4f(photon.position, 1.0));
    return max(0.0, pixels * w / g_buffer_pixels_a_length(view));
}

// No kernel of this photon is wider.
fn splat_widest(b: Bandwidth, photon: Photon) -> f32 {
    let widest = b.scale * inverseSqrt(b.lowest) * bandwidth_narrowing(b, photon);
    return min(max(widest, splat_pixels(b.min_radius, photon)), splat_pixels(b.max_radius, photon));
}

// Radius of a photon's kernel, unit frame (Yao et al. 2010, section 6, made dimensionless by area and pdf); 0 where nothing
// is to be drawn.
fn splat_radius(b: Bandwidth, photon: Photon) -> f32 {
    if !photon_is_splatted(photon.state) {
        return 0.0;
    }
    var h = bandwidth_radius(b, photon);
    if h > 0.0 && b.rule == BANDWIDTH_BIN {
        h *= inverseSqrt(clamp(bin_density(b, photon) / b.uniform, b.lowest, b.highest));
    }
    h = min(max(h, splat_pixels(b.min_radius, photon)), splat_pixels(b.max_radius, photon));
    return select(0.0, h, h > 0.0);
}
