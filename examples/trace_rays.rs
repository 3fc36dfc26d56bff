//! What rays through a scene cost: nodes, triangles and bytes touched by a ray, rays a second, and how long trees take to
//! build, on the GPU and beside `obvhs` on the CPU.
//!
//! ```text
//! cargo run --release --example trace_rays -- sample:pillars --rays 1000000
//! ```
//!
//! The rays are those of diffuse light: from where paths that started at the first camera hit a surface for the second
//! time, in directions distributed by the cosine. The scene is traced as it is, instance by instance, and flattened into
//! one mesh, whose tree `obvhs` can follow on the CPU (one thread); beside it the tree that `obvhs` itself builds. A row
//! names the same rays as every other.

mod common;

use clap::Parser;
use common::adapter::{Gpu, Wishes};
use common::clock::Clock;
use common::offline::wait;
use common::sequence::Sequence;
use common::{arguments, named_scene};
use lightfall::glam::{DAffine3, DVec3, UVec2, Vec3, Vec3A};
use lightfall::pass::{BvhTracer, BvhTracerRayInputs, BvhTracerResources, RayQuery};
use lightfall::resource::{BvhGeometry, BvhGeometryConfig, Ray, RayHit, Rays};
use lightfall::scene::{Instance, Material, Mesh, Scene, UnitFrame};
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::cwbvh::node::CwBvhNode;
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use obvhs::{BvhBuildParams, traverse};
use std::time::{Duration, Instant};

/// Bytes that the GPU reads of a node, and of a triangle to test it.
const NODE_BYTES: f64 = size_of::<CwBvhNode>() as f64;
const TRIANGLE_BYTES: f64 = 48.0;
/// Triangles along each side of the large grid: a million in all.
const GRID: u32 = 708;

/// Prints what rays through a scene cost.
#[derive(Parser)]
struct Arguments {
    /// A .glb or .gltf file, or sample:NAME
    scene: String,
    /// How many rays, up to four million
    #[arg(long, default_value_t = 1_000_000, value_parser = clap::value_parser!(u32).range(1..=4_000_000))]
    rays: u32,
    /// How often each list is traced; the median counts
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    repeats: u32,
    /// Part of the adapter's name or backend
    #[arg(long)]
    adapter: Option<String>,
}

fn main() {
    let arguments: Arguments = arguments::parse("trace_rays");
    if let Err(message) = run(&arguments) {
        eprintln!("trace_rays: {message}");
        std::process::exit(2);
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let scene = named_scene::load(&arguments.scene, 0.0)?;
    let wishes = Wishes {
        timestamps: true,
        ..Wishes::default()
    };
    let gpu = Gpu::open(arguments.adapter.as_deref(), wishes)?;
    let bench = Bench::new(&gpu, arguments.repeats)?;
    println!("{}, {}", arguments.scene, gpu.describe());

    let flat = flatten(&scene)?;
    println!("\n| build | triangles | nodes | seconds | obvhs alone, seconds | GPU, bytes a triangle | CPU |");
    println!("|---|---|---|---|---|---|---|");
    let (flat_geometry, flat_frame) = bench.build("the scene as one mesh", &flat)?;
    bench.build("noise over a grid", &alone(noisy_grid()))?;

    let (geometry, frame) = bench.place(&scene)?;
    let rays = bench.diffuse_rays(&scene, &geometry, &frame, arguments.rays)?;
    println!("\n{} rays.\n", rays.len());
    println!(
        "| rays | nodes a ray: mean, 50, 95, 99 % | triangles: mean, 50, 95, 99 % | bytes | million rays a second |"
    );
    println!("|---|---|---|---|---|");
    for (name, query) in [("closest", RayQuery::Closest), ("any", RayQuery::Any)] {
        for (how, geometry) in [("instances", &geometry), ("one mesh", &flat_geometry)] {
            let (hits, seconds) = bench.trace(geometry, query, &rays)?;
            let counts: Vec<_> = hits.iter().map(|h| [h.nodes_visited, h.triangles_visited]).collect();
            row(&format!("{name}, {how}, {}", bench.clock()), &counts, seconds);
        }
        for (how, tree) in [
            ("one mesh, CPU", CpuTree::shared(&flat_geometry, &flat)),
            ("one mesh, CPU, tree by obvhs", CpuTree::by_obvhs(&flat)),
        ] {
            let (counts, seconds) = tree.trace(query, &rays, &flat_frame);
            row(&format!("{name}, {how}"), &counts, seconds);
        }
    }
    gpu.check()
}

/// One line of the table.
fn row(name: &str, counts: &[[u32; 2]], seconds: f64) {
    let statistics = |which: usize| {
        let mut sorted: Vec<u32> = counts.iter().map(|c| c[which]).collect();
        sorted.sort_unstable();
        let mean = sorted.iter().map(|&n| f64::from(n)).sum::<f64>() / sorted.len() as f64;
        let at = |part: f64| sorted[(part * (sorted.len() - 1) as f64) as usize];
        (mean, format!("{mean:.1}, {}, {}, {}", at(0.5), at(0.95), at(0.99)))
    };
    let ((nodes, node_text), (triangles, triangle_text)) = (statistics(0), statistics(1));
    let bytes = nodes * NODE_BYTES + triangles * TRIANGLE_BYTES;
    let rate = counts.len() as f64 / seconds * 1e-6;
    println!("| {name} | {node_text} | {triangle_text} | {bytes:.0} | {rate:.2} |");
}

/// What it takes to trace rays on the GPU and time it.
struct Bench<'a> {
    gpu: &'a Gpu,
    tracer: BvhTracer,
    repeats: u32,
}

