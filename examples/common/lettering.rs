//! Small text in pictures.

use image::{Rgb, RgbImage};
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

const SIZE: RasterHeight = RasterHeight::Size16;
const WEIGHT: FontWeight = FontWeight::Regular;

/// What letters and other things stand on: dark, and told from the dark end of a colour map.
pub(crate) const BACKGROUND: Rgb<u8> = Rgb([48; 3]);

/// Pixels that a line takes, with the space above and below its letters.
pub(crate) const LINE_HEIGHT: u32 = SIZE.val() as u32;

/// Pixels that a text takes.
pub(crate) fn width(text: &str) -> u32 {
    (text.chars().count() * get_raster_width(WEIGHT, SIZE)) as u32
}

/// Writes a line in white over what is there, its upper left corner at `(x, y)`. What leaves the picture is cut off;
/// letters outside ASCII become question marks.
pub(crate) fn write(picture: &mut RgbImage, (x, y): (u32, u32), text: &str) {
    let mut left = x;
    for letter in text.chars() {
        let Some(raster) = get_raster(letter, WEIGHT, SIZE).or_else(|| get_raster('?', WEIGHT, SIZE)) else {
            continue;
        };
        for (row, coverage) in (y..).zip(raster.rows()) {
            for (column, &coverage) in (left..).zip(coverage) {
                if let Some(pixel) = picture.get_pixel_mut_checked(column, row) {
                    let Rgb(below) = *pixel;
                    *pixel = Rgb(below.map(|below| below.max(coverage)));
                }
            }
        }
        left += raster.width() as u32;
    }
}
