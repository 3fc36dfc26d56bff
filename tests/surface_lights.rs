//! Statements about surface lights: what they hold, where it comes from, and what they give.

mod common;

use common::{Component, Gpu, Offline, Wishes, assert_no_errors, gpu, gpu_with};
use lightfall::frame::{IndirectMethod, LightPlacement, PhotonFeeder, Settings};
use lightfall::glam::{DVec3, Vec3};
use lightfall::pass::*;
use lightfall::resource::*;
use lightfall::scene::{LightKind, Scene, SceneBounds, SurfacePlace, UnitFrame, samples};
use lightfall::{Error, creation_count, read_buffer_blocking, wgpu};
use std::f64::consts::PI;
use std::sync::Arc;

/// A unit frame that is the world.
fn unit_frame() -> UnitFrame {
    UnitFrame::new(&SceneBounds::new(DVec3::splat(-0.57), DVec3::splat(0.57)).unwrap(), 1.0).unwrap()
}

/// Numbers in [0, 1), the same every time.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / (1u64 << 31) as f64
    }

    fn within(&mut self) -> DVec3 {
        DVec3::from([(); 3].map(|()| self.unit() - 0.5))
    }

    fn direction(&mut self) -> DVec3 {
        loop {
            let v = 2.0 * self.within();
            if v.length_squared() > 0.01 && v.length_squared() < 1.0 {
                return v.normalize();
            }
        }
    }

    fn places(&mut self, count: usize) -> Vec<SurfacePlace> {
        let place = |r: &mut Self| SurfacePlace {
            position: r.within(),
            normal: r.direction(),
            areas: [0.02; 2],
            surface: 0,
        };
        (0..count).map(|_| place(self)).collect()
    }

    /// One that arrived, or did not.
    fn photon(&mut self, most: f32) -> Photon {
        let is_stored = self.unit() < 0.8;
        Photon {
            position: self.within().as_vec3().to_array(),
            state: u32::from(is_stored) | if self.unit() < 0.1 { 8 } else { 0 },
            flux: [(); 3].map(|()| most * self.unit() as f32),
            density: 1.0,
            normal: Photon::pack_unit_vector(self.direction().as_vec3()),
            direction: 0,
            reflectance: Photon::pack_reflectance([(); 3].map(|()| self.unit() as f32)),
            light_and_surface: 0,
        }
    }
}

fn read(gpu: &Gpu, buffer: &wgpu::Buffer) -> Vec<[u32; 4]> {
    read_buffer_blocking(&gpu.device, &gpu.queue, buffer).unwrap()
}

/// Of each impact in a pool light, red, green, blue.
fn read_pool(gpu: &Gpu, pool: &PhotonPool) -> Vec<[u32; 4]> {
    let halves = read(gpu, pool.buffer());
    halves.into_iter().step_by(2).collect()
}

/// What the impacts of a pool add up to, by light: red, green, blue, and how many.
fn sums(impacts: &[[u32; 4]], lights: usize) -> Vec<[u32; 4]> {
    let mut sums = vec![[0u32; 4]; lights];
    for [light, flux @ ..] in impacts {
        if flux.iter().any(|&f| f > 0) {
            let own = &mut sums[*light as usize];
            (0..3).for_each(|i| own[i] += flux[i]);
            own[3] += 1;
        }
    }
    sums
}

