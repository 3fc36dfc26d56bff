//! Rays against triangles: nothing leaks, and what is hit is what brute force in `f64` finds.
//!
//! `LIGHTFALL_RAYS` sets how many rays look for leaks; ten million, the default, take a quarter of a minute on a software
//! adapter.
#![cfg(feature = "bvh")]

mod common;

use common::brute_force::{self, Triangle, ends, triangles};
use common::meshes;
use common::statistics::Random;
use common::texture::{bilinear, opacity};
use common::{Gpu, assert_no_errors, gpu};
use lightfall::glam::{DAffine3, DQuat, DVec3, EulerRot, Vec3};
use lightfall::pass::{BvhTracer, BvhTracerRayInputs, BvhTracerResources, RayQuery};
use lightfall::resource::{BvhGeometry, BvhGeometryConfig, Ray, RayHit, Rays};
use lightfall::scene::{Instance, Material, Mesh, Scene, SceneBounds, Texture, UnitFrame, samples};
use lightfall::{Error, read_buffer_blocking};
use std::cell::RefCell;
use std::time::Instant;

/// A device and the pass.
struct Bench {
    gpu: Gpu,
    tracer: BvhTracer,
    resources: RefCell<BvhTracerResources>,
}

impl Bench {
    fn open() -> Option<Self> {
        let gpu = gpu()?;
        Some(Self {
            tracer: BvhTracer::new(&gpu.device),
            resources: RefCell::new(BvhTracerResources::new(&gpu.device).unwrap()),
            gpu,
        })
    }

    fn build(&self, scene: &Scene) -> Result<BvhGeometry, Error> {
        BvhGeometry::new(&self.gpu.device, &self.gpu.queue, scene, &BvhGeometryConfig::default())
    }

    /// Triangles of a scene, ready to be traced in the frame of its bounds.
    fn place(&self, scene: &Scene) -> (BvhGeometry, UnitFrame) {
        let frame = UnitFrame::new(&scene.bounds().unwrap(), 1.0).unwrap();
        let mut geometry = self.build(scene).unwrap();
        geometry.prepare(&self.gpu.queue, &frame).unwrap();
        (geometry, frame)
    }

    /// What rays hit.
    fn trace(&self, geometry: &BvhGeometry, query: RayQuery, rays: &[Ray]) -> Vec<RayHit> {
        let Gpu { device, queue, .. } = &self.gpu;
        let list = Rays::new(device, rays.len() as u32).unwrap();
        list.write(queue, rays).unwrap();
        let mut encoder = device.create_command_encoder(&Default::default());
        let inputs = BvhTracerRayInputs {
            queue,
            geometry,
            rays: &list,
            query,
            timestamps: None,
        };
        self.tracer
            .record_rays(&mut encoder, &mut self.resources.borrow_mut(), &inputs);
        queue.submit([encoder.finish()]);
        let hits = read_buffer_blocking(device, queue, list.hits());
        assert_no_errors(&self.gpu);
        let mut hits: Vec<RayHit> = hits.unwrap();
        hits.truncate(rays.len());
        hits
    }

    fn closest(&self, geometry: &BvhGeometry, rays: &[Ray]) -> Vec<RayHit> {
        self.trace(geometry, RayQuery::Closest, rays)
    }
}

fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray {
        origin: origin.to_array(),
        furthest: Ray::FURTHEST,
        direction: direction.to_array(),
        mask: Ray::ALL,
    }
}

/// A point of the unit frame within 1/2 of its centre in each axis.
fn point(random: &mut Random) -> Vec3 {
    Vec3::from([(); 3].map(|()| random.unit() - 0.5))
}

/// Rays from all over the unit frame in all directions.
fn random_rays(count: usize, seed: u64) -> Vec<Ray> {
    let mut random = Random(seed);
    (0..count)
        .map(|_| ray(point(&mut random), random.direction().as_vec3()))
        .collect()
}

/// Rays that are hard on a tracer: at points of triangles, large or small; at corners, edges and their midpoints; along
/// faces, at up to a hundred-thousandth of a radian.
fn hard_rays(triangles: &[Triangle], count: usize, seed: u64) -> Vec<Ray> {
    let mut random = Random(seed);
    (0..count)
        .map(|i| {
            let triangle = triangles[random.bits() as usize % triangles.len()];
            let [a, b, c] = triangle.corners;
            let (u, v) = (f64::from(random.unit()).sqrt(), f64::from(random.unit()));
            let inside = a.lerp(b.lerp(c, v), u);
            let origin = point(&mut random);
            match i % 4 {
                0 => ray(origin, inside.as_vec3() - origin),
                1 => ray(origin, a.lerp(b, f64::from(random.bits() % 3) / 2.0).as_vec3() - origin),
                2 => ray(origin, a.lerp(b, f64::from(random.unit())).as_vec3() - origin),
                _ => {
                    let normal = triangle.normal();
                    let along = random.direction().reject_from_normalized(normal).normalize_or(DVec3::X);
                    let slope = 10f64.powf(-1.0 - 4.0 * f64::from(random.unit()));
                    let origin = (inside - (0.1 + 0.5 * u) * (along + slope * normal)).as_vec3();
                    ray(origin, inside.as_vec3() - origin)
                }
            }
        })
        .collect()
}

/// Meshes placed, all of one grey material.
fn scene_of(placed: impl IntoIterator<Item = (Mesh, Vec<DAffine3>)>) -> Scene {
    let mut scene = Scene {
        materials: vec![Material::diffuse("grey", [0.5; 3])],
        ..Scene::default()
    };
    for (mesh, transforms) in placed {
        scene.meshes.push(mesh);
        let mesh = scene.meshes.len() - 1;
        scene.instances.extend(transforms.into_iter().map(|transform| Instance {
            transform,
            ..Instance::new(mesh, 0)
        }));
    }
    scene
}

/// Turned about all axes.
fn turn() -> DQuat {
    DQuat::from_euler(EulerRot::XYZ, 0.7, -1.1, 2.3)
}

