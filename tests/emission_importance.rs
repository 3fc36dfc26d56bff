//! Photons that start where their paths are seen: what the tables say against where photons start, and light against light.
//! What it gains is in `docs/density.md`.

mod common;

use common::{Component, Gpu, Offline, assert_no_errors, gpu};
use lightfall::Error;
use lightfall::frame::{Settings, TracerKind};
use lightfall::glam::DVec3;
use lightfall::resource::{Photon, PhotonState};
use lightfall::scene::{Light, Scene, samples};
use std::collections::BTreeSet;

/// Cells along an axis of a light's emission.
const CELLS: usize = 16;
const SIZE: [u32; 2] = [48, 36];

fn settings(importance: f32) -> Settings {
    Settings {
        frames: 1,
        photons: 30_000,
        emission_importance: importance,
        tracer_kind: TracerKind::Bvh,
        ..Settings::fast()
    }
}

/// Light from the near room reaches the camera in the far one through the doorway alone.
fn doorway() -> Scene {
    samples::two_rooms(1.0)
}

fn rendered<'a>(gpu: &'a Gpu, scene: &Scene, settings: &Settings) -> Offline<'a> {
    let mut offline = Offline::new(gpu, scene.clone(), settings, 0, SIZE, Component::Indirect).unwrap();
    for _ in 0..settings.frames {
        offline.render_frame(None).unwrap();
    }
    offline
}

fn photons(gpu: &Gpu, offline: &Offline<'_>) -> Vec<Photon> {
    let buffer = offline.renderer.photons().unwrap().buffer();
    lightfall::read_buffer_blocking(&gpu.device, &gpu.queue, buffer).unwrap()
}

/// For each light: share of its photons by cell, as its table says.
fn shares(gpu: &Gpu, offline: &Offline<'_>, lights: usize) -> Vec<Vec<f64>> {
    let buffer = offline.renderer.emission_cells().unwrap().tables();
    let all: Vec<f32> = lightfall::read_buffer_blocking(&gpu.device, &gpu.queue, buffer).unwrap();
    let step = |ends: &[f32], i: usize| f64::from(ends[i]) - if i == 0 { 0.0 } else { f64::from(ends[i - 1]) };
    all.chunks_exact(CELLS + CELLS * CELLS)
        .take(lights)
        .map(|table| {
            let (columns, rows) = table.split_at(CELLS);
            let cell = |i: usize| {
                let rows = &rows[i / CELLS * CELLS..][..CELLS];
                step(columns, i / CELLS) * step(rows, i % CELLS)
            };
            (0..CELLS * CELLS).map(cell).collect()
        })
        .collect()
}

