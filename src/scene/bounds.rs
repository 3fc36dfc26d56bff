//! The region that light should fill.

use crate::Error;
use glam::DVec3;

/// An axis-aligned region of world space: the whole scene, or the part of an open world that deserves indirect light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneBounds {
    /// Lower corner.
    pub min: DVec3,
    /// Upper corner.
    pub max: DVec3,
}

impl SceneBounds {
    /// The box between two corners.
    ///
    /// # Errors
    /// [`Error::InvalidBounds`] unless both corners are finite, ordered, and apart in at least one axis.
    pub fn new(min: DVec3, max: DVec3) -> Result<Self, Error> {
        let extent = max - min;
        let is_region = min.is_finite() && max.is_finite() && extent.min_element() >= 0.0 && extent.length() > 0.0;
        if !is_region {
            return Err(Error::InvalidBounds {
                min: min.into(),
                max: max.into(),
            });
        }
        Ok(Self { min, max })
    }

    /// Midpoint.
    pub fn center(&self) -> DVec3 {
        self.min + 0.5 * (self.max - self.min)
    }

    /// Radius of the enclosing sphere: half the diagonal.
    pub fn radius(&self) -> f64 {
        0.5 * (self.max - self.min).length()
    }

    /// The smallest box that holds both.
    pub fn union(&self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }
}
