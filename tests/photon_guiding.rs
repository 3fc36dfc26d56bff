//! Photons that go where their paths are seen: what the tables say against where photons go, and light against light.
//! What it gains is in `docs/density.md`.

mod common;

use common::{Component, Gpu, Offline, assert_no_errors, gpu};
use lightfall::frame::{Settings, TracerKind};
use lightfall::glam::{DVec3, Vec3};
use lightfall::pass::FirstHits;
use lightfall::resource::{Photon, PhotonState};
use lightfall::scene::{Light, LightKind, Scene, samples};
use lightfall::{Error, wgpu};
use std::collections::BTreeSet;

/// Cells along an axis of a light's emission.
const CELLS: usize = 16;
/// Cells along an axis of the directions from a diffuse surface.
const REFLECTIONS: usize = 4;
/// Places along an axis of the unit frame.
const PLACES: f32 = 16.0;
const SIZE: [u32; 2] = [48, 36];
/// Of the photons, guided.
const SHARE: f64 = 0.8;

fn settings(guided: f64) -> Settings {
    Settings {
        frames: 1,
        photons: 30_000,
        guided_photons: guided as f32,
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

/// How many times as densely photons come this one's way as if all were spread evenly.
fn boost(photon: &Photon) -> f64 {
    SHARE * f64::from(photon.guidance()) + (1.0 - SHARE)
}

/// Whether a number is another one rounded by chance to an eighth of a doubling.
fn is_rounded(found: f32, exact: f64) -> bool {
    (f64::from(found) / exact).log2().abs() < 0.1251
}

/// For each table: share of its photons by cell of N × N, as it says.
fn shares<const N: usize>(gpu: &Gpu, tables: &wgpu::Buffer) -> Vec<Vec<f64>> {
    let all: Vec<f32> = lightfall::read_buffer_blocking(&gpu.device, &gpu.queue, tables).unwrap();
    let step = |ends: &[f32], i: usize| f64::from(ends[i]) - if i == 0 { 0.0 } else { f64::from(ends[i - 1]) };
    all.chunks_exact(N + N * N)
        .map(|table| {
            let (columns, rows) = table.split_at(N);
            let cell = |i: usize| step(columns, i / N) * step(&rows[i / N * N..][..N], i % N);
            (0..N * N).map(cell).collect()
        })
        .collect()
}

/// For each light: share of its photons by cell of its emission.
fn emission_shares(gpu: &Gpu, offline: &Offline<'_>) -> Vec<Vec<f64>> {
    shares::<CELLS>(gpu, offline.renderer.guiding_tables().unwrap().emission())
}

/// For each table of reflections: share of the photons that it is for, by cell.
fn reflection_shares(gpu: &Gpu, offline: &Offline<'_>) -> Vec<Vec<f64>> {
    shares::<REFLECTIONS>(gpu, offline.renderer.guiding_tables().unwrap().reflection())
}

/// The table of reflections of a place and a normal, and the cell of a direction from there; `None` where rounding may decide.
fn reflection(origin: &Photon, direction: Vec3) -> Option<(usize, usize)> {
    let normal = Photon::unpack_unit_vector(origin.normal);
    let scaled = (Vec3::from(origin.position) * 0.5 + 0.5) * PLACES;
    let place = scaled.as_uvec3();
    let axis = normal.abs().max_position();
    let side = 2 * axis + usize::from(normal[axis] < 0.0);
    let table = 6 * (place.x + 16 * (place.y + 16 * place.z)) as usize + side;
    // The frame of Duff et al. 2017.
    let sign = if normal.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + normal.z);
    let b = normal.x * normal.y * a;
    let x = Vec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x);
    let y = Vec3::new(b, sign + normal.y * normal.y * a, -normal.y);
    let turn = direction.dot(y).atan2(direction.dot(x)) / std::f32::consts::TAU;
    let u = [1.0 - direction.dot(normal).powi(2), turn.rem_euclid(1.0)].map(|u| u * REFLECTIONS as f32);
    let is_sure = |v: f32| (0.01..0.99).contains(&v.fract());
    let cell = u[0] as usize * REFLECTIONS + u[1] as usize;
    (u.into_iter().all(is_sure) && scaled.to_array().into_iter().all(is_sure)).then_some((table, cell))
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
    let guided = rendered(&gpu, &scene, &settings(SHARE));
    let count = settings(0.0).photons as usize;
    let tables = emission_shares(&gpu, &guided);
    let (even, guided) = (photons(&gpu, &even), photons(&gpu, &guided));
    for (light, table) in tables.iter().take(scene.lights.len()).enumerate() {
        let own: Vec<&Photon> = guided[..count].iter().filter(|p| p.light() as usize == light).collect();
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
            let relative = f64::from(photon.flux[1]) * boost(photon) / flux_of_one;
            assert!((relative - 1.0).abs() < 1e-4, "{relative}");
            assert!(is_rounded(photon.guidance(), table[cell] / evenly));
        }
        // In standard deviations, if it were by chance who is guided.
        let expected = |share: f64| (SHARE * share + (1.0 - SHARE) * evenly) * own.len() as f64;
        let worst = found
            .iter()
            .zip(table)
            .map(|(found, share)| (found - expected(*share)).abs() / expected(*share).sqrt())
            .fold(0.0, f64::max);
        let flux: f64 = own.iter().map(|p| f64::from(p.flux[1])).sum::<f64>() / (own.len() as f64 * flux_of_one);
        println!(
            "light {light}: {} photons, at most {largest:.1} times as densely as evenly, a cell off by up to {worst:.1} deviations; \
             flux {:+.3} %",
            own.len(),
            100.0 * (flux - 1.0)
        );
        assert!(worst < 4.0, "{worst}");
        assert!((flux - 1.0).abs() < 0.01);
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
        let ratio = flux(&guided, hop) / flux(&even, hop);
        println!("hop {hop}: {:+.2} % of the flux", 100.0 * (ratio - 1.0));
        assert!((ratio - 1.0).abs() < 0.03);
    }
    assert_no_errors(&gpu);
}

