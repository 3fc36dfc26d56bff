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

/// A ball around something, world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundingSphere {
    /// Centre.
    pub center: DVec3,
    /// Radius, 0 or more.
    pub radius: f64,
}

impl BoundingSphere {
    /// Around points: about the middle of their box. `None` for none.
    pub fn of(points: impl Iterator<Item = DVec3> + Clone) -> Option<Self> {
        let bounds = points.clone().map(|p| SceneBounds { min: p, max: p });
        let center = bounds.reduce(|a, b| a.union(&b))?.center();
        let radius = points.map(|p| p.distance(center)).fold(0.0, f64::max);
        Some(Self { center, radius })
    }

    /// The balls themselves, or at most so many around those that stand together.
    pub(crate) fn group(balls: &[Self], most: usize) -> Vec<Self> {
        if balls.len() <= most {
            return balls.to_vec();
        }
        if most <= 1 {
            return Self::around(balls).into_iter().collect();
        }
        let centers = balls.iter().map(|b| SceneBounds {
            min: b.center,
            max: b.center,
        });
        let extent = centers
            .reduce(|a, b| a.union(&b))
            .map_or(DVec3::ZERO, |b| b.max - b.min);
        let axis = extent.max_position();
        let mut sorted = balls.to_vec();
        sorted.sort_by(|a, b| a.center[axis].total_cmp(&b.center[axis]));
        let (low, high) = sorted.split_at(sorted.len() / 2);
        let mut groups = Self::group(low, most / 2);
        groups.extend(Self::group(high, most - most / 2));
        groups
    }

    /// Around balls.
    fn around(balls: &[Self]) -> Option<Self> {
        let boxes = balls.iter().map(|b| SceneBounds {
            min: b.center - b.radius,
            max: b.center + b.radius,
        });
        let center = boxes.reduce(|a, b| a.union(&b))?.center();
        let reach = balls.iter().map(|b| b.center.distance(center) + b.radius);
        Some(Self {
            center,
            radius: reach.fold(0.0, f64::max),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grouped_balls_hold_all_that_they_stand_for() {
        let balls: Vec<_> = (0..200)
            .map(|i| BoundingSphere {
                center: DVec3::new(f64::from(i % 20), f64::from(i / 20), f64::from(i * 7 % 13)),
                radius: 0.1 * f64::from(i % 5),
            })
            .collect();
        for most in [1, 3, 64] {
            let groups = BoundingSphere::group(&balls, most);
            assert!(!groups.is_empty() && groups.len() <= most);
            let holds = |b: &BoundingSphere| {
                groups
                    .iter()
                    .any(|g| g.center.distance(b.center) + b.radius <= g.radius * (1.0 + 1e-12))
            };
            assert!(balls.iter().all(holds), "{most}");
        }
        assert_eq!(BoundingSphere::group(&balls[..64], 64), balls[..64]);
        assert_eq!(BoundingSphere::of([].into_iter()), None);
        let pair = BoundingSphere::of([DVec3::ZERO, DVec3::X].into_iter()).unwrap();
        assert_eq!((pair.center, pair.radius), (0.5 * DVec3::X, 0.5));
    }
}
