//! The error metrics against what can be worked out by hand, and the files that they read.

#[path = "../examples/common/exr_file.rs"]
mod exr_file;
#[path = "../examples/common/truth_file.rs"]
mod truth_file;

use approx::assert_relative_eq;
use lightfall::Error;
use lightfall::reference::metrics::{Comparison, Geometry, Image, Truth, compare};
use std::path::{Path, PathBuf};

/// 1 / (1 + 0.01²): what the guard against black pixels makes of relative errors in an image of constant radiance.
const GUARDED: f64 = 1.0 / 1.0001;

fn uniform(width: u32, height: u32, radiance: f32) -> Image {
    Image {
        width,
        height,
        rgb: vec![[radiance; 3]; (width * height) as usize],
    }
}

fn times(image: &Image, factor: f32) -> Image {
    Image {
        rgb: image
            .rgb
            .iter()
            .map(|rgb| rgb.map(|radiance| radiance * factor))
            .collect(),
        ..image.clone()
    }
}

/// Numerical Recipes' 32-bit linear congruential generator; uniform in −1 .. 1.
struct Noise(u32);

impl Noise {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        // The upper bits are the good ones, and 24 of them fit an f32.
        (self.0 >> 8) as f32 / (1 << 23) as f32 - 1.0
    }

    /// Every radiance between a half and one and a half.
    fn image(&mut self, width: u32, height: u32) -> Image {
        let mut image = uniform(width, height, 1.0);
        image
            .rgb
            .iter_mut()
            .flatten()
            .for_each(|radiance| *radiance += 0.5 * self.next());
        image
    }
}

#[test]
fn an_image_does_not_differ_from_itself() -> Result<(), Error> {
    let image = Noise(1).image(16, 9);
    let comparison = compare(&image, &Truth::new(image.clone()))?;
    assert!(comparison.finite);
    assert_eq!(comparison.pixels, 16 * 9);
    assert_eq!(
        [
            comparison.relmse,
            comparison.bias,
            comparison.rmse,
            comparison.truth_noise
        ],
        [0.0; 4]
    );
    assert_eq!(comparison.bias_rgb, [0.0; 3]);
    assert_eq!(
        [
            comparison.relmse_mixed,
            comparison.relmse_edge,
            comparison.relmse_interior
        ],
        [None; 3]
    );
    Ok(())
}

#[test]
fn ten_percent_too_bright_is_a_bias_of_a_tenth() -> Result<(), Error> {
    let truth = Truth::new(uniform(8, 8, 4.0));
    let comparison = compare(&uniform(8, 8, 4.4), &truth)?;
    // 4.4 is rounded to 24 bits.
    assert_relative_eq!(comparison.bias, 0.1, max_relative = 1e-6);
    assert_relative_eq!(comparison.relmse, 0.01 * GUARDED, max_relative = 1e-6);
    assert_relative_eq!(comparison.rmse, 0.4, max_relative = 1e-6);
    Ok(())
}

#[test]
fn the_worst_hundredth_can_be_left_out() -> Result<(), Error> {
    let truth = Truth::new(uniform(20, 10, 4.0));
    let with_outliers = |count: usize| {
        let mut image = uniform(20, 10, 5.0);
        image.rgb[7..7 + count].fill([400.0; 3]);
        compare(&image, &truth)
    };
    // Two of 200.
    for (outliers, left) in [(0, 0.0), (2, 0.0), (3, 99.0 * 99.0 - 0.25 * 0.25)] {
        let comparison = with_outliers(outliers)?;
        let expected = (0.25 * 0.25 + left / 198.0) * GUARDED;
        assert_relative_eq!(comparison.relmse_trimmed, expected, max_relative = 1e-12);
        assert!(outliers == 0 || comparison.relmse > 40.0);
    }
    Ok(())
}

#[test]
fn each_channel_has_its_own_bias() -> Result<(), Error> {
    let image = Image {
        width: 1,
        height: 1,
        rgb: vec![[1.0, 3.0, 5.0]],
    };
    let truth = Truth::new(Image {
        width: 1,
        height: 1,
        rgb: vec![[2.0, 2.0, 4.0]],
    });
    let comparison = compare(&image, &truth)?;
    assert_eq!(comparison.bias_rgb, [-0.5, 0.5, 0.25]);
    assert_relative_eq!(comparison.bias, 1.0 / 8.0, max_relative = 1e-15);
    Ok(())
}

