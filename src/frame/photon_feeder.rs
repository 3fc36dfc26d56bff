//! Photons that the processor traces in threads of its own while the GPU draws (photon streaming with virtual surface
//! lights, section 0.7.2).
//!
//! The thread that renders hands over a scene when it has changed and takes what is there when it is there: it never waits, and
//! no thread waits in a channel for it. Limits: bulbs, spots and suns have no extent; metal reflects like a mirror and glass
//! ends a path; textures are looked up without filtering, cut-outs are whole.

use crate::bvh_tree::binary_tree;
use crate::halton::radical_inverse;
use crate::resource::{Photon, PhotonMap, Photons};
use crate::scene::{EmissiveTriangle, Light, LightKind, Scene, Sun, UnitFrame, one_minus_cos};
use glam::{DVec3, Mat3, Vec2, Vec3, Vec3A};
use obvhs::bvh2::Bvh2;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;
use std::f32::consts::{PI, TAU};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver, Sender, SyncSender, TrySendError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Batches that wait to be taken.
const WAITING: usize = 2;

/// Between looks whether one was taken.
const PAUSE: Duration = Duration::from_micros(500);

/// Suns that stand for an environment.
const SUNS: usize = 24;

/// How far from where it leaves a surface a ray begins, unit frame.
const OFF_SURFACE: f32 = 1.0 / (1 << 14) as f32;

/// Threads that trace photons.
#[derive(Debug)]
pub struct PhotonFeeder {
    scenes: Sender<Snapshot>,
    /// Scenes handed over so far.
    newest: AtomicU64,
    /// `None` while it is dropped.
    batches: Option<Receiver<Batch>>,
    coordinator: Option<JoinHandle<()>>,
    counts: Arc<Counts>,
    paths: u32,
    bounces: u32,
}

/// What all threads have done.
#[derive(Debug, Default)]
struct Counts {
    impacts: AtomicU64,
    nanoseconds: AtomicU64,
}

/// Photons in the order that [`Photons`] has, and the number of their scene.
type Batch = (u64, Vec<Photon>);

/// A scene as it was handed over, and its number.
struct Snapshot {
    number: u64,
    frame: UnitFrame,
    scene: Arc<Scene>,
}

impl PhotonFeeder {
    /// Starts `threads` threads, which trace `paths` paths at a time of up to `bounces` scatterings: as many as [`Photons`]
    /// that they are for. They idle until there is a scene.
    pub fn new(paths: u32, bounces: u32, threads: usize) -> Self {
        let (scenes, new_scenes) = mpsc::channel();
        let (finished, batches) = mpsc::sync_channel(WAITING);
        let counts = Arc::new(Counts::default());
        let own = Coordinator {
            new_scenes,
            finished,
            counts: Arc::clone(&counts),
            paths,
            bounces,
            threads: threads.max(1),
        };
        Self {
            scenes,
            newest: AtomicU64::new(0),
            batches: Some(batches),
            coordinator: Some(thread::spawn(move || own.run())),
            counts,
            paths,
            bounces,
        }
    }

    /// Says what the scene is from now on, and the unit frame that photons are wanted in. Batches of scenes before are not
    /// taken any more.
    pub fn set_scene(&self, frame: &UnitFrame, scene: &Arc<Scene>) {
        let snapshot = Snapshot {
            number: self.newest.fetch_add(1, Ordering::Relaxed) + 1,
            frame: *frame,
            scene: Arc::clone(scene),
        };
        // Without a receiver the coordinator has panicked; then there are no photons.
        let _ = self.scenes.send(snapshot);
    }

    /// Uploads the next batch, if one is there and `photons` has room for as many paths of as many scatterings; else it leaves
    /// them alone and returns false. Does not wait.
    pub fn upload(&self, queue: &wgpu::Queue, photons: &Photons) -> bool {
        let fits = photons.count() == self.paths && photons.bounces() == self.bounces;
        let newest = self.newest.load(Ordering::Relaxed);
        let batches = self.batches.iter().filter(|_| fits).flat_map(Receiver::try_iter);
        let Some((_, mut batch)) = batches.into_iter().find(|(number, _)| *number == newest) else {
            return false;
        };
        if photons.map() != PhotonMap::Global {
            batch.iter_mut().for_each(|p| p.state &= !Photon::CAUSTIC);
        }
        queue.write_buffer(photons.buffer(), 0, bytemuck::cast_slice(&batch));
        true
    }