#[test]
fn photons_go_on_as_densely_as_the_tables_say() {
    let Some(gpu) = gpu() else { return };
    let guided = rendered(&gpu, &doorway(), &settings(SHARE));
    let tables = reflection_shares(&gpu, &guided);
    let all = photons(&gpu, &guided);
    let count = settings(SHARE).photons as usize;
    let (mut checked, mut most) = (0, 0.0f64);
    for (from, to) in all.iter().zip(&all[count..]) {
        let way = || reflection(from, Photon::unpack_unit_vector(to.direction));
        if to.state() == PhotonState::Empty {
            continue;
        }
        let Some((table, cell)) = way() else { continue };
        // Paths whose guidance eight bits may not hold much longer go on evenly.
        let is_guided = (2f32.powi(-12)..2f32.powi(11)).contains(&from.guidance());
        let guidance = if is_guided { 16.0 * tables[table][cell] } else { 1.0 };
        assert!(is_rounded(to.guidance(), f64::from(from.guidance()) * guidance));
        let flux = f64::from(from.flux[1] * from.reflectance()[1]) * boost(from) / boost(to);
        assert!(
            (f64::from(to.flux[1]) / flux - 1.0).abs() < 1e-3,
            "{} instead of {flux}",
            to.flux[1]
        );
        (checked, most) = (checked + 1, guidance.max(most));
    }
    println!(
        "{checked} of {} hops, at most {most:.1} times as densely as evenly",
        3 * count
    );
    assert!(checked > 2 * count && most > 4.0);
    assert_no_errors(&gpu);
}

