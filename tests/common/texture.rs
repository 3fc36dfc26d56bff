//! What textures show, in `f64`.

use lightfall::scene::Texture;

/// A value by bilinear interpolation of an image that repeats; coordinates count its sides, `value` is that of a texel's
/// four bytes.
pub(crate) fn bilinear(texture: &Texture, [u, v]: [f64; 2], value: impl Fn([u8; 4]) -> f64) -> f64 {
    let Texture { width, height, .. } = *texture;
    let (x, y) = (u * f64::from(width) - 0.5, v * f64::from(height) - 0.5);
    let texel = |i: f64, j: f64| {
        let at = |k: f64, n: u32| k.rem_euclid(f64::from(n)) as usize;
        value(texture.rgba.as_chunks().0[at(j, height) * width as usize + at(i, width)])
    };
    let (i, j) = (x.floor(), y.floor());
    let row = |j: f64| texel(i, j) * (1.0 - (x - i)) + texel(i + 1.0, j) * (x - i);
    row(j) * (1.0 - (y - j)) + row(j + 1.0) * (y - j)
}

/// A texel's opacity.
pub(crate) fn opacity([_, _, _, alpha]: [u8; 4]) -> f64 {
    f64::from(alpha) / 255.0
}

/// What an sRGB byte encodes (IEC 61966-2-1).
pub(crate) fn srgb_to_linear(byte: u8) -> f64 {
    let x = f64::from(byte) / 255.0;
    if x <= 0.04045 {
        x / 12.92
    } else {
        ((x + 0.055) / 1.055).powf(2.4)
    }
}
