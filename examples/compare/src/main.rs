//! Measures how far an image is from a reference.
//!
//! ```text
//! cargo run --release -p compare -- OURS.exr TRUTH.exr [--png DIFF.png]
//! ```
//!
//! Prints one line of JSON: `finite`, `pixels`, `relmse`, `bias`, `bias_rgb`, `rmse`, `truth_noise` and, where the
//! reference has what they need, `relmse_mixed`, `relmse_edge`, `relmse_interior`; their definitions are those of
//! `lightfall::reference::metrics`. Then `flip`, the mean of the FLIP error map (Andersson et al. 2020, "FLIP: A
//! Difference Evaluator for Alternating Images"; 0 is equal, 1 is the worst) over the compared pixels, and `flip_image`,
//! its mean over the whole image. Numbers are `null` if the image is not finite; the exit status is then 1.
//!
//! FLIP sees both images as [`common::difference`] puts them on a display: one exposure for both, taken from the
//! reference, cut off at 1, sRGB; 67 pixels per degree of the field of view. A difference in a pixel that is not compared
//! reaches the compared ones around it as far as the eye blurs it, a few pixels.
//!
//! With `--minus FILE` the reference is what is left of it without that image: a caustic is all light without what paths from the eye
//! find of it. With `--inside SHARE` only pixels count where the reference, mean of channels, is more than so much of what half a
//! percent of them exceed.
//!
//! With `--png`, writes image, reference and relative error side by side; [`common::difference`] explains the colours.
//!
//! Both files hold linear radiance in channels R, G, B; `common/truth_file.rs` lists the channels of a reference that
//! say which of its pixels count. Bad input gets one line on stderr and exit status 2.

#[path = "../../common"]
#[allow(dead_code, reason = "each example uses its own part of this")]
mod common {
    pub(crate) mod arguments;
    pub(crate) mod difference;
    pub(crate) mod exr_file;
    pub(crate) mod lettering;
    pub(crate) mod report;
    pub(crate) mod truth_file;
}

use clap::Parser;
use common::difference::{self, Display};
use common::{arguments, exr_file, lettering, report, truth_file};
use image::RgbImage;
use image::imageops::replace;
use lightfall::reference::metrics::{self, Image, Truth};
use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8};
use serde_json::{Value, json};
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Measures how far an image is from a reference; prints one line of JSON.
#[derive(Parser)]
#[command(name = "compare")]
struct Arguments {
    /// The image, an EXR file with channels R, G, B
    ours: PathBuf,
    /// The reference, an EXR file of the same size
    truth: PathBuf,
    /// Writes image, reference and relative error side by side
    #[arg(long, value_name = "DIFF.png")]
    png: Option<PathBuf>,
    /// Subtracted from the reference: an EXR file of the same size
    #[arg(long, value_name = "PART.exr")]
    minus: Option<PathBuf>,
    /// Compares bright pixels alone: more than this share of what half a percent of the reference's exceed
    #[arg(long, value_name = "SHARE")]
    inside: Option<f32>,
}

/// Share of the pixels that are brighter than what `--inside` is measured by.
const BRIGHTEST: f64 = 0.005;

fn main() -> ExitCode {
    let arguments: Arguments = arguments::parse("compare");
    match run(&arguments) {
        Ok((line, is_finite)) => {
            println!("{line}");
            if is_finite {
                ExitCode::SUCCESS
            } else {
                ExitCode::FAILURE
            }
        }
        Err(problem) => {
            eprintln!("compare: {problem}");
            ExitCode::from(2)
        }
    }
}

/// The report, and whether the image is finite.
fn run(arguments: &Arguments) -> Result<(Value, bool), String> {
    let image = truth_file::read_image(&arguments.ours)?;
    let mut truth = truth_file::read_truth(&arguments.truth)?;
    if let Some(path) = &arguments.minus {
        subtract(&mut truth, path)?;
    }
    if let Some(share) = arguments.inside {
        if !(share.is_finite() && share >= 0.0) {
            return Err(format!("--inside {share}: expected a share, 0 or more"));
        }
        keep_bright(&mut truth, share);
    }
    let between = |error| {
        format!(
            "{} against {}: {error}",
            arguments.ours.display(),
            arguments.truth.display()
        )
    };
    let comparison = metrics::compare(&image, &truth).map_err(between)?;
    let display = Display::of(&truth);
    let flip = comparison.finite.then(|| Flip::of(&image, &truth, &display));
    let mut figures = report::figures(&comparison, &truth);
    figures["flip"] = json!(flip.as_ref().map(|flip| flip.compared));
    figures["flip_image"] = json!(flip.as_ref().map(|flip| flip.image));
    if let Some(path) = &arguments.png {
        write_picture(path, &picture(&image, &truth, &display))?;
    }
    Ok((figures, comparison.finite))
}