/// Transforms of every kind that an instance may have, by name.
fn transforms() -> [(&'static str, DAffine3); 5] {
    let stretch = DVec3::new(0.3, 1.7, 0.05);
    let at = DVec3::new(-3.0, 5.0, 11.0);
    [
        ("as modelled", DAffine3::IDENTITY),
        ("turned", DAffine3::from_rotation_translation(turn(), at)),
        (
            "stretched and turned",
            DAffine3::from_scale_rotation_translation(stretch, turn(), at),
        ),
        (
            "mirrored",
            DAffine3::from_scale_rotation_translation(DVec3::new(1.0, -1.0, 1.0), turn(), at),
        ),
        (
            "sheared and mirrored",
            DAffine3::from_scale(DVec3::new(-2.0, 0.2, 0.7)) * DAffine3::from_quat(turn()),
        ),
    ]
}

/// A number from the environment.
fn setting(name: &str, default: usize) -> usize {
    std::env::var(name).map_or(default, |value| value.parse().unwrap())
}

/// A closed mesh and a way to draw points inside it.
struct Closed {
    mesh: Mesh,
    inside: fn(&mut Random) -> DVec3,
}

fn closed_meshes() -> [Closed; 4] {
    let in_the_middle = |random: &mut Random| 0.9 * f64::from(random.unit()) * random.direction();
    [
        Closed {
            mesh: meshes::split(&meshes::sphere(64, 128, 0.0)),
            inside: in_the_middle,
        },
        Closed {
            mesh: meshes::prism(16),
            inside: in_the_middle,
        },
        Closed {
            mesh: meshes::torus(48, 160, 0.3),
            inside: |random| {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(random.unit())).sin_cos();
                DVec3::new(cos, sin, 0.0) + 0.25 * f64::from(random.unit()) * random.direction()
            },
        },
        Closed {
            // Its corners and these points are exact in f32, so that rays meet corners and edges exactly.
            mesh: meshes::cube(),
            inside: |random| DVec3::from_array([(); 3].map(|()| f64::from(random.bits() % 63) / 32.0 - 31.0 / 32.0)),
        },
    ]
}

/// Rays that start inside a closed mesh, or on it going inward: in random directions, along axes and planes of axes, at
/// its corners, at points of its edges, from points of its faces.
fn rays_from_inside(closed: &Closed, transform: &DAffine3, frame: &UnitFrame, count: usize, seed: u64) -> Vec<Ray> {
    let mut random = Random(seed);
    let place = |p: DVec3| frame.point(transform.transform_point3(p));
    let mesh = &closed.mesh;
    let corners_of = |triangle: usize| {
        [0, 1, 2].map(|k| Vec3::from(mesh.positions[mesh.indices[3 * triangle + k] as usize]).as_dvec3())
    };
    (0..count)
        .map(|i| {
            let origin = place((closed.inside)(&mut random));
            let corners = corners_of(random.bits() as usize % (mesh.indices.len() / 3));
            let direction = random.direction().as_vec3();
            match i % 6 {
                0 => ray(origin, direction),
                1 => ray(origin, place(corners[0]) - origin),
                2 => ray(
                    origin,
                    place(corners[0].lerp(corners[1], f64::from(random.unit()))) - origin,
                ),
                3 => ray(origin, Vec3::AXES[i % 3] * direction.x.signum()),
                4 => ray(origin, direction * (Vec3::ONE - Vec3::AXES[i % 3])),
                _ => {
                    // Well inside the face, and steep enough not to slip over its rim where rounding has moved the
                    // origin out of it.
                    let weights = [(); 3].map(|()| 0.1 + f64::from(random.unit()));
                    let sum: f64 = weights.iter().sum();
                    let [a, b, c] = corners.map(|p| transform.transform_point3(p));
                    let point = (weights[0] * a + weights[1] * b + weights[2] * c) / sum;
                    let inward = -(b - a).cross(c - a).normalize() * transform.matrix3.determinant().signum();
                    let leaving = (inward + 0.99 * random.direction()).normalize();
                    ray(frame.point(point), leaving.as_vec3())
                }
            }
        })
        .collect()
}

#[test]
fn no_ray_leaks_out_of_a_closed_mesh() {
    let Some(bench) = Bench::open() else { return };
    let total = setting("LIGHTFALL_RAYS", 10_000_000);
    let far = DAffine3::from_translation(DVec3::new(90.0, -40.0, 60.0));
    let (mut traced, mut leaked) = (0, 0);
    let cases = closed_meshes();
    let share = total.div_ceil(cases.len() * (transforms().len() + 1));
    let start = Instant::now();
    for closed in &cases {
        // Last a mesh that is a hundredth of its scene and stands at its border.
        let alone = transforms().map(|(name, transform)| (name, transform, vec![transform]));
        let off_centre = (
            "off centre",
            far,
            vec![far, DAffine3::from_translation(-far.translation)],
        );
        for (seed, (name, transform, placed)) in (0..).zip(alone.into_iter().chain([off_centre])) {
            let (geometry, frame) = bench.place(&scene_of([(closed.mesh.clone(), placed)]));
            let rays = rays_from_inside(closed, &transform, &frame, share, seed);
            for part in rays.chunks(1 << 20) {
                let hits = bench.closest(&geometry, part);
                let missed: Vec<_> = part.iter().zip(&hits).filter(|(_, hit)| !hit.is_hit()).collect();
                for (ray, _) in missed.iter().take(3) {
                    println!("{} {name}: {ray:?} leaks", closed.mesh.name);
                }
                traced += part.len();
                leaked += missed.len();
            }
        }
    }
    println!("{traced} rays in {:.1} s, {leaked} leak", start.elapsed().as_secs_f64());
    assert_eq!(leaked, 0);
}

