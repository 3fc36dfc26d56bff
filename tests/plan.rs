//! Only what a scene requires is done: what is left out saves stages and bytes, and changes nothing that is asked for.
#![cfg(all(feature = "bvh", feature = "reference"))]

mod common;

use common::{Component, Offline, Reference, assert_no_errors, gpu};
use lightfall::frame::{CausticSettings, Settings, TracerKind};
use lightfall::glam::{DAffine3, DVec3, Vec3};
use lightfall::pass::EnvMapSelectorSettings;
use lightfall::read_buffer_blocking;
use lightfall::reference::metrics::{self, Image, Truth};
use lightfall::reference::{PathComponent, PathTracerSettings};
use lightfall::resource::{Photon, PhotonState, Subsampling};
use lightfall::scene::{Instance, Light, LightKind, SceneBounds, SceneSummary, samples};

const SIZE: [u32; 2] = [48, 32];

fn settings() -> Settings {
    Settings {
        photons: 5_000,
        env_map_count: 3,
        env_map_size: 32,
        shadow_map_size: 64,
        selector: EnvMapSelectorSettings {
            candidates: 40,
            ..Default::default()
        },
        subsampling: Subsampling::Full,
        ..Settings::balanced()
    }
}

#[test]
fn what_a_scene_does_not_need_is_left_out_and_changes_nothing() {
    let Some(gpu) = gpu() else { return };
    let mut black = samples::cornell(0.0);
    for material in &mut black.materials {
        (material.base_color, material.base_color_texture) = ([0.0; 3], None);
    }
    // Nothing specular; nothing that reflects.
    for (scene, saved) in [(samples::cornell(0.0), 1.2), (black, 4.0)] {
        let render = |presumes_all: bool| {
            let mut summary = SceneSummary::of(&scene).unwrap();
            if presumes_all {
                summary = summary.presuming_all();
            }
            let told = (scene.clone(), summary);
            let mut offline = Offline::with_summary(&gpu, told, &settings(), 0, SIZE, Component::All).unwrap();
            offline.in_motion = false;
            offline.render_frame(None).unwrap();
            let bytes = offline.renderer.memory_use() + offline.view.memory_use();
            let plan = offline.renderer.plan().unwrap();
            let stages = plan.stages.iter().filter(|stage| stage.on).count();
            (offline.read().unwrap(), stages, bytes)
        };
        let (planned, presumed) = (render(false), render(true));
        assert!(planned.0 == presumed.0, "the picture is the same");
        println!(
            "stages {} of {}, bytes {} of {}",
            planned.1, presumed.1, planned.2, presumed.2
        );
        assert!(planned.1 < presumed.1 && planned.2 as f64 * saved < presumed.2 as f64);
    }
    assert_no_errors(&gpu);
}

