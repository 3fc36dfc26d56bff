//! Statements about the fused composite: it shows what the passes it stands for show, and takes less for it.

mod common;

use common::{Component, Gpu, Offline, assert_no_errors, gpu};
use lightfall::creation_count;
use lightfall::frame::{Settings, Stage};
use lightfall::glam::DVec3;
use lightfall::scene::{Light, LightKind, Scene, samples};

const SIZE: [u32; 2] = [96, 64];

/// Settings by name.
type Overrides = &'static [(&'static str, &'static str)];

fn settings(overrides: &[(&str, &str)]) -> Settings {
    let mut settings = Settings {
        photons: 5000,
        shadow_map_size: 128,
        environment_suns: 4,
        ..Settings::fast()
    };
    settings.set("caustic.photons", "2000").unwrap();
    settings.set("soft_shadow.method", "disc").unwrap();
    settings.set("tracer.kind", "bvh").unwrap();
    for (name, value) in overrides {
        settings.set(name, value).unwrap();
    }
    settings
}

fn fused(settings: &Settings) -> Settings {
    Settings {
        fuses_composite: true,
        ..settings.clone()
    }
}

fn offline<'a>(gpu: &'a Gpu, scene: &Scene, settings: &Settings) -> Offline<'a> {
    Offline::new(gpu, scene.clone(), settings, 0, SIZE, Component::All).unwrap()
}

/// Many small bulbs under a lamp.
fn bulbs(count: u32) -> Scene {
    let mut scene = samples::penumbra(0.0);
    let lamp = scene.lights[0].clone();
    for i in 0..count {
        let LightKind::Point { position, radius } = lamp.kind else {
            panic!("the sample's light is a bulb");
        };
        let aside = 0.3 * DVec3::new((f64::from(i) * 2.4).cos(), 0.0, (f64::from(i) * 2.4).sin());
        let kind = LightKind::Point {
            position: position + aside,
            // Some have no extent.
            radius: if i % 3 == 2 { 0.0 } else { radius },
        };
        scene.lights.push(Light {
            kind,
            intensity: lamp.intensity / count as f32,
            ..lamp.clone()
        });
    }
    scene
}

#[test]
fn one_pass_shows_what_one_after_the_other_shows() {
    let Some(gpu) = gpu() else { return };
    let penumbra = samples::penumbra(0.0);
    let mut hard = penumbra.clone();
    if let LightKind::Point { radius, .. } = &mut hard.lights[0].kind {
        *radius = 0.0;
    }
    let cases: [(&str, Scene, Overrides); 11] = [
        ("penumbra", penumbra.clone(), &[]),
        ("no extent", hard, &[]),
        ("no search", penumbra.clone(), &[("soft_shadow.search", "off")]),
        ("shadow maps", penumbra.clone(), &[("soft_shadow.method", "pcss")]),
        (
            "every pixel estimated",
            penumbra.clone(),
            &[("splatter.subsampling", "1")],
        ),
        ("an eighth of them", penumbra.clone(), &[("splatter.subsampling", "8")]),
        ("direct light alone", penumbra, &[("bounces", "0")]),
        // More than a word of flags has bits for.
        ("forty lights", bulbs(40), &[("bounces", "0")]),
        ("two of them soft", bulbs(4), &[("soft_shadow.lights", "2")]),
        ("caustics, glass", samples::glass_sphere(0.0), &[]),
        ("a sky", samples::courtyard(0.0), &[]),
    ];
    for (name, scene, overrides) in cases {
        let separate = settings(overrides);
        let read = |settings: &Settings| {
            let mut offline = offline(&gpu, &scene, settings);
            offline.render_frame(None).unwrap();
            offline.read().unwrap()
        };
        let (found, expected) = (read(&fused(&separate)), read(&separate));
        let mean = expected.iter().flatten().sum::<f32>() / (3 * expected.len()) as f32;
        assert!(mean > 0.0, "{name}");
        let differences = found.iter().flatten().zip(expected.iter().flatten());
        let largest = differences.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        println!("{name}: {:.1e} of the mean at most", largest / mean);
        // Rounding: the compiler may contract what it sees in one shader and not in another.
        assert!(largest <= 1e-5 * mean, "{name}: {largest}, mean {mean}");
    }
    assert_no_errors(&gpu);
}