/// Scenes for brute force: several meshes, transforms of every kind, triangles of every shape; how many of the rays.
fn brute_force_scenes() -> [(&'static str, Scene, usize); 6] {
    let sample = |name| samples::by_name(name, 0.7).unwrap();
    let transforms = transforms().map(|(_, transform)| transform);
    let near = transforms.map(|t| DAffine3 {
        translation: 0.3 * t.translation,
        ..t
    });
    let placed = scene_of([
        (meshes::split(&meshes::sphere(10, 16, 0.2)), near.to_vec()),
        (meshes::torus(9, 14, 0.4), near[1..4].to_vec()),
        (meshes::prism(7), near[2..].to_vec()),
    ]);
    let slivers = scene_of([(meshes::slivers(3000, 5), vec![DAffine3::IDENTITY])]);
    let fine = scene_of([(meshes::sphere(100, 150, 0.3), vec![transforms[3]])]);
    [
        ("cornell", sample("cornell"), 1),
        ("pillars", sample("pillars"), 1),
        ("two rooms", sample("two-rooms"), 1),
        ("transformed meshes", placed, 1),
        ("slivers", slivers, 1),
        ("29 700 triangles", fine, 25),
    ]
}

/// How what was found departs from the truth.
#[derive(Debug, Default)]
struct Departure {
    hits: usize,
    /// Distances off by more than [`TOLERANCE`] of the scene's radius, and of those: past an edge by less than
    /// [`AT_EDGE`]; on their triangle within [`ROUNDING`], which the ray grazes.
    different: usize,
    at_edges: usize,
    grazing: usize,
    /// Of the others: the largest error of a distance, in the unit frame; the largest times the cosine where it is the
    /// right triangle.
    error: f64,
    error_cosine: f64,
}

/// Of a distance, relative to the scene's radius.
const TOLERANCE: f64 = 1e-5;
/// In the unit frame.
const AT_EDGE: f64 = 1e-6;
/// How far from its triangle a hit is at most, in the unit frame: a corner's place relative to the ray passes through
/// about six roundings of 2^-24, and is up to √3 away.
const ROUNDING: f64 = 6e-7;

impl Departure {
    fn of(scene: &Scene, frame: &UnitFrame, rays: &[Ray], hits: &[RayHit]) -> Self {
        let all = triangles(scene, frame);
        let mut departure = Self::default();
        for ((ray, hit), truth) in rays.iter().zip(hits).zip(brute_force::closest(&all, rays)) {
            let found = hit.is_hit().then(|| {
                let is_it = |t: &&Triangle| (t.instance, t.index) == (hit.instance, hit.triangle);
                (f64::from(hit.distance), *all.iter().find(is_it).unwrap())
            });
            departure.add(ray, found, truth, f64::from(frame.radius()));
        }
        departure
    }

    fn add(&mut self, ray: &Ray, found: Option<(f64, Triangle)>, truth: Option<(f64, Triangle)>, radius: f64) {
        let (from, along) = ends(ray);
        self.hits += usize::from(truth.is_some());
        if let (Some((t, hit)), Some((right, triangle))) = (found, truth) {
            let error = (t - right).abs() * along.length();
            if error <= TOLERANCE * radius {
                self.error = self.error.max(error);
                if (hit.instance, hit.index) == (triangle.instance, triangle.index) {
                    let cosine = along.normalize().dot(triangle.normal()).abs();
                    self.error_cosine = self.error_cosine.max(error * cosine);
                }
                return;
            }
        } else if found.is_none() && truth.is_none() {
            return;
        }
        self.different += 1;
        let furthest = found.iter().chain(&truth).map(|f| f.0).fold(0.0, f64::max);
        // A ray that grazes a triangle passes over its edge some way behind or before the hit.
        let to = from + (furthest + 1.0) * along;
        let passes_edge = |(_, t): &(f64, Triangle)| t.distance_to_edges(from, to) < AT_EDGE;
        let lies_on_it = |(t, triangle): &(f64, Triangle)| triangle.distance(from + *t * along) < ROUNDING;
        if found.iter().chain(&truth).any(passes_edge) {
            self.at_edges += 1;
        } else if found.as_ref().is_some_and(lies_on_it) {
            self.grazing += 1;
        }
    }
}

#[test]
fn the_closest_hit_is_the_one_that_brute_force_finds() {
    let Some(bench) = Bench::open() else { return };
    let total = setting("LIGHTFALL_RAYS", 1_000_000) / 10;
    for (name, scene, divisor) in brute_force_scenes() {
        let (geometry, frame) = bench.place(&scene);
        let rays = random_rays(total / divisor, 7);
        let found = Departure::of(&scene, &frame, &rays, &bench.closest(&geometry, &rays));
        println!("{name}, {} random rays: {found:?}", rays.len());
        assert!(found.different as f64 <= 1e-4 * rays.len() as f64, "{name}: {found:?}");
        assert_eq!(found.at_edges, found.different, "{name}: {found:?}");
        assert!(
            found.hits > rays.len() / 10,
            "most rays of {name} hit nothing: {found:?}"
        );

        let rays = hard_rays(&triangles(&scene, &frame), total / divisor / 4, 8);
        let found = Departure::of(&scene, &frame, &rays, &bench.closest(&geometry, &rays));
        println!("{name}, {} hard rays: {found:?}", rays.len());
        if name != "slivers" {
            assert_eq!(found.at_edges + found.grazing, found.different, "{name}: {found:?}");
            assert!(found.error_cosine < ROUNDING, "{name}: {found:?}");
        }
    }
}

#[test]
fn whether_anything_is_hit_is_the_same_whichever_is_asked() {
    let Some(bench) = Bench::open() else { return };
    for (name, scene, _) in brute_force_scenes() {
        let (geometry, frame) = bench.place(&scene);
        let all = triangles(&scene, &frame);
        let rays: Vec<_> = random_rays(20_000, 11)
            .into_iter()
            .chain(hard_rays(&all, 20_000, 12))
            .collect();
        let free = bench.closest(&geometry, &rays);
        // Limits before, at and behind the hit.
        for part in [0.5, 1.0, 1.0 + f32::EPSILON, 2.0] {
            let limited: Vec<_> = rays
                .iter()
                .zip(&free)
                .map(|(ray, hit)| Ray {
                    furthest: part * if hit.is_hit() { hit.distance } else { 3.0 },
                    ..*ray
                })
                .collect();
            let closest = bench.closest(&geometry, &limited);
            let any = bench.trace(&geometry, RayQuery::Any, &limited);
            for (((ray, free), closest), any) in limited.iter().zip(&free).zip(&closest).zip(&any) {
                let expected = free.is_hit() && free.distance < ray.furthest;
                assert_eq!(
                    closest.is_hit(),
                    expected,
                    "{name}, {part}: {ray:?} {free:?} {closest:?}"
                );
                assert_eq!(any.is_hit(), expected, "{name}, {part}: {ray:?} {free:?} {any:?}");
                if expected {
                    assert_eq!(closest.distance, free.distance, "{name}, {part}: {ray:?}");
                    assert!(
                        any.distance >= free.distance && any.distance < ray.furthest,
                        "{name}: {any:?}"
                    );
                } else {
                    assert_eq!([closest.distance, any.distance], [ray.furthest; 2], "{name}: {ray:?}");
                    assert_eq!(
                        [closest.triangle, any.triangle],
                        [RayHit::NOTHING; 2],
                        "{name}: {ray:?}"
                    );
                }
            }
        }
    }
}

/// Two squares one above the other, 1 apart, each with its own instance and material.
fn two_squares() -> Scene {
    let square = meshes::grid(1, |_, _| 0.0);
    let above = DAffine3::from_translation(DVec3::Y);
    scene_of([(square, vec![DAffine3::IDENTITY, above])])
}

#[test]
fn rays_meet_the_instances_that_their_mask_names() {
    let Some(bench) = Bench::open() else { return };
    let mut scene = two_squares();
    scene.instances[1].casts_shadow = false;
    scene.instances[0].in_env_maps = false;
    let (geometry, frame) = bench.place(&scene);
    let down = ray(frame.point(DVec3::new(0.2, 3.0, 0.1)), Vec3::NEG_Y);
    // The mask of a ray, and the instances that it meets, from the nearest.
    let cases: [(u32, &[u32]); 5] = [
        (Ray::ALL, &[1, 0]),
        (Ray::CASTS_SHADOW, &[0]),
        (Ray::IN_ENV_MAPS, &[1]),
        (Ray::CASTS_SHADOW | Ray::IN_ENV_MAPS, &[1, 0]),
        (0, &[]),
    ];
    let rays = cases.map(|(mask, _)| Ray { mask, ..down });
    for (hit, (mask, met)) in bench.closest(&geometry, &rays).iter().zip(cases) {
        let nearest = met.first().copied().unwrap_or(RayHit::NOTHING);
        assert_eq!(hit.instance, nearest, "mask {mask}");
    }
    for (hit, (mask, met)) in bench.trace(&geometry, RayQuery::Any, &rays).iter().zip(cases) {
        assert_eq!(hit.is_hit(), !met.is_empty(), "mask {mask}");
        assert!(!hit.is_hit() || met.contains(&hit.instance), "mask {mask}: {hit:?}");
    }
}

#[test]
fn a_hit_says_where_on_which_triangle_and_on_which_side() {
    let Some(bench) = Bench::open() else { return };
    for (name, scene, _) in brute_force_scenes().into_iter().filter(|(name, ..)| *name != "slivers") {
        let (geometry, frame) = bench.place(&scene);
        let all = triangles(&scene, &frame);
        let rays: Vec<_> = random_rays(20_000, 13)
            .into_iter()
            .chain(hard_rays(&all, 20_000, 14))
            .collect();
        let (mut hits, mut fronts) = (0, 0);
        for (ray, hit) in rays
            .iter()
            .zip(bench.closest(&geometry, &rays))
            .filter(|(_, hit)| hit.is_hit())
        {
            let (from, along) = ends(ray);
            let instance = &scene.instances[hit.instance as usize];
            let mesh = &scene.meshes[instance.mesh];
            let first = 3 * hit.triangle as usize;
            let corners = [0, 1, 2].map(|k| Vec3::from(mesh.positions[mesh.indices[first + k] as usize]).as_dvec3());
            let [v, w] = hit.barycentric.map(f64::from);
            assert!(v >= 0.0 && w >= 0.0 && v + w <= 1.0 + 1e-6, "{name}: {hit:?}");
            // Corner, weights and transform lead to the same point as the ray.
            let [a, b, c] =
                corners.map(|p| (instance.transform.transform_point3(p) - frame.center()) / frame.length_scale());
            let point = a + v * (b - a) + w * (c - a);
            let cosine = (b - a).cross(c - a).normalize().dot(along.normalize()).abs();
            let off = point.distance(from + f64::from(hit.distance) * along);
            assert!(
                off * cosine < ROUNDING,
                "{name}: {ray:?} {hit:?} is off by {off:e}, cosine {cosine:e}"
            );
            // In the mesh, counter-clockwise triangles face the ray, whatever the transform does.
            let [a, b, c] = corners;
            let in_mesh = instance.transform.matrix3.inverse() * along;
            let facing = -(b - a).cross(c - a).normalize().dot(in_mesh.normalize());
            if facing.abs() > 1e-5 {
                assert_eq!(
                    hit.is_front,
                    u32::from(facing > 0.0),
                    "{name}: {ray:?} {hit:?}, facing {facing}"
                );
            }
            hits += 1;
            fronts += hit.is_front;
        }
        println!("{name}: {hits} hits, {fronts} of them on the front");
        assert!(fronts > hits / 100 && fronts < hits, "{name}: one side is never seen");
    }
}

#[test]
fn rays_pass_where_a_texture_is_cut_out() {
    const SIDE: u32 = 16;
    let Some(bench) = Bench::open() else { return };
    let mut random = Random(21);
    let sizes = [[SIDE, SIDE], [8, 8], [5, 12], [SIDE, 2]];
    let cutoffs = [0.5, 0.3, 0.7, 0.5];
    let mut scene = Scene::default();
    for ([width, height], cutoff) in sizes.into_iter().zip(cutoffs) {
        let texel = |_| [10, 20, 30, (random.bits() >> 24) as u8];
        let rgba = (0..width * height).flat_map(texel).collect();
        scene.textures.push(Texture {
            name: format!("{width}×{height}"),
            width,
            height,
            srgb: scene.textures.len() != 1,
            rgba,
        });
        scene.materials.push(Material {
            base_color_texture: Some(scene.textures.len() - 1),
            alpha_cutoff: Some(cutoff),
            ..Material::default()
        });
    }
    // Without a cut-off a texture's opacity means nothing.
    scene.materials.push(Material {
        base_color_texture: Some(0),
        ..Material::default()
    });
    let mut square = meshes::grid(3, |_, _| 0.0);
    square.tex_coords = square
        .positions
        .iter()
        .map(|p| [1.7 * p[0] - 0.4, 1.1 * p[2] + 6.0])
        .collect();
    scene.meshes = vec![square];
    scene.instances = (0..scene.materials.len())
        .map(|material| Instance {
            transform: DAffine3::from_translation(DVec3::new(3.0 * material as f64, 0.0, 0.0)),
            ..Instance::new(0, material)
        })
        .collect();
    let (geometry, frame) = bench.place(&scene);
    // What a texture becomes when all are brought to the size of the largest.
    let middle = |k: u32| (f64::from(k) + 0.5) / f64::from(SIDE);
    let resampled: Vec<Texture> = scene
        .textures
        .iter()
        .map(|t| {
            let own = |i: u32| bilinear(t, [middle(i % SIDE), middle(i / SIDE)], opacity);
            Texture {
                width: SIDE,
                height: SIDE,
                rgba: (0..SIDE * SIDE)
                    .flat_map(|i| [0, 0, 0, (255.0 * own(i)).round() as u8])
                    .collect(),
                ..t.clone()
            }
        })
        .collect();
    for (material, instance) in (0..).zip(&scene.instances) {
        let at: Vec<DVec3> = (0..20_000)
            .map(|_| 0.99 * (2.0 * point(&mut random).as_dvec3()) * DVec3::new(1.0, 0.0, 1.0))
            .collect();
        let start = |p: &DVec3| frame.point(instance.transform.transform_point3(*p + DVec3::Y));
        let rays: Vec<_> = at.iter().map(|p| ray(start(p), Vec3::NEG_Y)).collect();
        let (mut solid, mut unsure) = (0, 0);
        for (p, hit) in at.iter().zip(bench.closest(&geometry, &rays)) {
            let Some(cutoff) = cutoffs.get(material).copied().map(f64::from) else {
                assert!(hit.is_hit(), "no cut-off: {p}");
                continue;
            };
            let own = bilinear(&resampled[material], [1.7 * p.x - 0.4, 1.1 * p.z + 6.0], opacity);
            // Filters weigh texels in steps of 1/256, and bytes are steps of 1/255.
            if (own - cutoff).abs() < 1.0 / 100.0 {
                unsure += 1;
            } else {
                let name = &scene.textures[material].name;
                assert_eq!(
                    hit.is_hit(),
                    own > cutoff,
                    "{name} at {p}: opacity {own}, cut off at {cutoff}"
                );
                solid += u32::from(hit.is_hit());
            }
        }
        println!("material {material}: {solid} of 20000 are solid, {unsure} too near the cut-off to tell");
        assert!(material == cutoffs.len() || (unsure < 2000 && (2000..18_000).contains(&solid)));
    }
}

#[test]
fn moving_an_instance_uploads_the_tree_of_instances_alone() {
    let Some(bench) = Bench::open() else { return };
    let Gpu { device, queue, .. } = &bench.gpu;
    let mut scene = scene_of([
        (
            meshes::sphere(64, 128, 0.2),
            vec![DAffine3::IDENTITY, DAffine3::from_translation(3.0 * DVec3::X)],
        ),
        (
            meshes::grid(1, |_, _| -1.5),
            vec![DAffine3::from_scale(DVec3::splat(9.0))],
        ),
    ]);
    let frame = UnitFrame::new(&scene.bounds().unwrap(), 1.0).unwrap();
    let mut geometry = bench.build(&scene).unwrap();
    // Three records of 128 bytes, one node of 80, one material of 64.
    assert_eq!(geometry.prepare(queue, &frame).unwrap(), 3 * 128 + 80 + 64);
    assert_eq!(geometry.prepare(queue, &frame).unwrap(), 0, "nothing has moved");
    let rays = random_rays(20_000, 31);
    let before = bench.closest(&geometry, &rays);
    let moved = DAffine3::from_scale_rotation_translation(DVec3::splat(0.7), turn(), DVec3::new(-2.0, 0.5, 1.0));
    geometry.set_transform(1, moved).unwrap();
    scene.instances[1].transform = moved;
    let created = lightfall::creation_count();
    assert_eq!(geometry.prepare(queue, &frame).unwrap(), 3 * 128 + 80);
    assert_eq!(lightfall::creation_count(), created, "moving makes nothing new");
    assert_eq!(geometry.prepare(queue, &frame).unwrap(), 0, "it rests again");
    let after = bench.closest(&geometry, &rays);
    assert_ne!(before, after);
    let mut anew = bench.build(&scene).unwrap();
    anew.prepare(queue, &frame).unwrap();
    assert_eq!(
        after,
        bench.closest(&anew, &rays),
        "hits are those of a scene built like that"
    );
    // Another frame is another place for everything.
    let other = UnitFrame::new(&SceneBounds::new(DVec3::splat(-30.0), DVec3::splat(30.0)).unwrap(), 1.0).unwrap();
    assert_eq!(geometry.prepare(queue, &other).unwrap(), 3 * 128 + 80);
    assert!(geometry.set_transform(3, moved).is_err());
    assert!(
        geometry
            .set_transform(0, DAffine3::from_translation(DVec3::NAN))
            .is_err()
    );
    assert_eq!(
        geometry.prepare(queue, &other).unwrap(),
        0,
        "what was refused has changed nothing"
    );
    drop(device.poll(lightfall::wgpu::PollType::Poll));
}

/// Distances and places on the triangle, without which of equal ones it is and what it took to find it.
fn found(hits: &[RayHit]) -> Vec<(f32, [f32; 2])> {
    hits.iter().map(|h| (h.distance, h.barycentric)).collect()
}

#[test]
fn a_deformed_mesh_is_hit_like_one_that_was_built_so() {
    let Some(bench) = Bench::open() else { return };
    let queue = &bench.gpu.queue;
    let wave = |height: f64| meshes::grid(60, move |x, z| height * (5.0 * x).sin() * (3.0 * z + 1.0).cos());
    let ball = |bump: f64| meshes::split(&meshes::sphere(24, 48, bump));
    let placed = [
        DAffine3::IDENTITY,
        DAffine3::from_translation(DVec3::new(0.2, 1.4, 0.0)),
    ];
    let at_rest = scene_of([(wave(0.0), placed[..1].to_vec()), (ball(0.0), placed[1..].to_vec())]);
    let (mut geometry, frame) = bench.place(&at_rest);
    let rays = random_rays(50_000, 41);
    let flat = bench.closest(&geometry, &rays);
    for (height, bump) in [(0.2, 0.3), (2.0, 0.0), (0.0, -0.2)] {
        let meshes = [wave(height), ball(bump)];
        for (index, mesh) in meshes.iter().enumerate() {
            geometry.deform(queue, index, &mesh.positions, &mesh.normals).unwrap();
        }
        assert!(geometry.prepare(queue, &frame).unwrap() > 0, "bounds have changed");
        let deformed = Scene {
            meshes: meshes.to_vec(),
            ..at_rest.clone()
        };
        let mut anew = bench.build(&deformed).unwrap();
        anew.prepare(queue, &frame).unwrap();
        // The order of corners is that of the mesh at rest, so that sums are rounded otherwise.
        let (hits, expected) = (bench.closest(&geometry, &rays), bench.closest(&anew, &rays));
        let is_same = |(a, b): &(&RayHit, &RayHit)| a.instance == b.instance && (a.distance - b.distance).abs() < 2e-6;
        let same = hits.iter().zip(&expected).filter(is_same).count();
        println!(
            "wave {height}, bump {bump}: {} of {} hits differ",
            rays.len() - same,
            rays.len()
        );
        assert!(
            rays.len() - same <= rays.len() / 10_000,
            "wave {height}, bump {bump}: {same} agree"
        );
        let truth = Departure::of(&deformed, &frame, &rays[..3000], &hits[..3000]);
        assert_eq!(truth.different, truth.at_edges, "wave {height}, bump {bump}: {truth:?}");
        let closed = Closed {
            mesh: meshes[1].clone(),
            inside: |random| 0.5 * f64::from(random.unit()) * random.direction(),
        };
        let inside = rays_from_inside(&closed, &placed[1], &frame, 50_000, 42);
        assert!(
            bench.closest(&geometry, &inside).iter().all(RayHit::is_hit),
            "bump {bump} leaks"
        );
    }
    for (index, mesh) in at_rest.meshes.iter().enumerate() {
        // Flat normals are part of the mesh; without any it is hit the same.
        geometry.deform(queue, index, &mesh.positions, &[]).unwrap();
    }
    geometry.prepare(queue, &frame).unwrap();
    assert_eq!(bench.closest(&geometry, &rays), flat, "as if nothing had been");
}

#[test]
fn a_deformation_that_cannot_be_is_refused_and_changes_nothing() {
    let Some(bench) = Bench::open() else { return };
    let queue = &bench.gpu.queue;
    let mesh = meshes::split(&meshes::grid(4, |_, _| 0.0));
    let (mut geometry, frame) = bench.place(&scene_of([(mesh.clone(), vec![DAffine3::IDENTITY])]));
    let rays = random_rays(2000, 51);
    let before = bench.closest(&geometry, &rays);
    let raised: Vec<_> = mesh.positions.iter().map(|p| [p[0], 1.0, p[2]]).collect();
    let broken = |at: usize, value: f32| {
        let mut values = raised.clone();
        values[at][1] = value;
        values
    };
    let mut refused = |mesh: usize, positions: &[[f32; 3]], normals: &[[f32; 3]]| {
        geometry
            .deform(queue, mesh, positions, normals)
            .unwrap_err()
            .to_string()
    };
    assert!(refused(0, &raised[1..], &[]).contains("95 given, 96 expected"));
    assert!(refused(0, &raised, &raised[3..]).contains("93 given, 96 expected"));
    assert!(refused(0, &[], &[]).contains("0 given, 96 expected"));
    assert!(refused(0, &broken(17, f32::NAN), &[]).contains("position of vertex 17"));
    assert!(refused(0, &raised, &broken(95, f32::INFINITY)).contains("normal of vertex 95"));
    assert!(refused(1, &raised, &[]).contains("mesh \"#1\""));
    assert_eq!(geometry.prepare(queue, &frame).unwrap(), 0);
    assert_eq!(bench.closest(&geometry, &rays), before);
}

#[test]
fn scenes_of_next_to_nothing_are_traced_too() {
    let Some(bench) = Bench::open() else { return };
    let queue = &bench.gpu.queue;
    let frame = UnitFrame::new(&SceneBounds::new(-DVec3::ONE, DVec3::ONE).unwrap(), 1.0).unwrap();
    let rays = random_rays(1000, 61);
    let triangle = meshes::soup("triangle", [[[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [0.0, 0.0, 1.0]]]);
    let flattened = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0));
    let turned_flat = DAffine3::from_quat(turn()) * flattened * DAffine3::from_quat(turn().inverse());
    let unused = Mesh {
        positions: vec![[0.0; 3]; 7],
        ..Mesh::default()
    };
    let empty = [
        ("no scene", Scene::default()),
        ("no instance", scene_of([(triangle.clone(), vec![])])),
        ("no triangle", scene_of([(Mesh::default(), vec![DAffine3::IDENTITY])])),
        ("vertices alone", scene_of([(unused, vec![DAffine3::IDENTITY; 3])])),
        ("flattened away", scene_of([(meshes::cube(), vec![flattened])])),
        (
            "shrunk to a point",
            scene_of([(meshes::cube(), vec![DAffine3::from_scale(DVec3::ZERO)])]),
        ),
    ];
    for (name, scene) in empty {
        // A scene whose triangles have no extent is refused; what is left of it here has no triangles at all.
        let mut geometry = match bench.build(&scene) {
            Ok(geometry) => geometry,
            Err(Error::InvalidBounds { .. }) if name == "shrunk to a point" => continue,
            Err(error) => panic!("{name}: {error}"),
        };
        geometry.prepare(queue, &frame).unwrap();
        for query in [RayQuery::Closest, RayQuery::Any] {
            let hits = bench.trace(&geometry, query, &rays);
            assert!(
                hits.iter().all(|h| !h.is_hit() && h.distance == Ray::FURTHEST),
                "{name}"
            );
        }
    }
    // No list of rays at all.
    let one = scene_of([(triangle.clone(), vec![DAffine3::IDENTITY])]);
    let (geometry, frame) = bench.place(&one);
    assert_eq!(bench.closest(&geometry, &[]), []);
    // One triangle, alone, beside unseen instances, and flattened in a frame where rounding hides it.
    let beside = scene_of([
        (
            triangle.clone(),
            vec![flattened, DAffine3::IDENTITY, DAffine3::from_scale(DVec3::ZERO)],
        ),
        (Mesh::default(), vec![DAffine3::IDENTITY]),
    ]);
    let alone = bench.closest(&geometry, &rays);
    assert!(alone.iter().any(RayHit::is_hit));
    let mut geometry = bench.build(&beside).unwrap();
    geometry.prepare(queue, &frame).unwrap();
    for (one, other) in alone.iter().zip(bench.closest(&geometry, &rays)) {
        let instance = if one.is_hit() { 1 } else { RayHit::NOTHING };
        assert_eq!((one.distance, instance), (other.distance, other.instance));
    }
    let mut geometry = bench
        .build(&scene_of([(triangle, vec![turned_flat, DAffine3::IDENTITY])]))
        .unwrap();
    geometry.prepare(queue, &frame).unwrap();
    for (one, other) in alone.iter().zip(bench.closest(&geometry, &rays)) {
        assert!(other.distance <= one.distance && other.distance >= 0.0, "{other:?}");
    }
}

