//! Which surface lies open, and which is hidden where parts of a scene stand in one another: no light comes there, and no ray.

use super::{Scene, SurfacePlace};
use crate::bvh_tree::binary_tree;
use crate::halton::radical_inverse;
use glam::{DVec3, Vec3, Vec3A};
use obvhs::bvh2::Bvh2;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;
use std::f64::consts::TAU;

/// Rays from a place on either side.
const RAYS: u32 = 4;

/// How far off its surface a ray starts, over half the scene's diagonal.
const OFF_SURFACE: f32 = 1e-5;

/// The triangles of a scene, for rays that the processor follows.
pub(super) struct OpenSurface {
    tree: Bvh2,
    triangles: Vec<Triangle>,
    center: DVec3,
    radius: f64,
}

impl OpenSurface {
    pub(super) fn new(scene: &Scene) -> Self {
        let corners = || {
            let of_instance = |i: &super::Instance| {
                let transform = i.transform;
                let place = move |p: &[f32; 3]| transform.transform_point3(Vec3::from(*p).as_dvec3());
                scene.meshes[i.mesh].positions.iter().map(place)
            };
            scene.instances.iter().flat_map(of_instance)
        };
        let low = corners().reduce(DVec3::min).unwrap_or_default();
        let high = corners().reduce(DVec3::max).unwrap_or_default();
        let (center, radius) = (0.5 * (low + high), (0.5 * (high - low).length()).max(f64::MIN_POSITIVE));
        let mut triangles = Vec::with_capacity(scene.triangle_count());
        for instance in &scene.instances {
            let mesh = &scene.meshes[instance.mesh];
            let is_mirrored = instance.transform.matrix3.determinant() < 0.0;
            for t in mesh.indices.chunks_exact(3) {
                let [a, b, c] = [0, 1, 2].map(|k| {
                    let p = Vec3::from(mesh.positions[t[k] as usize]).as_dvec3();
                    Vec3A::from(((instance.transform.transform_point3(p) - center) / radius).as_vec3())
                });
                let (v1, v2) = if is_mirrored { (c, b) } else { (b, c) };
                triangles.push(Triangle { v0: a, v1, v2 });
            }
        }
        Self {
            tree: binary_tree(triangles.iter().map(Triangle::aabb)),
            triangles,
            center,
            radius,
        }
    }

    /// Whether the surface at a place lies open on the side of its normal, and on the other: at least half of some rays do not
    /// meet backs of triangles. `index` chooses the rays.
    pub(super) fn is_open(&self, place: &SurfacePlace, index: u32) -> [bool; 2] {
        let p = ((place.position - self.center) / self.radius).as_vec3();
        [1.0, -1.0].map(|side| {
            let normal = (side * place.normal).as_vec3();
            let meets_back = |ray: &u32| {
                let number = RAYS * index + ray + 1;
                self.meets_back(p + OFF_SURFACE * normal, as_dense_as_the_cosine(normal, number))
            };
            2 * (0..RAYS).filter(meets_back).count() as u32 <= RAYS
        })
    }

    fn meets_back(&self, origin: Vec3, direction: Vec3) -> bool {
        let mut nearest = RayHit::none();
        let order = &self.tree.primitive_indices;
        let ray = Ray::new_inf(origin.into(), direction.into());
        self.tree.ray_traverse(ray, &mut nearest, |ray, i| {
            self.triangles[order[i] as usize].intersect(ray)
        });
        let hit = order.get(nearest.primitive_id as usize);
        nearest.t.is_finite()
            && nearest.t < 1e30
            && hit.is_some_and(|&index| {
                let t = &self.triangles[index as usize];
                (t.v1 - t.v0).cross(t.v2 - t.v0).dot(direction.into()) > 0.0
            })
    }
}

/// A direction of the Halton sequence.
fn as_dense_as_the_cosine(normal: Vec3, number: u32) -> Vec3 {
    let [u, v] = [2, 3].map(|base| radical_inverse(number, base));
    let (x, y) = normal.any_orthonormal_pair();
    let (sin, cos) = (TAU * v).sin_cos();
    let (r, height) = (u.sqrt(), (1.0 - u).sqrt());
    (r * cos) as f32 * x + (r * sin) as f32 * y + height as f32 * normal
}