#[test]
fn black_pixels_are_measured_against_a_hundredth_of_the_mean() -> Result<(), Error> {
    let truth = Truth::new(Image {
        width: 2,
        height: 1,
        rgb: vec![[0.0; 3], [2.0; 3]],
    });
    let image = Image {
        width: 2,
        height: 1,
        rgb: vec![[0.0625; 3], [2.0; 3]],
    };
    // Mean 1: 0.0625² / 0.01² in one of two pixels.
    assert_relative_eq!(compare(&image, &truth)?.relmse, 0.5 * 6.25 * 6.25, max_relative = 1e-12);
    Ok(())
}

#[test]
fn noise_as_large_as_the_truth_admits_is_no_error() -> Result<(), Error> {
    let (width, height, amplitude) = (128, 128, 0.125_f32);
    let reference = uniform(width, height, 1.0);
    let mut noise = Noise(7);
    let mut image = reference.clone();
    image
        .rgb
        .iter_mut()
        .flatten()
        .for_each(|radiance| *radiance += amplitude * noise.next());
    // Uniform in ±a: variance σ² = a²/3, and (x − r)² − σ² has the variance a⁴/5 − a⁴/9 = 0.8 σ⁴.
    let deviation = amplitude / 3.0_f32.sqrt();
    let truth = Truth {
        standard_error: Some(vec![[deviation; 3]; image.rgb.len()]),
        ..Truth::new(reference)
    };
    let comparison = compare(&image, &truth)?;
    let variance = f64::from(deviation).powi(2) * GUARDED;
    let sigma = (0.8 / (3.0 * comparison.pixels as f64)).sqrt() * variance;
    assert!(
        comparison.relmse.abs() < 3.0 * sigma,
        "relmse {}, sigma {sigma}",
        comparison.relmse
    );
    assert_relative_eq!(comparison.truth_noise, variance, max_relative = 1e-6);
    assert_relative_eq!(comparison.rmse, f64::from(deviation), max_relative = 0.01);
    Ok(())
}

#[test]
fn a_power_of_two_in_both_images_cancels_exactly() -> Result<(), Error> {
    let (image, reference) = (Noise(2).image(8, 8), Noise(3).image(8, 8));
    let nominal = compare(&image, &Truth::new(reference.clone()))?;
    for exponent in [-60, 60] {
        let factor = 2.0_f32.powi(exponent);
        let scaled = compare(&times(&image, factor), &Truth::new(times(&reference, factor)))?;
        assert_eq!(scaled.rmse, nominal.rmse * f64::from(factor));
        let ratios = |c: &Comparison| [c.relmse, c.bias, c.bias_rgb[0], c.bias_rgb[1], c.bias_rgb[2]];
        assert_eq!(ratios(&scaled), ratios(&nominal));
    }
    Ok(())
}

#[test]
fn one_nan_fails_everything() -> Result<(), Error> {
    let mut truth = Truth::new(uniform(4, 4, 1.0));
    // Even where nothing is compared.
    truth.valid[5] = false;
    truth.mixed[6] = true;
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut image = uniform(4, 4, 1.0);
        image.rgb[5][1] = bad;
        let comparison = compare(&image, &truth)?;
        assert!(!comparison.finite);
        let numbers = [
            comparison.relmse,
            comparison.bias,
            comparison.rmse,
            comparison.truth_noise,
        ];
        assert!(
            numbers.iter().chain(&comparison.bias_rgb).all(|number| number.is_nan()),
            "{comparison:?}"
        );
        assert!(comparison.relmse_mixed.is_some_and(f64::is_nan));
    }
    Ok(())
}

#[test]
fn images_of_different_size_are_refused() {
    let truth = Truth::new(uniform(4, 4, 1.0));
    let mismatch = |image: Image| matches!(compare(&image, &truth), Err(Error::CountMismatch { .. }));
    assert!(mismatch(uniform(5, 4, 1.0)));
    assert!(mismatch(uniform(4, 3, 1.0)));
    assert!(mismatch(uniform(2, 8, 1.0)));
    assert!(mismatch(Image {
        rgb: vec![[1.0; 3]; 15],
        ..uniform(4, 4, 1.0)
    }));
}