#[test]
fn triangles_without_area_are_in_nobodys_way() {
    let Some(bench) = Bench::open() else { return };
    let square = meshes::split(&meshes::grid(8, |x, z| 0.1 * x * z));
    let (geometry, frame) = bench.place(&scene_of([(square.clone(), vec![DAffine3::IDENTITY])]));
    let mut random = Random(71);
    let mut corner = || (2.0 * point(&mut random)).to_array();
    let degenerate = (0..3000).map(|i| {
        let (a, b) = (corner(), corner());
        let along = |t: f32| Vec3::from(a).lerp(b.into(), t).to_array();
        match i % 4 {
            0 => [a; 3],
            1 => [a, b, a],
            2 => [a, b, b],
            // On a line as well as numbers can be.
            _ => [a, along(0.3), b],
        }
    });
    let mut all = meshes::soup("degenerate", degenerate.collect::<Vec<_>>());
    all.indices
        .extend(square.indices.iter().map(|i| i + all.positions.len() as u32));
    all.positions.extend(&square.positions);
    let mut with = bench.build(&scene_of([(all, vec![DAffine3::IDENTITY])])).unwrap();
    with.prepare(&bench.gpu.queue, &frame).unwrap();
    let rays = random_rays(100_000, 72);
    let (alone, among) = (bench.closest(&geometry, &rays), bench.closest(&with, &rays));
    let in_the_way = alone
        .iter()
        .zip(&among)
        .filter(|(a, b)| a.distance != b.distance)
        .count();
    assert_eq!(in_the_way, 0);
}