#[test]
fn a_light_holds_the_sum_of_its_photons_after_a_million_of_them_and_a_thousand_moves() {
    let Some(gpu) = gpu() else { return };
    let (device, queue) = (&gpu.device, &gpu.queue);
    const PATHS: u32 = 500;
    const BOUNCES: u32 = 1;
    const FRAMES: u32 = 1000;
    let frame = unit_frame();
    let mut random = Random(7);
    let mut places = random.places(60);
    let photons = Photons::new(device, PATHS, BOUNCES).unwrap();
    let mut pool = PhotonPool::new(device, 3 * PATHS + 17, BOUNCES + 1).unwrap();
    let mut lights = SurfaceLights::new(device, 60, BOUNCES + 1).unwrap();
    let stream = PhotonStream::new(device);
    let mut own = PhotonStreamResources::new(device).unwrap();
    let sets: Vec<Vec<Photon>> = (0..7)
        .map(|_| {
            (0..photons.slots())
                .map(|_| random.photon(1.0 / PATHS as f32))
                .collect()
        })
        .collect();
    for i in 0..FRAMES {
        // One of them moves.
        places[(i % 60) as usize].position = random.within();
        lights.write(queue, &frame, &places).unwrap();
        queue.write_buffer(photons.buffer(), 0, bytemuck::cast_slice(&sets[(i % 7) as usize]));
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut inputs = PhotonStreamInputs {
            queue,
            photons: &photons,
            pool: &mut pool,
            lights: &lights,
            timestamps: None,
        };
        stream.record(&mut encoder, &mut own, &mut inputs).unwrap();
        queue.submit([encoder.finish()]);
        if i % 100 == 0 || i + 1 == FRAMES {
            let found = read(&gpu, lights.flux());
            assert_eq!(found, sums(&read_pool(&gpu, &pool), found.len()), "frame {i}");
        }
    }
    // What the last photons carried is there, as a share of the pool.
    let total: f64 = read(&gpu, lights.flux()).iter().map(|f| f64::from(f[0])).sum();
    let newest = |photons: &[Photon]| {
        let is_counted = |p: &&Photon| p.state & 15 == 1;
        let sent_on = photons
            .iter()
            .filter(is_counted)
            .map(|p| f64::from(p.flux[0] * p.reflectance()[0]));
        sent_on.sum::<f64>()
    };
    let mean = sets.iter().map(|s| newest(s)).sum::<f64>() / 7.0;
    let found = total * f64::from(lights.flux_of_step());
    println!("{found:.6} of {mean:.6}");
    assert!((found / mean - 1.0).abs() < 0.05, "{found} of {mean}");
    assert!((pool.share() - 1.0).abs() < 1e-6);
    // Emptied with the next photons.
    pool.restart();
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut inputs = PhotonStreamInputs {
        queue,
        photons: &photons,
        pool: &mut pool,
        lights: &lights,
        timestamps: None,
    };
    stream.record(&mut encoder, &mut own, &mut inputs).unwrap();
    queue.submit([encoder.finish()]);
    let found = read(&gpu, lights.flux());
    let impacts = read_pool(&gpu, &pool);
    assert_eq!(found, sums(&impacts, found.len()));
    let used = impacts.iter().filter(|i| i[1] | i[2] | i[3] != 0).count() as u32;
    assert!(used <= photons.slots() && used > photons.slots() / 2, "{used}");
    assert!((pool.share() - PATHS as f32 / pool.paths() as f32).abs() < 1e-6);
    assert_no_errors(&gpu);
}

#[test]
fn impacts_go_to_the_nearest_light_that_faces_the_same_way() {
    let Some(gpu) = gpu() else { return };
    let (device, queue) = (&gpu.device, &gpu.queue);
    let frame = unit_frame();
    let mut random = Random(3);
    for count in [1usize, 5, 40, 400] {
        let places = random.places(count);
        let mut lights = SurfaceLights::new(device, count as u32, 1).unwrap();
        lights.write(queue, &frame, &places).unwrap();
        let paths = 3000;
        let photons = Photons::new(device, paths, 0).unwrap();
        let all: Vec<Photon> = (0..paths).map(|_| random.photon(1e-3)).collect();
        queue.write_buffer(photons.buffer(), 0, bytemuck::cast_slice(&all));
        let mut pool = PhotonPool::new(device, paths, 1).unwrap();
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut inputs = PhotonStreamInputs {
            queue,
            photons: &photons,
            pool: &mut pool,
            lights: &lights,
            timestamps: None,
        };
        let mut own = PhotonStreamResources::new(device).unwrap();
        PhotonStream::new(device)
            .record(&mut encoder, &mut own, &mut inputs)
            .unwrap();
        queue.submit([encoder.finish()]);
        let sides: Vec<(Vec3, Vec3)> = places
            .iter()
            .flat_map(|p| [1.0, -1.0].map(|s| (frame.point(p.position), (s * p.normal).as_vec3())))
            .collect();
        let mut unlike = 0;
        for (photon, impact) in all.iter().zip(read_pool(&gpu, &pool)) {
            if impact[1] | impact[2] | impact[3] == 0 {
                continue;
            }
            let (p, n) = (Vec3::from(photon.position), Photon::unpack_unit_vector(photon.normal));
            // Off the impact's plane distances count more.
            let squared = |i: usize| {
                let away = sides[i].0 - p;
                away.length_squared() + 30.0 * away.dot(n).powi(2)
            };
            let facing: Vec<usize> = (0..sides.len()).filter(|&i| sides[i].1.dot(n) >= 0.5).collect();
            let found = impact[0] as usize;
            match facing
                .iter()
                .copied()
                .min_by(|&a, &b| squared(a).total_cmp(&squared(b)))
            {
                // Rounding may decide between two as near, and at the cone's rim.
                Some(best) => unlike += usize::from((squared(found) - squared(best)).abs() > 1e-5),
                None => assert!(sides[found].1.dot(n) > -1.0),
            }
        }
        assert!(unlike <= 3, "{count}: {unlike}");
    }
    assert_no_errors(&gpu);
}

