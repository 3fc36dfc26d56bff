//! Points that stand for the surface around them.

use super::{Instance, Mesh, Scene, SurfacePartition};
use crate::halton::radical_inverse;
use glam::{DAffine3, DMat3, DVec3, Vec3};

/// Share of a triangle's extent that points are placed in, around its centroid: they stay away from its edges.
const SHRUNK: f64 = 0.9;

/// Points that are placed at first and removed again, over those that stay. With the paper's tenth, closest points lie half as
/// far apart as darts of the same number; with three times as many, 0.8 of it; five times gain a hundredth more.
const TOO_MANY: f64 = 3.0;

/// No more than so many, and the paper's tenth: time grows as the square.
const MOST_TOO_MANY: usize = 3000;

/// Samples that the area around a point is taken from.
const SAMPLES_A_CELL: f64 = 256.0;

/// No more of an instance.
const MOST_SAMPLES: u32 = 1 << 20;

/// The least area of a point, as a share of the mean.
const LEAST_CELL: f64 = 0.02;

/// The least share of the surface around a point that lies open on a side, or the point keeps no light on it.
const LEAST_OPEN: f64 = 0.25;

/// What an angle costs where no point faces the same way, over the square of the scene's scale: about as in
/// `shaders/common/nearest_surface_light.wgsl`.
const APART: f64 = 64.0;

/// Twins of `SAME_WAY` and `OFF_PLANE` in `shaders/common/nearest_surface_light.wgsl`.
const SAME_WAY: f64 = 0.5;
const OFF_PLANE: f64 = 30.0;

/// A point of a surface, fixed to its instance, and how much surface it stands for. Placed once; moves with the instance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Index of the instance.
    pub instance: usize,
    /// Mesh space.
    pub position: Vec3,
    /// Normal of the triangle that it lies on, on its front; mesh space, unit.
    pub normal: Vec3,
    /// World units squared, on its front and on its back: what lies nearer to it than to others, from samples, to some
    /// hundredths; of what lies open, where they were placed in a still scene. 0: no light is kept there.
    pub areas: [f64; 2],
    /// As in [`SurfacePlace`]: numbers of the parts of instances that have no sharp edges ([`SurfacePartition`]).
    pub surface: u32,
}

impl SurfacePoint {
    /// Places `count` points on a scene, as evenly as may be, away from the edges of triangles, and at least one on each
    /// instance that has an area: with more such instances than `count`, as many as instances. Deterministic. Takes time in
    /// proportion to the triangles and to `count` squared, and for 256 samples of the surface of each.
    ///
    /// Source: photon streaming with virtual surface lights, section 0.4.2 and Algorithm 1: points are placed in shrunk
    /// triangles by area, too many, and of the two that lie closest the one whose second neighbour is closer goes, until
    /// `count` are left. Changes: four times as many instead of a tenth more, up to 3000; places come from the Halton sequence
    /// instead of at random; points that face apart, as on both sides of a wall, are no neighbours; the last point of an
    /// instance stays.
    pub fn place(scene: &Scene, count: usize) -> Vec<Self> {
        Self::place_where(scene, count, |_, _| [true; 2])
    }

    /// The same for a scene whose parts stay where they are: surface that is hidden where these stand in one another has no
    /// area, so that a texel or a light holds what falls on the open surface around it alone. A side of a place is hidden where
    /// three of four rays from there meet the backs of triangles: of solids, that is, whose fronts face outward. Where what
    /// hides a place moves away, or is a single sheet, use [`SurfacePoint::place`], which takes all surface for open. Takes as
    /// long again, and two thousand rays a point that the processor follows.
    #[cfg(feature = "bvh")]
    pub fn place_in_still_scene(scene: &Scene, count: usize) -> Vec<Self> {
        let surface = super::open_surface::OpenSurface::new(scene);
        Self::place_where(scene, count, |place, index| surface.is_open(place, index))
    }