impl<'a> Bench<'a> {
    fn new(gpu: &'a Gpu, repeats: u32) -> Result<Self, String> {
        Ok(Self {
            gpu,
            tracer: BvhTracer::new(&gpu.device),
            repeats,
        })
    }

    fn clock(&self) -> &'static str {
        match Clock::new(self.gpu).kind() {
            "gpu" => "GPU",
            _ => "GPU by the wall clock",
        }
    }

    fn place(&self, scene: &Scene) -> Result<(BvhGeometry, UnitFrame), String> {
        let place = || {
            let frame = UnitFrame::new(&scene.bounds()?, 1.0)?;
            let Gpu { device, queue, .. } = self.gpu;
            let mut geometry = BvhGeometry::new(device, queue, scene, &BvhGeometryConfig::default())?;
            geometry.prepare(queue, &frame)?;
            Ok((geometry, frame))
        };
        place().map_err(|error: lightfall::Error| error.to_string())
    }

    /// Builds the trees of a scene of one mesh and prints what it takes, in turns with the same build by `obvhs`.
    fn build(&self, name: &str, scene: &Scene) -> Result<(BvhGeometry, UnitFrame), String> {
        let (mut own, mut obvhs) = (Vec::new(), Vec::new());
        for _ in 0..3 {
            let start = Instant::now();
            self.place(scene)?;
            own.push(start.elapsed().as_secs_f64());
            let start = Instant::now();
            CpuTree::by_obvhs(scene);
            obvhs.push(start.elapsed().as_secs_f64());
        }
        let (geometry, frame) = self.place(scene)?;
        let triangles = geometry.triangle_count();
        let a_triangle = |bytes: u64| bytes as f64 / triangles as f64;
        println!(
            "| {name} | {triangles} | {} | {:.3} | {:.3} | {:.1} | {:.1} |",
            geometry.node_count(),
            median(own),
            median(obvhs),
            a_triangle(geometry.memory_use()),
            a_triangle(geometry.cpu_memory_use()),
        );
        Ok((geometry, frame))
    }

    /// What rays hit, and the seconds it takes.
    fn trace(&self, geometry: &BvhGeometry, query: RayQuery, rays: &[Ray]) -> Result<(Vec<RayHit>, f64), String> {
        let trace = |clock: &mut Clock| {
            let Gpu { device, queue, .. } = self.gpu;
            let list = Rays::new(device, rays.len() as u32)?;
            list.write(queue, rays)?;
            let mut resources = BvhTracerResources::new(device)?;
            // The first time warms up.
            for _ in 0..=self.repeats {
                let timed = clock.time(self.gpu, |timestamps| {
                    let mut encoder = device.create_command_encoder(&Default::default());
                    let inputs = BvhTracerRayInputs {
                        queue,
                        geometry,
                        rays: &list,
                        query,
                        timestamps,
                    };
                    self.tracer.record_rays(&mut encoder, &mut resources, &inputs);
                    if let Some(timestamps) = timestamps {
                        timestamps.resolve(&mut encoder);
                    }
                    queue.submit([encoder.finish()]);
                    wait(device)
                });
                timed.map_err(|reason| lightfall::Error::ReadBack { what: "hits", reason })?;
            }
            lightfall::read_buffer_blocking(device, queue, list.hits())
        };
        let mut clock = Clock::new(self.gpu);
        let mut hits: Vec<RayHit> = trace(&mut clock).map_err(|error: lightfall::Error| error.to_string())?;
        hits.truncate(rays.len());
        Ok((hits, clock.frame_ms()[0] * 1e-3))
    }

    /// Rays of diffuse light at the second surface that paths from the first camera meet.
    fn diffuse_rays(
        &self,
        scene: &Scene,
        geometry: &BvhGeometry,
        frame: &UnitFrame,
        count: u32,
    ) -> Result<Vec<Ray>, String> {
        let camera = scene.cameras.first().ok_or("the scene has no camera")?;
        let eye = frame.point(camera.transform.translation);
        let mut random = Sequence::default();
        let mut rays: Vec<_> = (0..count).map(|_| leaving(eye, random.direction())).collect();
        for _ in 0..2 {
            let (hits, _) = self.trace(geometry, RayQuery::Closest, &rays)?;
            rays = rays
                .iter()
                .zip(&hits)
                .filter(|(_, hit)| hit.is_hit())
                .map(|(ray, hit)| bounce(scene, frame, ray, hit, &mut random))
                .collect();
        }
        if rays.is_empty() {
            return Err("no path from the first camera meets two surfaces".into());
        }
        Ok(rays)
    }
}

