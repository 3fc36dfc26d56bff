//! Many frames of a scene in which light, object and camera move: as bright as ever, with no more of anything than at first.

use crate::common::{Component, assert_no_errors};
use crate::studio::{SIZE, by_name, mean, studio};
use lightfall::creation_count;
use lightfall::glam::{DAffine3, DVec3};
use lightfall::scene::{LightKind, Scene, samples};
use std::f64::consts::TAU;

/// Frames after which everything is where it was.
const PERIOD: u32 = 50;

/// The box in a frame: a block turns, the bulb and the eye go round.
fn moment(frame: u32) -> Scene {
    let phase = TAU * f64::from(frame % PERIOD) / f64::from(PERIOD);
    let around = DVec3::new(phase.cos(), 0.0, phase.sin());
    let mut scene = samples::cornell(0.5 + 0.5 * phase.sin());
    scene.lights[0].kind = LightKind::Point {
        position: DVec3::new(2.78, 4.6, 2.795) + around,
        radius: 0.0,
    };
    let eye = &mut scene.cameras[0];
    eye.transform = DAffine3::from_translation(0.3 * around) * eye.transform;
    scene
}

/// Textures, buffers and bind groups made so far.
fn made() -> u64 {
    let count = creation_count();
    count.textures + count.buffers + count.bind_groups
}

/// Memory of the process in MB, where the system tells.
fn resident() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmRSS:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().nth(1)?.parse::<f64>().ok());
    kilobytes.unwrap_or(f64::NAN) / 1024.0
}

fn run(ways: &[&str], frames: u32) {
    let Some(mut studio) = studio() else { return };
    let Some(studio) = studio.as_mut() else { return };
    for way in ways.iter().map(|name| by_name(name)) {
        let mut offline = studio.stage(&way, &[], &moment(0), SIZE, Component::All).unwrap();
        // Once around, after which everything has been made, and what goes by earlier frames has some.
        let (mut first, mut created, mut counts, mut before) = (0.0, 0, String::new(), 0.0);
        let mut drift = 0.0f64;
        for frame in 0..frames {
            offline.set_scene(moment(frame)).unwrap();
            offline.render_frame(None).unwrap();
            if frame % PERIOD != 0 || frame == 0 {
                continue;
            }
            let now = mean(&offline.read().unwrap());
            assert!(now.is_finite());
            if frame == PERIOD {
                first = now;
                counts = format!("{:?}", studio.gpu.device.get_internal_counters().hal);
                (created, before) = (made(), resident());
                continue;
            }
            drift = drift.max((now / first - 1.0).abs());
        }
        let grown = resident() - before;
        let after = format!("{:?}", studio.gpu.device.get_internal_counters().hal);
        println!(
            "| {frames} frames | {} | drift {drift:.1e} | {} resources made, {grown:.1} MB more |",
            way.name,
            made() - created
        );
        assert_eq!(counts, after, "{}", way.name);
        assert!(drift < 0.02, "{}: {drift}", way.name);
        // Numbers of frames and of photons wrap around.
        for last in [u32::MAX / 5_000, u32::MAX] {
            offline.pictures_before = last;
            offline.render_frame(None).unwrap();
            let now = mean(&offline.read().unwrap());
            assert!(
                (now / first - 1.0).abs() < 0.1,
                "{}: {now} instead of {first}",
                way.name
            );
        }
    }
    assert_no_errors(studio.gpu);
}

#[test]
fn hundreds_of_frames_leave_nothing_behind() {
    run(&["triangles", "hybrid", "illumination maps"], 4 * PERIOD + 1);
}

const TEN_THOUSAND: u32 = 200 * PERIOD + 1;

#[test]
#[ignore = "takes ten minutes"]
fn ten_thousand_frames_by_triangles_leave_nothing_behind() {
    run(&["triangles"], TEN_THOUSAND);
}

#[test]
#[ignore = "takes half an hour"]
fn ten_thousand_frames_by_other_ways_leave_nothing_behind() {
    run(&["hybrid", "illumination maps"], TEN_THOUSAND);
}