#[test]
fn a_list_that_does_not_fit_the_truth_is_refused() {
    let image = uniform(4, 4, 1.0);
    let truth = || Truth::new(image.clone());
    let geometry = Geometry {
        depth: vec![1.0; 16],
        normal: vec![[0.0; 3]; 17],
    };
    for broken in [
        Truth {
            valid: vec![true; 15],
            ..truth()
        },
        Truth {
            mixed: vec![false; 17],
            ..truth()
        },
        Truth {
            standard_error: Some(Vec::new()),
            ..truth()
        },
        Truth {
            geometry: Some(geometry),
            ..truth()
        },
    ] {
        assert!(
            matches!(compare(&image, &broken), Err(Error::CountMismatch { .. })),
            "{broken:?}"
        );
    }
}

#[test]
fn a_truth_that_says_nothing_is_refused() {
    let image = uniform(4, 4, 1.0);
    let refused = |truth: &Truth| matches!(compare(&image, truth), Err(Error::InvalidReference { .. }));
    assert!(refused(&Truth {
        valid: vec![false; 16],
        ..Truth::new(image.clone())
    }));
    assert!(refused(&Truth::new(uniform(4, 4, 0.0))));
    assert!(refused(&Truth::new(uniform(4, 4, f32::NAN))));
    assert!(refused(&Truth {
        standard_error: Some(vec![[f32::INFINITY; 3]; 16]),
        ..Truth::new(image.clone())
    }));
}

#[test]
fn masked_pixels_do_not_count() -> Result<(), Error> {
    let mut image = uniform(4, 1, 1.0);
    let mut truth = Truth::new(image.clone());
    // A lamp that the truth itself could not compute, and a pixel on a silhouette, twice too bright.
    truth.valid[1] = false;
    truth.image.rgb[1] = [f32::NAN; 3];
    image.rgb[1] = [1e30; 3];
    truth.mixed[2] = true;
    image.rgb[2] = [2.0; 3];
    let comparison = compare(&image, &truth)?;
    assert_eq!(comparison.pixels, 2);
    assert_eq!([comparison.relmse, comparison.bias, comparison.rmse], [0.0; 3]);
    assert_relative_eq!(
        comparison.relmse_mixed.unwrap_or(f64::NAN),
        GUARDED,
        max_relative = 1e-12
    );
    Ok(())
}

#[test]
fn errors_near_an_edge_are_told_from_the_others() -> Result<(), Error> {
    let mut image = uniform(16, 1, 1.0);
    image.rgb[..8].fill([1.5; 3]);
    // A step between columns 3 and 4 reaches columns 0 to 8: eight wrong, one right.
    let depth = (0..16).map(|column| if column < 4 { 1.0 } else { 2.0 }).collect();
    let geometry = Geometry {
        depth,
        normal: vec![[0.0, 1.0, 0.0]; 16],
    };
    let comparison = compare(
        &image,
        &Truth {
            geometry: Some(geometry),
            ..Truth::new(uniform(16, 1, 1.0))
        },
    )?;
    assert_relative_eq!(
        comparison.relmse_edge.unwrap_or(f64::NAN),
        0.25 * GUARDED * 8.0 / 9.0,
        max_relative = 1e-12
    );
    assert_eq!(comparison.relmse_interior, Some(0.0));
    Ok(())
}

#[test]
fn a_downsampled_truth_is_the_mean_of_its_pixels() -> Result<(), Error> {
    let image = Noise(6).image(12, 8);
    let mean = |column: u32, row: u32, channel: usize| {
        let sum: f64 = (0..16)
            .map(|i| (4 * row + i / 4) * 12 + 4 * column + i % 4)
            .map(|pixel| f64::from(image.rgb[pixel as usize][channel]))
            .sum();
        (sum / 16.0) as f32
    };
    let coarse = Truth::new(image.clone()).downsampled(4)?;
    assert_eq!((coarse.image.width, coarse.image.height), (3, 2));
    for (pixel, rgb) in (0..).zip(&coarse.image.rgb) {
        assert_eq!(*rgb, [0, 1, 2].map(|channel| mean(pixel % 3, pixel / 3, channel)));
    }
    assert_eq!(coarse.standard_error, None);
    assert_eq!(coarse.geometry, None);
    Ok(())
}