#[test]
fn a_volume_takes_the_photons_of_a_sun_to_itself() {
    let Some(gpu) = gpu() else { return };
    // The sun shines into a box that stands open on a plain.
    let mut scene = samples::cornell(0.0);
    scene.lights = vec![Light {
        name: "sun".into(),
        kind: LightKind::Directional {
            direction: DVec3::new(0.15, -0.35, 1.0),
            angle: 0.0,
        },
        color: [1.0, 0.95, 0.9],
        intensity: 4.0,
    }];
    let own = SceneSummary::of(&scene).unwrap();
    let plain = samples::plane();
    scene.meshes.push(plain.meshes[0].clone());
    scene.instances.push(Instance {
        transform: DAffine3::from_translation(DVec3::new(0.0, -0.05, 0.0)),
        ..Instance::new(scene.meshes.len() - 1, 0)
    });
    let whole = SceneSummary::of(&scene).unwrap();
    // What lies around the box lights it, too.
    let margin = DVec3::new(12.0, 0.0, 12.0);
    let bounds = SceneBounds::new(own.bounds.min - margin, own.bounds.max + margin).unwrap();
    let volume = SceneSummary::of_part(&scene, bounds).unwrap();
    let settings = Settings {
        photons: 100_000,
        tracer_kind: TracerKind::Bvh,
        ..settings()
    };
    let paths = PathTracerSettings {
        component: PathComponent::Indirect,
        bounces: settings.bounces,
        spans_pixel: false,
        ..Default::default()
    };
    let mut reference = Reference::new(&gpu, scene.clone(), &paths, 0, SIZE).unwrap();
    let traced = reference.truth(1024).unwrap();
    let image = |rgb| Image {
        width: SIZE[0],
        height: SIZE[1],
        rgb,
    };
    // The eye looks into the box.
    let sees_box = |pixel: usize| {
        let [x, y] = [pixel % SIZE[0] as usize, pixel / SIZE[0] as usize];
        (10..38).contains(&x) && (2..30).contains(&y)
    };
    let truth = Truth {
        valid: (0..traced.valid.len()).map(sees_box).collect(),
        ..traced
    };
    let error = |summary: &SceneSummary| {
        let told = (scene.clone(), summary.clone());
        let mut offline = Offline::with_summary(&gpu, told, &settings, 0, SIZE, Component::Indirect).unwrap();
        offline.render_frame(None).unwrap();
        metrics::compare(&image(offline.read().unwrap()), &truth).unwrap()
    };
    let (all, own) = (error(&whole), error(&volume));
    println!(
        "relMSE {:.4}, of a volume {:.4}, energy {:+.1}, {:+.1} %",
        all.relmse,
        own.relmse,
        100.0 * all.bias,
        100.0 * own.bias
    );
    assert!(own.relmse < all.relmse / 8.0 && own.bias.abs() < all.bias.abs() + 0.02);
    assert_no_errors(&gpu);
}

#[test]
fn caustics_of_one_thing_take_all_photons_there() {
    let Some(gpu) = gpu() else { return };
    let mut scene = samples::glass_sphere(0.0);
    let ball = scene.instances.last().unwrap().clone();
    scene.instances.push(Instance {
        transform: DAffine3::from_translation(DVec3::new(1.9, 0.0, -0.4)) * ball.transform,
        ..ball.clone()
    });
    let both = SceneSummary::of(&scene).unwrap();
    let own = ball.transform.translation;
    let mut one = both.clone();
    one.specular_bounds.retain(|b| (b.center - own).length() < b.radius);
    assert_eq!([both.specular_bounds.len(), one.specular_bounds.len()], [2, 1]);
    let settings = Settings {
        tracer_kind: TracerKind::Bvh,
        caustic: CausticSettings {
            photons: 40_000,
            ..Default::default()
        },
        ..settings()
    };
    // Share of photons that land on the first ball, and their flux, W.
    let landed = |summary: &SceneSummary| {
        let told = (scene.clone(), summary.clone());
        let mut offline = Offline::with_summary(&gpu, told, &settings, 0, SIZE, Component::All).unwrap();
        offline.render_frame(None).unwrap();
        let plan = offline.renderer.plan().unwrap().to_string();
        let aims = format!("aimed at {} thing(s)", summary.specular_bounds.len());
        assert!(plan.contains(&aims), "{plan}");
        let frame = offline.renderer.frame().unwrap();
        let (center, radius) = (frame.point(own), one.specular_bounds[0].radius / frame.length_scale());
        let photons = offline.renderer.caustic_photons().unwrap();
        let records: Vec<Photon> = read_buffer_blocking(&gpu.device, &gpu.queue, photons.buffer()).unwrap();
        let first = &records[..photons.count() as usize];
        let is_there = |p: &&Photon| {
            let off = (Vec3::from(p.position) - center).length();
            p.state() == PhotonState::Stored && f64::from(off) < 1.01 * radius
        };
        let there: Vec<_> = first.iter().filter(is_there).collect();
        let flux: f32 = there.iter().map(|p| p.flux[1]).sum();
        (there.len() as f64 / first.len() as f64, f64::from(flux))
    };
    let (among, alone) = (landed(&both), landed(&one));
    println!(
        "share {:.2}, alone {:.2}; flux {:.5}, {:.5}",
        among.0, alone.0, among.1, alone.1
    );
    // The other one, farther from the lamp, had a third.
    assert!(alone.0 > 1.4 * among.0);
    assert!((alone.1 / among.1 - 1.0).abs() < 0.02);
    assert_no_errors(&gpu);
}
