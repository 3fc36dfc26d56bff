//! Light sources without geometry; point, spot and directional ones by the conventions of `KHR_lights_punctual` without
//! luminous efficacy.

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
    /// A flat lamp that shines from its front with equal radiance in all directions. It blocks nothing; reflections show
    /// it, the eye does not see it directly.
    Rectangle {
        /// World position of its middle.
        center: DVec3,
        /// From the middle to the middle of one edge, world units.
        half_u: DVec3,
        /// From the middle to the middle of the next edge. `half_u` × `half_v` points out of the front; they need not be
        /// perpendicular.
        half_v: DVec3,
    },
    /// Light from infinitely far away, all around. A scene has at most one.
    Environment {
        /// Index into [`Scene::environments`](super::Scene::environments); `None`: the same radiance everywhere.
        image: Option<usize>,
        /// Turn about +Y, radians.
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
    /// Times `color`: radiant intensity in W/sr (point, spot), irradiance on a perpendicular plane in W/m² (directional), or
    /// radiance in W/m²/sr (rectangle; environment, where it multiplies the image). Not negative.
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
    /// spot's falloff ((cosθ − cos o)/(cos i − cos o))² the penumbra counts a third. Zero for lights without an intensity.
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
    /// what enters a sphere of that radius, without its image.
    pub fn flux(&self, region_radius: f64) -> DVec3 {
        let disc = PI * region_radius * region_radius;
        match self.kind {
            LightKind::Directional { .. } => self.strength() * disc,
            LightKind::Rectangle { half_u, half_v, .. } => self.strength() * PI * 4.0 * half_u.cross(half_v).length(),
            // Irradiance π L on each of the sphere's four discs of area.
            LightKind::Environment { .. } => self.strength() * PI * 4.0 * disc,
            LightKind::Point { .. } | LightKind::Spot { .. } => self.strength() * self.effective_solid_angle(),
        }
    }

    /// Whether it is a point, spot or directional light: what shadow maps and photons start from.
    pub fn is_punctual(&self) -> bool {
        !matches!(self.kind, LightKind::Rectangle { .. } | LightKind::Environment { .. })
    }

    /// Whether the light has an extent, and so a penumbra.
    pub fn has_extent(&self) -> bool {
        match self.kind {
            LightKind::Point { radius, .. } | LightKind::Spot { radius, .. } => radius > 0.0,
            LightKind::Directional { angle, .. } => angle > 0.0,
            LightKind::Rectangle { .. } | LightKind::Environment { .. } => true,
        }
    }

    /// Checks every number.
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
                let area = 4.0 * half_u.cross(half_v).length();
                if !(area > 0.0 && area.is_finite()) {
                    return error(
                        "half_u and half_v",
                        format!("span an area of {area}; expected finite and above zero"),
                    );
                }
                (center, DVec3::X, 0.0, f64::MAX)
            }
            LightKind::Environment { rotation, .. } => {
                if !rotation.is_finite() {
                    return error("rotation", format!("is {rotation}, not finite"));
                }
                (DVec3::ZERO, DVec3::X, 0.0, f64::MAX)
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

/// 1 − cos θ without the cancellation at small angles.
pub(crate) fn one_minus_cos(angle: f64) -> f64 {
    let s = (0.5 * angle).sin();
    2.0 * s * s
}