#[test]
fn the_noise_of_a_downsampled_truth_is_as_large_as_it_says() -> Result<(), Error> {
    let (exact, amplitude, mut noise) = (uniform(256, 256, 1.0), 0.125_f32, Noise(8));
    let mut noisy = exact.clone();
    noisy
        .rgb
        .iter_mut()
        .flatten()
        .for_each(|radiance| *radiance += amplitude * noise.next());
    let deviation = amplitude / 3.0_f32.sqrt();
    let truth = Truth {
        standard_error: Some(vec![[deviation; 3]; noisy.rgb.len()]),
        ..Truth::new(noisy)
    };
    let coarse = truth.downsampled(4)?;
    for error in coarse.standard_error.iter().flatten().flatten() {
        assert_relative_eq!(*error, deviation / 4.0, max_relative = 1e-6);
    }
    // A sum of 16 is nearly normal: (x − r)² − σ² has the variance 2 σ⁴.
    let comparison = compare(&uniform(64, 64, 1.0), &coarse)?;
    let sigma = (2.0 / (3.0 * comparison.pixels as f64)).sqrt() * comparison.truth_noise;
    assert!(
        comparison.relmse.abs() < 3.0 * sigma,
        "relmse {}, sigma {sigma}",
        comparison.relmse
    );
    Ok(())
}

#[test]
fn one_bad_pixel_masks_the_larger_pixel_that_holds_it() -> Result<(), Error> {
    let mut truth = Truth::new(uniform(6, 4, 1.0));
    truth.valid[6 + 1] = false;
    truth.image.rgb[6 + 1] = [f32::NAN; 3];
    truth.mixed[2 * 6 + 4] = true;
    let coarse = truth.downsampled(2)?;
    assert_eq!(coarse.valid, [false, true, true, true, true, true]);
    assert_eq!(coarse.mixed, [false, false, false, false, false, true]);
    Ok(())
}

#[test]
fn a_larger_pixel_that_an_edge_crosses_is_mixed() -> Result<(), Error> {
    // The edge runs between columns 2 and 3, so that no pixel of the original is mixed.
    let up_to = |column: usize, first: f32, then: f32| (0..32).map(move |i| if i % 8 < column { first } else { then });
    let truth = Truth {
        geometry: Some(Geometry {
            depth: up_to(3, 1.0, 2.0).collect(),
            normal: vec![[0.0, 0.0, 1.0]; 32],
        }),
        ..Truth::new(uniform(8, 4, 1.0))
    };
    let coarse = truth.downsampled(4)?;
    assert_eq!(coarse.mixed, [true, false]);
    let depth = coarse.geometry.expect("the original has one").depth;
    assert_eq!(
        depth,
        [1.0, 2.0],
        "of the pixel at the centre, not a mean of both surfaces"
    );
    // Between two larger pixels it harms neither.
    let coarse = Truth {
        geometry: Some(Geometry {
            depth: up_to(4, 1.0, 2.0).collect(),
            normal: vec![[0.0, 0.0, 1.0]; 32],
        }),
        ..truth
    }
    .downsampled(4)?;
    assert_eq!(coarse.mixed, [false, false]);
    Ok(())
}

#[test]
fn a_truth_is_reduced_by_what_divides_its_size_alone() -> Result<(), Error> {
    let truth = Truth::new(Noise(9).image(12, 8));
    assert_eq!(truth.downsampled(1)?, truth);
    for factor in [0, 3, 5, 8, 24, u32::MAX] {
        assert!(
            matches!(truth.downsampled(factor), Err(Error::InvalidReference { .. })),
            "{factor}"
        );
    }
    Ok(())
}

/// A file in the folder for temporary files, removed at the end.
struct Temporary(PathBuf);

