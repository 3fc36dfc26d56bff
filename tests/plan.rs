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
use lightfall::scene::{Instance, SceneBounds, SceneSummary, samples};
use std::f64::consts::PI;

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
fn a_volume_in_one_room_takes_fewer_maps_and_its_light_is_as_right() {
    let Some(gpu) = gpu() else { return };
    // The door is open, the eye in the room with the bulb.
    let mut scene = samples::two_rooms(2.0);
    scene.cameras[0].transform = DAffine3::from_rotation_y(PI) * scene.cameras[0].transform;
    let both = SceneSummary::of(&scene).unwrap();
    let bounds = SceneBounds::new(both.bounds.min, DVec3::new(both.bounds.max.x, both.bounds.max.y, 0.0)).unwrap();
    let one = SceneSummary { bounds, ..both.clone() };
    let settings = Settings {
        photons: 60_000,
        env_map_count: 12,
        ..settings()
    };
    let paths = PathTracerSettings {
        component: PathComponent::Indirect,
        bounces: settings.bounces,
        spans_pixel: false,
        ..Default::default()
    };
    let mut reference = Reference::new(&gpu, scene.clone(), &paths, 0, SIZE).unwrap();
    let estimate = reference.trace(1024).unwrap();
    let image = |rgb| Image {
        width: SIZE[0],
        height: SIZE[1],
        rgb,
    };
    let truth = Truth {
        standard_error: Some(estimate.standard_error),
        ..Truth::new(image(estimate.mean))
    };
    let render = |summary: &SceneSummary| {
        let told = (scene.clone(), summary.clone());
        let mut offline = Offline::with_summary(&gpu, told, &settings, 0, SIZE, Component::Indirect).unwrap();
        offline.render_frame(None).unwrap();
        let maps = offline.renderer.env_maps().unwrap().centers().len();
        let bytes = offline.renderer.memory_use();
        let comparison = metrics::compare(&image(offline.read().unwrap()), &truth).unwrap();
        println!(
            "{maps} maps, {bytes} bytes, relMSE {:.4}, energy {:+.1} %",
            comparison.relmse,
            100.0 * comparison.bias
        );
        (maps, bytes, comparison)
    };
    let (whole, room) = (render(&both), render(&one));
    assert!(room.0 < whole.0 && room.1 < whole.1);
    assert!(room.2.relmse < 1.1 * whole.2.relmse && room.2.bias.abs() < 0.03);
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
    assert!(alone.0 > 1.5 * among.0);
    assert!((alone.1 / among.1 - 1.0).abs() < 0.02);
    assert_no_errors(&gpu);
}
