//! How far off a picture is, told without a truth: noise from photons of another draw, blur from wider kernels.
//!
//! Two pictures of the same settings with photons of their own differ by noise alone, with twice the variance of one. Pictures
//! whose kernels are wider differ from them by how much more these blur, and by noise that is another one for each draw: the
//! product of both differences, one of each draw, is the square of the former in the mean.

use super::Settings;
use crate::Error;
use crate::pass::Bandwidth;
use crate::resource::BLACK_GUARD;

/// Squared blur of a kernel over the squared difference to one of twice its width.
const BLUR_SHARE: f64 = 1.0;

/// What relMSE (as in `reference::metrics`) of a picture of one frame is made of, all pixels counted. Light that never
/// arrives is no part of it, for no picture of the same settings has it: bounces that settings leave out, rays that
/// environment maps lose or that end beside where they should. Nor is blur of kernels that are as wide as they may be
/// (`splatter.max_radius`) already, and of caustics that have photons of their own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorEstimate {
    /// Variance: what another draw of photons changes.
    pub noise: f64,
    /// Squared blur of kernels.
    pub blur: f64,
}

impl ErrorEstimate {
    /// How many times as wide kernels are that blur is told from.
    pub const WIDENING: f32 = 2.0;

    /// The settings of the pictures with wider kernels.
    pub fn widened(settings: &Settings) -> Settings {
        let mut widened = settings.clone();
        match &mut widened.splatter.bandwidth {
            Bandwidth::Density { photons, .. } | Bandwidth::Screen { photons, .. } => {
                *photons *= Self::WIDENING * Self::WIDENING;
            }
            Bandwidth::Fixed(radius) => *radius *= Self::WIDENING,
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Even in [-1/2, 1/2), another one for each draw and value (SplitMix64).
    fn noise(draw: u32, value: usize) -> f32 {
        let mut bits = (u64::from(draw) << 32 | value as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) >> 40) as f32 / (1 << 24) as f32 - 0.5
    }

    fn picture(draw: u32, blur: f32, spread: f32) -> Vec<[f32; 3]> {
        let value = |i: usize| 1.0 + blur * (i as f32).sin() + spread * noise(draw, i);
        (0..40_000)
            .map(|i| [value(3 * i), value(3 * i + 1), value(3 * i + 2)])
            .collect()
    }

    #[test]
    fn noise_and_blur_are_told_apart() {
        for (blur, spread) in [(0.0, 0.4), (0.1, 0.0), (0.1, 0.4)] {
            // Twice the width blurs four times as much, and averages noise over four times the area.
            let own = [1, 2].map(|draw| picture(draw, blur, spread));
            let widened = [3, 4].map(|draw| picture(draw, 4.0 * blur, 0.5 * spread));
            let told = ErrorEstimate::of([&own[0], &own[1]], [&widened[0], &widened[1]]).unwrap();
            let (noise, apart) = (f64::from(spread).powi(2) / 12.0, (3.0 * f64::from(blur)).powi(2) / 2.0);
            assert!((told.noise - noise).abs() < 0.05 * noise + 1e-9, "{told:?} {noise}");
            let wanted = BLUR_SHARE * apart;
            // What is divided by is noisy, too: 3/2 of the squared variance.
            let allowed = 0.05 * wanted + 2.0 * noise * noise + 5e-5;
            assert!((told.blur - wanted).abs() < allowed, "{told:?} {wanted}");
        }
        let (large, small) = (vec![[1.0; 3]; 4], vec![[1.0; 3]; 3]);
        let error = ErrorEstimate::of([&large, &small], [&large, &large]).unwrap_err();
        assert!(
            matches!(
                error,
                Error::CountMismatch {
                    expected: 4,
                    found: 3,
                    ..
                }
            ),
            "{error}"
        );
    }

    #[test]
    fn kernels_are_widened() {
        let mut settings = Settings::fast();
        settings.set("splatter.photons", "50").unwrap();
        let widened = ErrorEstimate::widened(&settings).entries();
        assert!(widened.contains(&("splatter.photons", "200".to_owned())));
        settings.set("splatter.fixed_radius", "0.05").unwrap();
        let widened = ErrorEstimate::widened(&settings).entries();
        assert!(widened.contains(&("splatter.fixed_radius", "0.1".to_owned())));
    }
}
