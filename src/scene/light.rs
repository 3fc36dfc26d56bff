//! Light sources without geometry: those of `KHR_lights_punctual` by its conventions, without luminous efficacy, and two
//! kinds that it lacks.

use super::name_or_index;
use crate::Error;
use glam::DVec3;
use std::f64::consts::PI;

/// What kind of light, and what is particular to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightKind {
    /// Shines equally in all directions from a position.
    Point {
        /// World position.
        position: DVec3,
        /// Radius of the shining sphere, world units; 0 gives hard shadows.
        radius: f64,
    },
    /// Shines into a cone.
    Spot {
        /// World position.
        position: DVec3,
        /// Axis of the cone, away from the light; any length above zero.
        direction: DVec3,
        /// Half angle, radians, up to which intensity is full.
        inner_angle: f64,
        /// Half angle, radians, from which on intensity is zero; at most π/2.
        outer_angle: f64,
        /// Radius of the shining disc, world units; 0 gives hard shadows.
        radius: f64,
    },
    /// Parallel light from infinitely far away.
    Directional {
        /// The way light travels; any length above zero.
        direction: DVec3,
        /// Half the angle that the source subtends, radians; 0 gives hard shadows.
        angle: f64,
    },
    /// A flat lamp that shines from its front side only, with the same radiance everywhere and in all directions. It has
    /// no geometry: it blocks nothing, and the eye does not see it directly; rays that a surface has scattered do.
    Rectangle {
        /// World position of its middle.
        center: DVec3,
        /// From the middle to the middle of one side.
        half_u: DVec3,
        /// From the middle to the middle of a side next to it. The front is the side that `half_u` × `half_v` points to.
        /// The two need not be perpendicular: then the lamp is a parallelogram.
        half_v: DVec3,
    },
    /// Light from infinitely far away, all around. A scene has at most one. Rays that meet no surface see it.
    Environment {
        /// Index into [`Scene::environments`](super::Scene::environments): factors of the radiance by direction, as
        /// [`EnvironmentImage`](super::EnvironmentImage) says. `None`: the same radiance from everywhere.
        image: Option<usize>,
        /// Turns the image about +Y, radians, counter-clockwise seen from above.
        rotation: f64,
    },
}

/// A light source.
#[derive(Debug, Clone, PartialEq)]
pub struct Light {
    /// Name for messages; may be empty.
    pub name: String,
    /// Kind and placement.
    pub kind: LightKind,
    /// Linear RGB factor, not negative.
    pub color: [f32; 3],
    /// Times `color`: radiant intensity in W/sr (point, spot), irradiance on a perpendicular plane in W/m²
    /// (directional), or radiance in W/m²/sr (rectangle, environment). Not negative.
    pub intensity: f32,
}

impl Light {
    /// A point light of no extent.
    pub fn point(position: DVec3, intensity: f32, color: [f32; 3]) -> Self {
        Self {
            name: String::new(),
            kind: LightKind::Point { position, radius: 0.0 },
            color,
            intensity,
        }
    }

    /// `color` × `intensity` in `f64`.
    pub fn strength(&self) -> DVec3 {
        glam::Vec3::from(self.color).as_dvec3() * f64::from(self.intensity)
    }

    /// Solid angle that a light of full intensity would fill to emit the same flux, sr. A point light's is 4π; of a
    /// spot's falloff ((cosθ − cos o)/(cos i − cos o))² the penumbra counts a third. Zero for the other kinds, which have
    /// no intensity.
    pub fn effective_solid_angle(&self) -> f64 {
        match self.kind {
            LightKind::Point { .. } => 4.0 * PI,
            LightKind::Spot {
                inner_angle,
                outer_angle,
                ..
            } => {
                let (inner, outer) = (one_minus_cos(inner_angle), one_minus_cos(outer_angle));
                2.0 * PI * (inner + (outer - inner) / 3.0)
            }
            LightKind::Directional { .. } | LightKind::Rectangle { .. } | LightKind::Environment { .. } => 0.0,
        }
    }

    /// Radiant flux, W, per channel. A directional light's is what crosses a disc of `region_radius`; an environment's is
    /// what enters a sphere of that radius, its image left out: [`Scene::flux_of`](super::Scene::flux_of) counts it in.
    pub fn flux(&self, region_radius: f64) -> DVec3 {
        let disc = PI * region_radius * region_radius;
        let per_strength = match self.kind {
            LightKind::Point { .. } | LightKind::Spot { .. } => self.effective_solid_angle(),
            LightKind::Directional { .. } => disc,
            // Constant radiance L leaves each point with ∫ L cosθ dω = π L over the hemisphere; the sides are 2 |half_u|
            // and 2 |half_v|.
            LightKind::Rectangle { half_u, half_v, .. } => PI * 4.0 * half_u.cross(half_v).length(),
            // From each direction, parallel light of irradiance L dω crosses a disc of the sphere's radius: ∫ L π R² dω
            // over all 4π of them, 4π² R² L.
            LightKind::Environment { .. } => 4.0 * PI * disc,
        };
        self.strength() * per_strength
    }

    /// Whether light comes from all around. Passes take [`Sun`](super::Sun)s for it.
    pub fn is_environment(&self) -> bool {
        matches!(self.kind, LightKind::Environment { .. })
    }

    /// Whether the light has an extent, and so a penumbra.
    pub fn has_extent(&self) -> bool {
        match self.kind {
            LightKind::Point { radius, .. } | LightKind::Spot { radius, .. } => radius > 0.0,
            LightKind::Directional { angle, .. } => angle > 0.0,
            LightKind::Rectangle { .. } | LightKind::Environment { .. } => true,
        }
    }