#[test]
fn what_is_kept_near_by_is_what_discs_lose() {
    let Some(gpu) = gpu() else { return };
    let (device, queue) = (&gpu.device, &gpu.queue);
    const PATHS: u32 = 20_000;
    const BOUNCES: u32 = 3;
    let mut random = Random(11);
    let photons = Photons::new(device, PATHS, BOUNCES).unwrap();
    let all: Vec<Photon> = (0..photons.slots()).map(|_| random.photon(1e-4)).collect();
    queue.write_buffer(photons.buffer(), 0, bytemuck::cast_slice(&all));
    let mut lights = SurfaceLights::new(device, 40, BOUNCES).unwrap();
    lights.write(queue, &unit_frame(), &random.places(40)).unwrap();
    // Half of it is other, older paths': none.
    let mut pool = PhotonPool::new(device, 2 * PATHS, BOUNCES).unwrap();
    assert!(pool.near().is_none());
    pool.keep_near(device).unwrap();
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut inputs = PhotonStreamInputs {
        queue,
        photons: &photons,
        pool: &mut pool,
        lights: &lights,
        timestamps: None,
    };
    let mut own = PhotonStreamResources::new(device).unwrap();
    PhotonStream::new(device)
        .record(&mut encoder, &mut own, &mut inputs)
        .unwrap();
    queue.submit([encoder.finish()]);
    let impacts = read_pool(&gpu, &pool);
    let near: Vec<Photon> = read_buffer_blocking(device, queue, pool.near().unwrap().buffer()).unwrap();
    assert_eq!(near.len(), 2 * PATHS as usize);
    // What discs of an area of 0.02 lose of each hop.
    let lost = |path: usize, hop: usize| {
        let [before, photon] = [hop - 1, hop].map(|h| &all[h * PATHS as usize + path]);
        let impact = impacts[(hop - 1) * 2 * PATHS as usize + path];
        if photon.state & 15 != 1 {
            return 0.0;
        }
        if before.state & 12 != 0 {
            return 1.0;
        }
        let way = Vec3::from(photon.position).distance_squared(Vec3::from(before.position));
        if impact[1] | impact[2] | impact[3] == 0 {
            return 0.0;
        }
        0.02 / (0.02 + PI * f64::from(way))
    };
    let (mut expected, mut found, mut kept) = (0.0, 0.0, 0);
    for path in 0..PATHS as usize {
        let hops: Vec<usize> = (1..=BOUNCES as usize).collect();
        let shares: Vec<f64> = hops.iter().map(|&h| lost(path, h)).collect();
        let factor = 0.5 * shares.iter().sum::<f64>().max(1.0);
        for (&hop, share) in hops.iter().zip(&shares) {
            expected += 0.5 * share * f64::from(all[hop * PATHS as usize + path].flux[0]);
        }
        if near[path].state & 3 == 0 {
            continue;
        }
        let is_own = |h: &&usize| all[**h * PATHS as usize + path].position == near[path].position;
        let hop = *hops.iter().find(is_own).expect("a photon of the path's");
        assert!(shares[hop - 1] > 0.0);
        let flux = factor * f64::from(all[hop * PATHS as usize + path].flux[0]);
        assert!((f64::from(near[path].flux[0]) / flux - 1.0).abs() < 1e-4, "{path}");
        found += f64::from(near[path].flux[0]);
        kept += 1;
    }
    println!("{found:.5} of {expected:.5}, by {kept} photons of {}", PATHS * BOUNCES);
    // Three standard deviations of as many.
    assert!((found / expected - 1.0).abs() < 3.0 / f64::from(kept).sqrt());
    assert!(near[PATHS as usize..].iter().all(|p| p.state == 0));
    assert_no_errors(&gpu);
}

#[test]
fn discs_and_photons_near_by_lose_nothing_and_are_nearer_than_squares() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::cornell(0.0);
    let by = |shape: &str, near: &str, places: &str| {
        let overrides = [
            ("surface_lights.shape", shape),
            ("surface_lights.near_photons", near),
            ("surface_lights.places", places),
            ("surface_lights.shadows", "all"),
            ("surface_lights.pool", "50000"),
            ("surface_lights.stream", "10000"),
            ("splatter.subsampling", "2"),
        ];
        picture(&gpu, &scene, &settings(&overrides))
    };
    let many = by("square", "off", "2000");
    let [with, discs, squares] = [("disc", "on"), ("disc", "off"), ("square", "on")].map(|(s, n)| by(s, n, "100"));
    let losses = [&with, &discs, &squares].map(|p| 1.0 - mean(p) / mean(&many));
    let errors = [&with, &discs, &squares].map(|p| rms(p, &many) / mean(&many));
    println!("with photons near by, discs, squares: lost {losses:.3?}, errors {errors:.3?}");
    assert!(losses[0].abs() < 0.01 && losses[1] > 0.05);
    assert!(errors[0] < errors[1] && errors[0] < errors[2]);
    assert_no_errors(&gpu);
}

fn settings(overrides: &[(&str, &str)]) -> Settings {
    let mut settings = Settings {
        indirect_method: IndirectMethod::SurfaceLights,
        shadow_map_size: 128,
        bounces: 2,
        ..Settings::fast()
    };
    for (name, value) in [
        ("tracer.kind", "bvh"),
        ("surface_lights.places", "60"),
        ("surface_lights.pool", "8000"),
        ("surface_lights.stream", "1000"),
    ]
    .into_iter()
    .chain(overrides.iter().copied())
    {
        settings.set(name, value).unwrap();
    }
    settings
}