#[test]
fn a_gap_filled_with_triangles_without_area_stays_closed() {
    let Some(bench) = Bench::open() else { return };
    // A cube of which each edge is cut on one of its faces only: triangles without area join the two sides.
    let cube = meshes::cube();
    let mut triangles = Vec::new();
    for t in cube.indices.as_chunks::<3>().0 {
        let [a, b, c] = t.map(|i| Vec3::from(cube.positions[i as usize]));
        let cut = a.lerp(b, 0.37);
        triangles.extend([[a, cut, c], [cut, b, c], [a, b, cut]].map(|t| t.map(|p| p.to_array())));
    }
    let closed = Closed {
        mesh: meshes::soup("cut cube", triangles),
        inside: |random| 0.9 * f64::from(random.unit()) * random.direction(),
    };
    for (name, transform) in transforms() {
        let (geometry, frame) = bench.place(&scene_of([(closed.mesh.clone(), vec![transform])]));
        let rays = rays_from_inside(&closed, &transform, &frame, 100_000, 81);
        // Not the sixth kind of rays: it starts from faces, of which some have no area here.
        let rays: Vec<_> = (0..)
            .zip(rays)
            .filter(|(i, _)| i % 6 != 5)
            .map(|(_, ray)| ray)
            .collect();
        let leaked = bench.closest(&geometry, &rays).iter().filter(|h| !h.is_hit()).count();
        assert_eq!(leaked, 0, "{name}");
    }
}

