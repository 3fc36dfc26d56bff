//! Scale normalisation: the one frame in which all GPU arithmetic happens.
//!
//! Positions are taken relative to the centre of the region (subtracted in `f64`) and multiplied by a power of two, so
//! that the region's radius lies in (1/2, 1]; flux is divided by a power of two near the total emitted flux. Scaling a
//! scene's lengths or powers by a power of two therefore changes no bit of what the GPU computes.

use super::SceneBounds;
use crate::Error;
use glam::{DAffine3, DMat3, DVec3, Mat4, Vec3};

/// Maps world space to the unit frame and back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnitFrame {
    center: DVec3,
    /// Distance from the centre that the region reaches, in unit-frame lengths.
    radius: f64,
    /// One unit-frame length is 2^`length_exponent` world units.
    length_exponent: i32,
    /// One unit-frame flux is 2^`flux_exponent` watts.
    flux_exponent: i32,
}

/// Largest exponents accepted: beyond them `f64` itself runs out.
const MAX_EXPONENT: i32 = 400;

impl UnitFrame {
    /// The frame of a region in which sources emit `total_flux` watts (sum over channels and lights; 0 if nothing emits).
    ///
    /// # Errors
    /// [`Error::InvalidBounds`] if the extent is outside 2^±400, or the flux is.
    pub fn new(bounds: &SceneBounds, total_flux: f64) -> Result<Self, Error> {
        let (center, world_radius) = (bounds.center(), bounds.radius());
        let length_exponent = ceil_log2(world_radius);
        let flux_exponent = if total_flux > 0.0 { ceil_log2(total_flux) } else { 0 };
        let in_range = |e: i32| e.abs() <= MAX_EXPONENT;
        if !(center.is_finite() && world_radius > 0.0 && in_range(length_exponent) && in_range(flux_exponent)) {
            return Err(Error::InvalidBounds {
                min: bounds.min.into(),
                max: bounds.max.into(),
            });
        }
        Ok(Self {
            center,
            radius: world_radius * exp2(-length_exponent),
            length_exponent,
            flux_exponent,
        })
    }

    /// This frame, its radius brought up to date, or a new one if the region has left it by a factor of two. A kept
    /// frame keeps history valid.
    ///
    /// # Errors
    /// As [`UnitFrame::new`].
    pub fn follow(&self, bounds: &SceneBounds, total_flux: f64) -> Result<Self, Error> {
        let fresh = Self::new(bounds, total_flux)?;
        let reach = (bounds.center() - self.center).length() + bounds.radius();
        let lengths_fit = reach <= 2.0 * self.length_scale() && bounds.radius() >= 0.25 * self.length_scale();
        let flux_fits = (fresh.flux_exponent - self.flux_exponent).abs() <= 1;
        if !(lengths_fit && flux_fits) {
            return Ok(fresh);
        }
        Ok(Self {
            radius: reach / self.length_scale(),
            ..*self
        })
    }

    /// Whether both frames map the world to the same numbers; then history made in one is good in the other.
    pub fn maps_like(&self, other: &Self) -> bool {
        self.center == other.center
            && self.length_exponent == other.length_exponent
            && self.flux_exponent == other.flux_exponent
    }

    /// World position of the frame's origin.
    pub fn center(&self) -> DVec3 {
        self.center
    }

    /// How far from the frame's origin the region reaches, in unit-frame lengths: in (1/2, 1] for a new frame, up to 2
    /// while one is kept.
    pub fn radius(&self) -> f32 {
        self.radius as f32
    }

    /// World units per unit-frame length: a power of two.
    pub fn length_scale(&self) -> f64 {
        exp2(self.length_exponent)
    }

    /// Watts per unit-frame flux: a power of two.
    pub fn flux_scale(&self) -> f64 {
        exp2(self.flux_exponent)
    }

    /// What one unit-frame radiance (or irradiance) stands for in W/m²/sr (W/m²): a power of two.
    pub fn radiance_scale(&self) -> f64 {
        exp2(self.flux_exponent - 2 * self.length_exponent)
    }

    /// [`UnitFrame::radiance_scale`] times a pre-exposure as the `f32` that the composite multiplies by.
    ///
    /// # Errors
    /// [`Error::UnrepresentableRadiance`] if it, or numbers 2^20 to either side of it, do not fit.
    pub fn output_scale(&self, pre_exposure: f64) -> Result<f32, Error> {
        let scale = self.radiance_scale() * pre_exposure;
        let (low, high) = (exp2(-106), exp2(107));
        if scale >= low && scale <= high {
            Ok(scale as f32)
        } else {
            Err(Error::UnrepresentableRadiance {
                exponent: self.flux_exponent - 2 * self.length_exponent,
            })
        }
    }

    /// A world position in the unit frame.
    pub fn point(&self, world: DVec3) -> Vec3 {
        ((world - self.center) * exp2(-self.length_exponent)).as_vec3()
    }

