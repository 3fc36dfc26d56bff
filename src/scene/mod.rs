//! Layer 1: what a scene is, on the CPU. Nothing here touches the GPU.
//!
//! Lengths are in the host's own unit, radiometric quantities in watts over that unit; transforms are `f64`, so that a
//! scene may stand far from its origin. [`UnitFrame`] maps all of it to the numbers that the GPU sees.

mod bounds;
mod camera;
mod environment;
mod instance;
mod lamp;
mod light;
mod light_sources;
mod material;
mod mesh;
#[cfg(feature = "bvh")]
mod open_surface;
#[cfg(feature = "samples")]
pub mod samples;
mod summary;
mod suns;
mod surface_partition;
mod surface_points;
mod unit_frame;

pub use bounds::{BoundingSphere, SceneBounds};
pub use camera::{Camera, Projection};
pub use environment::EnvironmentImage;
pub use instance::Instance;
pub use lamp::{EmissiveTriangle, Lamp};
pub(crate) use light::one_minus_cos;
pub use light::{Light, LightKind};
pub use light_sources::LightSources;
pub use material::{Material, Texture};
pub use mesh::Mesh;
pub use summary::SceneSummary;
pub use suns::Sun;
pub use surface_partition::SurfacePartition;
pub use surface_points::{SurfacePlace, SurfacePoint};
pub use unit_frame::UnitFrame;

use crate::Error;
use glam::DVec3;

/// A whole scene: meshes, their materials and placements, lights and cameras. References are indices into these lists.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// Triangle meshes.
    pub meshes: Vec<Mesh>,
    /// Surface materials.
    pub materials: Vec<Material>,
    /// Images that materials refer to.
    pub textures: Vec<Texture>,
    /// Images that environment lights refer to.
    pub environments: Vec<EnvironmentImage>,
    /// Placed meshes.
    pub instances: Vec<Instance>,
    /// Light sources without geometry. Emissive materials shine by themselves.
    pub lights: Vec<Light>,
    /// View points.
    pub cameras: Vec<Camera>,
}

impl Scene {
    /// Checks everything that a user can hand in.
    ///
    /// # Errors
    /// [`Error::InvalidScene`] names the first offending mesh, vertex and field; [`Error::InvalidBounds`] if the scene
    /// has triangles but no extent.
    pub fn validate(&self) -> Result<(), Error> {
        for (index, texture) in self.textures.iter().enumerate() {
            texture.validate(index)?;
        }
        for (index, material) in self.materials.iter().enumerate() {
            material.validate(index, self.textures.len())?;
        }
        for (index, image) in self.environments.iter().enumerate() {
            image.validate(index)?;
        }
        for (index, mesh) in self.meshes.iter().enumerate() {
            mesh.validate(index)?;
        }
        for (index, instance) in self.instances.iter().enumerate() {
            instance.validate(index, self.meshes.len(), self.materials.len())?;
        }
        for (index, light) in self.lights.iter().enumerate() {
            light.validate(index)?;
        }
        self.validate_environment_lights()?;
        for (index, camera) in self.cameras.iter().enumerate() {
            camera.validate(index)?;
        }
        if self.triangle_count() > 0 {
            self.bounds()?;
        }
        Ok(())
    }

    /// There is one at most, and its image exists.
    fn validate_environment_lights(&self) -> Result<(), Error> {
        let mut is_second = false;
        for (index, light) in self.lights.iter().enumerate() {
            let LightKind::Environment { image, .. } = light.kind else {
                continue;
            };
            let error = |field: &str, problem: String| {
                Err(Error::scene("light", name_or_index(&light.name, index), field, problem))
            };
            if is_second {
                return error("kind", "is a second environment; expected one at most".into());
            }
            is_second = true;
            let count = self.environments.len();
            if let Some(image) = image.filter(|&i| i >= count) {
                return error("image", format!("is {image}, but there are {count} environment images"));
            }
        }
        Ok(())
    }

    /// [`Light::flux`], and with it the mean of the image that an environment light refers to.
    pub fn flux_of(&self, light: &Light, region_radius: f64) -> DVec3 {
        let image = match light.kind {
            LightKind::Environment { image, .. } => image.and_then(|i| self.environments.get(i)),
            _ => None,
        };
        light.flux(region_radius) * image.map_or(DVec3::ONE, EnvironmentImage::mean)
    }

    /// The image that the environment light refers to, if there is one.
    pub fn environment_image(&self) -> Option<&EnvironmentImage> {
        let index = self.lights.iter().find_map(|light| match light.kind {
            LightKind::Environment { image, .. } => image,
            _ => None,
        });
        index.and_then(|i| self.environments.get(i))
    }

    /// Triangles over all instances.
    pub fn triangle_count(&self) -> usize {
        self.instances
            .iter()
            .filter_map(|i| self.meshes.get(i.mesh))
            .map(|m| m.indices.len() / 3)
            .sum()
    }

    /// World-space bounds of all vertices that a triangle uses.
    ///
    /// # Errors
    /// [`Error::InvalidBounds`] if there is no geometry, it has no extent, or a vertex is not finite;
    /// [`Error::InvalidScene`] for an instance or index that refers to nothing.
    pub fn bounds(&self) -> Result<SceneBounds, Error> {
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let mut is_finite = true;
        for (index, instance) in self.instances.iter().enumerate() {
            instance.validate(index, self.meshes.len(), self.materials.len())?;
            let mesh = &self.meshes[instance.mesh];
            for &vertex in &mesh.indices {
                let Some(&position) = mesh.positions.get(vertex as usize) else {
                    mesh.validate(instance.mesh)?;
                    continue;
                };
                let p = instance
                    .transform
                    .transform_point3(glam::Vec3::from(position).as_dvec3());
                is_finite &= p.is_finite();
                min = min.min(p);
                max = max.max(p);
            }
        }
        SceneBounds::new(min, if is_finite { max } else { DVec3::NAN })
    }
}

/// Name for messages: the item's own, or its index.
pub(crate) fn name_or_index(name: &str, index: usize) -> String {
    if name.is_empty() {
        format!("#{index}")
    } else {
        name.to_owned()
    }
}