fn offline<'a>(gpu: &'a Gpu, scene: &Scene, settings: &Settings) -> Offline<'a> {
    Offline::new(gpu, scene.clone(), settings, 0, [64, 48], Component::Indirect).unwrap()
}

fn picture(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Vec<[f32; 3]> {
    let mut offline = offline(gpu, scene, settings);
    offline.render_frame(None).unwrap();
    offline.read().unwrap()
}

fn mean(pixels: &[[f32; 3]]) -> f64 {
    pixels.iter().flatten().map(|&v| f64::from(v)).sum::<f64>() / (3 * pixels.len()) as f64
}

fn rms(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let squares = a
        .iter()
        .flatten()
        .zip(b.iter().flatten())
        .map(|(a, b)| f64::from(a - b).powi(2));
    (squares.sum::<f64>() / (3 * a.len()) as f64).sqrt()
}

#[test]
fn all_forms_give_the_same() {
    let wide = Wishes {
        features: wgpu::Features::FLOAT32_BLENDABLE,
        ..Default::default()
    };
    let Some(gpu) = gpu_with(wide) else { return };
    let scene = samples::cornell(0.0);
    for threshold in ["0", "0.01"] {
        for subsampling in ["1", "4"] {
            let by = |form: &str| {
                let settings = settings(&[
                    ("surface_lights.shadows", "off"),
                    ("surface_lights.form", form),
                    ("surface_lights.threshold", threshold),
                    ("splatter.subsampling", subsampling),
                ]);
                picture(&gpu, &scene, &settings)
            };
            let (loop_, tiles, drawn) = (by("loop"), by("tiles"), by("drawn"));
            let whole = mean(&loop_);
            let errors = [rms(&tiles, &loop_) / whole, rms(&drawn, &loop_) / whole];
            println!(
                "threshold {threshold}, 1 in {subsampling}: tiles {:.1e}, drawn {:.1e}",
                errors[0], errors[1]
            );
            // Lights that were left out give no more than that.
            let least = if threshold == "0" { 1e-6 } else { 0.01 };
            assert!(errors.iter().all(|&e| e <= least), "{errors:?}");
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn drawn_lights_lose_digits_in_sixteen_bits() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::cornell(0.0);
    let by = |form: &str| {
        let settings = settings(&[("surface_lights.shadows", "off"), ("surface_lights.form", form)]);
        picture(&gpu, &scene, &settings)
    };
    let (tiles, drawn) = (by("tiles"), by("drawn"));
    let error = rms(&drawn, &tiles) / mean(&tiles);
    println!("{error:.4}");
    assert!(error < 0.03 && error > 0.0, "{error}");
    assert_no_errors(&gpu);
}

#[test]
fn a_pool_that_is_filled_at_once_is_the_one_that_frames_fill() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::cornell(0.0);
    let settings = settings(&[]);
    let mut at_once = offline(&gpu, &scene, &settings);
    at_once.render_frame(None).unwrap();
    let first = at_once.read().unwrap();
    // What comes again where nothing moves is the same, to the bit.
    for _ in 0..10 {
        at_once.render_frame(None).unwrap();
    }
    assert!(at_once.read().unwrap() == first);
    assert!(mean(&first) > 0.0);
    // A still scene rests: no photon is traced, and nothing else changes.
    at_once.in_motion = false;
    let passes = |offline: &mut Offline<'_>| {
        let before = creation_count().passes;
        offline.render_frame(None).unwrap();
        creation_count().passes - before
    };
    let busy = passes(&mut at_once);
    let resting = (0..10).map(|_| passes(&mut at_once)).last().unwrap();
    println!("{busy} passes, {resting} at rest");
    assert!(resting + 2 <= busy, "{busy} passes, {resting} at rest");
    assert!(at_once.read().unwrap() == first);
    // Until something moves.
    at_once.renderer.geometry_changed();
    assert_eq!(passes(&mut at_once), busy);
    // As many as the host wants.
    at_once.in_motion = true;
    at_once.renderer.set_streamed_photons(0);
    assert_eq!(passes(&mut at_once), resting);
    let next = |offline: &Offline<'_>| offline.renderer.photon_pool().unwrap().next();
    let before = next(&at_once);
    at_once.renderer.set_streamed_photons(300);
    at_once.render_frame(None).unwrap();
    assert_eq!(next(&at_once), (before + 300) % 8000);
    at_once.renderer.set_streamed_photons(1_000_000);
    at_once.render_frame(None).unwrap();
    assert_eq!(next(&at_once), (before + 1300) % 8000);
    assert!((mean(&at_once.read().unwrap()) / mean(&first) - 1.0).abs() < 0.01);
    assert_no_errors(&gpu);
}

#[test]
fn after_many_moves_the_picture_is_that_of_a_fresh_start() {
    let Some(gpu) = gpu() else { return };
    let settings = settings(&[("surface_lights.shadows", "off")]);
    let fresh = picture(&gpu, &samples::cornell(0.0), &settings);
    let mut offline = offline(&gpu, &samples::cornell(0.0), &settings);
    offline.render_frame(None).unwrap();
    // A block that slides, and a light that wanders; then all is as it was, and the pool is replaced once.
    for i in 1..20 {
        let mut scene = samples::cornell(0.1 * f64::from(i));
        if let LightKind::Point { position, .. } = &mut scene.lights[0].kind {
            position.z += 0.05 * f64::from(i % 7);
        }
        offline.set_scene(scene).unwrap();
        offline.render_frame(None).unwrap();
    }
    assert!(offline.read().unwrap() != fresh);
    offline.set_scene(samples::cornell(0.0)).unwrap();
    for _ in 0..8 {
        offline.render_frame(None).unwrap();
    }
    assert!(offline.read().unwrap() == fresh);
    assert_no_errors(&gpu);
}

#[test]
fn light_follows_a_jump_as_fast_as_the_pool_is_replaced() {
    let Some(gpu) = gpu() else { return };
    let mut scene = samples::cornell(0.0);
    for (pool, stream) in [(8000u32, 1000u32), (16000, 400)] {
        let settings = settings(&[
            ("surface_lights.pool", &pool.to_string()),
            ("surface_lights.stream", &stream.to_string()),
            ("surface_lights.shadows", "off"),
        ]);
        let mut offline = offline(&gpu, &scene, &settings);
        offline.render_frame(None).unwrap();
        let LightKind::Point { position, .. } = &mut scene.lights[0].kind else {
            panic!("the sample's light is a bulb");
        };
        let before = offline.read().unwrap();
        position.x += if position.x > 2.7 { -1.5 } else { 1.5 };
        offline.set_scene(scene.clone()).unwrap();
        let frames = pool.div_ceil(stream);
        let pictures: Vec<_> = (0..frames + 3)
            .map(|_| {
                offline.render_frame(None).unwrap();
                offline.read().unwrap()
            })
            .collect();
        let after = pictures.last().unwrap();
        // All is there when all was replaced, and not before.
        assert!(pictures[frames as usize - 1] == *after && pictures[frames as usize - 2] != *after);
        let whole = rms(&before, after);
        let until = pictures.iter().position(|p| rms(p, after) <= 0.1 * whole).unwrap() as f64 + 1.0;
        let expected = 0.9 * f64::from(pool) / f64::from(stream);
        println!("pool {pool}, {stream} a frame: {until} frames, {expected:.1} expected");
        assert!(
            (until - expected).abs() <= (0.1 * expected).max(1.0),
            "{until}, {expected}"
        );
    }
    assert_no_errors(&gpu);
}

#[test]
fn rays_to_all_lights_keep_them_behind_walls_and_rays_to_some_agree_in_the_mean() {
    let Some(gpu) = gpu() else { return };
    let with = |time: f64, shadows: &str, rays: &str, near: &str| {
        let settings = settings(&[
            ("surface_lights.near_photons", near),
            ("surface_lights.shadows", shadows),
            ("surface_lights.places", "200"),
            ("surface_lights.filter_radius", "0"),
            ("surface_lights.rays", rays),
            ("splatter.subsampling", "1"),
        ]);
        picture(&gpu, &samples::two_rooms(time), &settings)
    };
    let by = |time, shadows, rays| with(time, shadows, rays, "off");
    // The eye is in a room without light; the door to the lit one is closed.
    let (off, all) = (by(0.0, "off", "1"), by(0.0, "all", "1"));
    println!("closed: off {:.5}, all {:.5}", mean(&off), mean(&all));
    assert!(
        mean(&all) < 1e-3 * mean(&off),
        "light leaks through walls without shadows alone"
    );
    // Kernels of photons near by lie over the wall's foot, as all do that are splatted, but few photons have them.
    let near = with(0.0, "all", "1", "on");
    let mut splatted = settings(&[("photons", "8000"), ("splatter.photons", "150")]);
    splatted.indirect_method = IndirectMethod::Splatting;
    let splatted = picture(&gpu, &samples::two_rooms(0.0), &splatted);
    println!("closed: near {:.5}, splatted {:.5}", mean(&near), mean(&splatted));
    assert!(mean(&near) < 0.5 * mean(&splatted));
    // And open.
    let (all, some, few) = (by(1.0, "all", "1"), by(1.0, "some", "64"), by(1.0, "some", "4"));
    println!("open: all {:.5}, some {:.5}", mean(&all), mean(&some));
    assert!((mean(&some) / mean(&all) - 1.0).abs() < 0.03);
    // Noise falls with the number of rays.
    assert!(rms(&some, &all) < 0.5 * rms(&few, &all));
    assert_no_errors(&gpu);
}

#[test]
fn what_a_moving_light_hardly_reaches_is_as_steady_as_splatted() {
    let Some(gpu) = gpu() else { return };
    // A bulb in each of two rooms, the door between them closed; that of the room behind moves for 300 frames.
    let scene = common::rooms::with_bulbs(0.0);
    // Largest change of a picture from the first, over its mean.
    let change = |settings: &Settings| {
        let mut scene = scene.clone();
        let mut offline = offline(&gpu, &scene, settings);
        offline.render_frame(None).unwrap();
        let first = offline.read().unwrap();
        assert!(mean(&first) > 0.01);
        let mut most = 0f64;
        for frame in 0..300 {
            common::rooms::bulb(&mut scene, 0).x = -0.8 + 0.6 * (0.02 * PI * f64::from(frame)).sin();
            offline.set_scene(scene.clone()).unwrap();
            offline.render_frame(None).unwrap();
            if frame % 10 == 9 {
                most = most.max(rms(&offline.read().unwrap(), &first) / mean(&first));
            }
        }
        most
    };
    // Rays to some lights are to other ones where other lights give more.
    let lights = change(&settings(&[("surface_lights.shadows", "all")]));
    let mut splatting = settings(&[("photons", "8000"), ("splatter.photons", "150")]);
    splatting.indirect_method = IndirectMethod::Splatting;
    let splatted = change(&splatting);
    println!("surface lights {lights:.2e}, splatting {splatted:.2e}");
    // Light that comes by the rim of the door truly changes, as much in both.
    assert!(lights < 0.02 && lights < 1.2 * splatted);
    assert_no_errors(&gpu);
}

#[test]
fn lights_at_impacts_are_instant_radiosity() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::cornell(0.0);
    let by = |overrides: &[(&str, &str)]| {
        let all = [
            ("surface_lights.places", "300"),
            ("surface_lights.shadows", "all"),
            ("surface_lights.pool", "40000"),
            ("surface_lights.stream", "5000"),
        ];
        let settings = settings(&[&all[..], overrides].concat());
        let mut offline = offline(&gpu, &scene, &settings);
        offline.render_frame(None).unwrap();
        let expected = usize::from(settings.surface_lights.placement == LightPlacement::OnSurfaces);
        assert_eq!(usize::from(offline.renderer.photon_pool().is_some()), expected);
        (
            offline.renderer.surface_lights().unwrap().count(),
            offline.read().unwrap(),
        )
    };
    let (on_surfaces, steady) = by(&[]);
    let (at_impacts, jumping) = by(&[("surface_lights.placement", "at-impacts")]);
    assert_eq!((on_surfaces, at_impacts), (600, 300));
    println!(
        "mean {:.5} on surfaces, {:.5} at impacts",
        mean(&steady),
        mean(&jumping)
    );
    assert!((mean(&jumping) / mean(&steady) - 1.0).abs() < 0.15);
    // Both have lights where light arrives; those on surfaces stand for many photons each.
    let truth = by(&[("surface_lights.places", "3000")]).1;
    let errors = [&steady, &jumping].map(|p| rms(p, &truth) / mean(&truth));
    println!("off by {:.3} on surfaces, by {:.3} at impacts", errors[0], errors[1]);
    assert!(errors[0] < 0.9 * errors[1], "{errors:?}");
    assert_no_errors(&gpu);
}

