//! Statements about irradiance that is kept at texels of surfaces.
#![cfg(feature = "bvh")]

mod common;

use common::rooms::{block_at, bulb, move_block, with_blocks as rooms};
use common::{Component, Gpu, Offline, Reference, assert_no_errors, gpu};
use lightfall::frame::{IndirectMethod, Settings};
use lightfall::glam::Vec3;
use lightfall::reference::{PathComponent, PathTracerSettings};
use lightfall::scene::{Scene, samples};
use lightfall::{Error, read_buffer_blocking};

const SIZE: [u32; 2] = [64, 48];

fn settings(overrides: &[(&str, &str)]) -> Settings {
    let mut settings = Settings {
        indirect_method: IndirectMethod::IlluminationMaps,
        photons: 20_000,
        bounces: 2,
        shadow_map_size: 128,
        ..Settings::fast()
    };
    let own = [
        ("tracer.kind", "bvh"),
        ("illumination_maps.texels", "400"),
        ("illumination_maps.rays", "64"),
    ];
    for (name, value) in own.iter().chain(overrides) {
        settings.set(name, value).unwrap();
    }
    settings
}

fn offline<'a>(gpu: &'a Gpu, scene: &Scene, settings: &Settings) -> Offline<'a> {
    let mut offline = Offline::new(gpu, scene.clone(), settings, 0, SIZE, Component::Indirect).unwrap();
    offline.render_frame(None).unwrap();
    offline
}

/// Of each texel where it stands, and the light that was gathered there.
fn texels(gpu: &Gpu, offline: &Offline<'_>) -> Vec<(Vec3, [f32; 4])> {
    let lights = offline.renderer.surface_lights().unwrap();
    let places: Vec<[f32; 8]> = read_buffer_blocking(&gpu.device, &gpu.queue, lights.records()).unwrap();
    let map = offline.renderer.illumination_map().unwrap();
    let light: Vec<[f32; 4]> = read_buffer_blocking(&gpu.device, &gpu.queue, map.gathered()).unwrap();
    let count = lights.count() as usize;
    let at = |p: &[f32; 8]| Vec3::new(p[0], p[1], p[2]);
    places.iter().map(at).zip(light).take(count).collect()
}

/// Texels gathered in the last frame, and those that wait.
fn counts(gpu: &Gpu, offline: &Offline<'_>) -> [u32; 2] {
    let map = offline.renderer.illumination_map().unwrap();
    read_buffer_blocking::<[u32; 2]>(&gpu.device, &gpu.queue, map.counts()).unwrap()[0]
}

fn mean(pixels: &[[f32; 3]]) -> f64 {
    pixels.iter().flatten().map(|&v| f64::from(v)).sum::<f64>() / (3 * pixels.len()) as f64
}

fn rms(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    let squares = pairs.map(|(a, b)| f64::from(a - b).powi(2));
    (squares.sum::<f64>() / (3 * a.len()) as f64).sqrt()
}

/// Of the pixels, half err by more: edges, which the truth sees in parts, do not count.
fn median_error(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let of_pixel = |(a, b): (&[f32; 3], &[f32; 3])| (0..3).map(|c| f64::from((a[c] - b[c]).abs()) / 3.0).sum::<f64>();
    let mut errors: Vec<f64> = a.iter().zip(b).map(of_pixel).collect();
    errors.sort_by(f64::total_cmp);
    errors[errors.len() / 2]
}

fn truth(gpu: &Gpu, scene: &Scene, bounces: u32, samples: u32) -> Vec<[f32; 3]> {
    let paths = PathTracerSettings {
        component: PathComponent::Indirect,
        bounces,
        ..PathTracerSettings::default()
    };
    let mut reference = Reference::new(gpu, scene.clone(), &paths, 0, SIZE).unwrap();
    for _ in 0..samples {
        reference.render_sample(None).unwrap();
    }
    reference.read().unwrap().mean
}

#[test]
fn pixels_have_the_light_that_paths_find() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::pillars(0.3);
    let truth = truth(&gpu, &scene, 2, 1024);
    let by = |texels: &str| {
        let settings = settings(&[
            ("photons", "100000"),
            ("emission.first_hits", "traced"),
            ("illumination_maps.texels", texels),
            ("illumination_maps.rays", "256"),
            ("splatter.subsampling", "1"),
        ]);
        offline(&gpu, &scene, &settings).read().unwrap()
    };
    let (few, many) = (by("200"), by("1500"));
    let errors = [&few, &many].map(|p| median_error(p, &truth) / mean(&truth));
    let biases = [&few, &many].map(|p| mean(p) / mean(&truth) - 1.0);
    println!("200 and 1500 texels, median error {errors:.3?}, bias {biases:+.4?}");
    assert!(errors[1] < 0.6 * errors[0] && errors[1] < 0.05);
    assert!(biases[1].abs() < 0.02);
    assert_no_errors(&gpu);
}