impl Temporary {
    fn new(name: &str) -> Self {
        Self(std::env::temp_dir().join(format!("lightfall-metrics-{}-{name}", std::process::id())))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

#[test]
fn an_image_comes_back_from_its_file_bit_for_bit() -> Result<(), String> {
    let file = Temporary::new("round-trip.exr");
    let mut image = Noise(4).image(37, 21);
    image.rgb[0] = [f32::NAN, f32::INFINITY, -0.0];
    image.rgb[1] = [f32::MIN_POSITIVE / 8.0, f32::MAX, -f32::MAX];
    exr_file::write_rgb(&file.0, image.width, image.height, &image.rgb)?;
    let read = truth_file::read_image(&file.0)?;
    assert_eq!((read.width, read.height), (image.width, image.height));
    let bits = |image: &Image| {
        image
            .rgb
            .iter()
            .flatten()
            .map(|radiance| radiance.to_bits())
            .collect::<Vec<_>>()
    };
    assert_eq!(bits(&read), bits(&image));
    Ok(())
}

#[test]
fn a_broken_file_is_an_error_and_not_a_panic() -> Result<(), String> {
    let file = Temporary::new("broken.exr");
    let image = Noise(5).image(40, 40);
    exr_file::write_rgb(&file.0, image.width, image.height, &image.rgb)?;
    let whole = std::fs::read(&file.0).map_err(|error| error.to_string())?;
    let read = |bytes: &[u8]| {
        std::fs::write(&file.0, bytes).map_err(|error| error.to_string())?;
        exr_file::read(&file.0)
    };
    for length in (0..whole.len()).step_by(61).chain([whole.len() - 1]) {
        assert!(
            read(&whole[..length]).is_err(),
            "cut to {length} of {} bytes",
            whole.len()
        );
    }
    // Damage may go unnoticed in a sample; it must not panic or ask for all memory.
    for position in (0..whole.len()).step_by(whole.len().div_ceil(2000)).chain(0..400) {
        let mut damaged = whole.clone();
        damaged[position] ^= 0xFF;
        let _ = read(&damaged);
    }
    assert!(read(b"not an image").is_err());
    Ok(())
}

#[test]
fn what_cannot_be_written_leaves_nothing_behind() -> Result<(), String> {
    let folder = Temporary::new("folder");
    std::fs::create_dir_all(folder.0.join("taken.exr")).map_err(|error| error.to_string())?;
    let pixels = [[1.0; 3]; 4];
    let left = || std::fs::read_dir(&folder.0).map_or(0, Iterator::count);
    assert!(exr_file::write_rgb(&folder.0.join("a.exr"), 0, 4, &[]).is_err());
    assert!(exr_file::write_rgb(&folder.0.join("a.exr"), 3, 2, &pixels).is_err());
    assert!(exr_file::write_rgb(&folder.0.join("a.exr"), 1 << 20, 1, &pixels).is_err());
    // A folder stands where the file should go.
    assert!(exr_file::write_rgb(&folder.0.join("taken.exr"), 2, 2, &pixels).is_err());
    assert_eq!(left(), 1);
    std::fs::remove_dir_all(&folder.0).map_err(|error| error.to_string())
}

#[test]
fn a_missing_file_is_named() {
    let path = Path::new("no-such-folder/no-such-file.exr");
    let message = exr_file::read(path).expect_err("there is no such file");
    assert!(message.contains("no-such-file.exr"), "{message}");
}

#[test]
fn a_reference_of_an_independent_renderer_is_read() -> Result<(), String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/truth/cornell_point.indirect.exr");
    if !path.exists() {
        println!("skipped: there is no {}", path.display());
        return Ok(());
    }
    let truth = truth_file::read_truth(&path)?;
    assert!(truth.standard_error.is_some() && truth.geometry.is_some());
    assert!(truth.valid.contains(&false) && truth.mixed.contains(&true));
    let comparison = compare(&truth.image, &truth).map_err(|error| error.to_string())?;
    assert!(comparison.finite);
    assert_eq!([comparison.bias, comparison.rmse], [0.0; 2]);
    // Its own variance is taken out of an error of zero.
    assert_relative_eq!(comparison.relmse, -comparison.truth_noise, max_relative = 1e-12);
    Ok(())
}