/// One light over a floor, seen from above: irradiance at each pixel.
fn one_light(gpu: &Gpu, place: SurfacePlace, shape: LightShape) -> Vec<(DVec3, f64)> {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let frame = unit_frame();
    let size = [32; 2];
    let mut lights = SurfaceLights::new(device, 1, 1).unwrap();
    lights.write(queue, &frame, &[place]).unwrap();
    let one = (1.0 / lights.flux_of_step()) as u32;
    queue.write_buffer(
        lights.flux(),
        0,
        bytemuck::cast_slice(&[one, one, one, 1u32, 0, 0, 0, 0]),
    );
    // The floor y = 0 as a host's own G-buffer: seen from above, parallel.
    let texture = |format, bytes: &[u8], texel: u32| {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width: size[0],
                height: size[1],
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let all = bytes.repeat((size[0] * size[1]) as usize);
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(texel * size[0]),
            rows_per_image: None,
        };
        queue.write_texture(texture.as_image_copy(), &all, layout, texture.size());
        texture.create_view(&Default::default())
    };
    use bytemuck::bytes_of;
    // x to the right, z down, within 0.4 of the middle; depth 1/2 on the floor.
    let columns = [
        [2.5, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.5, 0.0],
        [0.0, -2.5, 0.0, 0.0],
        [0.0, 0.0, 0.5, 1.0],
    ];
    let view = CameraView::from_matrix(columns, [0.0, -1.0, 0.0, 0.0], 40.0);
    let wgpu_format = wgpu::TextureFormat::R32Float;
    let views = GBufferViews {
        depth: texture(wgpu_format, bytes_of(&0.5f32), 4),
        normal: texture(wgpu::TextureFormat::Rgba32Float, bytes_of(&[0.0f32, 1.0, 0.0, 0.0]), 16),
        normal_encoding: NormalEncoding::Signed,
        base_color: texture(wgpu::TextureFormat::Rgba32Float, bytes_of(&[1.0f32; 4]), 16),
        emission: texture(wgpu::TextureFormat::Rgba32Float, bytes_of(&[0.0f32; 4]), 16),
        surfaces: None,
        rectangle: None,
    };
    let mut g_buffer = GBuffer::from_views(device, views).unwrap();
    g_buffer.set_view(queue, &view);
    let irradiance = Irradiance::new(device, size, wgpu::TextureFormat::Rgba32Float).unwrap();
    let mut encoder = device.create_command_encoder(&Default::default());
    let inputs = SurfaceLightShadingInputs {
        queue,
        g_buffer: &g_buffer,
        subsampling: Subsampling::Full,
        lights: &lights,
        share: 1.0,
        area: 1.0,
        radius: 1.0,
        irradiance: &irradiance,
        sample_offset: 0,
        settings: &SurfaceLightShadingSettings {
            shape,
            threshold: 0.0,
            ..Default::default()
        },
        timestamps: None,
    };
    let mut own = SurfaceLightShadingResources::new(device).unwrap();
    SurfaceLightShading::new(device)
        .record(&mut encoder, &mut own, &inputs)
        .unwrap();
    queue.submit([encoder.finish()]);
    let texels = lightfall::read_rgba32float_blocking(device, queue, irradiance.view().texture()).unwrap();
    let at = |k: u32| (2.0 * (f64::from(k) + 0.5) / 32.0 - 1.0) * 0.4;
    (0..32 * 32)
        .map(|i| {
            (
                DVec3::new(at(i % 32), 0.0, at(i / 32)),
                f64::from(texels[i as usize][0]),
            )
        })
        .collect()
}

