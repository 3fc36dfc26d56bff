//! Rays through environment maps: exact where a map sees everything, close to what triangles say where it does not, honest
//! about what they cannot tell, and the same in any unit.
#![cfg(feature = "bvh")]

mod common;

#[allow(dead_code, reason = "the study uses all of it")]
#[path = "../examples/trace_study/bench.rs"]
mod bench;
#[allow(dead_code, reason = "the study uses all of it")]
#[path = "../examples/trace_study/judge.rs"]
mod judge;

use bench::{Bench, Maps};
use common::meshes::room;
use common::statistics::Random;
use common::{Gpu, assert_no_errors, gpu};
use judge::{Verdict, judge};
use lightfall::Error;
use lightfall::frame::{GiRenderer, Settings};
use lightfall::glam::{DAffine3, DVec3, Vec3};
use lightfall::pass::{
    ImageSpaceTracer, ImageSpaceTracerRayInputs, ImageSpaceTracerResources, ImageSpaceTracerSettings, TraceMethod,
};
use lightfall::resource::cube_face::CUBE_FACES;
use lightfall::resource::{EnvMaps, Photon, PhotonState, SurfaceHit, SurfaceHitKind, SurfaceRay, SurfaceRays};
use lightfall::scene::{SceneSummary, samples};

/// Methods that say whether they are certain.
const ORDERED: [TraceMethod; 3] = [
    TraceMethod::OrderedMarch,
    TraceMethod::OrderedWalk,
    TraceMethod::VerifiedWalk,
];

fn trace(bench: &Bench<'_>, method: TraceMethod, maps: &Maps, rays: &[SurfaceRay]) -> Vec<SurfaceHit> {
    let tracer = ImageSpaceTracer::new(&bench.gpu.device, method);
    bench
        .trace(&tracer, &ImageSpaceTracerSettings::default(), maps, rays)
        .unwrap()
        .0
}

/// Rays from the walls of the cube, whose half extent is `half` in the unit frame, and where they meet it again.
fn wall_rays(half: f32, directions: impl Iterator<Item = Vec3>) -> Vec<(SurfaceRay, f32)> {
    let mut random = Random(3);
    let mut rays = Vec::new();
    for (i, direction) in directions.enumerate() {
        let face = CUBE_FACES[i % 6];
        let [s, t] = [0, 1].map(|_| 1.9 * random.unit() - 0.95);
        let position = half * (face.forward + s * face.right + t * face.up);
        let normal = -face.forward;
        if direction.dot(normal) < 0.01 {
            continue;
        }
        let origin = position + normal / 4096.0;
        let to_walls = (Vec3::splat(half).copysign(direction) - origin) / direction;
        rays.push((SurfaceRay::new(position, normal, direction), to_walls.min_element()));
    }
    rays
}

fn is_hit(hit: &SurfaceHit) -> bool {
    matches!(hit.kind(), SurfaceHitKind::Surface | SurfaceHitKind::Tentative)
}

fn directions(count: usize) -> impl Iterator<Item = Vec3> {
    let mut random = Random(7);
    (0..count).map(move |_| random.direction().as_vec3())
}

