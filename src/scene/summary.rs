//! What a scene holds, in the few numbers that decide which stages it needs.

use super::{BoundingSphere, EmissiveTriangle, Light, Scene, SceneBounds};
use crate::Error;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// Everything that the plan and the unit frame need to know of a scene. A host without a [`Scene`] fills it in by hand.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneSummary {
    /// The region that light should fill. It may be a part of the scene (`docs/plan.md` says what that saves).
    pub bounds: SceneBounds,
    /// Area of all surfaces in it, one side counted, world units squared.
    pub area: f64,
    /// Triangles over all instances.
    pub triangles: usize,
    /// Flux of all lights and emitting surfaces, W, summed over channels.
    pub total_flux: f64,
    /// Lights without geometry, of all kinds.
    pub lights: usize,
    /// Those of them that are environments ([`Light::is_environment`]).
    pub environment_lights: usize,
    /// Lights with an extent, hence a penumbra, environments left out.
    pub lights_with_extent: usize,
    /// What shines with geometry. A host that leaves it empty has emissive surfaces that shine for the eye alone.
    pub emissive_triangles: Vec<EmissiveTriangle>,
    /// Whether any surface reflects light at all.
    pub has_reflecting_surfaces: bool,
    /// Names of emitting materials in use.
    pub emissive: Vec<String>,
    /// Names of metals in use.
    pub metals: Vec<String>,
    /// Names of transmitting materials in use.
    pub dielectrics: Vec<String>,
    /// Around each thing of metal or glass: what caustic photons are aimed at. What a host leaves out casts the caustics of
    /// photons that happen to meet it, or none where others are aimed at.
    pub specular_bounds: Vec<BoundingSphere>,
}

impl SceneSummary {
    /// Checks the numbers, which a host may have filled in by hand, against the lights given with them.
    ///
    /// # Errors
    /// [`Error::InvalidScene`]; [`Error::CountMismatch`] if there are not as many lights, or not as many environments, as it
    /// says.
    pub fn validate(&self, lights: &[Light]) -> Result<(), Error> {
        let error = |field: &str, value: f64| {
            let problem = format!("is {value}; expected finite and above zero");
            Err(Error::scene("summary", "scene", field, problem))
        };
        if !(self.area > 0.0 && self.area.is_finite()) {
            return error("area", self.area);
        }
        if !(self.total_flux >= 0.0 && self.total_flux.is_finite()) {
            return error("total_flux", self.total_flux);
        }
        let is_bad = |t: &EmissiveTriangle| !t.flux().is_finite() || t.radiance.iter().any(|&r| r < 0.0);
        let bad_triangle = self.emissive_triangles.iter().position(is_bad);
        if let Some(index) = bad_triangle {
            let problem = "has corners or a radiance that are not finite, or a negative radiance".to_owned();
            return Err(Error::scene(
                "summary",
                "scene",
                format!("emissive_triangles[{index}]"),
                problem,
            ));
        }
        let is_bad = |b: &BoundingSphere| !(b.center.is_finite() && b.radius >= 0.0 && b.radius.is_finite());
        if let Some(index) = self.specular_bounds.iter().position(is_bad) {
            let problem = "has a centre or a radius that is not finite, or a negative radius".to_owned();
            let field = format!("specular_bounds[{index}]");
            return Err(Error::scene("summary", "scene", field, problem));
        }
        let environments = count_environments(lights);
        for (what, expected, found) in [
            ("lights beside a summary that counted them", self.lights, lights.len()),
            (
                "environment lights beside a summary that counted them",
                self.environment_lights,
                environments,
            ),
        ] {
            if expected != found {
                return Err(Error::CountMismatch { what, expected, found });
            }
        }
        Ok(())
    }

    /// Takes for granted what a host cannot tell of its scene: every surface may reflect, every light may have an extent, there
    /// may be metal and glass anywhere. Nothing is left out then that might be there; `docs/plan.md` says what that costs. What
    /// shines with geometry stays what it is.
    #[must_use]
    pub fn presuming_all(mut self) -> Self {
        let presumed = || vec!["presumed".to_owned()];
        self.has_reflecting_surfaces = true;
        self.lights_with_extent = self.lights - self.environment_lights.min(self.lights);
        for names in [&mut self.metals, &mut self.dielectrics] {
            if names.is_empty() {
                *names = presumed();
            }
        }
        self.specular_bounds = vec![BoundingSphere {
            center: 0.5 * (self.bounds.min + self.bounds.max),
            radius: self.bounds.radius(),
        }];
        self
    }

