//! Statements about light, on whatever adapter there is: analytic answers, colour bleeding, occlusion, bit-exactness.

mod common;

use common::statistics::Random;
use common::{Component, Offline, assert_no_errors, disc_over_horizon, gpu, mean, offline};
use lightfall::frame::{Settings, Upsampling};
use lightfall::glam::{DAffine3, DVec3};
use lightfall::pass::{Bandwidth, PhotonSplatterSettings, TraceMethod};
use lightfall::resource::Subsampling;
use lightfall::scene::{Camera, Light, LightKind, Projection, Scene, samples};

/// Few photons, small maps: enough for statements that hold for any.
fn small() -> Settings {
    Settings {
        photons: 20_000,
        env_map_count: 4,
        env_map_size: 32,
        shadow_map_size: 128,
        ..Settings::balanced()
    }
}

/// Looks straight down on a square of `2 * half` around (x, z), from height y, +z down the image.
fn look_down(x: f64, y: f64, z: f64, half: f64) -> Camera {
    Camera {
        name: "above".into(),
        transform: DAffine3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y, DVec3::new(x, y, z)),
        projection: Projection::Orthographic { half_height: half },
    }
}

fn direct_light_matches(scene: &Scene, tolerance: f64, expected: impl Fn(DVec3) -> f64) {
    let Some(gpu) = gpu() else { return };
    let mut scene = scene.clone();
    let half = 3.0;
    scene.cameras = vec![look_down(0.0, 0.9, 0.0, half)];
    let size = 64;
    let settings = Settings {
        shadow_map_size: 512,
        ..small()
    };
    let pixels = offline::render(&gpu, &scene, &settings, [size, size], Component::Direct).unwrap();
    let mut worst = 0f64;
    for (i, pixel) in (0..).zip(&pixels) {
        let at = |k: u32| (f64::from(k) + 0.5) / f64::from(size) * 2.0 * half - half;
        let p = DVec3::new(at(i % size), 0.0, at(i / size));
        let (found, wanted) = (f64::from(pixel[0]), expected(p));
        let scale = wanted.max(1e-3 * expected(DVec3::ZERO).max(1e-9));
        worst = worst.max(((found - wanted) / scale).abs());
    }
    println!("worst relative error {worst:.2e}");
    assert!(worst < tolerance, "{worst}");
    assert_no_errors(&gpu);
}

#[test]
fn a_point_light_over_a_plane_falls_off_with_cosine_and_distance() {
    // ρ/π · I cosθ / r², with the light 1 m above the plane.
    let scene = samples::plane();
    direct_light_matches(&scene, 0.005, |p| {
        let r2 = p.length_squared() + 1.0;
        0.5 / std::f64::consts::PI * 10.0 / (r2 * r2.sqrt())
    });
}

#[test]
fn a_spot_lights_its_cone_with_a_squared_falloff() {
    let mut scene = samples::plane();
    let (inner, outer) = (0.3f64, 0.8f64);
    scene.lights[0].kind = LightKind::Spot {
        position: DVec3::Y,
        direction: DVec3::NEG_Y,
        inner_angle: inner,
        outer_angle: outer,
        radius: 0.0,
    };
    direct_light_matches(&scene, 0.005, |p| {
        let r2 = p.length_squared() + 1.0;
        let cosine = 1.0 / r2.sqrt();
        let f = ((cosine - outer.cos()) / (inner.cos() - outer.cos())).clamp(0.0, 1.0);
        0.5 / std::f64::consts::PI * 10.0 * f * f * cosine / r2
    });
}

#[test]
fn a_sun_lights_a_plane_by_its_cosine() {
    let mut scene = samples::plane();
    scene.lights[0].kind = LightKind::Directional {
        direction: DVec3::new(1.0, -2.0, 0.5),
        angle: 0.0,
    };
    let cosine = 2.0 / DVec3::new(1.0, -2.0, 0.5).length();
    direct_light_matches(&scene, 0.0005, |_| 0.5 / std::f64::consts::PI * 10.0 * cosine);
}

#[test]
fn a_wide_sun_that_sets_lights_a_plane_by_the_part_above_the_horizon() {
    for (elevation, angle) in [
        (0.7, 0.5),
        (0.4, 0.5),
        (0.0, 0.5),
        (-0.3, 0.5),
        (0.002, 0.0047),
        (0.02, 0.03),
        (0.02, 0.24),
        (0.02, 0.25),
        (0.1, 1.1),
        (-0.6, 0.5),
    ] {
        let mut scene = samples::plane();
        scene.lights[0].kind = LightKind::Directional {
            direction: -DVec3::new(f64::cos(elevation), f64::sin(elevation), 0.0),
            angle,
        };
        let expected = 0.5 / std::f64::consts::PI * 10.0 * disc_over_horizon(elevation, angle);
        println!("elevation {elevation}, half angle {angle}: {expected:.4}");
        direct_light_matches(&scene, 1e-3, |_| expected);
    }
}