    /// Checks every number. What takes the rest of the scene, an environment's image and that there is one environment at
    /// most, [`Scene::validate`](super::Scene::validate) checks.
    ///
    /// # Errors
    /// [`Error::InvalidScene`].
    pub fn validate(&self, index: usize) -> Result<(), Error> {
        let error =
            |field: &str, problem: String| Err(Error::scene("light", name_or_index(&self.name, index), field, problem));
        if !(self.intensity.is_finite() && self.intensity >= 0.0) {
            return error(
                "intensity",
                format!("is {}; expected finite and not negative", self.intensity),
            );
        }
        if !self.color.iter().all(|c| c.is_finite() && *c >= 0.0) {
            return error(
                "color",
                format!("is {:?}; expected finite and not negative", self.color),
            );
        }
        let (position, direction, extent, limit) = match self.kind {
            LightKind::Point { position, radius } => (position, DVec3::X, radius, f64::MAX),
            LightKind::Spot {
                position,
                direction,
                radius,
                ..
            } => (position, direction, radius, f64::MAX),
            LightKind::Directional { direction, angle } => (DVec3::ZERO, direction, angle, 0.5 * PI),
            LightKind::Rectangle { center, half_u, half_v } => {
                if !center.is_finite() {
                    return error("center", format!("is {center}, not finite"));
                }
                if !is_parallelogram(half_u, half_v) {
                    let problem = format!("are {half_u} and {half_v}; expected finite, not zero and not parallel");
                    return error("half_u and half_v", problem);
                }
                return Ok(());
            }
            LightKind::Environment { rotation, .. } => {
                if !rotation.is_finite() {
                    return error("rotation", format!("is {rotation}, not finite"));
                }
                return Ok(());
            }
        };
        if !position.is_finite() {
            return error("position", format!("is {position}, not finite"));
        }
        if !(direction.length() > 0.0 && direction.length().is_finite()) {
            return error("direction", format!("is {direction}; expected finite and not zero"));
        }
        if !(extent >= 0.0 && extent <= limit) {
            return error("radius or angle", format!("is {extent}; expected at least zero"));
        }
        if let LightKind::Spot {
            inner_angle,
            outer_angle,
            ..
        } = self.kind
            && !(inner_angle >= 0.0 && inner_angle <= outer_angle && outer_angle > 0.0 && outer_angle <= 0.5 * PI)
        {
            return error(
                "cone",
                format!("is {inner_angle} to {outer_angle}; expected 0 ≤ inner ≤ outer ≤ π/2, outer above 0"),
            );
        }
        Ok(())
    }
}

/// Whether two half sides span a finite area, and with it a front. Of parallel ones rounding leaves a product of a few ε
/// times both lengths, which points anywhere.
fn is_parallelogram(half_u: DVec3, half_v: DVec3) -> bool {
    let normal = half_u.cross(half_v);
    let rounding = 4.0 * f64::EPSILON * half_u.length() * half_v.length();
    normal.is_finite() && normal.length() > rounding && normal.length().is_finite()
}

/// 1 − cos θ without the cancellation at small angles.
pub(crate) fn one_minus_cos(angle: f64) -> f64 {
    let s = (0.5 * angle).sin();
    2.0 * s * s
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{EnvironmentImage, Scene};

    fn light(kind: LightKind) -> Light {
        Light {
            kind,
            ..Light::point(DVec3::ZERO, 3.0, [1.0, 0.5, 0.0])
        }
    }

    fn environment(image: Option<usize>) -> Light {
        light(LightKind::Environment { image, rotation: 0.3 })
    }

    fn assert_close(a: DVec3, b: DVec3) {
        assert!((a - b).length() <= 1e-13 * b.length(), "{a}, expected {b}");
    }

    #[test]
    fn a_lamp_of_any_slant_shines_by_its_area() {
        let lamp = |half_u, half_v| {
            light(LightKind::Rectangle {
                center: DVec3::splat(5.0),
                half_u,
                half_v,
            })
        };
        // 2 m by 6 m; a parallelogram of that base and height; the same one turned over.
        let (u, v, expected) = (DVec3::X, 3.0 * DVec3::Z, DVec3::new(3.0, 1.5, 0.0) * PI * 12.0);
        for lamp in [lamp(u, v), lamp(u, v + 0.7 * u), lamp(v, u)] {
            lamp.validate(0).unwrap();
            assert_close(lamp.flux(1.0), expected);
            assert_close(lamp.flux(9.0), expected);
        }
    }

    #[test]
    fn an_environment_lights_each_point_of_a_sphere_around_the_region_from_a_hemisphere() {
        let radius = 2.5;
        let irradiance = PI * environment(None).strength();
        assert_close(environment(None).flux(radius), irradiance * 4.0 * PI * radius * radius);
    }

    #[test]
    fn an_environment_of_one_shining_texel_has_the_flux_of_a_sun_there() {
        let mut sky = EnvironmentImage {
            name: String::new(),
            width: 64,
            height: 32,
            rgb: vec![[0.0; 3]; 64 * 32],
        };
        let row = 9;
        sky.rgb[row * 64 + 40] = [2.0, 4.0, 1.0];
        let sun = Light {
            color: [3.0 * 2.0, 1.5 * 4.0, 0.0],
            intensity: 1.0,
            ..light(LightKind::Directional {
                direction: DVec3::NEG_Y,
                angle: 0.0,
            })
        };
        let expected = sun.flux(2.5) * sky.texel_solid_angle(row as u32);
        let scene = Scene {
            environments: vec![sky],
            ..Scene::default()
        };
        assert_close(scene.flux_of(&environment(Some(0)), 2.5), expected);
        assert_close(scene.flux_of(&environment(None), 2.5), environment(None).flux(2.5));
    }
}
