//! Measures how far an image is from a reference.
//!
//! ```text
//! cargo run --release --example compare -- OURS.exr TRUTH.exr [--png DIFF.png]
//! ```
//!
//! Prints one line of JSON: `finite`, `pixels`, `relmse`, `bias`, `bias_rgb`, `rmse`, `truth_noise` and, where the
//! reference has what they need, `relmse_mixed`, `relmse_edge`, `relmse_interior`; their definitions are those of
//! `lightfall::reference::metrics`. Numbers are `null` if the image is not finite. With `--png`, writes the image, the
//! reference and the relative error side by side.
//!
//! Both files hold linear radiance in channels R, G, B; `common/truth_file.rs` lists the channels of a reference that
//! say which of its pixels count. Bad input gets one line on stderr and exit status 2.

mod common;

use clap::Parser;
use common::{arguments, exr_file, truth_file};
use lightfall::reference::metrics::{self, Comparison, Image, Truth};
use serde_json::{Value, json};
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Where the 90th percentile of the reference goes on the display's linear scale: most of the image is in the middle.
const DISPLAY_LEVEL: f64 = 0.5;
const DISPLAY_PERCENTILE: f64 = 0.9;
const DISPLAY_GAMMA: f64 = 2.2;
/// Part of the mean radiance that keeps the relative error of dark pixels from covering the picture.
const ERROR_GUARD: f64 = 0.05;

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
}

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
    let truth = truth_file::read_truth(&arguments.truth)?;
    let between = |error| {
        format!(
            "{} against {}: {error}",
            arguments.ours.display(),
            arguments.truth.display()
        )
    };
    let comparison = metrics::compare(&image, &truth).map_err(between)?;
    if let Some(path) = &arguments.png {
        write_picture(path, &image, &truth)?;
    }
    Ok((report(&comparison, &truth), comparison.finite))
}

fn report(comparison: &Comparison, truth: &Truth) -> Value {
    let mut report = json!({
        "finite": comparison.finite,
        "pixels": comparison.pixels,
        "relmse": comparison.relmse,
        "bias": comparison.bias,
        "bias_rgb": comparison.bias_rgb,
        "rmse": comparison.rmse,
        "truth_noise": comparison.truth_noise,
    });
    if let Some(relmse) = comparison.relmse_mixed {
        report["relmse_mixed"] = json!(relmse);
    }
    // Known geometry without any pixel near an edge, or away from one, is reported as null.
    if truth.geometry.is_some() {
        report["relmse_edge"] = json!(comparison.relmse_edge);
        report["relmse_interior"] = json!(comparison.relmse_interior);
    }
    report
}

/// Sizes agree and at least one pixel is compared: `metrics::compare` has been through.
fn write_picture(path: &Path, image: &Image, truth: &Truth) -> Result<(), String> {
    let (width, height) = (image.width, image.height);
    let exposure = Exposure::of(truth);
    let picture = image::RgbImage::from_fn(width * 3, height, |x, y| {
        let pixel = (y * width + x % width) as usize;
        let (ours, reference) = (image.rgb[pixel], truth.image.rgb[pixel]);
        image::Rgb(match x / width {
            0 => exposure.display(ours),
            1 => exposure.display(reference),
            _ if truth.is_compared(pixel) => exposure.error(ours, reference),
            _ => [0; 3],
        })
    });
    let mut bytes = Cursor::new(Vec::new());
    let at = |error| format!("{}: {error}", path.display());
    picture.write_to(&mut bytes, image::ImageFormat::Png).map_err(at)?;
    exr_file::replace_file(path, bytes.get_ref())
}

/// How radiance is shown; both images alike.
struct Exposure {
    scale: f64,
    mean: f64,
}

impl Exposure {
    fn of(truth: &Truth) -> Self {
        let compared = (0..truth.image.rgb.len()).filter(|&pixel| truth.is_compared(pixel));
        let mut radiance: Vec<f64> = compared
            .flat_map(|pixel| truth.image.rgb[pixel])
            .map(f64::from)
            .collect();
        radiance.sort_by(f64::total_cmp);
        let mean = radiance.iter().sum::<f64>() / radiance.len() as f64;
        let bright = percentile(&radiance, DISPLAY_PERCENTILE);
        // An image of which nine tenths are black still has something to show.
        let white = if bright > 0.0 { bright } else { mean };
        Self {
            scale: DISPLAY_LEVEL / white,
            mean,
        }
    }

    fn display(&self, radiance: [f32; 3]) -> [u8; 3] {
        radiance.map(|radiance| {
            to_byte(
                (f64::from(radiance) * self.scale)
                    .clamp(0.0, 1.0)
                    .powf(1.0 / DISPLAY_GAMMA),
            )
        })
    }

    fn error(&self, ours: [f32; 3], reference: [f32; 3]) -> [u8; 3] {
        [0, 1, 2].map(|c| {
            let (x, r) = (f64::from(ours[c]), f64::from(reference[c]));
            to_byte((x - r).abs() / (r + ERROR_GUARD * self.mean))
        })
    }
}

/// Of sorted values, interpolated between the two nearest.
fn percentile(sorted: &[f64], part: f64) -> f64 {
    let position = part * (sorted.len() - 1) as f64;
    let below = position.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (sorted[above] - sorted[below]) * position.fract()
}

/// From 0 .. 1; what is outside is clamped and NaN becomes 0.
fn to_byte(value: f64) -> u8 {
    (value * 255.0) as u8
}