#[test]
fn one_pass_takes_less_memory_and_fewer_passes_and_settles() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::penumbra(0.0);
    let separate = settings(&[]);
    let measure = |settings: &Settings| {
        let mut offline = offline(&gpu, &scene, settings);
        let before = creation_count();
        offline.render_frame(None).unwrap();
        let first = creation_count();
        offline.render_frame(None).unwrap();
        let second = creation_count();
        assert_eq!(second.bytes, first.bytes);
        assert_eq!(second.bind_groups, first.bind_groups);
        assert_eq!(second.pipelines, first.pipelines);
        let bytes: u64 = offline.view.memory_by_resource().iter().map(|r| r.1).sum();
        (bytes, first.passes - before.passes, offline)
    };
    let (bytes, passes, apart) = measure(&separate);
    let (fused_bytes, fused_passes, together) = measure(&fused(&separate));
    // No direct and no indirect irradiance, 16 bytes a pixel each, and no steps of the gathering, 12.
    let pixels = u64::from(SIZE[0] * SIZE[1]);
    let saved = bytes - fused_bytes;
    println!("{bytes} bytes, {fused_bytes} in one pass");
    assert!(saved > 43 * pixels && saved < 45 * pixels, "{saved}");
    // Test, list, search, blur, up-sampling, direct light, sum; test, flags, all else.
    assert_eq!(passes - fused_passes, 7 - 3);
    assert!(apart.view.visibility().is_some() && apart.view.direct().is_some() && apart.view.indirect().is_some());
    let view = &together.view;
    assert!(view.visibility().is_none() && view.direct().is_none() && view.indirect().is_none());
    let plan = together.renderer.plan().unwrap();
    assert!(plan.is_on(Stage::FusedComposite) && plan.is_on(Stage::SoftShadow));
    for stage in [Stage::DirectLight, Stage::Upsampler, Stage::Composite] {
        assert!(!plan.is_on(stage), "{stage:?}");
    }
    assert!(plan.to_string().contains("within FusedComposite"), "{plan}");
    // Where nothing shines there is nothing to fuse.
    let mut dark = scene.clone();
    dark.lights.clear();
    let mut dark = offline(&gpu, &dark, &fused(&separate));
    dark.render_frame(None).unwrap();
    let plan = dark.renderer.plan().unwrap();
    assert!(plan.is_on(Stage::Composite) && !plan.is_on(Stage::FusedComposite));
    assert!(dark.read().unwrap().iter().flatten().all(|v| *v == 0.0));
    assert_no_errors(&gpu);
}

#[test]
fn levels_before_the_last_are_estimated_anew() {
    let Some(gpu) = gpu() else { return };
    let scene = samples::penumbra(0.0);
    let by_levels = settings(&[("upsampler.levels", "by-levels")]);
    let levels = |settings: &Settings| {
        let mut offline = offline(&gpu, &scene, settings);
        offline.render_frame(None).unwrap();
        let is_on = offline.renderer.plan().unwrap().is_on(Stage::Upsampler);
        (offline.view.marked_pixels().count(), is_on, offline.read().unwrap())
    };
    let (count, is_on, apart) = levels(&by_levels);
    assert_eq!((count, is_on), (2, true));
    let (count, is_on, together) = levels(&fused(&by_levels));
    assert_eq!((count, is_on), (1, true));
    // The same but at the pixels that the last level was in doubt of.
    let mean = |pixels: &[[f32; 3]]| pixels.iter().flatten().sum::<f32>() / (3 * pixels.len()) as f32;
    let same = apart.iter().zip(&together).filter(|(a, b)| a == b).count();
    println!("{same} of {} pixels are the same", apart.len());
    assert!((mean(&together) / mean(&apart) - 1.0).abs() < 0.02);
    assert!(same * 10 > apart.len() * 6, "{same}");
    assert_no_errors(&gpu);
}