#[test]
fn emission_is_seen_on_the_front_and_not_on_the_back() {
    let Some(gpu) = gpu() else { return };
    let inside = samples::furnace(0.0, 3.0);
    let seen = offline::render(&gpu, &inside, &small(), [8, 8], Component::All).unwrap();
    assert!(seen.iter().flatten().all(|&v| (v - 3.0).abs() < 1e-5), "{:?}", seen[0]);
    let mut outside = inside;
    outside.cameras[0].transform = DAffine3::from_translation(DVec3::new(0.0, 0.0, 3.0));
    let seen = offline::render(&gpu, &outside, &small(), [8, 8], Component::All).unwrap();
    assert!(seen.iter().flatten().all(|&v| v == 0.0));
    assert_no_errors(&gpu);
}

#[test]
fn a_white_wall_is_tinted_by_the_wall_beside_it() {
    let Some(gpu) = gpu() else { return };
    let settings = Settings {
        env_map_count: 6,
        env_map_size: 64,
        ..small()
    };
    let size = 64;
    let render = |part| offline::render(&gpu, &samples::cornell(0.0), &settings, [size, size], part).unwrap();
    let (all, direct) = (render(Component::All), render(Component::Direct));
    // The back wall spans columns 14 to 50; red stands left, green right. Above the blocks.
    let ratio = |pixels: &[[f32; 3]], from: u32, to: u32| {
        let keep = |x: u32, y: u32| (from..to).contains(&x) && (15..26).contains(&y);
        mean(pixels, size, 0, keep) / mean(pixels, size, 1, keep)
    };
    let (near_red, middle, far) = (ratio(&all, 14, 18), ratio(&all, 30, 34), ratio(&all, 46, 50));
    let lamp = ratio(&direct, 14, 18);
    println!(
        "red over green: {near_red:.3} beside the red wall, {middle:.3} in the middle, {far:.3} at the far end; lamp {lamp:.3}"
    );
    assert!(
        near_red > 1.1 * lamp,
        "redder than the lamp alone makes it: {near_red} against {lamp}"
    );
    assert!(
        near_red > 1.1 * middle && near_red > 1.2 * far,
        "{near_red}, {middle}, {far}"
    );
    assert_no_errors(&gpu);
}

#[test]
fn rays_into_the_open_sky_escape() {
    let Some(gpu) = gpu() else { return };
    let mut offline = Offline::new(&gpu, samples::plane(), &small(), 0, [8, 8], Component::All).unwrap();
    offline.render_frame(None).unwrap();
    let hops = offline.statistics().unwrap();
    println!("{:?}", &hops[..2]);
    // Whatever leaves a plane upward meets nothing. Lost may be only what started beyond the horizon of every map: where
    // a texel at its rim sees past the plane's edge.
    assert_eq!(hops[1].stored, [0.0; 3]);
    assert!(hops[1].lost[0] < 1e-3 * hops[1].escaped[0]);
    assert_no_errors(&gpu);
}

/// Mean indirect irradiance on the far room's floor, from fixed maps in both rooms.
fn far_floor(gpu: &common::Gpu, method: TraceMethod, time: f64) -> f64 {
    let mut scene = samples::two_rooms(time);
    scene.cameras = vec![look_down(0.0, 1.0, 2.1, 1.9)];
    let mut settings = Settings {
        photons: 100_000,
        env_map_size: 128,
        // How finely the floor is sampled moves the figure: the bound is one of the tracer, at this sampling.
        upsampling: Upsampling::AtOnce,
        ..small()
    };
    settings.trace_method = method;
    let size = 32;
    let mut offline = Offline::new(gpu, scene, &settings, 0, [size, size], Component::Indirect).unwrap();
    let centers =
        [(-1.0, 1.5, -2.5), (1.0, 1.2, -1.2), (0.3, 1.4, 1.2), (-0.9, 1.6, 2.8)].map(|(x, y, z)| DVec3::new(x, y, z));
    offline.renderer.set_env_map_centers(&gpu.queue, &centers).unwrap();
    offline.render_frame(None).unwrap();
    mean(&offline.read().unwrap(), size, 1, |_, _| true)
}

#[test]
fn a_closed_door_keeps_indirect_light_out() {
    let Some(gpu) = gpu() else { return };
    for method in TraceMethod::ALL {
        let (open, closed) = (far_floor(&gpu, method, 2.0), far_floor(&gpu, method, 0.0));
        println!(
            "{method:?}: open {open:.3e}, closed {closed:.3e}, {:.3} %",
            100.0 * closed / open
        );
        // Where the nearest hit of all maps wins it may lie behind a wall: measured, not held to it.
        let nearest = [TraceMethod::Paper, TraceMethod::NearestMarch, TraceMethod::NearestWalk];
        if !nearest.contains(&method) {
            assert!(closed <= 0.01 * open, "{method:?}: {closed} against {open}");
        }
    }
    assert_no_errors(&gpu);
}