    /// `is_open`: whether a place lies open on the side of its normal, and on the other; a number chooses how it is looked for.
    fn place_where(scene: &Scene, count: usize, is_open: impl Fn(&SurfacePlace, u32) -> [bool; 2]) -> Vec<Self> {
        let mut sampled: Vec<_> = scene
            .instances
            .iter()
            .map(|i| SampledInstance::new(&scene.meshes[i.mesh], i))
            .collect();
        let mut next = 0;
        for own in &mut sampled {
            own.first_surface = next;
            next += own.surfaces.count() as u32;
        }
        let most = count + ((TOO_MANY * count as f64) as usize).min(MOST_TOO_MANY + count / 10);
        let mut placed = Vec::new();
        for (instance, number) in quotas(&sampled, most).into_iter().enumerate() {
            let sampled = &sampled[instance];
            placed.extend((0..number).map(|i| sampled.point(instance, i as u32 + 1, SHRUNK)));
        }
        thin_out(&mut placed, count);
        let areas = cell_areas(&sampled, &placed, is_open);
        let measured = |(p, areas): (Placed, [f64; 2])| Self { areas, ..p.point };
        placed.into_iter().zip(areas).map(measured).collect()
    }

    /// Where it is in the world, under its instance's transform.
    pub fn in_world(&self, transform: &DAffine3) -> SurfacePlace {
        let normals = normal_matrix(&transform.matrix3);
        SurfacePlace {
            position: transform.transform_point3(self.position.as_dvec3()),
            normal: (normals * self.normal.as_dvec3()).normalize_or(DVec3::Y),
            areas: self.areas,
            surface: self.surface,
        }
    }
}

/// Where a point stands, and for how much surface: world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePlace {
    /// World units.
    pub position: DVec3,
    /// Unit.
    pub normal: DVec3,
    /// World units squared, on the side of the normal and on the other. 0: no light is kept there.
    pub areas: [f64; 2],
    /// Which surface it is on: places of the same number are updated together where light is kept
    /// ([`IlluminationMap`](crate::resource::IlluminationMap)).
    pub surface: u32,
}

/// Cofactors: what takes normals along.
fn normal_matrix(m: &DMat3) -> DMat3 {
    DMat3::from_cols(
        m.y_axis.cross(m.z_axis),
        m.z_axis.cross(m.x_axis),
        m.x_axis.cross(m.y_axis),
    )
}

/// An instance's triangles by area.
struct SampledInstance<'a> {
    mesh: &'a Mesh,
    surfaces: SurfacePartition,
    /// The number of the first of its surfaces.
    first_surface: u32,
    transform: DAffine3,
    /// World area up to and with each triangle.
    until: Vec<f64>,
    area: f64,
}

/// A point and where it is in the world.
struct Placed {
    point: SurfacePoint,
    place: SurfacePlace,
}

impl<'a> SampledInstance<'a> {
    fn new(mesh: &'a Mesh, instance: &Instance) -> Self {
        let mut area = 0.0;
        let corners = |t: &[u32]| [0, 1, 2].map(|i| DVec3::from(Vec3::from(mesh.positions[t[i] as usize])));
        let until = mesh
            .indices
            .chunks_exact(3)
            .map(|t| {
                let [a, b, c] = corners(t).map(|p| instance.transform.transform_point3(p));
                let own = 0.5 * (b - a).cross(c - a).length();
                area += if own.is_finite() { own } else { 0.0 };
                area
            })
            .collect();
        Self {
            mesh,
            surfaces: SurfacePartition::of(mesh, &instance.transform.matrix3, SurfacePartition::CREASE),
            first_surface: 0,
            transform: instance.transform,
            until,
            area,
        }
    }

    /// The i-th of its points, in triangles shrunk to so much of their extent.
    fn point(&self, instance: usize, i: u32, extent: f64) -> Placed {
        let [u, v, w] = [2, 3, 5].map(|base| radical_inverse(i, base));
        let at = u * self.area;
        let triangle = self
            .until
            .partition_point(|&until| until <= at)
            .min(self.until.len() - 1);
        let corner = |k: usize| {
            DVec3::from(Vec3::from(
                self.mesh.positions[self.mesh.indices[3 * triangle + k] as usize],
            ))
        };
        let [a, b, c] = [corner(0), corner(1), corner(2)];
        let middle = (a + b + c) / 3.0;
        let root = v.sqrt();
        let within = (1.0 - root) * a + root * (1.0 - w) * b + root * w * c;
        let point = SurfacePoint {
            instance,
            position: (middle + extent * (within - middle)).as_vec3(),
            normal: (b - a).cross(c - a).normalize_or(DVec3::Y).as_vec3(),
            areas: [0.0; 2],
            surface: self.first_surface + self.surfaces.of_triangles()[triangle],
        };
        Placed {
            point,
            place: point.in_world(&self.transform),
        }
    }
}

