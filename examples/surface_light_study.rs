//! How long surface lights take, by their number and form: the table of `docs/surface_lights.md`.
//!
//! ```text
//! cargo run --release --example surface_light_study -- sample:cornell sample:colonnade
//! ```
//!
//! Times are of the shading alone, at every pixel and without shadows, on the wall: medians of rounds in which each form has
//! its turn. Growth is the exponent of time by the number of lights between the two largest numbers, 1 if twice the lights take
//! twice the time.

mod common;

use clap::Parser;
use common::adapter::{Gpu, Wishes};
use common::clock::median;
use common::offline::{self, Component, Offline};
use common::{arguments, named_scene};
use lightfall::frame::{IndirectMethod, PhotonFeeder, Settings};
use lightfall::pass::{
    IndirectShadows, LightForm, SurfaceLightShading, SurfaceLightShadingInputs, SurfaceLightShadingResources,
    SurfaceLightShadingSettings,
};
use lightfall::resource::{Irradiance, Subsampling};
use lightfall::scene::SceneSummary;
use lightfall::{Error, read_buffer_blocking, wgpu};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Sizes of the paper's Tables 2 and 3.
const SIZES: [[u32; 2]; 2] = [[800, 600], [1280, 1024]];

const FORMS: [(&str, LightForm); 3] = [
    ("loop", LightForm::Loop),
    ("drawn", LightForm::Drawn),
    ("tiles", LightForm::Tiles),
];

/// Prints a table about surface lights.
#[derive(Parser)]
struct Arguments {
    /// .glb or .gltf files, or sample:NAME
    #[arg(required = true)]
    scenes: Vec<String>,
    /// Places for lights
    #[arg(long, value_delimiter = ',', default_values_t = [10, 50, 100, 200, 1000])]
    places: Vec<u32>,
    /// What the paper's sizes are divided by, along each axis
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=64))]
    divide: u32,
    /// Light that may be lost by leaving out lights that give little
    #[arg(long, default_value_t = 0.01)]
    threshold: f32,
    /// Rounds of times
    #[arg(long, default_value_t = 5)]
    rounds: usize,
    /// Part of the adapter's name or backend
    #[arg(long)]
    adapter: Option<String>,
}