/// What is left of a reference; both errors are in it.
fn subtract(truth: &mut Truth, path: &Path) -> Result<(), String> {
    let Truth {
        image: part,
        standard_error,
        ..
    } = truth_file::read_truth(path)?;
    let image = &mut truth.image;
    if [part.width, part.height] != [image.width, image.height] {
        return Err(format!(
            "{}: is {}×{}, the reference {}×{}",
            path.display(),
            part.width,
            part.height,
            image.width,
            image.height
        ));
    }
    let values = image.rgb.as_flattened_mut().iter_mut();
    values
        .zip(part.rgb.as_flattened())
        .for_each(|(whole, part)| *whole -= part);
    truth.standard_error = match (truth.standard_error.take(), standard_error) {
        (Some(mut whole), Some(part)) => {
            let errors = whole.as_flattened_mut().iter_mut();
            errors.zip(part.as_flattened()).for_each(|(w, p)| *w = w.hypot(*p));
            Some(whole)
        }
        (whole, part) => whole.or(part),
    };
    Ok(())
}

/// Leaves pixels out that are not brighter than a share of the brightest ones.
fn keep_bright(truth: &mut Truth, share: f32) {
    let brightness = |pixel: usize| truth.image.rgb[pixel].iter().sum::<f32>();
    let compared = (0..truth.valid.len()).filter(|&pixel| truth.is_compared(pixel));
    let mut all: Vec<f32> = compared.map(brightness).collect();
    all.sort_by(f32::total_cmp);
    let place = ((1.0 - BRIGHTEST) * all.len() as f64) as usize;
    let Some(&bright) = all.get(place.min(all.len().saturating_sub(1))) else {
        return;
    };
    let kept: Vec<bool> = (0..truth.valid.len())
        .map(|pixel| truth.valid[pixel] && brightness(pixel) > share * bright)
        .collect();
    truth.valid = kept;
}

/// Means of the FLIP error map.
struct Flip {
    compared: f64,
    image: f64,
}

impl Flip {
    /// Of a finite image of the reference's size. Where the reference is not finite, which it may be outside its mask,
    /// both are black.
    fn of(image: &Image, truth: &Truth, display: &Display) -> Self {
        let is_known = |pixel: usize| truth.image.rgb[pixel].iter().all(|radiance| radiance.is_finite());
        let shown = |image: &Image| {
            let bytes: Vec<u8> = (0..image.rgb.len())
                .flat_map(|pixel| {
                    let radiance = if is_known(pixel) { image.rgb[pixel] } else { [0.0; 3] };
                    display.encode(radiance.map(f64::from))
                })
                .collect();
            FlipImageRgb8::with_data(image.width, image.height, &bytes)
        };
        let error = nv_flip::flip(shown(&truth.image), shown(image), DEFAULT_PIXELS_PER_DEGREE).to_vec();
        let mean = |pixels: &mut dyn Iterator<Item = usize>| {
            let (sum, count) = pixels.fold((0.0, 0_usize), |(sum, count), pixel| {
                (sum + f64::from(error[pixel]), count + 1)
            });
            sum / count as f64
        };
        Self {
            compared: mean(&mut (0..error.len()).filter(|&pixel| truth.is_compared(pixel))),
            image: mean(&mut (0..error.len())),
        }
    }
}

/// Sizes agree and at least one pixel is compared: `metrics::compare` has been through.
fn picture(image: &Image, truth: &Truth, display: &Display) -> RgbImage {
    let panels = [
        ("image", difference::radiance_picture(image, display, 1)),
        ("reference", difference::radiance_picture(&truth.image, display, 1)),
        ("relative error", difference::error_picture(image, truth, 1)),
    ];
    let line = lettering::LINE_HEIGHT;
    let mut picture = RgbImage::from_pixel(3 * image.width, image.height + 2 * line, lettering::BACKGROUND);
    for (left, (title, panel)) in (0..).step_by(image.width as usize).zip(&panels) {
        lettering::write(&mut picture, (left, 0), title);
        replace(&mut picture, panel, left.into(), line.into());
    }
    let legend = difference::legend(picture.width());
    replace(&mut picture, &legend, 0, (image.height + line).into());
    picture
}

fn write_picture(path: &Path, picture: &RgbImage) -> Result<(), String> {
    let mut bytes = Cursor::new(Vec::new());
    picture
        .write_to(&mut bytes, image::ImageFormat::Png)
        .map_err(|error| format!("{}: {error}", path.display()))?;
    exr_file::replace_file(path, bytes.get_ref())
}