    /// A unit-frame position in the world.
    pub fn world_point(&self, unit: Vec3) -> DVec3 {
        unit.as_dvec3() * self.length_scale() + self.center
    }

    /// Mesh-to-world as mesh-to-unit-frame, composed in `f64`.
    pub fn transform(&self, world: &DAffine3) -> Mat4 {
        let inverse_scale = exp2(-self.length_exponent);
        DAffine3 {
            matrix3: DMat3::from_diagonal(DVec3::splat(inverse_scale)) * world.matrix3,
            translation: (world.translation - self.center) * inverse_scale,
        }
        .into_mat4()
    }

    /// An area, world units squared, in the unit frame.
    pub fn area(&self, world: f64) -> f32 {
        (world * exp2(-2 * self.length_exponent)) as f32
    }

    /// A light's radiant intensity, W/sr, or a flux, W, in the unit frame.
    pub fn intensity(&self, world: DVec3) -> Vec3 {
        (world / self.flux_scale()).as_vec3()
    }

    /// An irradiance, W/m², or a radiance, W/m²/sr, in the unit frame.
    pub fn radiance(&self, world: DVec3) -> Vec3 {
        (world / self.radiance_scale()).as_vec3()
    }
}

trait IntoMat4 {
    fn into_mat4(self) -> Mat4;
}

impl IntoMat4 for DAffine3 {
    fn into_mat4(self) -> Mat4 {
        glam::DMat4::from(self).as_mat4()
    }
}

/// The smallest e with `x` ≤ 2^e, exact; a large number for what is not positive and normal.
fn ceil_log2(x: f64) -> i32 {
    if !x.is_normal() || x < 0.0 {
        return i32::MAX / 4;
    }
    let bits = x.to_bits();
    let exponent = ((bits >> 52) & 0x7ff) as i32 - 1023;
    let is_power_of_two = bits & ((1 << 52) - 1) == 0;
    if is_power_of_two { exponent } else { exponent + 1 }
}

/// 2^e, exact for the exponents used here.
fn exp2(e: i32) -> f64 {
    f64::from_bits(((e + 1023).clamp(1, 2046) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(half: f64, center: DVec3) -> SceneBounds {
        SceneBounds::new(center - half, center + half).unwrap()
    }

    #[test]
    fn the_region_radius_lies_between_a_half_and_one() {
        for half in [1e-12, 0.3, 0.5, 1.0, 7.25, 1e12] {
            let frame = UnitFrame::new(&cube(half, DVec3::ZERO), 1.0).unwrap();
            assert!(
                frame.radius() > 0.5 && frame.radius() <= 1.0,
                "{half}: {}",
                frame.radius()
            );
        }
    }

    #[test]
    fn powers_of_two_change_no_bit_of_a_unit_position() {
        let at = DVec3::new(0.1, -0.7, 0.33);
        let frame = UnitFrame::new(&cube(1.7, DVec3::new(0.3, 0.2, 0.1)), 3.0).unwrap();
        for e in [-40, -1, 1, 40] {
            let s = exp2(e);
            let scaled = UnitFrame::new(&cube(1.7 * s, DVec3::new(0.3, 0.2, 0.1) * s), 3.0).unwrap();
            assert_eq!(frame.point(at), scaled.point(at * s));
            assert_eq!(frame.radiance_scale(), scaled.radiance_scale() * s * s);
        }
    }

    #[test]
    fn a_frame_is_kept_until_the_region_leaves_it_by_two() {
        let frame = UnitFrame::new(&cube(1.0, DVec3::ZERO), 1.0).unwrap();
        let kept = |bounds: &SceneBounds, flux: f64| frame.follow(bounds, flux).unwrap().maps_like(&frame);
        assert!(kept(&cube(1.0, DVec3::ZERO), 1.0));
        assert!(kept(&cube(1.9, DVec3::splat(0.1)), 1.5));
        assert!(!kept(&cube(2.5, DVec3::ZERO), 1.0));
        assert!(!kept(&cube(0.25, DVec3::ZERO), 1.0));
        assert!(!kept(&cube(1.0, DVec3::ZERO), 64.0));
        let grown = frame.follow(&cube(1.9, DVec3::ZERO), 1.0).unwrap();
        assert_eq!(
            f64::from(grown.radius()),
            (1.9 * 3f64.sqrt() / 2.0) as f32 as f64,
            "the radius follows the region"
        );
    }

    #[test]
    fn positions_far_from_the_origin_keep_their_digits() {
        let center = DVec3::splat(1e8);
        let frame = UnitFrame::new(&cube(1.0, center), 1.0).unwrap();
        let unit = frame.point(center + DVec3::new(0.25, 0.5, -0.125));
        assert_eq!(unit, Vec3::new(0.125, 0.25, -0.0625));
    }
}