    /// Impacts that a second of tracing brought so far, by all threads together.
    pub fn impacts_per_second(&self) -> f64 {
        let seconds = self.counts.nanoseconds.load(Ordering::Relaxed) as f64 * 1e-9;
        self.counts.impacts.load(Ordering::Relaxed) as f64 / seconds.max(1e-9)
    }
}

impl Drop for PhotonFeeder {
    /// Stops the threads and waits for them: no longer than a batch, or the tree of a scene, takes.
    fn drop(&mut self) {
        self.batches = None;
        // An end of scenes as well, in case none has come yet.
        let (scenes, _) = mpsc::channel();
        self.scenes = scenes;
        if let Some(coordinator) = self.coordinator.take() {
            let _ = coordinator.join();
        }
    }
}

/// What follows a batch.
enum Next {
    Batch,
    Scene(Snapshot),
    End,
}

/// The thread that divides the work.
struct Coordinator {
    new_scenes: Receiver<Snapshot>,
    finished: SyncSender<Batch>,
    counts: Arc<Counts>,
    paths: u32,
    bounces: u32,
    threads: usize,
}

impl Coordinator {
    /// Until nobody wants batches any more.
    fn run(self) {
        let mut first = 0u32;
        let Ok(mut snapshot) = self.new_scenes.recv() else {
            return;
        };
        let mut world = World::new(&snapshot);
        loop {
            let start = Instant::now();
            let photons = self.trace(&world, first);
            let impacts = photons.iter().filter(|p| p.state & 3 == 1).count();
            self.counts.impacts.fetch_add(impacts as u64, Ordering::Relaxed);
            let nanoseconds = start.elapsed().as_nanos() as u64;
            self.counts.nanoseconds.fetch_add(nanoseconds, Ordering::Relaxed);
            first = first.wrapping_add(self.paths);
            match self.hand_over((snapshot.number, photons)) {
                Next::Batch => {}
                Next::Scene(newer) => {
                    snapshot = newer;
                    world = World::new(&snapshot);
                }
                Next::End => return,
            }
        }
    }

    /// Waits until there is room for a batch, or it is of no use.
    fn hand_over(&self, mut batch: Batch) -> Next {
        loop {
            if let Some(snapshot) = self.new_scenes.try_iter().last() {
                return Next::Scene(snapshot);
            }
            batch = match self.finished.try_send(batch) {
                Ok(()) => return Next::Batch,
                Err(TrySendError::Full(batch)) => batch,
                Err(TrySendError::Disconnected(_)) => return Next::End,
            };
            thread::sleep(PAUSE);
        }
    }

    /// A batch, in the order that [`Photons`] has.
    fn trace(&self, world: &World, first: u32) -> Vec<Photon> {
        let hops = self.bounces as usize + 1;
        let paths = self.paths as usize;
        let part = paths.div_ceil(self.threads).max(1);
        let trace = |range: std::ops::Range<usize>| -> Vec<Photon> {
            range
                .flat_map(|i| world.path(first.wrapping_add(i as u32), i, paths, hops))
                .collect()
        };
        let parts: Vec<Vec<Photon>> = thread::scope(|scope| {
            let starts = (0..paths).step_by(part);
            let own = starts.map(|start| scope.spawn(move || trace(start..(start + part).min(paths))));
            let handles: Vec<_> = own.collect();
            handles.into_iter().map(|h| h.join().unwrap_or_default()).collect()
        });
        let by_path: Vec<Photon> = parts.into_iter().flatten().collect();
        // Path by path; wanted hop by hop. A thread that panicked leaves none.
        let at = |hop: usize, path: usize| by_path.get(path * hops + hop).copied();
        let all = (0..hops).flat_map(|hop| (0..paths).map(move |path| (hop, path)));
        all.map(|(hop, path)| at(hop, path).unwrap_or_else(bytemuck::Zeroable::zeroed))
            .collect()
    }
}

