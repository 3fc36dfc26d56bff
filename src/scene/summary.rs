//! What a scene holds, in the few numbers that decide which stages it needs.

use super::{BoundingSphere, EmissiveTriangle, Instance, Light, Scene, SceneBounds};
use crate::Error;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// Everything that the plan and the unit frame need to know of a scene. A host without a [`Scene`] fills it in by hand.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneSummary {
    /// The region that light should fill. It may be a part of the scene (`docs/plan.md` says what that saves).
    pub bounds: SceneBounds,
    /// Whether it leaves something out. Nothing but the plan's text depends on it.
    pub is_part: bool,
    /// Area of all surfaces in it, one side counted, world units squared.
    pub area: f64,
    /// Triangles over all instances.
    pub triangles: usize,
    /// Instances that environment maps do not show, and traced photons pass through ([`Instance::in_env_maps`]), wherever they
    /// stand. It is the geometry that leaves them out, the plan only says so; as it does of the next.
    pub out_of_env_maps: usize,
    /// Instances without a shadow ([`Instance::casts_shadow`]).
    pub without_shadow: usize,
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
        let mut used = vec![false; scene.materials.len()];
        for instance in &scene.instances {
            used[instance.material] = true;
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
        let count = |is: fn(&Instance) -> bool| scene.instances.iter().filter(|i| is(i)).count();
        Ok(Self {
            bounds,
            is_part: false,
            area: scene.instances.iter().map(|i| instance_area(scene, i)).sum(),
            triangles: scene.triangle_count(),
            out_of_env_maps: count(|i| !i.in_env_maps),
            without_shadow: count(|i| !i.casts_shadow),
            total_flux: flux(scene, bounds.radius()),
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

    /// Reads it off a scene of which light should fill a part: photons of suns start over it alone, environment maps stand in
    /// it, kernels are as wide as the area of what lies in it says, and caustic photons are aimed at what is in it. What is
    /// counted or named is that of the whole scene: light comes from there.
    ///
    /// # Errors
    /// As [`Scene::bounds`]; [`Error::InvalidScene`] if there is no surface in it.
    pub fn of_part(scene: &Scene, part: SceneBounds) -> Result<Self, Error> {
        let whole = Self::of(scene)?;
        let area_within = |t: [DVec3; 3]| clipped_area(&t, &part);
        let area = scene
            .instances
            .iter()
            .flat_map(|i| triangles(scene, i))
            .map(area_within)
            .sum();
        if area <= 0.0 {
            let problem = format!("from {} to {} holds no surface of the scene", part.min, part.max);
            return Err(Error::scene("summary", "scene", "part", problem));
        }
        let meets = |ball: &BoundingSphere| ball.center.clamp(part.min, part.max).distance(ball.center) <= ball.radius;
        Ok(Self {
            bounds: part,
            is_part: part.min.cmpgt(whole.bounds.min).any() || part.max.cmplt(whole.bounds.max).any(),
            area,
            total_flux: flux(scene, part.radius()),
            specular_bounds: whole.specular_bounds.iter().copied().filter(meets).collect(),
            ..whole
        })
    }
}

/// W, over channels, of all that shines, suns over a region of this radius.
fn flux(scene: &Scene, radius: f64) -> f64 {
    let of_surface = |instance: &Instance| {
        let emission = Vec3::from(scene.materials[instance.material].emission).as_dvec3();
        emission.element_sum() * PI * instance_area(scene, instance)
    };
    let of_surfaces: f64 = scene.instances.iter().map(of_surface).sum();
    let of_light = |light| scene.flux_of(light, radius).element_sum();
    scene
        .lights
        .iter()
        .map(of_light)
        .fold(of_surfaces, |sum, own| sum + own)
}

fn specular_bounds(scene: &Scene) -> Vec<BoundingSphere> {
    let is_specular = |i: &&Instance| {
        let material = &scene.materials[i.material];
        material.is_metal() || material.is_transmissive()
    };
    let around = |instance: &Instance| {
        let corners = scene.meshes[instance.mesh].positions.iter();
        BoundingSphere::of(corners.map(|&p| instance.transform.transform_point3(Vec3::from(p).as_dvec3())))
    };
    scene.instances.iter().filter(is_specular).filter_map(around).collect()
}

fn count_environments(lights: &[Light]) -> usize {
    lights.iter().filter(|l| l.is_environment()).count()
}

fn instance_area(scene: &Scene, instance: &Instance) -> f64 {
    triangles(scene, instance).map(|t| polygon_area(&t)).sum()
}

/// Corners in world space.
fn triangles<'a>(scene: &'a Scene, instance: &'a Instance) -> impl Iterator<Item = [DVec3; 3]> + 'a {
    let mesh = &scene.meshes[instance.mesh];
    let corner = |i: u32| {
        let p = Vec3::from(mesh.positions[i as usize]).as_dvec3();
        instance.transform.transform_point3(p)
    };
    mesh.indices
        .chunks_exact(3)
        .map(move |t| [t[0], t[1], t[2]].map(corner))
}

/// Of a flat, convex one.
fn polygon_area(corners: &[DVec3]) -> f64 {
    let cross = |pair: &[DVec3]| (pair[0] - corners[0]).cross(pair[1] - corners[0]);
    let [_, rest @ ..] = corners else { return 0.0 };
    0.5 * rest.windows(2).map(cross).sum::<DVec3>().length()
}

/// Of what lies in a box: cut at one face after the other (Sutherland and Hodgman 1974).
fn clipped_area(triangle: &[DVec3; 3], bounds: &SceneBounds) -> f64 {
    let [a, b, c] = *triangle;
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    if low.cmpgt(bounds.max).any() || high.cmplt(bounds.min).any() {
        return 0.0;
    }
    if low.cmpge(bounds.min).all() && high.cmple(bounds.max).all() {
        return polygon_area(triangle);
    }
    let mut polygon = triangle.to_vec();
    for axis in 0..3 {
        for (face, sign) in [(bounds.min[axis], 1.0), (bounds.max[axis], -1.0)] {
            let depth = |p: DVec3| sign * (p[axis] - face);
            let mut kept = Vec::with_capacity(polygon.len() + 1);
            for (i, &to) in polygon.iter().enumerate() {
                let from = polygon[(i + polygon.len() - 1) % polygon.len()];
                let (a, b) = (depth(from), depth(to));
                if (a < 0.0) != (b < 0.0) {
                    kept.push(from + (to - from) * (a / (a - b)));
                }
                if b >= 0.0 {
                    kept.push(to);
                }
            }
            polygon = kept;
        }
    }
    polygon_area(&polygon)
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

    #[test]
    fn a_part_has_the_area_within_it_and_what_is_specular_there() {
        let scene = samples::glass_sphere(0.0);
        let whole = SceneSummary::of(&scene).unwrap();
        let of = |min: DVec3, max: DVec3| SceneSummary::of_part(&scene, SceneBounds::new(min, max).unwrap());
        let (min, max) = (whole.bounds.min, whole.bounds.max);
        let all = of(min, max).unwrap();
        assert!(!all.is_part && (all.area / whole.area - 1.0).abs() < 1e-12);
        assert_eq!(all.specular_bounds.len(), 1);
        // Two parts have all of the area between them.
        let middle = whole.specular_bounds[0].center.x - 1.01 * whole.specular_bounds[0].radius;
        let [left, right] = [
            of(min, max.with_x(middle)).unwrap(),
            of(min.with_x(middle), max).unwrap(),
        ];
        assert!(left.is_part && right.is_part);
        assert!(((left.area + right.area) / whole.area - 1.0).abs() < 1e-12);
        assert_eq!([left.specular_bounds.len(), right.specular_bounds.len()], [0, 1]);
        let error = of(max + 1.0, max + 2.0).unwrap_err().to_string();
        assert!(error.contains("no surface"), "{error}");
    }

    #[test]
    fn triangles_are_cut_at_a_box() {
        let unit = SceneBounds::new(DVec3::ZERO, DVec3::ONE).unwrap();
        let area = |corners: [[f64; 3]; 3]| clipped_area(&corners.map(DVec3::from), &unit);
        // All of the square, as it lies in the triangle; the half of it beside a diagonal; a triangle inside; none.
        for (corners, expected) in [
            ([[-3.0, 0.5, -3.0], [9.0, 0.5, -3.0], [-3.0, 0.5, 9.0]], 1.0),
            ([[-1.0, 0.5, -1.0], [2.0, 0.5, -1.0], [-1.0, 0.5, 2.0]], 0.5),
            ([[0.1, 0.2, 0.1], [0.4, 0.2, 0.1], [0.1, 0.6, 0.1]], 0.06),
            ([[2.0, 0.5, 0.0], [3.0, 0.5, 0.0], [2.0, 0.5, 1.0]], 0.0),
        ] {
            assert!((area(corners) - expected).abs() < 1e-12, "{corners:?}");
        }
    }
}
