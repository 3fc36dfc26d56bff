//! The figures of a comparison as JSON.

use lightfall::reference::metrics::{Comparison, Truth};
use serde_json::{Value, json};

/// `finite`, `pixels`, `relmse`, `bias`, `bias_rgb`, `rmse`, `truth_noise` and, where the reference has what they need,
/// `relmse_mixed`, `relmse_edge`, `relmse_interior`; as [`Comparison`] defines them. Errors of an image that is not
/// finite are null.
pub(crate) fn figures(comparison: &Comparison, truth: &Truth) -> Value {
    let mut figures = json!({
        "finite": comparison.finite,
        "pixels": comparison.pixels,
        "relmse": comparison.relmse,
        "bias": comparison.bias,
        "bias_rgb": comparison.bias_rgb,
        "rmse": comparison.rmse,
        "truth_noise": comparison.truth_noise,
    });
    if let Some(relmse) = comparison.relmse_mixed {
        figures["relmse_mixed"] = json!(relmse);
    }
    // Known geometry without any pixel near an edge, or away from one, is reported as null.
    if truth.geometry.is_some() {
        figures["relmse_edge"] = json!(comparison.relmse_edge);
        figures["relmse_interior"] = json!(comparison.relmse_interior);
    }
    figures
}