/// A scene in the unit frame.
struct World {
    tree: Bvh2,
    triangles: Vec<Triangle>,
    /// Of each triangle its instance, and its corners' places in the mesh.
    origins: Vec<(usize, [u32; 3])>,
    scene: Arc<Scene>,
    sources: Vec<Source>,
    /// Share of all flux up to and with each source.
    until: Vec<f64>,
    radius: f32,
}

/// Where paths begin.
struct Source {
    kind: SourceKind,
    /// Unit-frame flux.
    flux: Vec3,
}

enum SourceKind {
    Point(Vec3),
    Spot {
        position: Vec3,
        direction: Vec3,
        inner: f32,
        outer: f32,
    },
    Parallel(Vec3),
    /// A parallelogram or a triangle by its corner and sides.
    Flat {
        corner: Vec3,
        u: Vec3,
        v: Vec3,
        is_triangle: bool,
    },
}

impl World {
    fn new(snapshot: &Snapshot) -> Self {
        let (frame, scene) = (&snapshot.frame, &snapshot.scene);
        let (mut triangles, mut origins) = (Vec::new(), Vec::new());
        for (index, instance) in scene.instances.iter().enumerate() {
            let to_unit = frame.transform(&instance.transform);
            let mesh = &scene.meshes[instance.mesh];
            let corner = |i: u32| Vec3A::from(to_unit.transform_point3(mesh.positions[i as usize].into()));
            for t in mesh.indices.chunks_exact(3) {
                triangles.push(Triangle {
                    v0: corner(t[0]),
                    v1: corner(t[1]),
                    v2: corner(t[2]),
                });
                origins.push((index, [t[0], t[1], t[2]]));
            }
        }
        let tree = binary_tree(triangles.iter().map(Triangle::aabb));
        let sources = sources(frame, scene);
        let mut sum = 0.0;
        let mut until: Vec<f64> = sources
            .iter()
            .map(|s| {
                sum += f64::from(s.flux.element_sum());
                sum
            })
            .collect();
        until.iter_mut().for_each(|u| *u /= sum.max(1e-300));
        Self {
            tree,
            triangles,
            origins,
            scene: Arc::clone(scene),
            sources,
            until,
            radius: frame.radius(),
        }
    }

    /// What becomes of a path, by hops. `index` of the random sequence; the i-th of so many.
    fn path(&self, index: u32, i: usize, paths: usize, hops: usize) -> Vec<Photon> {
        let mut photons = vec![bytemuck::Zeroable::zeroed(); hops];
        let mut random = Random::new(index);
        let pick = (i as f64 + random.unit(2)) / paths as f64;
        let source = self
            .until
            .partition_point(|&u| u <= pick)
            .min(self.sources.len().saturating_sub(1));
        let Some(Source { kind, flux }) = self.sources.get(source) else {
            return photons;
        };
        let share = self.until[source] - if source == 0 { 0.0 } else { self.until[source - 1] };
        let mut flux = *flux / (share * paths as f64) as f32;
        let (mut origin, mut direction) = kind.start(&mut random, self.radius);
        // By way of metal and glass alone so far; and since the last diffuse surface, how it was left and how far ago.
        let mut is_caustic = false;
        let (mut leaving, mut way) = (None, 0.0);
        for (hop, photon) in photons.iter_mut().enumerate() {
            let Some(hit) = self.hit(origin, direction) else { break };
            // Not diffuse, in one way or another.
            let lobe = u32::from(hit.is_metal || hit.is_glass) << 2;
            way += hit.position.distance(origin);
            let arriving = hit.normal.dot(direction).abs();
            let density = leaving.map_or(0.0, |cosine: f32| {
                cosine * arriving / (PI * way * way).max(f32::MIN_POSITIVE)
            });
            let caustic = if is_caustic { Photon::CAUSTIC } else { 0 };
            is_caustic = lobe != 0 && (hop == 0 || is_caustic);
            *photon = Photon {
                position: hit.position.to_array(),
                state: 1 | lobe | caustic | if hop == 0 { Photon::FIRST_HIT } else { 0 },
                flux: flux.to_array(),
                density,
                normal: Photon::pack_unit_vector(hit.normal),
                direction: Photon::pack_unit_vector(direction),
                reflectance: Photon::pack_reflectance(hit.reflectance.to_array()),
                light_and_surface: (source as u32 & 0xff) | u32::from(self.scene.instances[hit.instance].surface) << 16,
            };
            // Russian roulette by what the surface takes.
            let survival = hit.reflectance.max_element();
            if hit.is_glass || random.unit(3) as f32 >= survival {
                break;
            }
            flux *= hit.reflectance / survival;
            direction = match hit.is_metal {
                true => direction - 2.0 * direction.dot(hit.normal) * hit.normal,
                false => about(hit.normal) * cosine(random.pair()),
            };
            if !hit.is_metal {
                (leaving, way) = (Some(hit.normal.dot(direction)), 0.0);
            }
            origin = hit.position + OFF_SURFACE * hit.normal;
        }
        photons
    }