#[test]
fn a_light_gives_what_its_formula_says_near_and_far() {
    let Some(gpu) = gpu() else { return };
    for (position, normal, area) in [
        (DVec3::new(0.05, 0.3, -0.02), DVec3::NEG_Y, 0.01),
        (DVec3::new(0.0, 0.02, 0.0), DVec3::NEG_Y, 0.09),
        (DVec3::new(-0.4, 0.1, 0.1), DVec3::new(1.0, -0.3, 0.2).normalize(), 0.04),
        (DVec3::new(0.3, 0.05, 0.0), DVec3::NEG_X, 0.01),
    ] {
        let place = SurfacePlace {
            position,
            normal,
            areas: [area; 2],
            surface: 0,
        };
        for shape in [LightShape::Point, LightShape::Disc, LightShape::Square] {
            let mut worst = 0.0f64;
            let mut sums = [0.0; 2];
            for (p, found) in one_light(&gpu, place, shape) {
                let exact = match shape {
                    LightShape::Square => by_square(&place, p),
                    LightShape::Point => factor(&place, p, 0.0),
                    LightShape::Disc => factor(&place, p, area),
                };
                sums = [sums[0] + found, sums[1] + exact];
                worst = worst.max((found - exact).abs() / exact.abs().max(0.05));
            }
            println!(
                "{shape:?} at {position}: worst {worst:.1e}, sum {:.5}",
                sums[0] / sums[1]
            );
            // The square of the test is summed over 64 x 64 pieces, and the shader's is a point beyond five sides.
            let allowed = if shape == LightShape::Square { 0.03 } else { 1e-5 };
            assert!(
                worst < allowed && (sums[0] / sums[1] - 1.0).abs() < 0.01,
                "{shape:?} {position}: {worst}"
            );
        }
    }
    assert_no_errors(&gpu);
}