#[test]
fn a_million_triangles_in_one_place_are_hit_as_one() {
    let Some(bench) = Bench::open() else { return };
    let triangle = [[-1.0, 0.0, -1.0], [1.0, 0.2, -1.0], [0.0, 0.0, 1.0]];
    let one = scene_of([(meshes::soup("one", [triangle]), vec![DAffine3::IDENTITY])]);
    let (geometry, _) = bench.place(&one);
    let rays = random_rays(20, 91);
    let expected = bench.closest(&geometry, &rays);
    assert!(expected.iter().any(RayHit::is_hit));
    let start = Instant::now();
    let million = scene_of([(
        meshes::soup("million", std::iter::repeat_n(triangle, 1_000_000)),
        vec![DAffine3::IDENTITY],
    )]);
    let (geometry, _) = bench.place(&million);
    println!("built in {:.1} s", start.elapsed().as_secs_f64());
    assert_eq!(found(&bench.closest(&geometry, &rays)), found(&expected));
    let many = random_rays(200, 92);
    let is_hit = |hits: Vec<RayHit>| hits.iter().map(RayHit::is_hit).collect::<Vec<_>>();
    let (geometry_of_one, _) = bench.place(&one);
    assert_eq!(
        is_hit(bench.trace(&geometry, RayQuery::Any, &many)),
        is_hit(bench.trace(&geometry_of_one, RayQuery::Any, &many))
    );
}