    fn hit(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        let ray = Ray::new_inf(origin.into(), direction.into());
        let mut nearest = RayHit::none();
        let order = &self.tree.primitive_indices;
        self.tree.ray_traverse(ray, &mut nearest, |ray, i| {
            self.triangles[order[i] as usize].intersect(ray)
        });
        if !(nearest.t.is_finite() && nearest.t < 1e30) {
            return None;
        }
        let index = *order.get(nearest.primitive_id as usize)? as usize;
        let triangle = &self.triangles[index];
        let normal = Vec3::from((triangle.v1 - triangle.v0).cross(triangle.v2 - triangle.v0)).normalize_or(Vec3::Y);
        let position = origin + nearest.t * direction;
        let (instance, corners) = self.origins[index];
        let material = &self.scene.materials[self.scene.instances[instance].material];
        let texel = material.base_color_texture.map_or(Vec3::ONE, |texture| {
            self.texel(texture, instance, corners, triangle, position)
        });
        Some(Hit {
            position,
            normal: if normal.dot(direction) > 0.0 { -normal } else { normal },
            reflectance: (Vec3::from(material.base_color) * texel).clamp(Vec3::ZERO, Vec3::ONE),
            is_metal: material.is_metal(),
            is_glass: material.is_transmissive(),
            instance,
        })
    }

    fn texel(&self, texture: usize, instance: usize, corners: [u32; 3], triangle: &Triangle, p: Vec3) -> Vec3 {
        let (texture, mesh) = (
            &self.scene.textures[texture],
            &self.scene.meshes[self.scene.instances[instance].mesh],
        );
        if mesh.tex_coords.is_empty() || texture.width == 0 || texture.height == 0 {
            return Vec3::ONE;
        }
        // Barycentric coordinates by areas.
        let [a, b, c] = [triangle.v0, triangle.v1, triangle.v2].map(Vec3::from);
        let whole = (b - a).cross(c - a);
        let inverse = 1.0 / whole.length_squared().max(1e-30);
        let v = whole.dot((p - a).cross(c - a)) * inverse;
        let w = whole.dot((b - a).cross(p - a)) * inverse;
        let at = |i: u32| Vec2::from(mesh.tex_coords[i as usize]);
        let uv = at(corners[0]) * (1.0 - v - w) + at(corners[1]) * v + at(corners[2]) * w;
        let place = |x: f32, size: u32| ((x - x.floor()) * size as f32).min(size as f32 - 1.0) as u32;
        let first = 4 * (place(uv.y, texture.height) * texture.width + place(uv.x, texture.width)) as usize;
        let rgb = texture.rgba.get(first..first + 3).unwrap_or(&[255; 3]);
        Vec3::from([0, 1, 2].map(|i| match texture.srgb {
            true => linear(f32::from(rgb[i]) / 255.0),
            false => f32::from(rgb[i]) / 255.0,
        }))
    }
}

