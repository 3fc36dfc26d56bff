//! Images of what is infinitely far away.

use super::name_or_index;
use crate::Error;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// An equirectangular image of linear radiance, constant within each texel: what is sampled is what is seen.
///
/// The middle shows −Z, the top +Y; x grows towards +X. A light's rotation turns it about +Y.
#[derive(Debug, Clone, PartialEq)]
pub struct EnvironmentImage {
    /// Name for messages; may be empty.
    pub name: String,
    /// Texels around the horizon.
    pub width: u32,
    /// Texels from +Y to −Y.
    pub height: u32,
    /// Linear RGB that multiplies the light's radiance; rows from the top, `width * height` of them; not negative.
    pub rgb: Vec<[f32; 3]>,
}

impl EnvironmentImage {
    /// Index of the texel that shows a direction, for a light turned by `rotation`.
    pub fn texel_at(&self, direction: DVec3, rotation: f64) -> usize {
        let turn = (rotation + direction.x.atan2(-direction.z)) / TAU + 0.5;
        let v = direction.normalize().y.clamp(-1.0, 1.0).acos() / PI;
        let index = |part: f64, count: u32| ((part * f64::from(count)) as u32).min(count - 1) as usize;
        index(v, self.height) * self.width as usize + index(turn - turn.floor(), self.width)
    }

    /// Mean over the sphere.
    pub fn mean(&self) -> DVec3 {
        let edge = |row: u32| (PI * f64::from(row) / f64::from(self.height)).cos();
        let mut sum = DVec3::ZERO;
        for (row, texels) in (0..self.height).zip(self.rgb.chunks(self.width.max(1) as usize)) {
            let share = 0.5 * (edge(row) - edge(row + 1)) / f64::from(self.width);
            sum += share * texels.iter().map(|&t| glam::Vec3::from(t).as_dvec3()).sum::<DVec3>();
        }
        sum
    }

    /// Checks size, length and every number.
    ///
    /// # Errors
    /// [`Error::InvalidScene`].
    pub fn validate(&self, index: usize) -> Result<(), Error> {
        let error = |field: &str, problem: String| {
            let name = name_or_index(&self.name, index);
            Err(Error::scene("environment", name, field, problem))
        };
        if self.width == 0 || self.height == 0 {
            return error(
                "size",
                format!("is {}×{}; expected at least 1×1", self.width, self.height),
            );
        }
        let expected = self.width as usize * self.height as usize;
        if self.rgb.len() != expected {
            return error("rgb", format!("holds {} texels; expected {expected}", self.rgb.len()));
        }
        if let Some(at) = self
            .rgb
            .iter()
            .position(|t| !t.iter().all(|x| x.is_finite() && *x >= 0.0))
        {
            let problem = format!("is {:?}; expected finite and not negative", self.rgb[at]);
            return error(&format!("texel {at}"), problem);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32) -> EnvironmentImage {
        let rgb = (0..width * height).map(|i| [i as f32, 1.0, 0.5]).collect();
        EnvironmentImage {
            name: String::new(),
            width,
            height,
            rgb,
        }
    }

    #[test]
    fn the_middle_shows_minus_z_and_the_right_plus_x() {
        let four = image(4, 2);
        let level = |x: f64, z: f64| four.texel_at(DVec3::new(x, 0.1, z), 0.0);
        assert_eq!([level(-0.1, -1.0), level(0.1, -1.0)], [1, 2]);
        assert_eq!([level(1.0, -0.1), level(1.0, 0.1)], [2, 3]);
        assert_eq!(four.texel_at(DVec3::new(0.1, -1.0, -0.2), 0.0), 6);
        assert_eq!(four.texel_at(DVec3::new(0.1, 0.1, -1.0), 0.5 * PI), 3);
    }

    #[test]
    fn the_mean_weighs_rows_by_the_sphere() {
        let mut sky = image(3, 4);
        sky.rgb = (0..12).map(|i| if i < 3 { [1.0; 3] } else { [0.0; 3] }).collect();
        // The cap from the pole to 45 degrees: (1 - cos 45) / 2 of the sphere.
        let expected = 0.5 * (1.0 - 0.5f64.sqrt());
        assert!((sky.mean() - expected).length() < 1e-12);
    }

    #[test]
    fn a_bad_image_is_refused_by_name() {
        let mut short = image(2, 2);
        short.rgb.pop();
        let mut dark = image(2, 2);
        dark.rgb[3] = [0.0, f32::NAN, 0.0];
        for (image, word) in [(short, "3 texels"), (dark, "texel 3"), (image(0, 2), "0×2")] {
            let error = image.validate(5).unwrap_err().to_string();
            assert!(error.contains(word) && error.contains("#5"), "{error}");
        }
    }
}
