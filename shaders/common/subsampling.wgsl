// Which pixels have a sample where irradiance is estimated at a part of them. Twin of `Subsampling`.

// Samples along each axis of an image of `full` pixels.
fn subsampling_size(full: vec2u, factor: u32) -> vec2u {
    return (full + factor - 1u) / factor;
}

// The pixel that a sample stands on: the middle of its block, within the image.
fn subsampling_pixel(index: vec2u, factor: u32, full: vec2u) -> vec2u {
    return min(index * factor + factor / 2u, full - 1u);
}