/// Root mean square of how far light at texels is off, over all of it, and its bias; of texels that stand in the open.
fn off(own: &[(Vec3, [f32; 4])], truth: &[(Vec3, [f32; 4])]) -> [f64; 2] {
    let pairs = own.iter().zip(truth).filter(|(_, t)| t.1[3] > 0.999);
    let mut sums = [0.0; 4];
    for (own, truth) in pairs {
        for c in 0..3 {
            let (own, truth) = (f64::from(own.1[c]), f64::from(truth.1[c]));
            let own_sums = [(own - truth).powi(2), truth * truth, own, truth];
            (0..4).for_each(|i| sums[i] += own_sums[i]);
        }
    }
    [(sums[0] / sums[1]).sqrt(), sums[2] / sums[3] - 1.0]
}

#[test]
fn rays_that_go_where_photons_came_from_err_less() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::cornell(0.3);
    let by = |rays: &str, guided: &str| {
        let settings = settings(&[
            ("photons", "200000"),
            ("illumination_maps.rays", rays),
            ("illumination_maps.guided", guided),
        ]);
        texels(&gpu, &offline(&gpu, &scene, &settings))
    };
    let truth = by("4096", "0");
    let [even, half, most] = ["0", "0.5", "0.9"].map(|guided| off(&by("64", guided), &truth));
    println!("64 rays, error and bias: even {even:.4?}, half guided {half:.4?}, nine tenths {most:.4?}");
    assert!(half[0] < 0.8 * even[0]);
    assert!([even, half, most].iter().all(|e| e[1].abs() < 0.02));
    assert_no_errors(&gpu);
}

#[test]
fn texels_of_few_photons_take_the_light_around_them() {
    let Some(gpu) = gpu() else { return };
    let scene = rooms(1.0);
    let radiosity = |least: &str| {
        let settings = settings(&[("photons", "4000"), ("illumination_maps.least_photons", least)]);
        let offline = offline(&gpu, &scene, &settings);
        let lights = offline.renderer.surface_lights().unwrap();
        let map = offline.renderer.illumination_map().unwrap();
        let read = |buffer| read_buffer_blocking::<[f32; 4]>(&gpu.device, &gpu.queue, buffer).unwrap();
        let areas: Vec<f32> = read(lights.records()).iter().step_by(2).map(|r| r[3]).collect();
        let light: Vec<[f32; 4]> = read(map.radiosity());
        light.into_iter().zip(areas).collect::<Vec<_>>()
    };
    let (own, around) = (radiosity("0"), radiosity("50"));
    let lit = |all: &[([f32; 4], f32)]| all.iter().filter(|t| t.0[0] > 0.0).count();
    let few = |all: &[([f32; 4], f32)]| all.iter().filter(|t| t.0[0] > 0.0 && t.0[3] < 50.0).count();
    let sent = |all: &[([f32; 4], f32)]| all.iter().map(|t| f64::from(t.0[0] * t.1)).sum::<f64>();
    println!(
        "lit {} and {}, of few photons {} and {}, light {:.4} and {:.4}",
        lit(&own),
        lit(&around),
        few(&own),
        few(&around),
        sent(&own),
        sent(&around)
    );
    assert!(few(&own) > lit(&own) / 2 && few(&around) < few(&own) / 2);
    assert!((sent(&around) / sent(&own) - 1.0).abs() < 0.1);
    assert_no_errors(&gpu);
}

#[test]
fn while_nothing_changes_no_texel_is_gathered_and_no_bit_changes() {
    let Some(gpu) = gpu() else { return };
    let mut offline = offline(&gpu, &rooms(1.0), &settings(&[]));
    offline.render_frame(None).unwrap();
    let (first, picture) = (texels(&gpu, &offline), offline.read().unwrap());
    assert!(first.iter().filter(|t| t.1[3] > 0.5).count() > 300);
    for _ in 0..5 {
        offline.render_frame(None).unwrap();
        assert_eq!(counts(&gpu, &offline), [0, 0]);
    }
    assert!(texels(&gpu, &offline) == first);
    assert!(offline.read().unwrap() == picture);
    assert_no_errors(&gpu);
}

#[test]
fn behind_a_closed_door_no_texel_is_gathered_again_and_through_an_open_one_some_are() {
    let Some(gpu) = gpu() else { return };
    for time in [0.0, 1.0] {
        let mut scene = rooms(time);
        let settings = settings(&[("selective.budget", "20000")]);
        let mut offline = offline(&gpu, &scene, &settings);
        offline.render_frame(None).unwrap();
        let before = texels(&gpu, &offline);
        move_block(&mut scene, "near block", block_at(-0.5, -1.5, 0.5));
        offline.set_scene(scene).unwrap();
        let mut gathered = 0;
        for _ in 0..offline.renderer.photon_groups().unwrap().largest() {
            offline.render_frame(None).unwrap();
            gathered += counts(&gpu, &offline)[0];
        }
        let after = texels(&gpu, &offline);
        // Rooms lie to both sides of z = 0 of the unit frame, beyond the wall and what looks out of it.
        let mut changed = [0; 2];
        for (a, b) in before.iter().zip(&after) {
            changed[usize::from(b.0.z > 0.02)] += usize::from(a.1 != b.1);
        }
        println!(
            "door {time}: {gathered} gathered, changed near {}, far {}",
            changed[0], changed[1]
        );
        assert!(changed[0] > 50);
        assert_eq!(changed[1] > 0, time == 1.0, "door {time}");
    }
    assert_no_errors(&gpu);
}

