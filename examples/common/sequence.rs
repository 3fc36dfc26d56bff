//! Directions that are evenly spread and the same every time.

use lightfall::glam::DVec3;
use std::f64::consts::TAU;

/// Points of a low-discrepancy sequence (Roberts 2018): additive, by the powers of the plastic number's inverse.
#[derive(Default)]
pub(crate) struct Sequence(u64);

impl Sequence {
    /// Uniform on the sphere.
    pub(crate) fn direction(&mut self) -> DVec3 {
        const PLASTIC: f64 = 1.324_717_957_244_746;
        self.0 += 1;
        let [u, v] = [1, 2].map(|k| (0.5 + self.0 as f64 / PLASTIC.powi(k)).fract());
        let z = 1.0 - 2.0 * u;
        let (sin, cos) = (TAU * v).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(r * cos, r * sin, z)
    }
}
