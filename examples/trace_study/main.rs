//! How well rays are traced through environment maps.
//!
//! ```text
//! cargo run --release --example trace_study -- sample:cornell sample:living-room sample:colonnade
//! ```

#[path = "../common/mod.rs"]
mod common;

mod bench;
mod judge;

use bench::{Bench, Maps};
use clap::Parser;
use common::adapter::{Gpu, Wishes};
use common::{arguments, named_scene};
use judge::{judge, percentile};
use lightfall::frame::Settings;
use lightfall::glam::Vec3;
use lightfall::pass::{
    EnvMapSelector, EnvMapSelectorResources, EnvMapSelectorSettings, ImageSpaceTracer, ImageSpaceTracerSettings,
    SelectBlockingInputs, TraceMethod,
};
use lightfall::resource::SurfaceHit;

/// Prints how well rays are traced through environment maps.
#[derive(Parser)]
struct Arguments {
    /// .glb or .gltf files, or sample:NAME
    #[arg(required = true)]
    scenes: Vec<String>,
    /// How many rays
    #[arg(long, default_value_t = 100_000)]
    rays: usize,
    /// How many maps
    #[arg(long, value_delimiter = ',', default_values_t = [4, 8, 12])]
    maps: Vec<u32>,
    /// Texels along a face
    #[arg(long, value_delimiter = ',', default_values_t = [128, 256, 512])]
    sizes: Vec<u32>,
    /// Candidates that the places of maps are chosen from
    #[arg(long, default_value_t = 100)]
    candidates: u32,
    #[arg(long, value_delimiter = ',')]
    methods: Vec<String>,
    #[arg(long, default_value_t = 2)]
    rounds: u32,
    /// Part of the adapter's name or backend
    #[arg(long)]
    adapter: Option<String>,
}

fn main() {
    let arguments: Arguments = arguments::parse("trace_study");
    if let Err(message) = run(&arguments) {
        eprintln!("trace_study: {message}");
        std::process::exit(2);
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let gpu = Gpu::open(arguments.adapter.as_deref(), Wishes::default())?;
    println!("{}", gpu.describe());
    for name in &arguments.scenes {
        let scene = named_scene::load(name, 0.0)?;
        let mut bench = Bench::new(&gpu, scene).map_err(|e| e.to_string())?;
        study(&mut bench, name, arguments).map_err(|e| e.to_string())?;
    }
    gpu.check()
}

fn study(bench: &mut Bench<'_>, name: &str, arguments: &Arguments) -> Result<(), lightfall::Error> {
    let rays = bench.rays(arguments.rays)?;
    let truths = bench.truths(&rays)?;
    println!("\n{name}: {} rays\n", rays.len());
    println!("| method | k | size | correct | false (normal) | lost | ghost | again → hybrid | error 50, 95 % | fetches mean, 50, 95, 99 % | µs a ray |");
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for &k in &arguments.maps {
        let centers = select(bench, arguments.candidates, k, arguments.rounds)?;
        for &size in &arguments.sizes {
            let maps = bench.capture(&centers, size)?;
            for method in TraceMethod::ALL.into_iter().filter(|m| arguments.methods.is_empty() || arguments.methods.contains(&format!("{m:?}"))) {
                let tracer = ImageSpaceTracer::new(&bench.gpu.device, method);
                let (hits, ms) = bench.trace(&tracer, &ImageSpaceTracerSettings::default(), &maps, &rays)?;
                let v = judge(&truths, &hits, bench.diagonal);
                let percent = |x: f64| format!("{:.2}", 100.0 * x);
                println!(
                    "| {method:?} | {k} | {size} | {} | {} ({}) | {} | {} | {} → {} | {}, {} | {} | {:.2} |",
                    percent(v.correct), percent(v.wrong), percent(v.wrong_normal), percent(v.lost), percent(v.ghost),
                    percent(v.again), percent(v.hybrid), percent(v.error[0]), percent(v.error[1]),
                    fetches(&hits), ms * 1e3 / rays.len() as f64,
                );
            }
            let _: &Maps = &maps;
        }
    }
    Ok(())
}

fn fetches(hits: &[SurfaceHit]) -> String {
    let mut all: Vec<f64> = hits.iter().map(|h| f64::from(h.fetches)).collect();
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    let [a, b, c] = [0.5, 0.95, 0.99].map(|part| percentile(&mut all, part));
    format!("{mean:.0}, {a}, {b}, {c}")
}

fn select(bench: &mut Bench<'_>, candidates: u32, k: u32, rounds: u32) -> Result<Vec<Vec3>, lightfall::Error> {
    let Gpu { device, queue, .. } = bench.gpu;
    let selector = EnvMapSelector::new(device);
    let mut resources = EnvMapSelectorResources::new(device, candidates)?;
    let bounds = bench.scene.bounds()?;
    let (min, max) = (bench.frame.point(bounds.min), bench.frame.point(bounds.max));
    resources.set_candidates(queue, &EnvMapSelector::candidates(min, max, candidates))?;
    let settings = EnvMapSelectorSettings { candidates, coverage_target: 1.0, ..Default::default() };
    let mut photons = None;
    let mut centers = Vec::new();
    for round in 0..=rounds {
        let inputs = SelectBlockingInputs { queue, frame: &bench.frame, limit: k, tag: 1 + round, photons: photons.as_ref(), settings: &settings };
        centers = selector.select_blocking(&mut resources, &inputs, &mut bench.geometry)?.centers;
        if round < rounds {
            let renderer_settings = Settings { photons: 100_000, env_map_count: k, ..Settings::balanced() };
            let all = bench.photons(&renderer_settings, &centers)?;
            let p = lightfall::resource::Photons::new(device, 100_000, 3)?;
            queue.write_buffer(p.buffer(), 0, bytemuck::cast_slice(&all));
            photons = Some(p);
        }
    }
    Ok(centers)
}