#[test]
fn an_occluder_takes_its_indirect_shadow_along() {
    let Some(gpu) = gpu() else { return };
    let floor_beside = |time: f64, x: f64| {
        let mut scene = samples::cornell(time);
        // The floor 10 cm to the left of where the short block's side stands, seen from 1.5 m: below its top.
        scene.cameras = vec![look_down(x, 1.5, 1.45, 0.1)];
        let settings = Settings {
            photons: 200_000,
            env_map_count: 8,
            env_map_size: 64,
            ..small()
        };
        let pixels = offline::render(&gpu, &scene, &settings, [16, 16], Component::Indirect).unwrap();
        mean(&pixels, 16, 1, |_, _| true)
    };
    let (here, away) = (0.86, 0.86 + 1.2);
    let (with_block, without) = (floor_beside(0.0, here), floor_beside(2.0, here));
    println!("beside the block {with_block:.4}, after it moved away {without:.4}");
    assert!(with_block < 0.8 * without, "{with_block} against {without}");
    let (moved_along, before) = (floor_beside(2.0, away), floor_beside(0.0, 4.2));
    println!("beside the block where it went {moved_along:.4}, open floor {before:.4}");
    assert!(moved_along < 0.9 * before, "{moved_along} against {before}");
    assert_no_errors(&gpu);
}

#[test]
fn the_same_frame_twice_has_the_same_bits() {
    let Some(gpu) = gpu() else { return };
    for name in ["cornell", "two-rooms"] {
        let scene = samples::by_name(name, 0.7).unwrap();
        let mut offline = Offline::new(&gpu, scene, &small(), 0, [48, 40], Component::All).unwrap();
        offline.render_frame(None).unwrap();
        let first = offline.read().unwrap();
        offline.render_frame(None).unwrap();
        assert!(first == offline.read().unwrap(), "{name}");
    }
    assert_no_errors(&gpu);
}

#[test]
fn accumulated_frames_are_less_noisy_than_one() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::cornell(0.0);
    let settings = |frames| Settings {
        frames,
        splatter: PhotonSplatterSettings {
            bandwidth: Bandwidth::Fixed(0.03),
            ..Default::default()
        },
        // Neighbours are compared, and interpolated ones are alike whatever the noise.
        subsampling: Subsampling::Full,
        // Noise alone is looked at: radii stay.
        radius_alpha: 1.0,
        ..small()
    };
    let render = |frames| offline::render(&gpu, &scene, &settings(frames), [48, 48], Component::Indirect).unwrap();
    // Roughness of the back wall above the blocks: mean squared difference of neighbours over squared mean.
    let roughness = |p: &[[f32; 3]]| {
        let at = |x: usize, y: usize| f64::from(p[y * 48 + x][1]);
        let spots = || (12..18).flat_map(|y| (13..34).map(move |x| (x, y)));
        let squares: f64 = spots().map(|(x, y)| (at(x + 1, y) - at(x, y)).powi(2)).sum();
        let sum: f64 = spots().map(|(x, y)| at(x, y)).sum();
        squares * spots().count() as f64 / (sum * sum)
    };
    let (one, sixteen) = (roughness(&render(1)), roughness(&render(16)));
    println!("squared noise: one frame {one:.2e}, sixteen {sixteen:.2e}");
    assert!(sixteen < one / 8.0);
    assert_no_errors(&gpu);
}

#[test]
fn flux_of_every_light_is_the_integral_of_its_intensity() {
    let mut random = Random(7);
    let light = Light {
        name: String::new(),
        kind: LightKind::Spot {
            position: DVec3::ZERO,
            direction: DVec3::X,
            inner_angle: 0.4,
            outer_angle: 1.1,
            radius: 0.0,
        },
        color: [1.0; 3],
        intensity: 3.0,
    };
    let (inner, outer) = (0.4f64.cos(), 1.1f64.cos());
    let count = 400_000;
    let sum: f64 = (0..count)
        .map(|_| {
            ((1.0 - 2.0 * f64::from(random.unit()) - outer) / (inner - outer))
                .clamp(0.0, 1.0)
                .powi(2)
        })
        .sum();
    let integral = 3.0 * 4.0 * std::f64::consts::PI * sum / f64::from(count);
    let flux = light.flux(1.0).x;
    assert!((flux / integral - 1.0).abs() < 0.01, "{flux} against {integral}");
}