#[test]
fn photons_start_as_densely_as_the_table_says_and_bring_as_much_light() {
    let Some(gpu) = gpu() else { return };
    let mut scene = doorway();
    // One that is never seen, and one beside the camera.
    scene
        .lights
        .push(Light::point(DVec3::new(1.5, 0.3, -3.5), 1.0, [0.2, 1.0, 0.2]));
    scene
        .lights
        .push(Light::point(DVec3::new(0.0, 2.5, 2.0), 2.0, [1.0; 3]));
    let even = rendered(&gpu, &scene, &settings(0.0));
    let led = rendered(&gpu, &scene, &settings(0.8));
    let count = settings(0.0).photons as usize;
    let tables = shares(&gpu, &led, scene.lights.len());
    let (even, led) = (photons(&gpu, &even), photons(&gpu, &led));
    for (light, table) in tables.iter().enumerate() {
        let own: Vec<&Photon> = led[..count].iter().filter(|p| p.light() as usize == light).collect();
        let total: f64 = table.iter().sum();
        assert!((total - 1.0).abs() < 1e-5, "light {light}: shares sum up to {total}");
        let evenly = 1.0 / (CELLS * CELLS) as f64;
        let largest = table.iter().copied().fold(0.0, f64::max) / evenly;
        let flux_of_one = f64::from(even.iter().find(|p| p.light() as usize == light).unwrap().flux[1]);
        let mut found = vec![0.0; CELLS * CELLS];
        for photon in &own {
            let cell = (photon.state >> 16 & 255) as usize;
            found[cell] += 1.0;
            // As much less light each as there are more of them.
            let boost = table[cell] / evenly;
            assert!((f64::from(photon.flux[1]) * boost / flux_of_one - 1.0).abs() < 1e-4);
            assert!((f64::from(photon.emission_boost()) / boost - 1.0).abs() < 0.025);
        }
        // A low-discrepancy sequence: no cell is off by more than a few photons.
        let worst = found
            .iter()
            .zip(table)
            .map(|(found, share)| (found - share * own.len() as f64).abs())
            .fold(0.0, f64::max);
        let flux: f64 = own.iter().map(|p| f64::from(p.flux[1])).sum::<f64>() / (own.len() as f64 * flux_of_one);
        println!(
            "light {light}: {} photons, at most {largest:.1} times as densely as evenly, a cell off by up to {worst:.1}; \
             flux {:+.3} %",
            own.len(),
            100.0 * (flux - 1.0)
        );
        assert!(worst < 12.0, "{worst}");
        assert!((flux - 1.0).abs() < 0.01);
        assert!(
            table.iter().all(|&share| share > 0.19 * evenly),
            "a fifth is spread evenly"
        );
    }
    // The bulb's paths through the doorway are seen, those into the corner behind it are not.
    let spread = |light: usize| {
        let most = tables[light].iter().copied().fold(0.0, f64::max);
        most / tables[light].iter().copied().fold(f64::INFINITY, f64::min)
    };
    assert!(spread(0) > 1.5, "{}", spread(0));
    // What later hops bring is the same as well, up to noise.
    let flux = |all: &[Photon], hop: usize| -> f64 {
        let hops = &all[hop * count..][..count];
        let stored = hops.iter().filter(|p| p.state() == PhotonState::Stored);
        stored.map(|p| f64::from(p.flux[1])).sum()
    };
    for hop in 1..=3 {
        let ratio = flux(&led, hop) / flux(&even, hop);
        println!("hop {hop}: {:+.2} % of the flux", 100.0 * (ratio - 1.0));
        assert!((ratio - 1.0).abs() < 0.03);
    }
    assert_no_errors(&gpu);
}

#[test]
fn a_scene_at_rest_comes_to_the_same_bits() {
    let Some(gpu) = gpu() else { return };
    let scene = doorway();
    let mut offline = Offline::new(&gpu, scene.clone(), &settings(0.8), 0, SIZE, Component::Indirect).unwrap();
    offline.in_motion = false;
    for _ in 0..10 {
        offline.render_frame(None).unwrap();
    }
    let table = shares(&gpu, &offline, 1);
    let image = offline.read().unwrap();
    offline.render_frame(None).unwrap();
    assert!(image.iter().flatten().any(|&v| v > 0.0));
    assert!(offline.read().unwrap() == image);
    assert_eq!(shares(&gpu, &offline, 1), table);
    assert_no_errors(&gpu);
}

#[test]
fn all_photons_led_are_refused_and_none_need_no_memory() {
    let Some(gpu) = gpu() else { return };
    let refused = Settings::fast().set("emission.importance", "1");
    assert!(matches!(refused, Err(Error::InvalidSetting { .. })), "{refused:?}");
    let has_cells = |importance| {
        let offline = rendered(&gpu, &doorway(), &settings(importance));
        let list = offline.memory_by_resource();
        let names: BTreeSet<_> = list.iter().map(|(name, _)| *name).collect();
        assert_eq!(names.len(), list.len(), "each name once: {list:?}");
        names.contains("emission_cells")
    };
    assert!(!has_cells(0.0) && has_cells(0.5));
    assert_no_errors(&gpu);
}
