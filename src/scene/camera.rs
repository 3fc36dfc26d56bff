//! View points.

use super::name_or_index;
use crate::Error;
use glam::DAffine3;

/// How a camera projects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// Perspective; the far plane is at infinity.
    Perspective {
        /// Vertical field of view, radians, in (0, π).
        fov_y: f64,
    },
    /// Parallel.
    Orthographic {
        /// Half the height of the view, world units, above zero.
        half_height: f64,
    },
}

/// A view point. It looks along its local −Z, +Y is up.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Name for messages; may be empty.
    pub name: String,
    /// Camera to world. Rotation and translation; scale is ignored.
    pub transform: DAffine3,
    /// Projection.
    pub projection: Projection,
}

impl Camera {
    /// Checks this camera; `index` serves the message of an unnamed one.
    ///
    /// # Errors
    /// [`Error::InvalidScene`].
    pub fn validate(&self, index: usize) -> Result<(), Error> {
        let error =
            |field: &str, problem: &str| Err(Error::scene("camera", name_or_index(&self.name, index), field, problem));
        if !self.transform.is_finite() {
            return error("transform", "is not finite");
        }
        let determinant = self.transform.matrix3.determinant();
        if determinant == 0.0 || !determinant.is_finite() {
            return error("transform", "is singular; give it three independent axes");
        }
        match self.projection {
            Projection::Perspective { fov_y } if !(fov_y > 0.0 && fov_y < std::f64::consts::PI) => {
                error("fov_y", &format!("is {fov_y}; expected radians between 0 and π"))
            }
            Projection::Orthographic { half_height } if !(half_height > 0.0 && half_height.is_finite()) => {
                error("half_height", &format!("is {half_height}; expected above zero"))
            }
            _ => Ok(()),
        }
    }
}
