//! Pictures of how an image differs from a reference: both on a display, and the relative error in false colours.
//!
//! *On a display.* Both images alike: radiance times an exposure, cut off at 1, sRGB (IEC 61966-2-1), 8 bits. The
//! exposure brings the 90th percentile of the reference, over all channels of the compared pixels, or its mean if that is
//! larger, to 0.5.
//!
//! *Relative error.* The root of a pixel's part of relMSE, the reference's own noise left in:
//! √(mean over channels of (x − r)² / (r² + (0.01 · mean r)²)). Its logarithm from 1 % to 100 % runs through the
//! perceptually uniform colour map magma (Smith and van der Walt 2015), black to light yellow. Pixels that are not
//! compared are hatched in grey; those where the image is not finite are green.

use super::lettering;
use image::{Rgb, RgbImage};
use lightfall::reference::metrics::{Image, Truth};

/// Where the percentile of the reference goes on the display's linear scale: most of the image is in the middle.
const DISPLAY_LEVEL: f64 = 0.5;
const DISPLAY_PERCENTILE: f64 = 0.9;
/// Relative errors at the ends of the colour map.
const ERROR_RANGE: (f64, f64) = (0.01, 1.0);
/// Part of the mean radiance that stands in for the radiance of black pixels, as in relMSE.
const BLACK_GUARD: f64 = 0.01;
const NOT_FINITE: [u8; 3] = [0, 255, 0];
const HATCH: [[u8; 3]; 2] = [[150; 3], [90; 3]];
/// Pixels from one line of the hatching to the next, and of the line.
const HATCH_PERIOD: u32 = 6;
const HATCH_LINE: u32 = 2;

/// How radiance becomes display values.
pub(crate) struct Display {
    exposure: f64,
}

impl Display {
    /// Made for a reference that has at least one pixel to compare and is not black there.
    pub(crate) fn of(truth: &Truth) -> Self {
        let mut radiance: Vec<f64> = compared(truth)
            .flat_map(|pixel| truth.image.rgb[pixel])
            .map(f64::from)
            .collect();
        radiance.sort_by(f64::total_cmp);
        // The mean, where light falls on less than a tenth of the image.
        let bright = percentile(&radiance, DISPLAY_PERCENTILE).max(mean_radiance(truth));
        Self {
            exposure: DISPLAY_LEVEL / bright,
        }
    }

    /// NaN becomes black.
    pub(crate) fn encode(&self, radiance: [f64; 3]) -> [u8; 3] {
        radiance.map(|radiance| (srgb((radiance * self.exposure).clamp(0.0, 1.0)) * 255.0).round() as u8)
    }
}

/// The image on a display. A pixel of the picture is the mean of `block` × `block` pixels, fewer at the right and lower
/// border.
pub(crate) fn radiance_picture(image: &Image, display: &Display, block: u32) -> RgbImage {
    reduced(image, block, |_, pixels| {
        if !pixels.iter().all(|&pixel| is_finite(image, pixel)) {
            return NOT_FINITE;
        }
        let sum = pixels.iter().fold([0.0; 3], |sum: [f64; 3], &pixel| {
            [0, 1, 2].map(|c| sum[c] + f64::from(image.rgb[pixel][c]))
        });
        display.encode(sum.map(|sum| sum / pixels.len() as f64))
    })
}

/// The relative error of two images of the same size. A pixel of the picture is the root mean square over the compared
/// ones of `block` × `block` pixels.
pub(crate) fn error_picture(image: &Image, truth: &Truth, block: u32) -> RgbImage {
    let guard = (BLACK_GUARD * mean_radiance(truth)).powi(2);
    let squared_error = |pixel: usize| {
        let (x, r) = (image.rgb[pixel].map(f64::from), truth.image.rgb[pixel].map(f64::from));
        [0, 1, 2]
            .map(|c| (x[c] - r[c]).powi(2) / (r[c] * r[c] + guard))
            .iter()
            .sum::<f64>()
            / 3.0
    };
    reduced(image, block, |(x, y), pixels| {
        if !pixels.iter().all(|&pixel| is_finite(image, pixel)) {
            return NOT_FINITE;
        }
        let errors: Vec<f64> = pixels
            .iter()
            .filter(|&&pixel| truth.is_compared(pixel))
            .map(|&pixel| squared_error(pixel))
            .collect();
        if errors.is_empty() {
            hatch(x, y)
        } else {
            error_color((errors.iter().sum::<f64>() / errors.len() as f64).sqrt())
        }
    })
}

