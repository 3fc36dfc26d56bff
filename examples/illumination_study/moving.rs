//! How far off methods of indirect light are while things move, and how long a frame takes: what is kept lags behind.
//!
//! Frames follow one another at 30 a second. The truth is path traced at some of them.

use crate::Arguments;
use crate::common::adapter::Gpu;
use crate::common::clock::median;
use crate::common::offline::{self, Component, Offline};
use crate::picture::{SIZE, errors, truth};
use lightfall::frame::Settings;
use lightfall::reference::PathEstimate;
use lightfall::scene::{LightKind, Scene, samples};
use std::time::Instant;

const FRAMES_PER_SECOND: f64 = 30.0;

/// Frames whose picture is looked at.
const LOOKED_AT: [usize; 3] = [20, 30, 40];

const BOUNCES: u32 = 2;

/// How fast the bulb moves, metres a second.
const SPEED: f64 = 1.0;

type Motion = fn(f64) -> Scene;

const MOTIONS: [(&str, Motion); 2] = [
    ("`cornell`, a block slides", samples::cornell),
    ("`pillars`, the bulb moves", with_moving_bulb),
];

/// Name of a way, and settings that make it.
const WAYS: [(&str, &[(&str, &str)]); 8] = [
    ("splatting, 60 000 photons", &[("photons", "60000")]),
    ("splatting, 240 000 photons", &[("photons", "240000")]),
    (
        "200 surface lights, 8 rays",
        &[
            ("indirect.method", "surface-lights"),
            ("surface_lights.places", "200"),
            ("surface_lights.rays", "8"),
        ],
    ),
    (
        "400 surface lights, 32 rays",
        &[
            ("indirect.method", "surface-lights"),
            ("surface_lights.places", "400"),
            ("surface_lights.rays", "32"),
        ],
    ),
    (
        "1000 places of maps, 64 rays, 200 texels a frame",
        &[
            ("indirect.method", "illumination-maps"),
            ("illumination_maps.texels", "1000"),
            ("illumination_maps.rays", "64"),
            ("illumination_maps.a_frame", "200"),
        ],
    ),
    (
        "1000 places of maps, 64 rays, all texels",
        &[
            ("indirect.method", "illumination-maps"),
            ("illumination_maps.texels", "1000"),
            ("illumination_maps.rays", "64"),
            ("illumination_maps.a_frame", "2000"),
        ],
    ),
    (
        "3000 places of maps, 64 rays, 600 texels a frame",
        &[
            ("indirect.method", "illumination-maps"),
            ("illumination_maps.texels", "3000"),
            ("illumination_maps.rays", "64"),
            ("illumination_maps.a_frame", "600"),
        ],
    ),
    (
        "3000 places of maps, 64 rays, all texels",
        &[
            ("indirect.method", "illumination-maps"),
            ("illumination_maps.texels", "3000"),
            ("illumination_maps.rays", "64"),
            ("illumination_maps.a_frame", "6000"),
        ],
    ),
];

fn with_moving_bulb(seconds: f64) -> Scene {
    let mut scene = samples::pillars(0.0);
    if let LightKind::Point { position, .. } = &mut scene.lights[0].kind {
        position.x += SPEED * seconds;
    }
    scene
}

/// Prints the table.
pub(crate) fn table(gpu: &Gpu, arguments: &Arguments) -> Result<(), String> {
    println!("{SIZE} × {SIZE} pixels, {BOUNCES} bounces\n");
    println!("| relMSE, bias, ms a frame | {} |", MOTIONS.map(|m| m.0).join(" | "));
    println!("|---|{}", "---|".repeat(MOTIONS.len()));
    let at = |motion: Motion, frame: usize| motion(frame as f64 / FRAMES_PER_SECOND);
    let all_truths = |(_, motion): &(&str, Motion)| {
        let of_frame = |frame| truth(gpu, &at(*motion, frame), BOUNCES);
        LOOKED_AT.into_iter().map(of_frame).collect::<Result<Vec<_>, _>>()
    };
    let truths = MOTIONS.iter().map(all_truths).collect::<Result<Vec<_>, _>>()?;
    for (way, overrides) in WAYS.iter().filter(|w| w.0.contains(&arguments.ways)) {
        let mut row = format!("| {way} |");
        for ((_, motion), truths) in MOTIONS.iter().zip(&truths) {
            let scene = |frame| at(*motion, frame);
            let [relative, bias, time] = measure(gpu, &scene, truths, overrides)?;
            row += &format!(" {relative:.4}, {:+.1} %, {time:.0} ms |", 100.0 * bias);
        }
        println!("{row}");
    }
    Ok(())
}

/// Error, bias, milliseconds: means over the frames that are looked at, and the median of all times.
fn measure(
    gpu: &Gpu,
    scene: &dyn Fn(usize) -> Scene,
    truths: &[PathEstimate],
    overrides: &[(&str, &str)],
) -> Result<[f64; 3], String> {
    let mut settings = Settings {
        bounces: BOUNCES,
        ..Settings::fast()
    };
    for (key, value) in [
        ("tracer.kind", "bvh"),
        ("emission.first_hits", "traced"),
        ("splatter.subsampling", "1"),
    ]
    .iter()
    .chain(overrides)
    {
        settings.set(key, value).map_err(|e| e.to_string())?;
    }
    let offline = Offline::new(gpu, scene(0), &settings, 0, [SIZE; 2], Component::Indirect);
    let mut offline = offline.map_err(|e| e.to_string())?;
    let (mut times, mut sums) = (Vec::new(), [0.0; 2]);
    for frame in 0..=LOOKED_AT[LOOKED_AT.len() - 1] {
        offline.set_scene(scene(frame)).map_err(|e| e.to_string())?;
        let start = Instant::now();
        offline.render_frame(None).map_err(|e| e.to_string())?;
        offline::wait(&gpu.device).map_err(|e| e.to_string())?;
        times.push(1e3 * start.elapsed().as_secs_f64());
        if let Some(looked_at) = LOOKED_AT.iter().position(|&f| f == frame) {
            let own = offline.read().map_err(|e| e.to_string())?;
            let errors = errors(&own, &truths[looked_at])?;
            for (sum, value) in sums.iter_mut().zip(errors) {
                *sum += value / LOOKED_AT.len() as f64;
            }
        }
    }
    Ok([sums[0], sums[1], median(&times)])
}