fn main() {
    let arguments: Arguments = arguments::parse("surface_light_study");
    if let Err(message) = run(&arguments) {
        eprintln!("surface_light_study: {message}");
        std::process::exit(2);
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let wishes = Wishes {
        large_buffers: true,
        ..Wishes::default()
    };
    let gpu = Gpu::open(arguments.adapter.as_deref(), wishes)?;
    println!("{}\n", gpu.describe());
    let columns: Vec<_> = arguments.places.iter().map(|p| format!("{p} places")).collect();
    println!("| ms | {} | growth |", columns.join(" | "));
    println!("|---|{}---|", "---|".repeat(columns.len()));
    for name in &arguments.scenes {
        for size in SIZES.map(|s| s.map(|length| length / arguments.divide)) {
            // By form, then by number of places.
            let mut times = vec![Vec::new(); FORMS.len()];
            for &places in &arguments.places {
                let all = measure(arguments, &gpu, name, size, places)?;
                times.iter_mut().zip(all).for_each(|(times, ms)| times.push(ms));
            }
            for ((form, _), times) in FORMS.iter().zip(&times) {
                let cells: Vec<_> = times.iter().map(|ms| format!("{ms:.1}")).collect();
                let growth = growth(&arguments.places, times);
                println!(
                    "| {name}, {} × {}, {form} | {} | {growth:.2} |",
                    size[0],
                    size[1],
                    cells.join(" | ")
                );
            }
        }
    }
    for name in &arguments.scenes {
        let (gpu_rate, threads_rate) = impacts_per_second(&gpu, name)?;
        println!("\n{name}: {gpu_rate:.2e} impacts a second by tracers, {threads_rate:.2e} by two threads");
    }
    gpu.check()
}

/// Of a pool that is filled at once by tracers, and of threads of the processor by themselves.
fn impacts_per_second(gpu: &Gpu, name: &str) -> Result<(f64, f64), String> {
    let scene = named_scene::load(name, 0.0)?;
    let mut settings = Settings {
        indirect_method: IndirectMethod::SurfaceLights,
        ..Settings::fast()
    };
    settings.set("tracer.kind", "bvh").map_err(|e| e.to_string())?;
    let time = || -> Result<(f64, f64), Error> {
        let mut offline = Offline::new(gpu, scene.clone(), &settings, 0, [64, 64], Component::Indirect)?;
        // The first makes pipelines.
        offline.render_frame(None)?;
        let frames = settings.surface_lights.pool.div_ceil(settings.surface_lights.stream);
        let start = Instant::now();
        (0..frames).try_for_each(|_| offline.render_frame(None))?;
        let seconds = start.elapsed().as_secs_f64();
        let stored: f64 = match offline.renderer.photon_pool() {
            Some(pool) => {
                let impacts: Vec<[u32; 8]> = read_buffer_blocking(&gpu.device, &gpu.queue, pool.buffer())?;
                impacts.iter().filter(|i| (i[1] | i[2] | i[3]) != 0).count() as f64
            }
            None => 0.0,
        };
        let feeder = PhotonFeeder::new(settings.surface_lights.stream, settings.walked_bounces(), 2);
        if let Some(frame) = offline.renderer.frame() {
            feeder.set_scene(frame, &Arc::new(scene.clone()));
        }
        std::thread::sleep(Duration::from_secs(1));
        Ok((stored / seconds, feeder.impacts_per_second()))
    };
    time().map_err(|e| e.to_string())
}

/// Exponent between the last two.
fn growth(places: &[u32], times: &[f64]) -> f64 {
    let [.., a, b] = times else { return f64::NAN };
    let [.., p, q] = places else { return f64::NAN };
    (b / a).ln() / (f64::from(*q) / f64::from(*p)).ln()
}

/// Milliseconds of each form.
fn measure(arguments: &Arguments, gpu: &Gpu, name: &str, size: [u32; 2], places: u32) -> Result<Vec<f64>, String> {
    let scene = named_scene::load(name, 0.0)?;
    let mut settings = Settings {
        indirect_method: IndirectMethod::SurfaceLights,
        ..Settings::fast()
    };
    settings.surface_lights.places = places;
    settings.surface_lights.shading.shadows = IndirectShadows::Off;
    settings.set("tracer.kind", "bvh").map_err(|e| e.to_string())?;
    let time = || -> Result<Vec<f64>, Error> {
        let area = SceneSummary::of(&scene)?.area;
        let mut offline = Offline::new(gpu, scene, &settings, 0, size, Component::Indirect)?;
        offline.render_frame(None)?;
        shade(arguments, gpu, &offline, area)
    };
    time().map_err(|e| e.to_string())
}

fn shade(arguments: &Arguments, gpu: &Gpu, offline: &Offline<'_>, area: f64) -> Result<Vec<f64>, Error> {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let (Some(lights), Some(frame)) = (offline.renderer.surface_lights(), offline.renderer.frame()) else {
        return Ok(vec![0.0; FORMS.len()]);
    };
    let g_buffer = offline.view.g_buffer();
    let pass = SurfaceLightShading::new(device);
    let mut own = SurfaceLightShadingResources::new(device)?;
    let [wide, narrow] = [wgpu::TextureFormat::Rgba32Float, wgpu::TextureFormat::Rgba16Float]
        .map(|format| Irradiance::new(device, g_buffer.size(), format));
    let (wide, narrow) = (wide?, narrow?);
    let mut times = vec![Vec::new(); FORMS.len()];
    // The first round makes pipelines.
    for round in 0..=arguments.rounds {
        for ((_, form), times) in FORMS.iter().zip(&mut times) {
            let inputs = SurfaceLightShadingInputs {
                queue,
                g_buffer,
                subsampling: Subsampling::Full,
                lights,
                share: 1.0,
                area: frame.area(area),
                radius: frame.radius(),
                irradiance: if *form == LightForm::Drawn { &narrow } else { &wide },
                sample_offset: 0,
                settings: &SurfaceLightShadingSettings {
                    form: *form,
                    threshold: arguments.threshold,
                    ..Default::default()
                },
                timestamps: None,
            };
            let start = Instant::now();
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            pass.record(&mut encoder, &mut own, &inputs)?;
            queue.submit([encoder.finish()]);
            offline::wait(device)?;
            if round > 0 {
                times.push(start.elapsed().as_secs_f64() * 1e3);
            }
        }
    }
    Ok(times.iter().map(|t| median(t)).collect())
}