/// Walks that two tracers share, photons that start on a panel, and such as come by way of metal and glass.
#[test]
fn guided_photons_bring_as_much_light_however_they_are_traced() {
    let Some(gpu) = gpu() else { return };
    let panel = || {
        let mut scene = doorway();
        scene.lights = vec![Light {
            kind: LightKind::Rectangle {
                center: DVec3::new(-0.8, 2.4, -2.2),
                half_u: DVec3::new(0.3, 0.0, 0.0),
                half_v: DVec3::new(0.0, 0.0, 0.3),
            },
            ..Light::point(DVec3::ZERO, 20.0, [1.0, 0.9, 0.75])
        }];
        scene
    };
    let glass = samples::glass_sphere(0.0);
    // Of the glass fresh paths: where little light is stored, tables fit paths that stay the same too well.
    for (name, scene, tracer_kind, first_hits, frames) in [
        ("hybrid", doorway(), TracerKind::Hybrid, FirstHits::ShadowMaps, 1),
        ("panel", panel(), TracerKind::Hybrid, FirstHits::Traced, 1),
        ("glass", glass, TracerKind::Bvh, FirstHits::Traced, 12),
    ] {
        let flux = |guided| {
            let settings = Settings {
                tracer_kind,
                first_hits,
                frames,
                ..settings(guided)
            };
            let offline = rendered(&gpu, &scene, &settings);
            let count = settings.photons as usize;
            let all = photons(&gpu, &offline);
            let by_hop = all.chunks_exact(count).map(|hop| {
                let stored = hop.iter().filter(|p| p.state() == PhotonState::Stored);
                stored.map(|p| f64::from(p.flux[1])).sum::<f64>()
            });
            by_hop.collect::<Vec<_>>()
        };
        let ratios: Vec<f64> = flux(SHARE).iter().zip(flux(0.0)).map(|(a, b)| a / b - 1.0).collect();
        println!("{name}: {ratios:.4?} of each hop's flux");
        assert_eq!(ratios.len(), 4);
        assert!(ratios.iter().all(|ratio| ratio.abs() < 0.04), "{name}: {ratios:?}");
    }
    assert_no_errors(&gpu);
}

/// As many photons as those behind the doorway are worth, were they all of the same flux.
#[test]
fn more_photons_come_through_a_doorway() {
    let Some(gpu) = gpu() else { return };
    let worth = |share| {
        let all = photons(&gpu, &rendered(&gpu, &doorway(), &settings(share)));
        let count = settings(share).photons as usize;
        let far = all[count..]
            .iter()
            .filter(|p| p.state() == PhotonState::Stored && p.position[2] > 0.1);
        let (sum, squares) = far.fold((0.0, 0.0), |(sum, squares), p| {
            let flux = f64::from(p.flux[1]);
            (sum + flux, squares + flux * flux)
        });
        sum * sum / squares
    };
    let [even, guided] = [worth(0.0), worth(0.5)];
    println!("{even:.0} spread evenly, {guided:.0} guided");
    assert!(guided > 1.3 * even);
    assert_no_errors(&gpu);
}

#[test]
fn a_scene_at_rest_comes_to_the_same_bits() {
    let Some(gpu) = gpu() else { return };
    let scene = doorway();
    let mut offline = Offline::new(&gpu, scene.clone(), &settings(SHARE), 0, SIZE, Component::Indirect).unwrap();
    offline.in_motion = false;
    for _ in 0..10 {
        offline.render_frame(None).unwrap();
    }
    let table = emission_shares(&gpu, &offline);
    let reflections = reflection_shares(&gpu, &offline);
    let image = offline.read().unwrap();
    offline.render_frame(None).unwrap();
    assert!(image.iter().flatten().any(|&v| v > 0.0));
    assert!(offline.read().unwrap() == image);
    assert_eq!(emission_shares(&gpu, &offline), table);
    assert_eq!(reflection_shares(&gpu, &offline), reflections);
    assert_no_errors(&gpu);
}

#[test]
fn all_photons_guided_are_refused_and_none_need_no_memory() {
    let Some(gpu) = gpu() else { return };
    let refused = Settings::fast().set("photons.guided", "1");
    assert!(matches!(refused, Err(Error::InvalidSetting { .. })), "{refused:?}");
    let has_tables = |guided| {
        let offline = rendered(&gpu, &doorway(), &settings(guided));
        let list = offline.memory_by_resource();
        let names: BTreeSet<_> = list.iter().map(|(name, _)| *name).collect();
        assert_eq!(names.len(), list.len(), "each name once: {list:?}");
        names.contains("guiding_tables")
    };
    assert!(!has_tables(0.0) && has_tables(0.5));
    assert_no_errors(&gpu);
}