    /// Reads it off a scene.
    ///
    /// # Errors
    /// As [`Scene::bounds`].
    pub fn of(scene: &Scene) -> Result<Self, Error> {
        let bounds = scene.bounds()?;
        let mut area = 0.0;
        let mut total_flux = 0.0;
        let mut used = vec![false; scene.materials.len()];
        for instance in &scene.instances {
            used[instance.material] = true;
            let own_area = instance_area(scene, instance);
            area += own_area;
            let emission = Vec3::from(scene.materials[instance.material].emission).as_dvec3();
            total_flux += emission.element_sum() * PI * own_area;
        }
        for light in &scene.lights {
            total_flux += scene.flux_of(light, bounds.radius()).element_sum();
        }
        let names = |wanted: fn(&super::Material) -> bool| {
            let in_use = scene
                .materials
                .iter()
                .enumerate()
                .filter(|(i, m)| used[*i] && wanted(m));
            in_use
                .map(|(i, m)| super::name_or_index(&m.name, i))
                .collect::<Vec<_>>()
        };
        Ok(Self {
            bounds,
            area,
            triangles: scene.triangle_count(),
            total_flux,
            lights: scene.lights.len(),
            environment_lights: count_environments(&scene.lights),
            lights_with_extent: scene
                .lights
                .iter()
                .filter(|l| !l.is_environment() && l.has_extent())
                .count(),
            emissive_triangles: EmissiveTriangle::all_of(scene),
            has_reflecting_surfaces: !names(|m| m.base_color.iter().any(|&c| c > 0.0)).is_empty(),
            emissive: names(super::Material::is_emissive),
            metals: names(super::Material::is_metal),
            dielectrics: names(super::Material::is_transmissive),
            specular_bounds: specular_bounds(scene),
        })
    }
}

fn specular_bounds(scene: &Scene) -> Vec<BoundingSphere> {
    let is_specular = |i: &&super::Instance| {
        let material = &scene.materials[i.material];
        material.is_metal() || material.is_transmissive()
    };
    let around = |instance: &super::Instance| {
        let corners = scene.meshes[instance.mesh].positions.iter();
        BoundingSphere::of(corners.map(|&p| instance.transform.transform_point3(Vec3::from(p).as_dvec3())))
    };
    scene.instances.iter().filter(is_specular).filter_map(around).collect()
}

fn count_environments(lights: &[Light]) -> usize {
    lights.iter().filter(|l| l.is_environment()).count()
}

fn instance_area(scene: &Scene, instance: &super::Instance) -> f64 {
    let mesh = &scene.meshes[instance.mesh];
    let corner = |i: u32| -> DVec3 {
        let p = Vec3::from(mesh.positions[i as usize]).as_dvec3();
        instance.transform.transform_point3(p)
    };
    mesh.indices
        .chunks_exact(3)
        .map(|t| {
            let (a, b, c) = (corner(t[0]), corner(t[1]), corner(t[2]));
            0.5 * (b - a).cross(c - a).length()
        })
        .sum()
}

#[cfg(all(test, feature = "samples"))]
mod tests {
    use super::*;
    use crate::scene::samples;

    #[test]
    fn what_cannot_be_told_is_presumed() {
        let scene = samples::cornell(0.0);
        let own = SceneSummary::of(&scene).unwrap();
        let all = own.clone().presuming_all();
        all.validate(&scene.lights).unwrap();
        assert!(own.metals.is_empty() && !all.metals.is_empty() && !all.dielectrics.is_empty());
        assert_eq!((own.lights_with_extent, all.lights_with_extent), (0, 1));
        assert_eq!(all.specular_bounds.len(), 1);
        let (center, radius) = (all.specular_bounds[0].center, all.specular_bounds[0].radius);
        assert!((own.bounds.max - center).length() <= radius * (1.0 + 1e-12));
        assert_eq!((all.area, all.total_flux), (own.area, own.total_flux));
    }
}
