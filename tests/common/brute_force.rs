//! Rays against every triangle, in `f64`.

use lightfall::glam::{DVec3, Vec3};
use lightfall::resource::Ray;
use lightfall::scene::{Scene, UnitFrame};

/// A triangle in the unit frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Triangle {
    pub(crate) instance: u32,
    /// Number in its mesh.
    pub(crate) index: u32,
    pub(crate) corners: [DVec3; 3],
}

impl Triangle {
    /// Unit normal; zero without area.
    pub(crate) fn normal(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// Where a ray meets it (Möller and Trumbore 1997).
    pub(crate) fn meets(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let [a, b, c] = self.corners;
        let (ab, ac) = (b - a, c - a);
        let across = direction.cross(ac);
        let determinant = ab.dot(across);
        let u = (origin - a).dot(across) / determinant;
        let along = (origin - a).cross(ab);
        let v = direction.dot(along) / determinant;
        let t = ac.dot(along) / determinant;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some(t)
    }

    /// How far a point is from it.
    pub(crate) fn distance(&self, p: DVec3) -> f64 {
        let [a, b, c] = self.corners;
        let n = self.normal();
        let is_over = [(a, b), (b, c), (c, a)]
            .into_iter()
            .all(|(from, to)| (to - from).cross(p - from).dot(n) >= 0.0);
        if is_over && n != DVec3::ZERO {
            return (p - a).dot(n).abs();
        }
        self.distance_to_edges(p, p)
    }

    /// How far a segment passes from the nearest of its edges.
    pub(crate) fn distance_to_edges(&self, from: DVec3, to: DVec3) -> f64 {
        let [a, b, c] = self.corners;
        [(a, b), (b, c), (c, a)]
            .into_iter()
            .map(|(p, q)| segment_distance((from, to), (p, q)))
            .fold(f64::INFINITY, f64::min)
    }
}

/// All triangles of a scene.
pub(crate) fn triangles(scene: &Scene, frame: &UnitFrame) -> Vec<Triangle> {
    let mut all = Vec::new();
    for (instance, placed) in (0..).zip(&scene.instances) {
        let mesh = &scene.meshes[placed.mesh];
        let corner = |&vertex: &u32| {
            let p = Vec3::from(mesh.positions[vertex as usize]).as_dvec3();
            (placed.transform.transform_point3(p) - frame.center()) / frame.length_scale()
        };
        for (index, t) in (0..).zip(mesh.indices.chunks_exact(3)) {
            all.push(Triangle {
                instance,
                index,
                corners: [corner(&t[0]), corner(&t[1]), corner(&t[2])],
            });
        }
    }
    all
}

/// What each ray hits first: distance in lengths of its direction, and the triangle.
pub(crate) fn closest(triangles: &[Triangle], rays: &[Ray]) -> Vec<Option<(f64, Triangle)>> {
    let first_hit = |ray: &Ray| {
        let (o, d) = ends(ray);
        let met = triangles
            .iter()
            .filter_map(|t| t.meets(o, d).map(|distance| (distance, *t)));
        met.filter(|(t, _)| *t <= f64::from(ray.furthest))
            .min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let share = rays.len().div_ceil(threads).max(1);
    std::thread::scope(|scope| {
        let run = |part: &'_ [Ray]| part.iter().map(first_hit).collect::<Vec<_>>();
        let running: Vec<_> = rays.chunks(share).map(|part| scope.spawn(move || run(part))).collect();
        running.into_iter().flat_map(|r| r.join().unwrap()).collect()
    })
}

/// Origin and direction.
pub(crate) fn ends(ray: &Ray) -> (DVec3, DVec3) {
    (Vec3::from(ray.origin).as_dvec3(), Vec3::from(ray.direction).as_dvec3())
}

/// Distance of two segments, either of which may be a point.
fn segment_distance((p1, q1): (DVec3, DVec3), (p2, q2): (DVec3, DVec3)) -> f64 {
    let (d1, d2) = (q1 - p1, q2 - p2);
    // Of the nearest points of the two lines if they are within both segments, else an end is one of the nearest points.
    let n = d1.cross(d2);
    let between = p2 - p1;
    let s = between.cross(d2).dot(n) / n.length_squared();
    let t = between.cross(d1).dot(n) / n.length_squared();
    if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
        return between.dot(n).abs() / n.length();
    }
    #[expect(clippy::manual_clamp, reason = "clamp would keep what is not a number")]
    let to_end = |p: DVec3, from: DVec3, along: DVec3| {
        let part = (p - from).dot(along) / along.length_squared();
        // Not a number for a point, which maximum turns into its place.
        p.distance(from + part.max(0.0).min(1.0) * along)
    };
    [
        to_end(p1, p2, d2),
        to_end(q1, p2, d2),
        to_end(p2, p1, d1),
        to_end(q2, p1, d1),
    ]
    .into_iter()
    .fold(f64::INFINITY, f64::min)
}
