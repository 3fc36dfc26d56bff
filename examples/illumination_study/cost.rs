//! What a frame costs by the share of the scene that changes in it.
//!
//! The sample `pillars` with eight bulbs of the same flux, of which none to all move a little in each frame: that share of the
//! photons then goes other ways. Budgets are high enough that everything is followed at once. Times are of whole frames on the
//! wall, medians of all frames; paths and rays are counted.

use crate::Arguments;
use crate::common::adapter::Gpu;
use crate::common::clock::median;
use crate::common::offline::{self, Component, Offline};
use lightfall::frame::Settings;
use lightfall::glam::DVec3;
use lightfall::scene::{Light, LightKind, Scene, samples};
use lightfall::{Error, read_buffer_blocking};
use plotters::prelude::*;
use std::time::Instant;

const BULBS: usize = 8;

/// How far a bulb moves to and fro, metres.
const STEP: f64 = 0.05;

/// Name of a way, and settings that make it.
const WAYS: [(&str, &[(&str, &str)]); 3] = [
    ("splatting, all photons", &[]),
    ("splatting, selective", &[("selective", "on")]),
    ("illumination maps", &[("indirect.method", "illumination-maps")]),
];

/// Of a frame.
struct Cost {
    milliseconds: f64,
    /// Paths traced.
    paths: f64,
    /// Texels gathered.
    texels: f64,
}

/// Prints the table, and draws it if there is a file to.
pub(crate) fn table(gpu: &Gpu, arguments: &Arguments) -> Result<(), String> {
    println!("{} × {} pixels\n", arguments.size, arguments.size);
    println!("| light that moves | way | paths a frame | texels a frame | ms a frame |");
    println!("|---|---|---|---|---|");
    let mut curves = vec![Vec::new(); WAYS.len()];
    for moving in 0..=BULBS {
        let share = moving as f64 / BULBS as f64;
        for ((name, overrides), curve) in WAYS.iter().zip(&mut curves) {
            let cost = measure(arguments, gpu, moving, overrides).map_err(|e| e.to_string())?;
            println!(
                "| {:.1} % | {name} | {:.0} | {:.0} | {:.0} |",
                100.0 * share,
                cost.paths,
                cost.texels,
                cost.milliseconds
            );
            curve.push((100.0 * share, cost.milliseconds));
        }
    }
    match &arguments.plot {
        Some(path) => plot(path, &curves).map_err(|e| format!("{}: {e}", path.display())),
        None => Ok(()),
    }
}

/// The hall with so many bulbs, of which the first few stand to one side or the other.
fn hall(moving: usize, frame: usize) -> Scene {
    let mut scene = samples::pillars(0.0);
    let bulb = scene.lights[0].clone();
    scene.lights = (0..BULBS)
        .map(|i| {
            let along = -5.0 + 8.0 * i as f64 / (BULBS - 1) as f64;
            let aside = if i < moving && frame % 2 == 1 { STEP } else { 0.0 };
            let place = DVec3::new(along + aside, 3.2, 0.2);
            Light {
                kind: LightKind::Point {
                    position: place,
                    radius: 0.0,
                },
                intensity: bulb.intensity / BULBS as f32,
                ..bulb.clone()
            }
        })
        .collect();
    scene
}

fn measure(arguments: &Arguments, gpu: &Gpu, moving: usize, overrides: &[(&str, &str)]) -> Result<Cost, Error> {
    let mut settings = Settings::fast();
    for (name, value) in [
        ("tracer.kind", "bvh"),
        ("photons", "60000"),
        ("selective.budget", "60000"),
        ("illumination_maps.texels", "500"),
        ("illumination_maps.a_frame", "1000"),
        ("illumination_maps.rays", "64"),
    ]
    .iter()
    .chain(overrides)
    {
        settings.set(name, value)?;
    }
    let mut offline = Offline::new(gpu, hall(moving, 0), &settings, 0, [arguments.size; 2], Component::All)?;
    // Pipelines are made, and all is gathered.
    for frame in 1..3 {
        offline.set_scene(hall(moving, frame))?;
        offline.render_frame(None)?;
    }
    offline::wait(&gpu.device)?;
    let (mut times, mut paths, mut texels) = (Vec::new(), 0.0, 0.0);
    for frame in 1..=arguments.frames {
        offline.set_scene(hall(moving, frame))?;
        let start = Instant::now();
        offline.render_frame(None)?;
        offline::wait(&gpu.device)?;
        times.push(1e3 * start.elapsed().as_secs_f64());
        let read = |buffer| read_buffer_blocking::<u32>(&gpu.device, &gpu.queue, buffer);
        paths += match offline.renderer.photon_groups() {
            None => f64::from(settings.photons),
            Some(groups) => {
                let counts = read(groups.counts())?;
                f64::from(counts[0] + counts[2])
            }
        };
        if let Some(map) = offline.renderer.illumination_map() {
            texels += f64::from(read(map.counts())?[0]);
        }
    }
    let frames = arguments.frames.max(1) as f64;
    Ok(Cost {
        milliseconds: median(&times),
        paths: paths / frames,
        texels: texels / frames,
    })
}

type Points = Vec<(f64, f64)>;

fn plot(path: &std::path::Path, curves: &[Points]) -> Result<(), Box<dyn std::error::Error>> {
    let most = curves.iter().flatten().map(|p| p.1).fold(0.0, f64::max);
    let area = SVGBackend::new(path, (720, 440)).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(56)
        .caption("Cost of a frame by how much of the light moves", ("sans-serif", 18))
        .build_cartesian_2d(0.0..100.0, 0.0..1.1 * most)?;
    chart
        .configure_mesh()
        .x_desc("photons whose way changes in the frame, %")
        .y_desc("ms a frame")
        .draw()?;
    let colors = [RED, BLUE, GREEN];
    for (((name, _), points), color) in WAYS.iter().zip(curves).zip(colors) {
        chart
            .draw_series(LineSeries::new(points.iter().copied(), color.stroke_width(2)).point_size(3))?
            .label(*name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], color.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK)
        .draw()?;
    area.present()?;
    Ok(())
}
