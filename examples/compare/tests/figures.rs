//! `compare` as a user meets it: its figures, its picture, and how it refuses.

use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Image, WritableImage};
use serde_json::Value;
use std::path::PathBuf;
use std::process::{Command, Output};

const SIDE: usize = 32;
const PIXELS: usize = SIDE * SIDE;
/// Height of the line above the picture's panels.
const LINE: u32 = 16;

/// A folder of one test, removed at its end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("lightfall-compare-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    fn path(&self, name: &str) -> String {
        self.0.join(name).to_str().unwrap().to_owned()
    }

    /// Writes an image of `SIDE` × `SIDE` pixels with these channels and returns its path.
    fn exr(&self, name: &str, channels: &[(&str, Vec<f32>)]) -> String {
        let list = channels
            .iter()
            .map(|(name, values)| AnyChannel::new(*name, FlatSamples::F32(values.clone())))
            .collect();
        let path = self.path(name);
        Image::from_channels((SIDE, SIDE), AnyChannels::sort(list))
            .write()
            .to_file(&path)
            .unwrap();
        path
    }

    /// An image of one grey, but for some pixels.
    fn grey(&self, name: &str, radiance: f32, others: &[(usize, f32)]) -> String {
        let channel = values(radiance, others);
        self.exr(name, &["R", "G", "B"].map(|name| (name, channel.clone())))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn values(value: f32, others: &[(usize, f32)]) -> Vec<f32> {
    let mut values = vec![value; PIXELS];
    others.iter().for_each(|&(pixel, other)| values[pixel] = other);
    values
}

fn compare(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_compare"))
        .args(arguments)
        .output()
        .unwrap()
}

/// The report, which is one line.
fn report(arguments: &[&str]) -> Value {
    let output = compare(arguments);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(text.lines().count(), 1, "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_str(&text).unwrap()
}

fn number(report: &Value, name: &str) -> f64 {
    report[name]
        .as_f64()
        .unwrap_or_else(|| panic!("no number {name} in {report}"))
}

#[track_caller]
fn assert_close(found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{found} instead of {expected} ± {tolerance}"
    );
}

#[test]
fn an_image_does_not_differ_from_itself() {
    let folder = Folder::new("itself");
    let image = folder.grey("image.exr", 2.0, &[(5, 7.0), (77, 0.25)]);
    let report = report(&[&image, &image]);
    assert_eq!(report["finite"], true);
    assert_eq!(report["pixels"], PIXELS);
    for name in ["relmse", "bias", "rmse", "truth_noise", "flip", "flip_image"] {
        assert_eq!(number(&report, name), 0.0, "{name}");
    }
}

/// Lightness of CIELAB for luminance relative to white, above its linear part.
fn lightness(luminance: f64) -> f64 {
    116.0 * luminance.cbrt() - 16.0
}

/// FLIP of two grey fields (Andersson et al. 2020): no edges, and all of the colour difference is that of lightness, its
/// 0.7th power mapped so that 0.4 of the largest one becomes 0.95.
fn flip_of_greys(a: f64, b: f64) -> f64 {
    // The largest difference is that of pure green and pure blue; CIELAB for sRGB, chroma scaled by lightness / 100.
    let hunt = |[l, a, b]: [f64; 3]| [l, 0.01 * l * a, 0.01 * l * b];
    let (green, blue) = (hunt([87.735, -86.183, 83.179]), hunt([32.297, 79.188, -107.860]));
    let largest = (green[0] - blue[0]).abs() + (green[1] - blue[1]).hypot(green[2] - blue[2]);
    let difference = (lightness(a) - lightness(b)).abs().powf(0.7);
    let knee = 0.4 * largest.powf(0.7);
    assert!(difference < knee, "only that part of the map is written down here");
    0.95 * difference / knee
}

#[test]
fn half_the_light_is_a_bias_of_a_half_and_the_flip_of_two_greys() {
    let folder = Folder::new("greys");
    let truth = folder.grey("truth.exr", 3.0, &[]);
    let report = report(&[&folder.grey("image.exr", 1.5, &[]), &truth]);
    assert_eq!(number(&report, "bias"), -0.5);
    assert_eq!(number(&report, "rmse"), 1.5);
    assert_close(number(&report, "relmse"), 0.25 / 1.0001, 1e-12);
    // The reference is exposed to 0.5. Rounding to 8 bits changes lightness by at most 0.2, FLIP by 0.7 · 0.2 / 19 of it.
    let expected = flip_of_greys(0.5, 0.25);
    assert_close(number(&report, "flip"), expected, 0.01 * expected);
    assert_close(number(&report, "flip_image"), number(&report, "flip"), 1e-6);
}

#[test]
fn the_unit_of_radiance_changes_no_ratio() {
    let folder = Folder::new("unit");
    let pair = |unit: f32| {
        let truth = folder.grey(&format!("truth{unit}.exr"), 2.0 * unit, &[(40, 3.0 * unit)]);
        report(&[&folder.grey(&format!("image{unit}.exr"), 2.5 * unit, &[]), &truth])
    };
    let (one, many) = (pair(1.0), pair(1024.0));
    for name in ["relmse", "bias", "flip", "flip_image"] {
        assert_eq!(one[name], many[name], "{name}");
    }
    assert_eq!(number(&one, "rmse") * 1024.0, number(&many, "rmse"));
}

#[test]
fn what_is_not_compared_is_hatched_and_counts_for_the_whole_image_alone() {
    let folder = Folder::new("masks");
    let right: Vec<(usize, f32)> = (0..PIXELS).filter(|i| i % SIDE >= SIDE / 2).map(|i| (i, 0.0)).collect();
    let mut channels = ["R", "G", "B"].map(|name| (name, values(2.0, &[]))).to_vec();
    channels.push(("diffuse.M", values(1.0, &right)));
    let truth = folder.exr("truth.exr", &channels);
    // Twice too bright in a corner far from what is compared.
    let image = folder.grey("image.exr", 2.0, &[(SIDE - 1, 4.0), (SIDE - 2, 4.0)]);
    let png = folder.path("difference.png");
    let report = report(&[&image, &truth, "--png", &png]);
    assert_eq!(report["pixels"], PIXELS / 2);
    assert_eq!(number(&report, "relmse"), 0.0);
    assert!(number(&report, "flip") < 1e-6, "{report}");
    assert!(number(&report, "flip_image") > 1e-4, "{report}");

    let picture = image::open(png).unwrap().to_rgb8();
    assert_eq!(picture.dimensions(), (3 * SIDE as u32, SIDE as u32 + 2 * LINE));
    let error = |column: u32, row: u32| picture.get_pixel(2 * SIDE as u32 + column, LINE + row).0;
    assert!(error(3, 9).iter().all(|&value| value < 5), "no error is black");
    let hatched: Vec<[u8; 3]> = (0..8).map(|step| error(20 + step, 20)).collect();
    assert!(
        hatched
            .iter()
            .all(|color| color[0] == color[1] && color[1] == color[2] && color[0] > 50)
    );
    assert!(hatched.iter().any(|color| *color != hatched[0]));
}

#[test]
fn larger_errors_have_lighter_colours() {
    let folder = Folder::new("colours");
    let truth = folder.grey("truth.exr", 1.0, &[]);
    let png = folder.path("difference.png");
    let errors = [(100, 1.002), (101, 1.03), (102, 1.1), (103, 0.7), (104, 1.9)];
    report(&[&folder.grey("image.exr", 1.0, &errors), &truth, "--png", &png]);
    let picture = image::open(png).unwrap().to_rgb8();
    let luma = |pixel: u32| {
        let (column, row) = (pixel % SIDE as u32, pixel / SIDE as u32);
        let [r, g, b] = picture.get_pixel(2 * SIDE as u32 + column, LINE + row).0.map(f64::from);
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    assert!((100..104).all(|pixel| luma(pixel) < luma(pixel + 1) - 10.0));
}

#[test]
fn one_nan_fails_everything() {
    let folder = Folder::new("nan");
    let truth = folder.grey("truth.exr", 1.0, &[]);
    for bad in [f32::NAN, f32::INFINITY] {
        let image = folder.grey("image.exr", 1.0, &[(33, bad)]);
        let png = folder.path("difference.png");
        let output = compare(&[&image, &truth, "--png", &png]);
        assert_eq!(output.status.code(), Some(1));
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(report["finite"], false);
        for name in ["relmse", "bias", "rmse", "truth_noise", "flip", "flip_image"] {
            assert!(report[name].is_null(), "{name} in {report}");
        }
        // The picture shows where.
        let picture = image::open(png).unwrap().to_rgb8();
        assert_eq!(picture.get_pixel(2 * SIDE as u32 + 1, LINE + 1).0, [0, 255, 0]);
    }
}

#[test]
fn bad_input_gets_one_line_status_two_and_no_file() {
    let folder = Folder::new("refusals");
    let image = folder.grey("image.exr", 1.0, &[]);
    let black = folder.grey("black.exr", 0.0, &[]);
    let broken = folder.path("broken.exr");
    std::fs::write(&broken, b"not an image").unwrap();
    let incomplete = folder.exr("incomplete.exr", &[("R", values(1.0, &[])), ("G", values(1.0, &[]))]);
    let small = folder.path("small.exr");
    exr::prelude::write_rgb_file(&small, 4, 4, |_, _| (1.0_f32, 1.0_f32, 1.0_f32)).unwrap();
    let png = folder.path("difference.png");
    let cases: &[(&[&str], &str)] = &[
        (&[&image], "TRUTH"),
        (&[&image, "no-such-file.exr"], "no-such-file.exr"),
        (&[&broken, &image], "broken.exr"),
        (&[&image, &incomplete], "\"B\""),
        (&[&small, &image], "width"),
        (&[&image, &black], "black"),
    ];
    for (files, word) in cases {
        let output = compare(&[files, &["--png", png.as_str()][..]].concat());
        assert_eq!(output.status.code(), Some(2), "{files:?}");
        assert!(output.stdout.is_empty(), "{files:?}");
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(message.lines().count(), 1, "{files:?}: {message}");
        assert!(
            message.starts_with("compare: ") && message.contains(word),
            "{files:?}: {message}"
        );
        assert!(!PathBuf::from(&png).exists(), "{files:?}");
    }
}

#[test]
fn a_part_is_subtracted_from_the_reference_and_bright_pixels_are_compared_alone() {
    let folder = Folder::new("minus");
    // What is left: 1 in eight pixels, 0.001 elsewhere.
    let bright: Vec<_> = (0..8).map(|i| (100 + i, 3.0)).collect();
    let truth = folder.grey("truth.exr", 2.001, &bright);
    let part = folder.grey("part.exr", 2.0, &[]);
    let twice: Vec<_> = (0..8).map(|i| (100 + i, 2.0)).collect();
    let ours = folder.grey("ours.exr", 5.0, &twice);
    let report = report(&[&ours, &truth, "--minus", &part, "--inside", "0.1"]);
    assert_eq!(report["pixels"], 8);
    assert!((report["bias"].as_f64().unwrap() - 1.0).abs() < 1e-6, "{report}");
    let missing = folder.path("missing.exr");
    for [option, value] in [
        ["--minus", missing.as_str()],
        ["--inside", "nan"],
        ["--inside=-1", "--png=x.png"],
    ] {
        let output = compare(&[&ours, &truth, option, value]);
        assert_eq!(output.status.code(), Some(2), "{option} {value}");
    }
}