/// Irradiance on the floor from a light of flux 1.
fn factor(place: &SurfacePlace, p: DVec3, area: f64) -> f64 {
    let away = place.position - p;
    let r2 = away.length_squared();
    away.y.max(0.0) * (-place.normal.dot(away)).max(0.0) / (r2 * (PI * r2 + area))
}

/// From the square around it: its sides as the shader turns them do not matter by much.
fn by_square(place: &SurfacePlace, p: DVec3) -> f64 {
    let (t, b) = frame_around(place.normal);
    let side = place.areas[0].sqrt();
    let pieces = 64;
    let at = |k: i32| (f64::from(k) + 0.5) / f64::from(pieces) - 0.5;
    let mut sum = 0.0;
    for i in 0..pieces * pieces {
        let piece = SurfacePlace {
            position: place.position + side * (at(i % pieces) * t + at(i / pieces) * b),
            ..*place
        };
        // Each piece is small, and a disc of its own.
        sum += factor(&piece, p, place.areas[0] / f64::from(pieces * pieces));
    }
    sum / f64::from(pieces * pieces)
}

/// As `sampling_frame` of the shaders.
fn frame_around(n: DVec3) -> (DVec3, DVec3) {
    let sign = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (
        DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        DVec3::new(b, sign + n.y * n.y * a, -n.y),
    )
}