/// What the colours of [`error_picture`] mean, one line of text high. What does not fit the width is cut off.
pub(crate) fn legend(width: u32) -> RgbImage {
    const BAR: u32 = 200;
    const SPACE: u32 = 8;
    let mut legend = RgbImage::from_pixel(width, lettering::LINE_HEIGHT, lettering::BACKGROUND);
    let mut left = 0;
    let mut place = |text: &str, swatch: u32, color: &dyn Fn(u32, u32) -> [u8; 3]| {
        lettering::write(&mut legend, (left, 0), text);
        left += lettering::width(text) + SPACE;
        for (x, y) in (0..swatch).flat_map(|x| (3..lettering::LINE_HEIGHT - 3).map(move |y| (x, y))) {
            if let Some(pixel) = legend.get_pixel_mut_checked(left + x, y) {
                *pixel = Rgb(color(x, y));
            }
        }
        left += swatch + SPACE;
    };
    let (least, most) = ERROR_RANGE;
    let ramp = |x: u32, _| error_color(least * (most / least).powf(f64::from(x) / f64::from(BAR - 1)));
    place("error 1%", BAR, &ramp);
    place("100%  not compared", 24, &hatch);
    place("not finite", 24, &|_, _| NOT_FINITE);
    legend
}

/// A picture of one pixel for each block of the image; `color` gets its place in the picture and the pixels in it.
fn reduced(image: &Image, block: u32, color: impl Fn((u32, u32), &[usize]) -> [u8; 3]) -> RgbImage {
    RgbImage::from_fn(image.width.div_ceil(block), image.height.div_ceil(block), |x, y| {
        let span = |at: u32, end: u32| at * block..((at + 1) * block).min(end);
        let pixels: Vec<usize> = span(y, image.height)
            .flat_map(|row| span(x, image.width).map(move |column| (row * image.width + column) as usize))
            .collect();
        Rgb(color((x, y), &pixels))
    })
}

fn error_color(error: f64) -> [u8; 3] {
    let (least, most) = ERROR_RANGE;
    // An error of 0 has the logarithm −∞, which the colour map takes for its lower end.
    let color = colorous::MAGMA.eval_continuous((error / least).ln() / (most / least).ln());
    [color.r, color.g, color.b]
}

fn hatch(x: u32, y: u32) -> [u8; 3] {
    HATCH[usize::from((x + y) % HATCH_PERIOD < HATCH_LINE)]
}

/// The transfer function of IEC 61966-2-1 for 0 to 1.
fn srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

fn is_finite(image: &Image, pixel: usize) -> bool {
    image.rgb[pixel].iter().all(|radiance| radiance.is_finite())
}

fn compared(truth: &Truth) -> impl Iterator<Item = usize> {
    (0..truth.image.rgb.len()).filter(|&pixel| truth.is_compared(pixel))
}

/// Over all channels of the compared pixels.
fn mean_radiance(truth: &Truth) -> f64 {
    let (sum, count) = compared(truth)
        .flat_map(|pixel| truth.image.rgb[pixel])
        .fold((0.0, 0_usize), |(sum, count), radiance| {
            (sum + f64::from(radiance), count + 1)
        });
    sum / count as f64
}

/// Of sorted values, interpolated between the two nearest.
fn percentile(sorted: &[f64], part: f64) -> f64 {
    let position = part * (sorted.len() - 1) as f64;
    let below = position.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (sorted[above] - sorted[below]) * position.fract()
}