/// How much open surface lies nearer to each point than to any other that faces the same way, as surface lights see it, on its
/// front and on its back: from a number of samples for each point, spread by area. Of points that are mostly hidden on a side,
/// what lies open around goes to others.
fn cell_areas(
    instances: &[SampledInstance<'_>],
    placed: &[Placed],
    is_open: impl Fn(&SurfacePlace, u32) -> [bool; 2],
) -> Vec<[f64; 2]> {
    let total: f64 = instances.iter().map(|i| i.area).sum();
    if placed.is_empty() || total <= 0.0 {
        return vec![[0.0; 2]; placed.len()];
    }
    let mut samples = Vec::new();
    for (index, instance) in instances.iter().enumerate() {
        let share = instance.area / total * placed.len() as f64;
        let count = ((SAMPLES_A_CELL * share).ceil() as u32).min(MOST_SAMPLES);
        samples.extend((0..count).map(|i| {
            let place = instance.point(index, i + 1, 1.0).place;
            let area = instance.area / f64::from(count);
            Sample {
                areas: is_open(&place, i).map(|open| if open { area } else { 0.0 }),
                area,
                place,
            }
        }));
    }
    // Sides by the signs of normals: all of them, then those that are open.
    let cells = Cells::new(placed, (total / placed.len() as f64).sqrt());
    let mut all = vec![[0.0; 2]; placed.len()];
    let mut open = all.clone();
    let kept = vec![[true; 2]; placed.len()];
    for sample in &samples {
        for side in [0, 1] {
            let (point, own) = cells.nearest(placed, &kept, (&sample.place, side));
            all[point][own] += sample.area;
            open[point][own] += sample.areas[side];
        }
    }
    let is_kept = |(all, open): (&[f64; 2], &[f64; 2])| [0, 1].map(|s| open[s] >= LEAST_OPEN * all[s]);
    let kept: Vec<_> = all.iter().zip(&open).map(is_kept).collect();
    // Where all are, samples belong to the same points again.
    let mut areas = open;
    if kept.iter().flatten().any(|is_kept| !is_kept) {
        areas.fill([0.0; 2]);
        for sample in &samples {
            for side in [0, 1] {
                let (point, own) = cells.nearest(placed, &kept, (&sample.place, side));
                areas[point][own] += sample.areas[side];
            }
        }
    }
    // A point between others has a little, not nothing, unless it is hidden.
    let least = LEAST_CELL * total / placed.len() as f64;
    for (areas, kept) in areas.iter_mut().zip(&kept) {
        (0..2)
            .filter(|&side| kept[side])
            .for_each(|side| areas[side] = areas[side].max(least));
    }
    areas
}

/// A place on a surface, how much surface it stands for, and how much of that lies open on either side.
struct Sample {
    place: SurfacePlace,
    area: f64,
    areas: [f64; 2],
}

fn cell_of(position: DVec3, side: f64) -> [i64; 3] {
    (position / side).floor().to_array().map(|v| v as i64)
}

/// Points by cells of space.
struct Cells {
    side: f64,
    points: std::collections::HashMap<[i64; 3], Vec<usize>>,
}

impl Cells {
    fn new(placed: &[Placed], side: f64) -> Self {
        let mut points = std::collections::HashMap::<_, Vec<_>>::new();
        for (index, p) in placed.iter().enumerate() {
            points.entry(cell_of(p.place.position, side)).or_default().push(index);
        }
        Self { side, points }
    }

    /// The point, and its side, that is nearest to a side of a place and faces the same way, of those that are kept; distances
    /// off the place's plane counted as surface lights do. Where none does, the nearest that faces least apart.
    fn nearest(&self, placed: &[Placed], kept: &[[bool; 2]], (own, side): (&SurfacePlace, usize)) -> (usize, usize) {
        let cost = |point: usize| {
            let away = placed[point].place.position - own.position;
            away.length_squared() + OFF_PLANE * away.dot(own.normal).powi(2)
        };
        let cosine = |point: usize| placed[point].place.normal.dot(own.normal);
        // Of the two sides of a point the one that faces the same way.
        let facing_side = |point: usize| if cosine(point) < 0.0 { 1 - side } else { side };
        let faces = |point: &usize| cosine(*point).abs() >= SAME_WAY && kept[*point][facing_side(*point)];
        let nearer = |a: &usize, b: &usize| cost(*a).total_cmp(&cost(*b));
        let middle = cell_of(own.position, self.side);
        for rings in 1..=3i64 {
            let width = 2 * rings + 1;
            let around = (0..width.pow(3)).map(|i| {
                let offset = [i % width, i / width % width, i / width.pow(2)];
                [0, 1, 2].map(|axis: usize| middle[axis] + offset[axis] - rings)
            });
            let near = around.filter_map(|cell| self.points.get(&cell)).flatten().copied();
            let found = near.filter(|p| faces(p)).min_by(nearer);
            // Whatever lies in other cells is this far away at least.
            let reach = (rings as f64 * self.side).powi(2);
            if let Some(found) = found.filter(|f| cost(*f) <= reach) {
                return (found, facing_side(found));
            }
        }
        if let Some(found) = (0..placed.len()).filter(faces).min_by(nearer) {
            return (found, facing_side(found));
        }
        let sides = (0..placed.len()).flat_map(|point| [(point, 0), (point, 1)]);
        let apart = |&(point, s): &(usize, usize)| {
            let away = placed[point].place.position.distance_squared(own.position);
            let cosine = if s == side { cosine(point) } else { -cosine(point) };
            away + APART * (1.0 - cosine)
        };
        let kept = sides.filter(|&(point, s)| kept[point][s]);
        kept.min_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap_or((0, side))
    }
}

/// How many points each instance has: by area, those cut off largest first; at least one where there is an area.
fn quotas(instances: &[SampledInstance<'_>], most: usize) -> Vec<usize> {
    let total: f64 = instances.iter().map(|i| i.area).sum();
    if total <= 0.0 {
        return vec![0; instances.len()];
    }
    let wanted: Vec<f64> = instances.iter().map(|i| most as f64 * i.area / total).collect();
    let least = |i: usize| usize::from(instances[i].area > 0.0);
    let mut numbers: Vec<usize> = (0..wanted.len())
        .map(|i| (wanted[i].floor() as usize).max(least(i)))
        .collect();
    let mut by_rest: Vec<usize> = (0..wanted.len()).collect();
    by_rest.sort_by(|&a, &b| wanted[b].fract().total_cmp(&wanted[a].fract()));
    let mut left = most.saturating_sub(numbers.iter().sum());
    for i in by_rest {
        if left > 0 && wanted[i] > numbers[i] as f64 {
            numbers[i] += 1;
            left -= 1;
        }
    }
    numbers
}

/// The two nearest neighbours of a point: squared distance and index.
#[derive(Clone, Copy)]
struct Neighbours([(f64, usize); 2]);

impl Neighbours {
    fn of(placed: &[Placed], is_left: &[bool], own: usize) -> Self {
        let mut nearest = Self([(f64::INFINITY, usize::MAX); 2]);
        for (other, point) in placed.iter().enumerate() {
            if other == own || !is_left[other] || placed[own].place.normal.dot(point.place.normal) <= 0.0 {
                continue;
            }
            let distance = placed[own].place.position.distance_squared(point.place.position);
            if distance < nearest.0[0].0 {
                nearest.0 = [(distance, other), nearest.0[0]];
            } else if distance < nearest.0[1].0 {
                nearest.0[1] = (distance, other);
            }
        }
        nearest
    }

    fn has(&self, point: usize) -> bool {
        self.0.iter().any(|n| n.1 == point)
    }
}

/// Removes points that lie close to others, until so many are left or only last ones of instances are.
fn thin_out(placed: &mut Vec<Placed>, count: usize) {
    let mut is_left = vec![true; placed.len()];
    let mut on_instance = std::collections::BTreeMap::new();
    for p in placed.iter() {
        *on_instance.entry(p.point.instance).or_insert(0usize) += 1;
    }
    let mut neighbours: Vec<_> = (0..placed.len()).map(|i| Neighbours::of(placed, &is_left, i)).collect();
    let mut number = placed.len();
    while number > count {
        // Of a closest pair both have the same first distance: the second one decides.
        let may_go = |i: &usize| is_left[*i] && on_instance[&placed[*i].point.instance] > 1;
        let distances = |i: usize| neighbours[i].0.map(|n| n.0);
        let closest = (0..placed.len()).filter(may_go).min_by(|&a, &b| {
            let ([a1, a2], [b1, b2]) = (distances(a), distances(b));
            a1.total_cmp(&b1).then(a2.total_cmp(&b2))
        });
        let Some(gone) = closest else { break };
        is_left[gone] = false;
        number -= 1;
        if let Some(rest) = on_instance.get_mut(&placed[gone].point.instance) {
            *rest -= 1;
        }
        for i in 0..placed.len() {
            if is_left[i] && neighbours[i].has(gone) {
                neighbours[i] = Neighbours::of(placed, &is_left, i);
            }
        }
    }
    let mut left = is_left.into_iter();
    placed.retain(|_| left.next().unwrap_or(false));
}

#[cfg(all(test, feature = "samples"))]
mod tests {
    use super::*;
    use crate::scene::samples;

    fn world(scene: &Scene, points: &[SurfacePoint]) -> Vec<SurfacePlace> {
        points
            .iter()
            .map(|p| p.in_world(&scene.instances[p.instance].transform))
            .collect()
    }

    /// Distance to the nearest that faces the same way.
    fn nearest(places: &[SurfacePlace], own: &SurfacePlace) -> f64 {
        let others = places.iter().filter(|o| *o != own && o.normal.dot(own.normal) > 0.0);
        others
            .map(|o| o.position.distance(own.position))
            .fold(f64::INFINITY, f64::min)
    }

    /// The smallest and the mean of those distances.
    fn spacing(places: &[SurfacePlace]) -> (f64, f64) {
        let all: Vec<f64> = places.iter().map(|p| nearest(places, p)).collect();
        let all: Vec<f64> = all.into_iter().filter(|d| d.is_finite()).collect();
        let least = all.iter().copied().fold(f64::INFINITY, f64::min);
        (least, all.iter().sum::<f64>() / all.len() as f64)
    }

    /// Places at random, by area, for ever.
    fn at_random(scene: &Scene) -> impl FnMut() -> SurfacePlace {
        let sampled: Vec<_> = scene
            .instances
            .iter()
            .map(|i| SampledInstance::new(&scene.meshes[i.mesh], i))
            .collect();
        let total: f64 = sampled.iter().map(|s| s.area).sum();
        let mut word = 12345u64;
        let mut random = move || {
            word = word
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (word >> 33) as f64 / (1u64 << 31) as f64
        };
        move || {
            let mut at = random() * total;
            let own = sampled.iter().position(|s| {
                at -= s.area;
                at < 0.0
            });
            let own = own.unwrap_or(0);
            sampled[own].point(own, (random() * 1e6) as u32, SHRUNK).place
        }
    }

    /// As many places as that at random, none nearer to another than a radius that shrinks when a thousand tries fail.
    fn by_darts(scene: &Scene, count: usize) -> Vec<SurfacePlace> {
        let mut random = at_random(scene);
        let (mut places, mut radius, mut failed) = (Vec::new(), 10.0, 0);
        while places.len() < count {
            let place = random();
            if nearest(&places, &place) >= radius {
                places.push(place);
                failed = 0;
            } else {
                failed += 1;
            }
            if failed == 1000 {
                (radius, failed) = (0.97 * radius, 0);
            }
        }
        places
    }

    #[test]
    fn points_are_spread_more_evenly_than_at_random() {
        let scenes = [("cornell", samples::cornell(0.0)), ("pillars", samples::pillars(0.0))];
        for (name, scene) in scenes {
            let points = SurfacePoint::place(&scene, 200);
            assert_eq!(points.len(), 200, "{name}");
            let (least, mean) = spacing(&world(&scene, &points));
            let mut random = at_random(&scene);
            let at_random: Vec<_> = (0..200).map(|_| random()).collect();
            let (random_least, random_mean) = spacing(&at_random);
            let (dart_least, dart_mean) = spacing(&by_darts(&scene, 200));
            println!(
                "{name}: least {least:.3}, mean {mean:.3}; at random {random_least:.3}, {random_mean:.3}; by darts \
                 {dart_least:.3}, {dart_mean:.3}"
            );
            assert!(least > 5.0 * random_least && mean > 1.5 * random_mean, "{name}");
            assert!(least > 0.8 * dart_least, "{name}");
        }
    }

    #[test]
    fn every_instance_has_a_point_and_areas_add_up() {
        let scene = samples::living_room(0.0);
        for count in [1, 50, 400] {
            let points = SurfacePoint::place(&scene, count);
            let mut all = 0.0;
            for (i, instance) in scene.instances.iter().enumerate() {
                let own = points.iter().filter(|p| p.instance == i).count();
                all += SampledInstance::new(&scene.meshes[instance.mesh], instance).area;
                assert!(own > 0, "{count}: instance {i}");
            }
            // But for a little of those that are hidden between others.
            // But for a little of those that lie between others.
            for side in [0, 1] {
                let sum: f64 = points.iter().map(|p| p.areas[side]).sum();
                assert!(sum >= (1.0 - 1e-9) * all && sum < 1.02 * all, "{count}: {sum} of {all}");
            }
            assert!(
                points.len() == count.max(scene.instances.len()),
                "{count}: {}",
                points.len()
            );
        }
        assert!(SurfacePoint::place(&Scene::default(), 10).is_empty());
    }

    #[test]
    #[cfg(feature = "bvh")]
    fn what_blocks_stand_on_has_no_area() {
        let scene = samples::cornell(0.0);
        let points = SurfacePoint::place_in_still_scene(&scene, 600);
        let of_instance = |name: &str| {
            let index = scene.instances.iter().position(|i| i.name == name).unwrap();
            let sampled = SampledInstance::new(&scene.meshes[scene.instances[index].mesh], &scene.instances[index]);
            let own = points.iter().filter(|p| p.instance == index);
            (sampled.area, own.map(|p| p.areas[0]).sum::<f64>())
        };
        // The top of a block is as large as what it stands on.
        let footprint = |name: &str| {
            let index = scene.instances.iter().position(|i| i.name == name).unwrap();
            let p = &scene.meshes[scene.instances[index].mesh].positions;
            let [a, b, c, d] = [0, 1, 2, 3].map(|i| Vec3::from(p[i]).as_dvec3());
            0.5 * ((b - a).cross(c - a).length() + (c - a).cross(d - a).length())
        };
        let (floor, open) = of_instance("floor");
        let wanted = floor - footprint("short block") - footprint("tall block");
        println!("{open:.3} m² of {floor:.3} lie open, {wanted:.3} wanted");
        assert!((open / wanted - 1.0).abs() < 0.01);
        let (ceiling, open) = of_instance("ceiling");
        assert!((open / ceiling - 1.0).abs() < 0.01);
    }

    #[test]
    fn areas_are_those_of_voronoi_cells() {
        // Points in a row along a strip: cells end halfway between.
        let strip = crate::scene::Mesh {
            positions: vec![[0.0, 0.0, 0.0], [0.0, 0.0, 0.1], [10.0, 0.0, 0.1], [10.0, 0.0, 0.0]],
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Default::default()
        };
        let scene = Scene {
            meshes: vec![strip],
            instances: vec![Instance::new(0, 0)],
            ..samples::cornell(0.0)
        };
        let mut points = SurfacePoint::place(&scene, 12);
        points.sort_by(|a, b| a.position.x.total_cmp(&b.position.x));
        let ends: Vec<f64> = points
            .windows(2)
            .map(|p| 0.5 * f64::from(p[0].position.x + p[1].position.x))
            .collect();
        for (i, p) in points.iter().enumerate() {
            let from = if i == 0 { 0.0 } else { ends[i - 1] };
            let to = ends.get(i).copied().unwrap_or(10.0);
            assert!(
                (p.areas[0] / (0.1 * (to - from)) - 1.0).abs() < 0.05,
                "{i}: {} of {}",
                p.areas[0],
                0.1 * (to - from)
            );
        }
        assert!(points.iter().all(|p| p.surface == points[0].surface));
    }

    #[test]
    fn points_lie_on_their_triangles_away_from_edges_and_move_along() {
        let mut scene = samples::cornell(0.0);
        let points = SurfacePoint::place(&scene, 300);
        for p in &points {
            let mesh = &scene.meshes[scene.instances[p.instance].mesh];
            let is_within = mesh.indices.chunks_exact(3).any(|t| {
                let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(mesh.positions[t[i] as usize]).as_dvec3());
                let q = p.position.as_dvec3();
                let n = (b - a).cross(c - a);
                let part = |s: DVec3, e: DVec3| n.dot((e - s).cross(q - s)) / n.length_squared();
                let off = n.normalize_or(DVec3::Y).dot(q - a).abs();
                // A tenth of a third from every edge.
                off < 1e-5 * n.length().sqrt() && [part(a, b), part(b, c), part(c, a)].iter().all(|&s| s > 0.032)
            });
            assert!(is_within, "{p:?}");
        }
        let moved =
            DAffine3::from_translation(DVec3::new(1.0, 2.0, 3.0)) * DAffine3::from_scale(DVec3::new(-1.0, 2.0, 1.0));
        let p = points[0];
        let before = p.in_world(&scene.instances[p.instance].transform);
        scene.instances[p.instance].transform = moved * scene.instances[p.instance].transform;
        let after = p.in_world(&scene.instances[p.instance].transform);
        assert!((after.position - moved.transform_point3(before.position)).length() < 1e-9);
        assert!((after.normal.length() - 1.0).abs() < 1e-12);
    }
}