#[test]
fn what_is_missing_or_bad_is_named() {
    let Some(gpu) = gpu() else { return };
    let (device, queue) = (&gpu.device, &gpu.queue);
    let frame = unit_frame();
    let mut lights = SurfaceLights::new(device, 2, 1).unwrap();
    let place = SurfacePlace {
        position: DVec3::ZERO,
        normal: DVec3::Y,
        areas: [1.0; 2],
        surface: 0,
    };
    let many = lights.write(queue, &frame, &[place; 3]);
    assert!(
        matches!(
            many,
            Err(Error::CountMismatch {
                expected: 2,
                found: 3,
                ..
            })
        ),
        "{many:?}"
    );
    for bad in [
        SurfacePlace {
            position: DVec3::NAN,
            ..place
        },
        SurfacePlace {
            normal: DVec3::ZERO,
            ..place
        },
        SurfacePlace {
            areas: [1.0, -1.0],
            ..place
        },
    ] {
        let found = lights.write(queue, &frame, &[place, bad]);
        assert!(matches!(found, Err(Error::InvalidScene { .. })), "{found:?}");
    }
    let photons = Photons::new(device, 10, 1).unwrap();
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut own = PhotonStreamResources::new(device).unwrap();
    for (paths, hops) in [(9, 2), (10, 1)] {
        let mut pool = PhotonPool::new(device, paths, hops).unwrap();
        let mut inputs = PhotonStreamInputs {
            queue,
            photons: &photons,
            pool: &mut pool,
            lights: &lights,
            timestamps: None,
        };
        let found = PhotonStream::new(device).record(&mut encoder, &mut own, &mut inputs);
        assert!(matches!(found, Err(Error::CountMismatch { .. })), "{found:?}");
    }
    // A renderer that was told of no places.
    let settings = settings(&[]);
    let mut offline = offline(&gpu, &samples::cornell(0.0), &settings);
    offline.points.clear();
    let found = offline.render_frame(None);
    assert!(
        matches!(
            found,
            Err(Error::MissingInput {
                stage: "SurfaceLightShading",
                ..
            })
        ),
        "{found:?}"
    );
    assert_no_errors(&gpu);
}

#[test]
fn photons_of_the_processor_bring_the_same_light() {
    let Some(gpu) = gpu() else { return };
    for scene in [samples::cornell(0.0), samples::cornell_spot(0.0)] {
        let settings = settings(&[("surface_lights.shadows", "off"), ("surface_lights.stream", "2000")]);
        let mut offline = offline(&gpu, &scene, &settings);
        offline.render_frame(None).unwrap();
        let expected = offline.read().unwrap();
        let feeder = PhotonFeeder::new(2000, settings.walked_bounces(), 2);
        feeder.set_scene(offline.renderer.frame().unwrap(), &Arc::new(scene.clone()));
        offline.renderer.set_photon_feeder(Some(feeder));
        let next = |offline: &Offline<'_>| offline.renderer.photon_pool().unwrap().next();
        let mut brought = 0;
        for _ in 0..2000 {
            let before = next(&offline);
            offline.render_frame(None).unwrap();
            brought += u32::from(next(&offline) != before);
            if brought == 4 {
                break;
            }
        }
        assert_eq!(brought, 4, "batches");
        let found = offline.read().unwrap();
        let feeder = offline.renderer.set_photon_feeder(None).unwrap();
        println!(
            "mean {:.5} of {:.5}, {:.2e} impacts a second",
            mean(&found),
            mean(&expected),
            feeder.impacts_per_second()
        );
        assert!(found != expected);
        assert!((mean(&found) / mean(&expected) - 1.0).abs() < 0.03);
        // Of other photons than are wanted nothing is taken.
        let other = Photons::new(&gpu.device, 100, 0).unwrap();
        assert!(!feeder.upload(&gpu.queue, &other));
    }
    assert_no_errors(&gpu);
}

#[test]
fn shadows_come_by_whatever_traces_and_ambient_occlusion_stands_in_for_them() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::cornell(0.0);
    let by = |tracer: &str, shadows: &str| {
        let settings = settings(&[
            ("tracer.kind", tracer),
            ("env_maps.size", "64"),
            ("surface_lights.places", "100"),
            ("surface_lights.shadows", shadows),
            ("surface_lights.rays", "32"),
        ]);
        picture(&gpu, &scene, &settings)
    };
    let (triangles, maps) = (by("bvh", "all"), by("image-space", "all"));
    let (off, ambient) = (by("bvh", "off"), by("bvh", "ambient-occlusion"));
    let means = [&triangles, &maps, &off, &ambient].map(|p| mean(p));
    println!(
        "triangles {:.4}, maps {:.4}, off {:.4}, ambient occlusion {:.4}",
        means[0], means[1], means[2], means[3]
    );
    assert!((means[1] / means[0] - 1.0).abs() < 0.03, "{means:?}");
    // It takes light away, though not all.
    assert!(means[3] < means[2] && means[3] > 0.5 * means[0], "{means:?}");
    assert_no_errors(&gpu);
}
