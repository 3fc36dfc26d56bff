//! Images of what shines from infinitely far away.

use super::name_or_index;
use crate::Error;
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::PI;

/// An equirectangular image of everything around a scene, for [`LightKind::Environment`](super::LightKind::Environment).
///
/// Rows go from the top (+Y) to the bottom (−Y). With image coordinates (u, v) in [0, 1], from the left and from the top, a
/// unit direction (x, y, z) away from the scene lies at
///
/// u = (rotation + atan2(x, −z)) / 2π + 1/2, wrapped, and v = acos(y) / π.
///
/// So −Z is in the middle of the image and +X a quarter of its width further right; `rotation` turns the surroundings by
/// so many radians about +Y, counter-clockwise seen from above. The light is constant within each texel and nothing is
/// interpolated, so that what is sampled is what is seen.
#[derive(Debug, Clone, PartialEq)]
pub struct EnvironmentImage {
    /// Name for messages; may be empty.
    pub name: String,
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// Linear RGB factors of the light's radiance, finite and not negative, `width * height` of them.
    pub rgb: Vec<[f32; 3]>,
}

impl EnvironmentImage {
    /// Image coordinates (u, v) in [0, 1] of a direction away from the scene, of any length above zero.
    pub fn uv_of(direction: DVec3, rotation: f64) -> DVec2 {
        let DVec3 { x, y, z } = direction;
        let turns = (rotation + x.atan2(-z)) / (2.0 * PI) + 0.5;
        // acos(y) of the unit vector, without its loss of digits near the poles.
        let polar_angle = x.hypot(z).atan2(y);
        DVec2::new(turns - turns.floor(), polar_angle / PI)
    }

    /// The unit direction at image coordinates (u, v).
    pub fn direction_at(uv: DVec2, rotation: f64) -> DVec3 {
        let (sin_azimuth, cos_azimuth) = (2.0 * PI * (uv.x - 0.5) - rotation).sin_cos();
        let (sin_polar, cos_polar) = (PI * uv.y).sin_cos();
        DVec3::new(sin_polar * sin_azimuth, cos_polar, -sin_polar * cos_azimuth)
    }

    /// Column and row of the texel that shines from a direction.
    pub fn texel_at(&self, direction: DVec3, rotation: f64) -> [u32; 2] {
        let uv = Self::uv_of(direction, rotation);
        // The right and bottom edges, u = 1 and v = 1, belong to the last texels.
        let texel = |coordinate: f64, count: u32| ((coordinate * f64::from(count)) as u32).min(count.saturating_sub(1));
        [texel(uv.x, self.width), texel(uv.y, self.height)]
    }

    /// Solid angle of each texel of a row, sr. All texels together fill 4π.
    pub fn texel_solid_angle(&self, row: u32) -> f64 {
        // (2π / width) (cos θ₀ − cos θ₁) between the row's edges; the difference as a product, which keeps its digits.
        let half_step = 0.5 * PI / f64::from(self.height);
        let middle = (2.0 * f64::from(row) + 1.0) * half_step;
        2.0 * PI / f64::from(self.width) * 2.0 * middle.sin() * half_step.sin()
    }