#[test]
fn after_a_change_the_light_is_that_of_a_fresh_start_and_a_blend_takes_its_jumps() {
    let Some(gpu) = gpu() else { return };
    let mut scene = rooms(0.0);
    let fresh = {
        let mut scene = scene.clone();
        move_bulb(&mut scene);
        offline(&gpu, &scene, &settings(&[("illumination_maps.threshold", "0")]))
            .read()
            .unwrap()
    };
    let start = scene.clone();
    let mut jumps = Vec::new();
    for blend in ["1", "0.3"] {
        scene = start.clone();
        let settings = settings(&[
            ("illumination_maps.blend", blend),
            ("illumination_maps.threshold", "0"),
            ("selective.budget", "4000"),
            ("illumination_maps.a_frame", "60"),
        ]);
        let mut offline = offline(&gpu, &scene, &settings);
        offline.render_frame(None).unwrap();
        let before = offline.read().unwrap();
        move_bulb(&mut scene);
        offline.set_scene(scene.clone()).unwrap();
        let mut last = before.clone();
        let (mut until, mut jump) = (None, 0f64);
        for frame in 0..80 {
            offline.render_frame(None).unwrap();
            let now = offline.read().unwrap();
            if until.is_none() && rms(&now, &fresh) <= 0.05 * rms(&before, &fresh) {
                until = Some(frame + 1);
            }
            jump = jump.max(rms(&now, &last) / rms(&before, &fresh));
            last = now;
        }
        let left = rms(&last, &fresh) / rms(&before, &fresh);
        println!("blend {blend}: 95 % after {until:?} frames, {left:.1e} left, largest jump {jump:.3}");
        assert!(left < 0.01 && until.is_some());
        jumps.push(jump);
    }
    assert!(jumps[1] < 0.8 * jumps[0]);
    assert_no_errors(&gpu);
}

fn move_bulb(scene: &mut Scene) {
    // Of the room that the eye is in.
    bulb(scene, 1).x += 1.2;
}

#[test]
fn small_changes_wait_until_they_add_up() {
    let Some(gpu) = gpu() else { return };
    let mut scene = rooms(0.0);
    // Nothing is ever so much.
    let settings = settings(&[("illumination_maps.threshold", "1e6"), ("selective.budget", "20000")]);
    let mut offline = offline(&gpu, &scene, &settings);
    let before = texels(&gpu, &offline);
    assert!(before.iter().all(|t| t.1[3] > 0.0), "each is gathered once");
    let changes = |offline: &Offline<'_>| -> u64 {
        let lights = offline.renderer.surface_lights().unwrap();
        let all: Vec<[u32; 2]> = read_buffer_blocking(&gpu.device, &gpu.queue, lights.changes()).unwrap();
        assert!(all.iter().all(|c| c[1] <= c[0]));
        all.iter().map(|c| u64::from(c[1])).sum()
    };
    let first = changes(&offline);
    assert!(first > 0);
    move_block(&mut scene, "near block", block_at(-0.5, -1.5, 0.5));
    offline.set_scene(scene).unwrap();
    offline.render_frame(None).unwrap();
    assert!(changes(&offline) > first);
    let light = |all: &[(Vec3, [f32; 4])]| all.iter().map(|t| t.1).collect::<Vec<_>>();
    assert!(light(&texels(&gpu, &offline)) == light(&before));
    assert_no_errors(&gpu);
}

#[test]
fn one_bounce_is_light_too() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::cornell(0.3);
    let settings = settings(&[
        ("bounces", "1"),
        ("photons", "100000"),
        ("emission.first_hits", "traced"),
        ("illumination_maps.texels", "1500"),
        ("splatter.subsampling", "1"),
    ]);
    let kept = offline(&gpu, &scene, &settings).read().unwrap();
    let bias = mean(&kept) / mean(&truth(&gpu, &scene, 1, 512)) - 1.0;
    println!("bias {bias:+.4}");
    assert!(bias.abs() < 0.02);
    assert_no_errors(&gpu);
}

#[test]
fn what_is_missing_is_named() {
    let Some(gpu) = gpu() else { return };
    let mut offline = offline(&gpu, &samples::cornell(0.0), &settings(&[]));
    offline.points.clear();
    let error = offline.render_frame(None).unwrap_err();
    let Error::MissingInput { stage, input, .. } = &error else {
        panic!("{error}");
    };
    assert_eq!((*stage, *input), ("TexelGather", "places on surfaces"));
    assert_no_errors(&gpu);
}
