//! Rays against triangles, compared with brute force in `f64`.
#![cfg(feature = "bvh")]

mod common;

use common::statistics::Random;
use common::{Gpu, assert_no_errors, gpu};
use lightfall::glam::{DVec3, Vec3};
use lightfall::pass::{BvhTracer, BvhTracerRayInputs, BvhTracerResources, RayQuery};
use lightfall::resource::{BvhGeometry, BvhGeometryConfig, Ray, RayHit, Rays};
use lightfall::scene::{Scene, UnitFrame, samples};

/// What rays hit, by the GPU.
fn trace(gpu: &Gpu, geometry: &BvhGeometry, query: RayQuery, rays: &[Ray]) -> Vec<RayHit> {
    let list = Rays::new(&gpu.device, rays.len() as u32).unwrap();
    list.write(&gpu.queue, rays).unwrap();
    let tracer = BvhTracer::new(&gpu.device);
    let mut resources = BvhTracerResources::new(&gpu.device).unwrap();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let inputs = BvhTracerRayInputs {
        queue: &gpu.queue,
        geometry,
        rays: &list,
        query,
        timestamps: None,
    };
    tracer.record_rays(&mut encoder, &mut resources, &inputs);
    gpu.queue.submit([encoder.finish()]);
    lightfall::read_buffer_blocking(&gpu.device, &gpu.queue, list.hits()).unwrap()
}

/// Where a ray meets a triangle, in `f64` (Möller and Trumbore 1997).
fn meets(origin: DVec3, direction: DVec3, [a, b, c]: [DVec3; 3]) -> Option<f64> {
    let (ab, ac) = (b - a, c - a);
    let across = direction.cross(ac);
    let determinant = ab.dot(across);
    let u = (origin - a).dot(across) / determinant;
    let along = (origin - a).cross(ab);
    let v = direction.dot(along) / determinant;
    let t = ac.dot(along) / determinant;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some(t)
}

/// All triangles in the unit frame: instance, index, corners.
fn triangles(scene: &Scene, frame: &UnitFrame) -> Vec<(u32, u32, [DVec3; 3])> {
    let mut all = Vec::new();
    for (index, instance) in (0..).zip(&scene.instances) {
        let mesh = &scene.meshes[instance.mesh];
        let corner = |vertex: u32| {
            let p = instance
                .transform
                .transform_point3(Vec3::from(mesh.positions[vertex as usize]).as_dvec3());
            (p - frame.center()) / frame.length_scale()
        };
        for (number, t) in (0..).zip(mesh.indices.chunks_exact(3)) {
            all.push((index, number, [corner(t[0]), corner(t[1]), corner(t[2])]));
        }
    }
    all
}

#[test]
fn the_closest_hit_is_the_one_that_brute_force_finds() {
    let Some(gpu) = gpu() else {
        return;
    };
    for name in ["cornell", "two-rooms", "pillars"] {
        let scene = samples::by_name(name, 0.7).unwrap();
        let frame = UnitFrame::new(&scene.bounds().unwrap(), 1.0).unwrap();
        let mut geometry = BvhGeometry::new(&gpu.device, &gpu.queue, &scene, &BvhGeometryConfig::default()).unwrap();
        geometry.prepare(&gpu.queue, &frame).unwrap();
        let mut random = Random(7);
        let rays: Vec<Ray> = (0..20_000)
            .map(|_| {
                let mut signed = || 2.0 * random.unit() - 1.0;
                Ray {
                    origin: [0.4 * signed(), 0.4 * signed(), 0.4 * signed()],
                    furthest: Ray::FURTHEST,
                    direction: [signed(), signed(), signed()],
                    mask: Ray::ALL,
                }
            })
            .collect();
        let hits = trace(&gpu, &geometry, RayQuery::Closest, &rays);
        let all = triangles(&scene, &frame);
        let mut differ = 0;
        for (ray, hit) in rays.iter().zip(&hits) {
            let (o, d) = (Vec3::from(ray.origin).as_dvec3(), Vec3::from(ray.direction).as_dvec3());
            let truth = all
                .iter()
                .filter_map(|(i, n, t)| meets(o, d, *t).map(|t| (t, *i, *n)))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let found = hit.is_hit().then(|| f64::from(hit.distance));
            let same = match (truth, found) {
                (None, None) => true,
                (Some((t, ..)), Some(f)) => (t - f).abs() * d.length() < 1e-5,
                _ => false,
            };
            differ += usize::from(!same);
        }
        let nodes: u32 = hits.iter().map(|h| h.nodes_visited).sum();
        println!("{name}: {differ} differ, {} nodes a ray", f64::from(nodes) / 20_000.0);
        assert_eq!(differ, 0, "{name}");
        assert_no_errors(&gpu);
    }
}
