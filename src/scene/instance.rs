//! Placed meshes.

use super::name_or_index;
use crate::Error;
use glam::DAffine3;

/// One placement of a mesh with a material.
#[derive(Debug, Clone, PartialEq)]
pub struct Instance {
    /// Name for messages; may be empty.
    pub name: String,
    /// Index into [`Scene::meshes`](super::Scene::meshes).
    pub mesh: usize,
    /// Index into [`Scene::materials`](super::Scene::materials).
    pub material: usize,
    /// Mesh to world, `f64`. Mirroring transforms are fine: the front face follows.
    pub transform: DAffine3,
    /// Whether environment maps show it, and traced photons meet it. Small or far decoration that need not reflect light may
    /// stay out.
    pub in_env_maps: bool,
    /// Whether it blocks direct light.
    pub casts_shadow: bool,
    /// Which surface it is part of, by a number of the host's from 1: light that arrives there is spread over instances of the
    /// same number and no others, if [`PhotonSplatterConfig::keeps_to_surfaces`](crate::pass::PhotonSplatterConfig) says so,
    /// however near they lie and whatever their normals; and irradiance is never interpolated from one to another. 0: no surface in particular, which takes light from all and gives to
    /// all (Larsen 2004, chapter 8).
    pub surface: u16,
}

impl Instance {
    /// A mesh where it was modelled, seen by everything.
    pub fn new(mesh: usize, material: usize) -> Self {
        Self {
            name: String::new(),
            mesh,
            material,
            transform: DAffine3::IDENTITY,
            in_env_maps: true,
            casts_shadow: true,
            surface: 0,
        }
    }

    /// Checks this instance against the lengths of the lists that it refers to.
    ///
    /// # Errors
    /// [`Error::InvalidScene`].
    pub fn validate(&self, index: usize, mesh_count: usize, material_count: usize) -> Result<(), Error> {
        let error = |field: &str, problem: String| {
            Err(Error::scene(
                "instance",
                name_or_index(&self.name, index),
                field,
                problem,
            ))
        };
        if self.mesh >= mesh_count {
            return error("mesh", format!("is {}, but there are {mesh_count} meshes", self.mesh));
        }
        if self.material >= material_count {
            return error(
                "material",
                format!("is {}, but there are {material_count} materials", self.material),
            );
        }
        if !self.transform.is_finite() {
            return error("transform", "is not finite".into());
        }
        Ok(())
    }
}
