// The bins of the screen that photons are counted in.

// Pixels of the irradiance along a bin's side. Twin of `BIN`.
const BIN: u32 = 1u;
// Bins beyond the rim on each side: photons out there reach in. Twin of `BORDER`.
const BORDER: u32 = 24u;

fn bin_grid(b: Bandwidth) -> vec2u {
    return (subsampling_size(view.size, b.factor) + BIN - 1u) / BIN + 2u * BORDER;
}

// Of the irradiance's pixels: where a point of the G-buffer, in pixels, lies among them. The centre of pixel i, i + 1/2, is
// that of pixel factor i + factor / 2, rounded down, of the G-buffer.
fn irradiance_place(b: Bandwidth, at: vec2f) -> vec2f {
    let factor = f32(b.factor);
    let shift = f32(b.factor / 2u) + 0.5 - 0.5 * factor;
    return (at - shift) / factor;
}

// The same of normalised device coordinates.
fn irradiance_point(b: Bandwidth, ndc: vec2f) -> vec2f {
    return irradiance_place(b, vec2f(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y) * vec2f(view.size));
}

// Column and row of a point's bin, before the eye; outside the grid beyond its border.
fn bin_place(b: Bandwidth, p: vec3f) -> vec2f {
    let w = dot(g_buffer_row(view, 3u), vec4f(p, 1.0));
    let ndc = vec2f(dot(g_buffer_row(view, 0u), vec4f(p, 1.0)), dot(g_buffer_row(view, 1u), vec4f(p, 1.0))) / w;
    return floor(irradiance_point(b, ndc) / f32(BIN)) + f32(BORDER);
}

fn is_before_eye(p: vec3f) -> bool {
    return dot(g_buffer_row(view, 3u), vec4f(p, 1.0)) > 0.0;
}

// The bin of a point of space; the number of bins where it is in none.
fn bin_of(b: Bandwidth, p: vec3f) -> u32 {
    let grid = bin_grid(b);
    let place = bin_place(b, p);
    if !(is_before_eye(p) && all(place >= vec2f(0.0)) && all(place < vec2f(grid))) {
        return grid.x * grid.y;
    }
    return u32(place.y) * grid.x + u32(place.x);
}

// The same, but that a point beyond the border is in the nearest bin.
fn nearest_bin(b: Bandwidth, p: vec3f) -> u32 {
    let grid = bin_grid(b);
    let place = clamp(bin_place(b, p), vec2f(0.0), vec2f(grid) - 1.0);
    return select(grid.x * grid.y, u32(place.y) * grid.x + u32(place.x), is_before_eye(p));
}
