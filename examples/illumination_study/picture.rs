//! Small pictures, and how far off they are.

use crate::common::adapter::Gpu;
use crate::common::reference::Reference;
use lightfall::reference::metrics::{self, Image, Truth};
use lightfall::reference::{PathComponent, PathEstimate, PathTracerSettings};
use lightfall::scene::Scene;

/// Pixels along an axis.
pub(crate) const SIZE: u32 = 64;

/// Paths of each pixel that the truth is the mean of.
const SAMPLES: u32 = 2048;

/// Indirect light in the middle of each pixel, path traced.
pub(crate) fn truth(gpu: &Gpu, scene: &Scene, bounces: u32) -> Result<PathEstimate, String> {
    let paths = PathTracerSettings {
        component: PathComponent::Indirect,
        bounces,
        spans_pixel: false,
        ..PathTracerSettings::default()
    };
    let mut reference = Reference::new(gpu, scene.clone(), &paths, 0, [SIZE; 2]).map_err(|e| e.to_string())?;
    reference.trace(SAMPLES).map_err(|e| e.to_string())
}

/// Relative mean square error, less what the truth's noise adds, and bias.
pub(crate) fn errors(own: &[[f32; 3]], truth: &PathEstimate) -> Result<[f64; 2], String> {
    let image = |rgb: &[[f32; 3]]| Image {
        width: SIZE,
        height: SIZE,
        rgb: rgb.to_vec(),
    };
    let truth = Truth {
        standard_error: Some(truth.standard_error.clone()),
        ..Truth::new(image(&truth.mean))
    };
    let comparison = metrics::compare(&image(own), &truth).map_err(|e| e.to_string())?;
    Ok([comparison.relmse, comparison.bias])
}