#[test]
fn a_million_triangles_are_hit_where_they_are() {
    let Some(bench) = Bench::open() else { return };
    let mut random = Random(95);
    let noise: Vec<f64> = (0..710 * 710).map(|_| 0.004 * f64::from(random.unit())).collect();
    let at = |x: f64| (0.5 * (x + 1.0) * 708.0).round() as usize;
    let terrain = meshes::grid(708, |x, z| 0.3 * (3.0 * x).sin() * z.cos() + noise[at(x) * 710 + at(z)]);
    let count = terrain.indices.len() / 3;
    let scene = scene_of([(terrain, vec![transforms()[1].1])]);
    let start = Instant::now();
    let (geometry, frame) = bench.place(&scene);
    println!("{count} triangles built in {:.1} s", start.elapsed().as_secs_f64());
    let rays = hard_rays(&triangles(&scene, &frame), 400, 96);
    let found = Departure::of(&scene, &frame, &rays, &bench.closest(&geometry, &rays));
    println!("{found:?}");
    assert_eq!(found.at_edges + found.grazing, found.different, "{found:?}");
    assert!(found.error_cosine < ROUNDING && found.hits > 350, "{found:?}");
}

#[test]
fn ten_thousand_instances_are_hit_where_they_are() {
    let Some(bench) = Bench::open() else { return };
    let queue = &bench.gpu.queue;
    let mut random = Random(101);
    let mut anywhere = || {
        let scale = DVec3::from([(); 3].map(|()| 0.05 + 0.2 * f64::from(random.unit())));
        let turn = DQuat::from_axis_angle(random.direction(), f64::from(random.unit()));
        DAffine3::from_scale_rotation_translation(scale, turn, 20.0 * point(&mut random).as_dvec3())
    };
    let strewn = scene_of([(meshes::cube(), (0..10_000).map(|_| anywhere()).collect())]);
    let mut geometry = bench.build(&strewn).unwrap();
    let frame = UnitFrame::new(&strewn.bounds().unwrap(), 1.0).unwrap();
    let start = Instant::now();
    let uploaded = geometry.prepare(queue, &frame).unwrap();
    println!(
        "10 000 instances placed in {:.1} ms, {uploaded} bytes",
        1e3 * start.elapsed().as_secs_f64()
    );
    assert!(uploaded <= 10_000 * (128 + 80));
    let rays = random_rays(2000, 102);
    let found = Departure::of(&strewn, &frame, &rays, &bench.closest(&geometry, &rays));
    println!("{found:?}");
    assert_eq!(found.different, 0, "{found:?}");
    assert!(found.hits > 400);

    // All in one place they are one.
    let one = scene_of([(meshes::cube(), vec![transforms()[2].1])]);
    let stacked = scene_of([(meshes::cube(), vec![transforms()[2].1; 10_000])]);
    let (one, stacked) = (bench.place(&one).0, bench.place(&stacked).0);
    let rays = random_rays(500, 103);
    for (one, other) in bench.closest(&one, &rays).iter().zip(bench.closest(&stacked, &rays)) {
        assert_eq!((one.distance, one.triangle), (other.distance, other.triangle));
    }
}