fn leaving(origin: Vec3, direction: DVec3) -> Ray {
    Ray {
        origin: origin.to_array(),
        furthest: Ray::FURTHEST,
        direction: direction.as_vec3().to_array(),
        mask: Ray::ALL,
    }
}

/// The ray scattered by a diffuse surface.
fn bounce(scene: &Scene, frame: &UnitFrame, ray: &Ray, hit: &RayHit, random: &mut Sequence) -> Ray {
    /// Off the surface, in unit-frame lengths.
    const OFFSET: f64 = 1e-5;
    let instance = &scene.instances[hit.instance as usize];
    let mesh = &scene.meshes[instance.mesh];
    let corner = |k: usize| {
        let vertex = mesh.indices[3 * hit.triangle as usize + k];
        let world = instance
            .transform
            .transform_point3(Vec3::from(mesh.positions[vertex as usize]).as_dvec3());
        (world - frame.center()) / frame.length_scale()
    };
    let [a, b, c] = [0, 1, 2].map(corner);
    let [v, w] = hit.barycentric.map(f64::from);
    let normal = (b - a).cross(c - a).normalize_or(DVec3::Y);
    let side = -normal.dot(Vec3::from(ray.direction).as_dvec3()).signum() * normal;
    let point = a + v * (b - a) + w * (c - a) + OFFSET * side;
    // The sum of a normal and a point of the unit sphere is distributed by the cosine.
    leaving(point.as_vec3(), (side + random.direction()).normalize_or(side))
}

/// All triangles of a scene as one mesh, in its unit frame.
fn flatten(scene: &Scene) -> Result<Scene, String> {
    let bounds = scene.bounds().map_err(|error| error.to_string())?;
    let frame = UnitFrame::new(&bounds, 1.0).map_err(|error| error.to_string())?;
    let mut all = Mesh::default();
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh];
        let first = all.positions.len() as u32;
        let place = |&p: &[f32; 3]| frame.point(instance.transform.transform_point3(Vec3::from(p).as_dvec3()));
        all.positions.extend(mesh.positions.iter().map(|p| place(p).to_array()));
        all.indices.extend(mesh.indices.iter().map(|i| first + i));
    }
    Ok(alone(all))
}

/// A scene of one mesh.
fn alone(mesh: Mesh) -> Scene {
    Scene {
        meshes: vec![mesh],
        materials: vec![Material::default()],
        instances: vec![Instance {
            transform: DAffine3::IDENTITY,
            ..Instance::new(0, 0)
        }],
        ..Scene::default()
    }
}