    /// Mean over all directions, per channel.
    pub fn mean(&self) -> DVec3 {
        let rows = self.rgb.chunks_exact(self.width.max(1) as usize);
        let sum = |row: &[[f32; 3]]| row.iter().map(|&texel| Vec3::from(texel).as_dvec3()).sum::<DVec3>();
        (0..self.height)
            .zip(rows)
            .map(|(row, texels)| sum(texels) * self.texel_solid_angle(row))
            .sum::<DVec3>()
            / (4.0 * PI)
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
        let expected = u64::from(self.width) * u64::from(self.height);
        if self.rgb.len() as u64 != expected {
            return error("rgb", format!("holds {} texels; expected {expected}", self.rgb.len()));
        }
        let is_radiance = |texel: &[f32; 3]| texel.iter().all(|c| c.is_finite() && *c >= 0.0);
        if let Some(at) = self.rgb.iter().position(|texel| !is_radiance(texel)) {
            let (column, row) = (at % self.width as usize, at / self.width as usize);
            return error(
                &format!("texel ({column}, {row})"),
                format!("is {:?}; expected finite and not negative", self.rgb[at]),
            );
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    fn image(width: u32, height: u32) -> EnvironmentImage {
        EnvironmentImage {
            name: "sky".into(),
            width,
            height,
            rgb: vec![[1.0; 3]; (width * height) as usize],
        }
    }

    /// `count` directions, spread evenly over the sphere along a spiral.
    fn directions(count: u32) -> impl Iterator<Item = DVec3> {
        let golden_angle = PI * (3.0 - 5f64.sqrt());
        (0..count).map(move |i| {
            let y = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
            let (sin, cos) = (golden_angle * f64::from(i)).sin_cos();
            let radius = (1.0 - y * y).sqrt();
            DVec3::new(radius * cos, y, radius * sin)
        })
    }

    #[test]
    fn minus_z_is_in_the_middle_plus_x_to_the_right_and_plus_y_on_top() {
        let uv = |direction| EnvironmentImage::uv_of(direction, 0.0);
        assert_eq!(uv(DVec3::NEG_Z), DVec2::new(0.5, 0.5));
        assert_eq!(uv(DVec3::X), DVec2::new(0.75, 0.5));
        assert_eq!(uv(7.0 * DVec3::NEG_X), DVec2::new(0.25, 0.5));
        assert_eq!((uv(DVec3::Y).y, uv(DVec3::NEG_Y).y), (0.0, 1.0));
        // Just left and just right of the seam behind the viewer.
        assert!(uv(DVec3::new(1e-9, 0.0, 1.0)).x > 0.999 && uv(DVec3::new(-1e-9, 0.0, 1.0)).x < 0.001);
    }

    #[test]
    fn a_rotation_turns_the_surroundings_about_plus_y() {
        let image = image(64, 32);
        for rotation in [-8.0, -0.3, 1.1, 3.0, 100.0] {
            let turn = DQuat::from_rotation_y(rotation);
            for direction in directions(1000) {
                // Away from texel edges, where rounding decides.
                let [column, row] = image.texel_at(direction, 0.0);
                let uv = DVec2::new((f64::from(column) + 0.5) / 64.0, (f64::from(row) + 0.5) / 32.0);
                let middle = EnvironmentImage::direction_at(uv, 0.0);
                assert_eq!(image.texel_at(turn * middle, rotation), [column, row], "{direction}");
            }
        }
    }

    #[test]
    fn directions_and_image_coordinates_are_each_others_inverse() {
        for rotation in [0.0, 0.7, -2.5] {
            for direction in directions(10_000).chain([DVec3::Y, DVec3::NEG_Y, DVec3::new(1e-9, -1.0, 1e-9)]) {
                let uv = EnvironmentImage::uv_of(direction, rotation);
                assert!(uv.min_element() >= 0.0 && uv.max_element() <= 1.0, "{uv}");
                let back = EnvironmentImage::direction_at(uv, rotation);
                assert!(
                    (back - direction.normalize()).length() < 1e-14,
                    "{direction} came back as {back}"
                );
            }
        }
    }

    #[test]
    fn every_direction_has_a_texel_the_edges_too() {
        let image = image(3, 5);
        let edges = [
            DVec3::Y,
            DVec3::NEG_Y,
            DVec3::Z,
            DVec3::new(-0.0, 0.0, 1.0),
            DVec3::new(-1e-300, 0.0, 1.0),
        ];
        for direction in edges.into_iter().chain(directions(1000)) {
            for rotation in [0.0, PI, -PI, -1e-17] {
                let [column, row] = image.texel_at(direction, rotation);
                assert!(column < 3 && row < 5, "{direction}, {rotation}: {column}, {row}");
            }
        }
    }

    #[test]
    fn a_texel_is_hit_by_its_solid_angles_share_of_all_directions() {
        let (image, count) = (image(6, 5), 1_000_000);
        let mut hits = [[0u32; 6]; 5];
        for direction in directions(count) {
            let [column, row] = image.texel_at(direction, 0.4);
            hits[row as usize][column as usize] += 1;
        }
        let mut all = 0.0;
        for (row, hits) in (0..).zip(hits) {
            let expected = image.texel_solid_angle(row) / (4.0 * PI);
            all += 6.0 * expected;
            for hits in hits {
                let share = f64::from(hits) / f64::from(count);
                // The spiral errs by the points along a texel's outline.
                assert!(
                    (share / expected - 1.0).abs() < 2e-3,
                    "row {row}: {share}, expected {expected}"
                );
            }
        }
        assert!((all - 1.0).abs() < 1e-14);
    }

    #[test]
    fn the_mean_weighs_texels_by_their_solid_angle() {
        let mut image = image(4, 3);
        assert!((image.mean() - DVec3::ONE).length() < 1e-14);
        // The middle row spans 60° to 120°: (cos 60° − cos 120°) / 2 of the sphere.
        image.rgb[4..8].fill([0.0, 2.0, 1.0]);
        assert!(
            (image.mean() - DVec3::new(0.5, 1.5, 1.0)).length() < 1e-14,
            "{}",
            image.mean()
        );
    }
}
