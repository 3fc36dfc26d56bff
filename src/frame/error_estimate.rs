//! How far off a picture is, told without a truth: noise from photons of another draw, blur from wider kernels.
//!
//! Two pictures of the same settings with photons of their own differ by noise alone; twice the variance of one. Pictures with
//! kernels of [`WIDENING`] times the width differ from them by blur, and by noise that is another one for each draw: the product
//! of both differences, one of each draw, is the square of the blur in the mean.

use super::Settings;
use crate::Error;
use crate::pass::Bandwidth;

/// How many times as wide kernels are that blur is told from.
pub const WIDENING: f32 = 2.0;

/// Squared blur of a kernel over the squared difference to one of twice its width.
const BLUR_SHARE: f64 = 1.0;

/// Part of the mean radiance that stands in for the radiance of black pixels, as in
/// [`metrics`](crate::reference::metrics).
const BLACK_GUARD: f64 = 0.01;

/// What relMSE ([`metrics`](crate::reference::metrics)) of one picture is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorEstimate {
    /// Variance: what another draw of photons changes.
    pub noise: f64,
    /// Squared blur of kernels. Light that never arrives, as bounces that settings leave out or rays that are lost, is no part of
    /// it: no picture of the same settings has it.
    pub blur: f64,
}

impl ErrorEstimate {
    /// The settings of the pictures with wider kernels.
    pub fn widened(settings: &Settings) -> Settings {
        let mut widened = settings.clone();
        match &mut widened.splatter.bandwidth {
            Bandwidth::Density { photons, .. } | Bandwidth::Screen { photons, .. } => *photons *= WIDENING * WIDENING,
            Bandwidth::Fixed(radius) => *radius *= WIDENING,
        }
        widened
    }

    /// From two pictures of the settings in question and two of [`ErrorEstimate::widened`], linear radiance, in any unit: the
    /// first of each with the same photons, the second of each with the next as many of the random sequence
    /// ([`SceneInputs::sample_offset`](super::SceneInputs::sample_offset)).
    ///
    /// # Errors
    /// [`Error::CountMismatch`] for pictures of unlike size.
    pub fn of(own: [&[[f32; 3]]; 2], widened: [&[[f32; 3]]; 2]) -> Result<Self, Error> {
        let pixels = own[0].len();
        for other in [own[1], widened[0], widened[1]] {
            if other.len() != pixels {
                return Err(Error::CountMismatch {
                    what: "pixels of pictures that an error is estimated from",
                    expected: pixels,
                    found: other.len(),
                });
            }
        }
        let values = |picture: [&[[f32; 3]]; 2], i: usize| picture.map(|p| f64::from(p.as_flattened()[i]));
        let means = || (0..3 * pixels).map(|i| 0.5 * values(own, i).iter().sum::<f64>());
        let count = (3 * pixels).max(1) as f64;
        let guard = BLACK_GUARD * means().sum::<f64>() / count;
        let (mut noise, mut blur) = (0.0, 0.0);
        for (i, mean) in means().enumerate() {
            let ([a, b], [c, d]) = (values(own, i), values(widened, i));
            let scale = mean * mean + guard * guard;
            if scale > 0.0 {
                noise += 0.5 * (a - b).powi(2) / scale;
                blur += (c - a) * (d - b) / scale;
            }
        }
        Ok(Self {
            noise: noise / count,
            blur: BLUR_SHARE * (blur / count).max(0.0),
        })
    }

    /// All of it.
    pub fn relmse(&self) -> f64 {
        self.noise + self.blur
    }
}