struct Hit {
    position: Vec3,
    /// On the side hit.
    normal: Vec3,
    reflectance: Vec3,
    is_metal: bool,
    is_glass: bool,
    instance: usize,
}

/// Lights, suns for an environment, and what shines.
fn sources(frame: &UnitFrame, scene: &Scene) -> Vec<Source> {
    let environment = scene.lights.iter().find(|l| l.is_environment());
    let suns = environment.map_or_else(Vec::new, |light| {
        let LightKind::Environment { rotation, .. } = light.kind else {
            return Vec::new();
        };
        let suns = Sun::divide(scene.environment_image(), SUNS);
        suns.iter().map(|s| s.light(light.strength(), rotation)).collect()
    });
    let region = f64::from(frame.radius()) * frame.length_scale();
    let lights = scene.lights.iter().filter(|l| !l.is_environment()).chain(&suns);
    let of_light = |light: &Light| {
        let vector = |v: DVec3| (v / frame.length_scale()).as_vec3();
        let kind = match light.kind {
            LightKind::Point { position, .. } => SourceKind::Point(frame.point(position)),
            LightKind::Spot {
                position,
                direction,
                inner_angle,
                outer_angle,
                ..
            } => SourceKind::Spot {
                position: frame.point(position),
                direction: direction.normalize_or(DVec3::NEG_Y).as_vec3(),
                inner: one_minus_cos(inner_angle) as f32,
                outer: one_minus_cos(outer_angle) as f32,
            },
            LightKind::Directional { direction, .. } => {
                SourceKind::Parallel(direction.normalize_or(DVec3::NEG_Y).as_vec3())
            }
            LightKind::Rectangle { center, half_u, half_v } => SourceKind::Flat {
                corner: frame.point(center - half_u - half_v),
                u: vector(2.0 * half_u),
                v: vector(2.0 * half_v),
                is_triangle: false,
            },
            LightKind::Environment { .. } => return None,
        };
        let flux = frame.intensity(light.flux(region));
        Some(Source { kind, flux })
    };
    let of_triangle = |t: &EmissiveTriangle| {
        let [a, b, c] = t.corners.map(|p| frame.point(p));
        let flux = Vec3::from(t.radiance).as_dvec3() * std::f64::consts::PI * t.area();
        Source {
            kind: SourceKind::Flat {
                corner: a,
                u: b - a,
                v: c - a,
                is_triangle: true,
            },
            flux: frame.intensity(flux),
        }
    };
    let triangles = EmissiveTriangle::all_of(scene);
    let all = lights.filter_map(of_light).chain(triangles.iter().map(of_triangle));
    all.filter(|s| s.flux.element_sum() > 0.0).collect()
}

impl SourceKind {
    /// Where a path begins and which way it goes.
    fn start(&self, random: &mut Random, radius: f32) -> (Vec3, Vec3) {
        let [a, b] = random.pair();
        match *self {
            Self::Point(position) => {
                let z = 1.0 - 2.0 * a;
                (position, polar((1.0 - z * z).max(0.0).sqrt(), b, z))
            }
            Self::Spot {
                position,
                direction,
                inner,
                outer,
            } => {
                let penumbra = (outer - inner) / 3.0;
                let target = a * (inner + penumbra);
                let down = if target > inner {
                    outer - (outer - inner) * (1.0 - (target - inner) / penumbra).max(0.0).cbrt()
                } else {
                    target
                };
                let local = polar((down * (2.0 - down)).max(0.0).sqrt(), b, 1.0 - down);
                (position, about(direction) * local)
            }
            Self::Parallel(direction) => {
                let disc = polar(radius * a.sqrt(), b, 0.0);
                (about(direction) * disc - 2.0 * radius * direction, direction)
            }
            Self::Flat {
                corner,
                u,
                v,
                is_triangle,
            } => {
                let at = if is_triangle && a + b > 1.0 {
                    [1.0 - a, 1.0 - b]
                } else {
                    [a, b]
                };
                let normal = u.cross(v).normalize_or(Vec3::NEG_Y);
                let direction = about(normal) * cosine(random.pair());
                (corner + at[0] * u + at[1] * v + OFF_SURFACE * normal, direction)
            }
        }
    }
}