/// A square of a million triangles whose height is noise.
fn noisy_grid() -> Mesh {
    let line = GRID + 1;
    let mut random = Sequence::default();
    let mut point = |i: u32| {
        let at = |i: u32| 2.0 * i as f32 / GRID as f32 - 1.0;
        [at(i % line), 0.01 * random.direction().y as f32, at(i / line)]
    };
    let cell = |i: u32| {
        let a = i / GRID * line + i % GRID;
        [a, a + line, a + 1, a + 1, a + line, a + line + 1]
    };
    Mesh {
        positions: (0..line * line).map(&mut point).collect(),
        indices: (0..GRID * GRID).flat_map(cell).collect(),
        ..Mesh::default()
    }
}

/// The tree of a mesh for one thread of the CPU.
struct CpuTree {
    tree: CwBvh,
    /// In the order of the leaves.
    triangles: Vec<RtTriangle>,
    /// The frame of the tree in mesh space.
    center: DVec3,
    scale: f64,
}

impl CpuTree {
    /// The tree that the GPU follows.
    fn shared(geometry: &BvhGeometry, scene: &Scene) -> Self {
        let own = geometry.mesh_tree(0).expect("the scene is one mesh");
        let place = |&vertex: &u32| {
            let p = Vec3::from(scene.meshes[0].positions[vertex as usize]).as_dvec3();
            Vec3A::from(((p - own.center) / own.scale).as_vec3())
        };
        Self {
            tree: CwBvh {
                nodes: own.nodes.to_vec(),
                ..CwBvh::default()
            },
            triangles: own
                .corners
                .iter()
                .map(|t| RtTriangle::new(place(&t[0]), place(&t[1]), place(&t[2])))
                .collect(),
            center: own.center,
            scale: own.scale,
        }
    }

    /// The tree that `obvhs` builds over the same triangles.
    fn by_obvhs(scene: &Scene) -> Self {
        let mesh = &scene.meshes[0];
        let corner = |&vertex: &u32| Vec3A::from(mesh.positions[vertex as usize]);
        let triangles: Vec<_> = mesh
            .indices
            .chunks_exact(3)
            .map(|t| Triangle {
                v0: corner(&t[0]),
                v1: corner(&t[1]),
                v2: corner(&t[2]),
            })
            .collect();
        let tree = build_cwbvh(&triangles, BvhBuildParams::medium_build(), &mut Duration::default());
        Self {
            triangles: tree
                .primitive_indices
                .iter()
                .map(|&i| (&triangles[i as usize]).into())
                .collect(),
            tree,
            center: DVec3::ZERO,
            scale: 1.0,
        }
    }

    /// Nodes and triangles that each ray is tested against, and the seconds it takes.
    fn trace(&self, query: RayQuery, rays: &[Ray], frame: &UnitFrame) -> (Vec<[u32; 2]>, f64) {
        let own_rays: Vec<_> = rays
            .iter()
            .map(|ray| {
                let world = frame.world_point(ray.origin.into());
                let origin = ((world - self.center) / self.scale).as_vec3();
                let direction = (Vec3::from(ray.direction).as_dvec3() * frame.length_scale() / self.scale).as_vec3();
                obvhs::ray::Ray::new_inf(origin.into(), direction.into())
            })
            .collect();
        let start = Instant::now();
        let counts = own_rays.iter().map(|ray| self.trace_one(query, *ray)).collect();
        (counts, start.elapsed().as_secs_f64())
    }

    fn trace_one(&self, query: RayQuery, mut ray: obvhs::ray::Ray) -> [u32; 2] {
        let mut state = self.tree.new_traversal(ray.direction);
        let (mut nodes, mut triangles) = (0, 0);
        let mut node;
        traverse!(
            self.tree,
            node,
            state,
            {
                nodes += 1;
                node.intersect_ray(&ray, state.oct_inv4)
            },
            {
                triangles += 1;
                let t = self.triangles[state.primitive_id as usize].intersect(&ray);
                if t < ray.tmax {
                    ray.tmax = t;
                    if query == RayQuery::Any {
                        return [nodes, triangles];
                    }
                }
            }
        );
        [nodes, triangles]
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
