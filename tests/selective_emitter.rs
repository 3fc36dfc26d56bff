//! Statements about photons that stay until their way changes.

mod common;

use common::rooms::{block_at, bulb, move_block, with_blocks as rooms};
use common::{Component, Gpu, Offline, assert_no_errors, gpu};
use lightfall::frame::Settings;
use lightfall::read_buffer_blocking;
use lightfall::resource::Photon;
use lightfall::scene::Scene;

fn settings(overrides: &[(&str, &str)]) -> Settings {
    let mut settings = Settings {
        photons: 12_000,
        bounces: 2,
        shadow_map_size: 128,
        ..Settings::fast()
    };
    for (name, value) in [("tracer.kind", "bvh"), ("selective", "on")].iter().chain(overrides) {
        settings.set(name, value).unwrap();
    }
    settings
}

fn offline<'a>(gpu: &'a Gpu, scene: &Scene, settings: &Settings) -> Offline<'a> {
    let mut offline = Offline::new(gpu, scene.clone(), settings, 0, [32, 24], Component::Indirect).unwrap();
    offline.render_frame(None).unwrap();
    offline
}

fn read_photons(gpu: &Gpu, offline: &Offline<'_>) -> Vec<Photon> {
    let photons = offline.renderer.photons().unwrap();
    read_buffer_blocking(&gpu.device, &gpu.queue, photons.buffer()).unwrap()
}

/// Of the last frame: paths probed, those that had become other ones, paths traced anew beside, groups that wait.
fn counts(gpu: &Gpu, offline: &Offline<'_>) -> [u32; 4] {
    let groups = offline.renderer.photon_groups().unwrap();
    read_buffer_blocking::<[u32; 4]>(&gpu.device, &gpu.queue, groups.counts()).unwrap()[0]
}

/// The paths that were traced anew in the last frame, beside probes.
fn chosen(gpu: &Gpu, offline: &Offline<'_>) -> Vec<u32> {
    let list = offline.renderer.photon_groups().unwrap().chosen();
    let words: Vec<u32> = read_buffer_blocking(&gpu.device, &gpu.queue, list.buffer()).unwrap();
    words[4..4 + words[3] as usize].to_vec()
}

/// Bits of what became of each hop; of one that there was not, only that.
fn bits(photons: &[Photon]) -> Vec<[u32; 12]> {
    let record = |p: &Photon| match p.state & 3 {
        0 => [0; 12],
        _ => bytemuck::cast(*p),
    };
    photons.iter().map(record).collect()
}

#[test]
fn while_nothing_changes_probes_alone_are_traced_and_no_bit_changes() {
    let Some(gpu) = gpu() else { return };
    for tracer in ["bvh", "hybrid"] {
        let settings = settings(&[("tracer.kind", tracer)]);
        let mut offline = offline(&gpu, &rooms(0.0), &settings);
        assert_eq!(counts(&gpu, &offline), [0; 4]);
        let (first, picture) = (read_photons(&gpu, &offline), offline.read().unwrap());
        for _ in 0..12 {
            offline.render_frame(None).unwrap();
            let groups = offline.renderer.photon_groups().unwrap().count();
            assert_eq!(counts(&gpu, &offline), [groups, 0, 0, 0]);
        }
        assert!(bits(&read_photons(&gpu, &offline)) == bits(&first), "{tracer}");
        assert_eq!(offline.read().unwrap(), picture);
    }
    // They are those that are traced as a whole.
    let all = offline(&gpu, &rooms(0.0), &settings(&[("selective", "off")]));
    let some = offline(&gpu, &rooms(0.0), &settings(&[]));
    assert!(bits(&read_photons(&gpu, &all)) == bits(&read_photons(&gpu, &some)));
    assert_no_errors(&gpu);
}

#[test]
fn behind_a_closed_door_nothing_is_traced_anew_and_through_an_open_one_it_is() {
    let Some(gpu) = gpu() else { return };
    // All that is found at once.
    let settings = settings(&[("selective.budget", "12000")]);
    for time in [0.0, 1.0] {
        let mut scene = rooms(time);
        let mut offline = offline(&gpu, &scene, &settings);
        let before = read_photons(&gpu, &offline);
        let half = before.len() as u32 / 3 / 2;
        move_block(&mut scene, "near block", block_at(-0.5, -1.5, 0.5));
        offline.set_scene(scene.clone()).unwrap();
        let groups = offline.renderer.photon_groups().unwrap().largest();
        let mut numbers = [0; 2];
        for _ in 0..groups {
            offline.render_frame(None).unwrap();
            for path in chosen(&gpu, &offline) {
                numbers[usize::from(path >= half)] += 1;
            }
        }
        println!(
            "door {time}: {} paths of the near bulb, {} of the far one",
            numbers[0], numbers[1]
        );
        assert!(numbers[0] > 500);
        assert_eq!(numbers[1] > 0, time == 1.0);
        // All is as if it had been traced as a whole, sooner or later.
        let whole = self::offline(&gpu, &scene, &settings);
        assert!(bits(&read_photons(&gpu, &offline)) == bits(&read_photons(&gpu, &whole)));
    }
    assert_no_errors(&gpu);
}