#[test]
fn what_one_map_sees_whole_is_traced_exactly() {
    let Some(gpu) = gpu() else { return };
    let mut bench = Bench::new(&gpu, room(DVec3::ONE)).unwrap();
    let half = bench.frame.point(DVec3::ONE).x;
    // The middle, anywhere, near a wall; sides that are no power of two. Along a wall that a map stands
    // close to, and in the cube's own edges, one texel shows one wall where another begins: some of what goes there is lost.
    for (center, size, least_found, least_certain) in [
        (Vec3::ZERO, 64, 0.999, 0.95),
        (Vec3::new(0.3, -0.2, 0.1) * half, 64, 0.998, 0.95),
        (Vec3::new(0.97, 0.1, -0.3) * half, 64, 0.99, 0.8),
        (Vec3::new(-0.3, 0.2, 0.5) * half, 33, 0.995, 0.85),
        (Vec3::ZERO, 100, 0.999, 0.96),
    ] {
        let maps = bench.capture(&[center], size).unwrap();
        let (rays, truths): (Vec<_>, Vec<_>) = wall_rays(half, directions(20_000)).into_iter().unzip();
        for method in [
            TraceMethod::OrderedWalk,
            TraceMethod::VerifiedWalk,
            TraceMethod::NearestWalk,
        ] {
            let hits = trace(&bench, method, &maps, &rays);
            let certain = hits.iter().filter(|h| h.kind() == SurfaceHitKind::Surface).count();
            let found = hits.iter().filter(|h| is_hit(h)).count();
            let mut errors: Vec<f64> = hits
                .iter()
                .zip(&truths)
                .filter(|(hit, _)| is_hit(hit))
                .map(|(hit, truth)| f64::from((hit.distance - truth).abs()))
                .collect();
            let [usual, high] = [0.5, 0.99].map(|part| judge::percentile(&mut errors, part));
            println!(
                "{method:?} from {center} at {size}²: {found} found, {certain} certain of {}, error {usual:.1e}, 99 % {high:.1e}",
                rays.len()
            );
            assert!(found as f64 >= least_found * rays.len() as f64);
            assert!(certain as f64 >= least_certain * rays.len() as f64);
            assert!(usual < 2e-5 && high < 2e-3, "{usual} {high}");
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn rays_along_axes_edges_and_through_centres_arrive() {
    let Some(gpu) = gpu() else { return };
    let mut bench = Bench::new(&gpu, room(DVec3::ONE)).unwrap();
    let half = bench.frame.point(DVec3::ONE).x;
    let mut special = Vec::new();
    for face in CUBE_FACES {
        // Through the map's centre and out again, along a face's middle line, through edges and corners of the map's cube.
        let start = -half * face.forward;
        special.extend([
            SurfaceRay::new(start, face.forward, face.forward),
            SurfaceRay::new(start, face.forward, (face.forward + 1e-7 * face.up).normalize()),
            SurfaceRay::new(start + 0.5 * half * face.up, face.forward, face.forward),
            SurfaceRay::new(start + 0.5 * half * (face.up + face.right), face.forward, face.forward),
            SurfaceRay::new(start, face.forward, (face.forward + face.up).normalize()),
            SurfaceRay::new(
                start,
                face.forward,
                (face.forward + 0.999 * face.up - 0.999 * face.right).normalize(),
            ),
        ]);
    }
    for size in [4, 33, 64] {
        let maps = bench.capture(&[Vec3::ZERO], size).unwrap();
        let truths = bench.truths(&special).unwrap();
        for method in TraceMethod::ALL {
            for (i, hit) in trace(&bench, method, &maps, &special).iter().enumerate() {
                assert!(
                    hit.distance.is_finite() && hit.distance >= 0.0,
                    "{method:?}, ray {i}: {hit:?}"
                );
                if size == 64 && ORDERED[1..].contains(&method) {
                    let truth = truths[i].unwrap();
                    let right = is_hit(hit) && (hit.distance - truth.distance).abs() < 1e-3;
                    assert!(right, "{method:?}, ray {i}: {hit:?}, {truth:?}");
                }
            }
        }
    }
    assert_no_errors(&gpu);
}

/// Places for so many maps as the renderer finds them, unit frame.
fn places(bench: &mut Bench<'_>, count: u32) -> Vec<Vec3> {
    let mut settings = Settings {
        env_map_count: count,
        photons: 30_000,
        ..Settings::balanced()
    };
    settings.selector.coverage_target = 1.0;
    settings.selector.candidates = 100;
    let queue = &bench.gpu.queue;
    let mut renderer = GiRenderer::new(&bench.gpu.device, &settings).unwrap();
    let summary = SceneSummary::of(&bench.scene).unwrap();
    renderer.set_scene(queue, &summary, &bench.scene.lights).unwrap();
    renderer.place_env_maps_blocking(queue, &mut bench.geometry).unwrap();
    renderer.env_maps().unwrap().centers().to_vec()
}

fn verdict(bench: &Bench<'_>, method: TraceMethod, maps: &Maps, rays: &[SurfaceRay]) -> Verdict {
    let truths = bench.truths(rays).unwrap();
    judge(&truths, &trace(bench, method, maps, rays), bench.diagonal)
}

#[test]
fn walks_find_what_triangles_find() {
    let Some(gpu) = gpu() else { return };
    // Scene, least share that is right, of all rays once unsure ones are traced again, most traced again.
    for (scene, [right, hybrid, again]) in [
        (samples::cornell(0.0), [0.99, 0.998, 0.02]),
        (samples::two_rooms(2.0), [0.98, 0.995, 0.03]),
        (samples::pillars(0.0), [0.96, 0.99, 0.06]),
    ] {
        let mut bench = Bench::new(&gpu, scene).unwrap();
        let rays = bench.rays(10_000).unwrap();
        let centers = places(&mut bench, 8);
        let maps = bench.capture(&centers, 256).unwrap();
        let fewer = bench.capture(&centers[..4], 256).unwrap();
        let mut walked = [0.0; 3];
        for (method, share) in ORDERED.into_iter().zip(&mut walked) {
            let v = verdict(&bench, method, &maps, &rays);
            println!("{method:?}: {v:?}");
            *share = v.correct;
        }
        let v = verdict(&bench, TraceMethod::VerifiedWalk, &maps, &rays);
        assert!(v.correct >= right && v.hybrid >= hybrid && v.again <= again, "{v:?}");
        // Asking the maps in order beats taking the nearest hit of all; more maps cost nothing.
        let nearest = verdict(&bench, TraceMethod::NearestWalk, &maps, &rays).correct;
        assert!(walked[1] > nearest, "{} {nearest}", walked[1]);
        let with_fewer = verdict(&bench, TraceMethod::OrderedWalk, &fewer, &rays).correct;
        assert!(walked[1] >= with_fewer - 0.003, "{} {with_fewer}", walked[1]);
    }
    assert_no_errors(&gpu);
}

#[test]
fn doubts_and_limits_make_tentative_and_lost_what_a_surer_tracer_should_see() {
    let Some(gpu) = gpu() else { return };
    let mut bench = Bench::new(&gpu, samples::pillars(0.0)).unwrap();
    let rays = bench.rays(5_000).unwrap();
    let truths = bench.truths(&rays).unwrap();
    let centers = places(&mut bench, 8);
    let maps = bench.capture(&centers, 128).unwrap();
    let tracer = ImageSpaceTracer::new(&gpu.device, TraceMethod::OrderedWalk);
    let with = |settings| {
        let hits = bench.trace(&tracer, &settings, &maps, &rays).unwrap().0;
        (judge(&truths, &hits, bench.diagonal), hits)
    };
    let usual = ImageSpaceTracerSettings::default();
    let (plain, plain_hits) = with(usual);
    let (doubting, doubting_hits) = with(ImageSpaceTracerSettings {
        doubts_normals: true,
        ..usual
    });
    // Nothing else is hit; more is said to be unsure, and rightly so.
    for (a, b) in plain_hits.iter().zip(&doubting_hits) {
        assert_eq!((a.distance, a.normal, a.fetches), (b.distance, b.normal, b.fetches));
        assert!(a.kind == b.kind || (a.kind(), b.kind()) == (SurfaceHitKind::Surface, SurfaceHitKind::Tentative));
    }
    assert!(doubting.again > plain.again && doubting.hybrid > plain.hybrid);
    let (limited, hits) = with(ImageSpaceTracerSettings {
        most_fetches: 60,
        ..usual
    });
    assert!(limited.again > plain.again && limited.hybrid >= plain.hybrid - 0.002);
    // A texel more, and a look at each map whether it knows the ray's origin.
    assert!(
        hits.iter().all(|h| h.fetches <= 60 + 2 + 8),
        "{:?}",
        hits.iter().map(|h| h.fetches).max()
    );
    assert_no_errors(&gpu);
}

#[test]
fn a_limit_of_fetches_is_for_each_ray_and_not_for_the_path() {
    let Some(gpu) = gpu() else { return };
    let mut bench = Bench::new(&gpu, samples::pillars(0.0)).unwrap();
    let centers = places(&mut bench, 4);
    let lost = |bench: &mut Bench<'_>, most_fetches| {
        let mut settings = Settings {
            photons: 3000,
            bounces: 3,
            env_map_count: 4,
            ..Settings::balanced()
        };
        settings.tracer.most_fetches = most_fetches;
        let photons = bench.photons(&settings, &centers).unwrap();
        let hops = photons.chunks_exact(3000).take(4);
        hops.map(|hop| hop.iter().filter(|p| p.state() == PhotonState::Lost).count() as f64 / 3000.0)
            .collect::<Vec<_>>()
    };
    let (free, limited) = (lost(&mut bench, 0), lost(&mut bench, 150));
    println!("lost without a limit {free:?}, with 150 fetches {limited:?}");
    assert!(limited[1] > free[1]);
    // Rays of later hops are like those of the first.
    assert!(limited[3] < 2.0 * limited[1] + 0.01);
    assert_no_errors(&gpu);
}

#[test]
fn a_scene_in_other_units_is_traced_bit_for_bit_alike() {
    let Some(gpu) = gpu() else { return };
    let mut seen: Option<Vec<SurfaceHit>> = None;
    for exponent in [0, -30, 30] {
        let mut scene = samples::pillars(0.0);
        let scale = DVec3::splat(2f64.powi(exponent));
        for instance in &mut scene.instances {
            instance.transform = DAffine3::from_scale(scale) * instance.transform;
        }
        let mut bench = Bench::new(&gpu, scene).unwrap();
        let centers = [
            Vec3::new(0.1, 0.0, 0.2),
            Vec3::new(-0.3, 0.05, 0.1),
            Vec3::new(0.4, -0.05, -0.1),
        ];
        let maps = bench.capture(&centers, 64).unwrap();
        let mut random = Random(11);
        let rays: Vec<_> = (0..2000)
            .map(|_| {
                let normal = random.direction().as_vec3();
                let position = 0.2 * random.direction().as_vec3();
                SurfaceRay::new(
                    position,
                    normal,
                    (normal + random.direction().as_vec3()).normalize_or(normal),
                )
            })
            .collect();
        let hits = trace(&bench, TraceMethod::VerifiedWalk, &maps, &rays);
        assert!(hits.iter().filter(|h| is_hit(h)).count() > 1000);
        match &seen {
            None => seen = Some(hits),
            Some(before) => assert!(hits == *before),
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn a_walk_without_a_hierarchy_is_refused_and_records_nothing() {
    let Some(gpu) = gpu() else { return };
    let Gpu { device, queue, .. } = &gpu;
    let maps = EnvMaps::new(device, 1, 4).unwrap();
    let rays = SurfaceRays::new(device, 1).unwrap();
    let mut resources = ImageSpaceTracerResources::new(device).unwrap();
    for method in TraceMethod::ALL {
        let tracer = ImageSpaceTracer::new(device, method);
        let mut encoder = device.create_command_encoder(&Default::default());
        let inputs = ImageSpaceTracerRayInputs {
            queue,
            env_maps: &maps,
            hierarchy: None,
            rays: &rays,
            settings: &ImageSpaceTracerSettings::default(),
            timestamps: None,
        };
        let before = lightfall::creation_count();
        let result = tracer.record_rays(&mut encoder, &mut resources, &inputs);
        if method.needs_hierarchy() {
            let error = result.unwrap_err();
            assert!(matches!(error, Error::MissingInput { .. }), "{error}");
            assert_eq!(lightfall::creation_count(), before);
        } else {
            result.unwrap();
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn normals_of_hits_face_the_ray() {
    let Some(gpu) = gpu() else { return };
    let mut bench = Bench::new(&gpu, samples::pillars(0.0)).unwrap();
    let rays = bench.rays(5_000).unwrap();
    let centers = places(&mut bench, 4);
    let maps = bench.capture(&centers, 64).unwrap();
    for method in TraceMethod::ALL {
        for (ray, hit) in rays.iter().zip(trace(&bench, method, &maps, &rays)) {
            let is_hit = is_hit(&hit);
            assert!(is_hit || hit.distance == 0.0, "{method:?}: {hit:?}");
            // The paper's test does not ask.
            if is_hit && method != TraceMethod::Paper {
                let cosine = Photon::unpack_unit_vector(hit.normal).dot(Vec3::from(ray.direction));
                // A plane seen edge-on is kept within what its neighbours show, and may be met a little from behind.
                assert!(cosine < 0.01, "{method:?}: {cosine} {hit:?}");
            }
        }
    }
    assert_no_errors(&gpu);
}
