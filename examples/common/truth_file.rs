//! Images and references for [`lightfall::reference::metrics`], out of EXR files.
//!
//! A reference may hold, beside R, G and B, the channels `diffuse.M`, `emission.R/G/B`, `mixed.M`, `stderr.R/G/B`,
//! `depth.Z` and `normal.X/Y/Z`. What is missing is taken as: all diffuse, nothing emits, nothing mixed, exact,
//! geometry unknown.

use super::exr_file::{self, ExrChannels};
use lightfall::reference::metrics::{Geometry, Image, Truth};
use std::path::Path;

/// Share of a pixel's samples that must hit a diffuse surface: all, but for rounding in 16-bit channels.
const ALL_DIFFUSE: f32 = 0.999;
/// `mixed.M` is 0 or 1.
const MIXED: f32 = 0.5;

/// Reads R, G and B.
///
/// # Errors
/// What [`exr_file::read`] refuses; a missing channel.
pub(crate) fn read_image(path: &Path) -> Result<Image, String> {
    image(&exr_file::read(path)?).map_err(|problem| format!("{}: {problem}", path.display()))
}

/// Reads a reference with all that the file knows about its pixels.
///
/// # Errors
/// What [`exr_file::read`] refuses; R, G or B missing, or part of a group of channels.
pub(crate) fn read_truth(path: &Path) -> Result<Truth, String> {
    truth(&exr_file::read(path)?).map_err(|problem| format!("{}: {problem}", path.display()))
}

fn image(file: &ExrChannels) -> Result<Image, String> {
    Ok(Image {
        width: file.width,
        height: file.height,
        rgb: file.triple(["R", "G", "B"])?,
    })
}

fn truth(file: &ExrChannels) -> Result<Truth, String> {
    let image = image(file)?;
    let pixels = 0..image.rgb.len();
    let emission: Vec<&[f32]> = ["emission.R", "emission.G", "emission.B"]
        .iter()
        .filter_map(|c| file.get(c))
        .collect();
    let is_diffuse = |pixel: usize| file.get("diffuse.M").is_none_or(|diffuse| diffuse[pixel] > ALL_DIFFUSE);
    let is_dark = |pixel: usize| emission.iter().all(|emission| emission[pixel] <= 0.0);
    let is_single = |pixel: usize| file.get("mixed.M").is_none_or(|mixed| mixed[pixel] < MIXED);
    Ok(Truth {
        standard_error: group(file, ["stderr.R", "stderr.G", "stderr.B"])?,
        valid: pixels
            .clone()
            .map(|pixel| is_diffuse(pixel) && is_dark(pixel))
            .collect(),
        mixed: pixels.map(|pixel| !is_single(pixel)).collect(),
        geometry: geometry(file)?,
        image,
    })
}

fn geometry(file: &ExrChannels) -> Result<Option<Geometry>, String> {
    let Some(depth) = file.get("depth.Z") else {
        return Ok(None);
    };
    let normal = group(file, ["normal.X", "normal.Y", "normal.Z"])?;
    Ok(normal.map(|normal| Geometry {
        depth: depth.to_vec(),
        normal,
    }))
}

/// `None` without the first channel; an error with the first but not the others.
fn group(file: &ExrChannels, names: [&str; 3]) -> Result<Option<Vec<[f32; 3]>>, String> {
    file.get(names[0]).map(|_| file.triple(names)).transpose()
}