/// Numbers of one path: the first few of the Halton sequence, then of a hash.
struct Random {
    index: u32,
    drawn: u32,
}

impl Random {
    fn new(index: u32) -> Self {
        Self { index, drawn: 0 }
    }

    /// In [0, 1). `salt` tells uses apart.
    fn unit(&mut self, salt: u32) -> f64 {
        self.drawn += 1;
        let mut word = self.index ^ self.drawn.wrapping_mul(0x9e37_79b9) ^ salt.rotate_left(16);
        for _ in 0..2 {
            word = word.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            word = ((word >> ((word >> 28) + 4)) ^ word).wrapping_mul(277_803_737);
            word ^= word >> 22;
        }
        f64::from(word >> 8) / f64::from(1u32 << 24)
    }

    fn pair(&mut self) -> [f32; 2] {
        const BASES: [[u32; 2]; 3] = [[2, 3], [5, 7], [11, 13]];
        let pair = self.drawn as usize / 2;
        let pair = match BASES.get(pair) {
            Some(bases) => bases.map(|base| radical_inverse(self.index, base)),
            None => [self.unit(0), self.unit(1)],
        };
        self.drawn += 1;
        pair.map(|x| (x as f32).min(1.0 - f32::EPSILON))
    }
}

/// A right-handed frame with the given z axis (Duff et al. 2017).
fn about(z: Vec3) -> Mat3 {
    let sign = if z.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + z.z);
    let b = z.x * z.y * a;
    Mat3::from_cols(
        Vec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
        Vec3::new(b, sign + z.y * z.y * a, -z.y),
        z,
    )
}

fn polar(radius: f32, turn: f32, z: f32) -> Vec3 {
    let (sin, cos) = (TAU * turn).sin_cos();
    Vec3::new(radius * cos, radius * sin, z)
}

/// About +z, as dense as the cosine over π.
fn cosine([a, b]: [f32; 2]) -> Vec3 {
    polar(a.sqrt(), b, (1.0 - a).max(0.0).sqrt())
}

fn linear(srgb: f32) -> f32 {
    match srgb <= 0.040_45 {
        true => srgb / 12.92,
        false => ((srgb + 0.055) / 1.055).powf(2.4),
    }
}

#[cfg(all(test, feature = "samples"))]
mod tests {
    use super::*;
    use crate::scene::{SceneSummary, samples};

    fn world(scene: Scene) -> World {
        let summary = SceneSummary::of(&scene).unwrap();
        let frame = UnitFrame::new(&summary.bounds, summary.total_flux).unwrap();
        World::new(&Snapshot {
            number: 1,
            frame,
            scene: Arc::new(scene),
        })
    }

    #[test]
    fn in_a_furnace_every_hop_brings_the_reflectance_times_the_hop_before() {
        let world = world(samples::furnace(0.5, 1.0));
        let (paths, hops) = (20_000, 4);
        let mut flux = vec![0.0; hops];
        for i in 0..paths {
            let photons = world.path(i as u32, i, paths, hops);
            photons
                .iter()
                .zip(&mut flux)
                .for_each(|(p, f)| *f += f64::from(p.flux[0]));
        }
        println!("{flux:?}");
        for (a, b) in flux.iter().zip(&flux[1..]) {
            assert!((b / a - 0.5).abs() < 0.01, "{flux:?}");
        }
    }

    #[test]
    fn threads_end_when_they_are_no_longer_wanted() {
        // Before there is a scene, and in the middle of things.
        drop(PhotonFeeder::new(100, 2, 2));
        let feeder = PhotonFeeder::new(2000, 2, 2);
        let scene = Arc::new(samples::cornell(0.0));
        let summary = SceneSummary::of(&scene).unwrap();
        let frame = UnitFrame::new(&summary.bounds, summary.total_flux).unwrap();
        feeder.set_scene(&frame, &scene);
        while feeder.impacts_per_second() == 0.0 {
            thread::yield_now();
        }
        drop(feeder);
    }
}