#[test]
fn a_small_change_is_found_after_as_many_frames_as_a_group_has_photons() {
    let Some(gpu) = gpu() else { return };
    let settings = settings(&[("selective.budget", "12000")]);
    let mut last = 0;
    for size in [0.5, 0.15, 0.05] {
        let mut scene = rooms(0.0);
        move_block(&mut scene, "near block", block_at(0.2, -1.2, size));
        let mut offline = offline(&gpu, &scene, &settings);
        let groups = offline.renderer.photon_groups().unwrap();
        let (largest, count) = (groups.largest(), groups.count() as usize);
        move_block(&mut scene, "near block", block_at(0.9, -2.8, size));
        let whole = bits(&read_photons(&gpu, &self::offline(&gpu, &scene, &settings)));
        let before = bits(&read_photons(&gpu, &offline));
        let differ = |now: &[[u32; 12]]| now.iter().zip(&whole).filter(|(a, b)| a != b).count();
        let all = differ(&before);
        offline.set_scene(scene).unwrap();
        let mut found = Vec::new();
        for _ in 0..largest {
            offline.render_frame(None).unwrap();
            found.push(differ(&bits(&read_photons(&gpu, &offline))));
        }
        let half = found.iter().position(|&f| f <= all / 2).unwrap() + 1;
        let done = found.iter().position(|&f| f == 0).unwrap() + 1;
        println!(
            "size {size}: {all} photons of {count} groups of {largest}: half after {half} frames, all after {done}"
        );
        assert!(all > 0 && done <= largest as usize);
        // The smaller, the later.
        assert!(half >= last, "{half} after {last}");
        last = half;
    }
    assert_no_errors(&gpu);
}

#[test]
fn photons_of_a_light_that_moves_are_traced_anew_within_the_budget_and_no_others() {
    let Some(gpu) = gpu() else { return };
    let settings = settings(&[("selective.budget", "1500")]);
    let mut scene = rooms(0.0);
    let mut offline = offline(&gpu, &scene, &settings);
    let half = 6000;
    bulb(&mut scene, 0).x += 0.5;
    offline.set_scene(scene.clone()).unwrap();
    let mut numbers = Vec::new();
    for _ in 0..6 {
        offline.render_frame(None).unwrap();
        let paths = chosen(&gpu, &offline);
        assert!(paths.iter().all(|&p| p < half), "of the other light");
        assert!(paths.len() <= 1500);
        numbers.push((paths.len(), counts(&gpu, &offline)[3]));
    }
    println!("traced anew, groups that wait: {numbers:?}");
    assert_eq!(numbers.iter().map(|n| n.0).sum::<usize>(), half as usize);
    assert!(numbers.windows(2).all(|n| n[1].1 <= n[0].1) && numbers[5] == (0, 0));
    let whole = self::offline(&gpu, &scene, &settings);
    assert!(bits(&read_photons(&gpu, &offline)) == bits(&read_photons(&gpu, &whole)));
    assert_no_errors(&gpu);
}

#[test]
fn photons_of_a_light_that_grows_brighter_are_traced_anew_and_no_others() {
    let Some(gpu) = gpu() else { return };
    let settings = settings(&[("selective.budget", "12000")]);
    let mut scene = rooms(0.0);
    let mut offline = offline(&gpu, &scene, &settings);
    let before = read_photons(&gpu, &offline);
    let half = 6000;
    scene.lights[0].intensity *= 1.2;
    offline.set_scene(scene.clone()).unwrap();
    let mut numbers = Vec::new();
    for _ in 0..3 {
        offline.render_frame(None).unwrap();
        let paths = chosen(&gpu, &offline);
        assert!(paths.iter().all(|&p| p < half), "of the other light");
        numbers.push(paths.len());
    }
    println!("traced anew: {numbers:?}");
    assert_eq!(numbers, [half as usize, 0, 0]);
    // As many as before go the same ways, and carry what the lights have.
    for (slot, (was, is)) in before.iter().zip(&read_photons(&gpu, &offline)).enumerate() {
        let (path, mut expected) = (slot as u32 % 12_000, *was);
        if was.state & 3 != 0 && path < half {
            expected.flux = is.flux;
            let ratios = was
                .flux
                .iter()
                .zip(is.flux)
                .filter(|(w, _)| **w > 0.0)
                .map(|(w, i)| i / w);
            assert!(ratios.into_iter().all(|r| (r - 1.2).abs() < 1e-5), "slot {slot}");
        }
        assert!(bits(&[expected]) == bits(&[*is]), "slot {slot}");
    }
    // Much brighter: divided anew, as at the start.
    scene.lights[0].intensity *= 10.0;
    offline.set_scene(scene.clone()).unwrap();
    offline.render_frame(None).unwrap();
    assert_eq!(counts(&gpu, &offline), [0; 4], "all at once");
    let of_near = |photons: &[Photon]| photons[..12_000].iter().filter(|p| p.light() == 0).count();
    let fresh = read_photons(&gpu, &self::offline(&gpu, &scene, &settings));
    let now = read_photons(&gpu, &offline);
    assert!(of_near(&now) > 9000 && of_near(&now) == of_near(&fresh));
    assert_no_errors(&gpu);
}

#[test]
fn a_small_budget_takes_what_has_changed_most_first_and_all_in_the_end() {
    let Some(gpu) = gpu() else { return };
    // Less than a group.
    let settings = settings(&[("selective.budget", "1"), ("selective.group", "20"), ("photons", "600")]);
    let mut scene = rooms(0.0);
    let mut offline = offline(&gpu, &scene, &settings);
    move_block(&mut scene, "near block", block_at(-0.5, -1.5, 0.5));
    offline.set_scene(scene.clone()).unwrap();
    let groups = offline.renderer.photon_groups().unwrap();
    let (largest, count) = (groups.largest(), groups.count());
    for _ in 0..2 * (largest + count) {
        offline.render_frame(None).unwrap();
        assert!(chosen(&gpu, &offline).len() <= largest as usize);
    }
    assert_eq!(counts(&gpu, &offline)[1..], [0, 0, 0]);
    let whole = self::offline(&gpu, &scene, &settings);
    assert!(bits(&read_photons(&gpu, &offline)) == bits(&read_photons(&gpu, &whole)));
    assert_no_errors(&gpu);
}