#[test]
fn powers_of_two_change_no_bit_of_a_hit() {
    let Some(bench) = Bench::open() else { return };
    for (name, scene, _) in brute_force_scenes() {
        let (geometry, frame) = bench.place(&scene);
        let rays: Vec<_> = random_rays(5000, 111)
            .into_iter()
            .chain(hard_rays(&triangles(&scene, &frame), 5000, 112))
            .collect();
        let expected = bench.closest(&geometry, &rays);
        for exponent in [-40, 40] {
            let factor = f64::from(exponent).exp2();
            // The scene in another unit: either its meshes are modelled in it, or its instances scale them.
            let mut modelled = scene.clone();
            for position in modelled.meshes.iter_mut().flat_map(|m| &mut m.positions).flatten() {
                *position *= factor as f32;
            }
            for instance in &mut modelled.instances {
                instance.transform.translation *= factor;
            }
            let mut scaled = scene.clone();
            for instance in &mut scaled.instances {
                instance.transform = DAffine3::from_scale(DVec3::splat(factor)) * instance.transform;
            }
            for (how, other) in [("modelled", modelled), ("scaled", scaled)] {
                let (geometry, _) = bench.place(&other);
                assert!(
                    bench.closest(&geometry, &rays) == expected,
                    "{name} {how}, 2^{exponent}"
                );
            }
            // And rays whose directions are longer or shorter.
            let longer = |ray: &Ray| Ray {
                direction: ray.direction.map(|x| x * factor as f32),
                ..*ray
            };
            let hits = bench.closest(&geometry, &rays.iter().map(longer).collect::<Vec<_>>());
            for (hit, expected) in hits.iter().zip(&expected).filter(|(_, expected)| expected.is_hit()) {
                let in_lengths = RayHit {
                    distance: hit.distance * factor as f32,
                    ..*hit
                };
                assert_eq!(in_lengths, *expected, "{name}, directions 2^{exponent}");
            }
        }
    }
}

#[test]
fn a_million_sizes_from_the_origin_hits_are_as_exact() {
    let Some(bench) = Bench::open() else { return };
    for (name, mut scene, divisor) in brute_force_scenes() {
        let size = scene.bounds().unwrap().radius();
        for instance in &mut scene.instances {
            instance.transform.translation += 1e6 * size * DVec3::new(1.0, -0.6, 0.3);
        }
        let (geometry, frame) = bench.place(&scene);
        let rays = random_rays(10_000 / divisor, 121);
        let found = Departure::of(&scene, &frame, &rays, &bench.closest(&geometry, &rays));
        println!("{name}: {found:?}");
        assert_eq!(found.at_edges, found.different, "{name}: {found:?}");
        assert!(
            found.different <= 1 && found.hits > rays.len() / 20,
            "{name}: {found:?}"
        );
    }
}

#[test]
fn more_triangles_than_a_binding_holds_are_a_named_error() {
    let Some(bench) = Bench::open() else { return };
    let one = meshes::soup("one", [[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]);
    let too_many = Mesh {
        indices: one.indices.repeat(2_800_000),
        ..one
    };
    let error = bench
        .build(&scene_of([(too_many, vec![DAffine3::IDENTITY])]))
        .unwrap_err();
    assert!(matches!(error, Error::LimitExceeded { .. }), "{error}");
}
