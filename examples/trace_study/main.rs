//! How well rays are traced through environment maps: what they hit against what triangles say, by method, number and size
//! of maps; where the maps stand; how much light is lost or misplaced; how evenly the work is spread; and what it costs.
//!
//! ```text
//! cargo run --release --example trace_study -- sample:cornell sample:living-room sample:colonnade
//! ```
//!
//! Rays are those of diffuse light: they leave, cosine-distributed, from where photons arrive that have bounced once to
//! three times. A ray is
//!
//! - correct, if its hit lies within 1 % of the scene's diagonal of the true one and the normal within 10°;
//! - false, if it hits something else (in brackets: at the right place, with another normal);
//! - lost, if it meets something and no hit is found;
//! - a ghost, if it meets nothing and hits something (share of the rays that meet nothing).
//!
//! "Again" are the rays, of all, that a hybrid traces against triangles because they are lost or tentative; the arrow leads
//! to the share of all rays that are right then. Errors are those of the distance of correct hits, as a share of the
//! diagonal. Maps stand where the selector puts them, by photons traced against triangles, so that all methods see the same
//! maps and no method chooses its own. All of it comes from one run on one adapter.

#[path = "../common/mod.rs"]
mod common;

mod bench;
mod divergence;
mod energy;
mod judge;
mod selection;

use bench::{Bench, Maps};
use clap::Parser;
use common::adapter::{Gpu, Wishes};
use common::{arguments, named_scene};
use judge::{Verdict, judge, percentile};
use lightfall::Error;
use lightfall::glam::Vec3;
use lightfall::pass::{CoverageMeasure, ImageSpaceTracer, ImageSpaceTracerSettings, TraceMethod};
use lightfall::resource::{SurfaceHit, SurfaceRay};
use selection::Selector;

/// Prints how well rays are traced through environment maps.
#[derive(Parser)]
struct Arguments {
    /// .glb or .gltf files, or sample:NAME
    #[arg(required = true)]
    scenes: Vec<String>,
    /// Which tables to print
    #[arg(long, value_delimiter = ',', default_values = ["methods", "selection", "energy", "divergence", "times"])]
    parts: Vec<String>,
    /// How many rays
    #[arg(long, default_value_t = 50_000, value_parser = clap::value_parser!(u32).range(100..=1_000_000))]
    rays: u32,
    /// How many maps
    #[arg(long, value_delimiter = ',', default_values_t = [4, 8, 12], value_parser = clap::value_parser!(u32).range(1..=31))]
    maps: Vec<u32>,
    /// Texels along a face
    #[arg(long, value_delimiter = ',', default_values_t = [128, 256, 512], value_parser = clap::value_parser!(u32).range(4..=2048))]
    sizes: Vec<u32>,
    /// Candidates that the places of maps are chosen from
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=512))]
    candidates: u32,
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
    let wishes = Wishes {
        large_buffers: true,
        ..Wishes::default()
    };
    let gpu = Gpu::open(arguments.adapter.as_deref(), wishes)?;
    println!("{}", gpu.describe());
    for name in &arguments.scenes {
        let mut bench = Bench::new(&gpu, named_scene::load(name, 0.0)?).map_err(|e| e.to_string())?;
        study(&mut bench, name, arguments).map_err(|e| e.to_string())?;
    }
    gpu.check()
}

fn study(bench: &mut Bench<'_>, name: &str, arguments: &Arguments) -> Result<(), Error> {
    let rays = bench.rays(arguments.rays as usize)?;
    let truths = bench.truths(&rays)?;
    println!(
        "\n## {name}\n\n{} rays, {} candidates.",
        rays.len(),
        arguments.candidates
    );
    let mut selector = Selector::new(bench, arguments.candidates)?;
    for part in &arguments.parts {
        match part.as_str() {
            "methods" => methods(bench, &mut selector, (&rays, &truths), arguments)?,
            "selection" => {
                let end = |(ray, truth): (&SurfaceRay, &Option<judge::Truth>)| {
                    let truth = truth.as_ref()?;
                    let position = Vec3::from(ray.position) + truth.distance * Vec3::from(ray.direction);
                    Some((position, truth.normal))
                };
                let ends: Vec<_> = rays.iter().zip(&truths).filter_map(end).collect();
                selection::table(bench, &mut selector, &ends)?;
            }
            "energy" => energy::table(bench, &mut selector)?,
            "divergence" => divergence::table(bench, &mut selector, (&rays, &truths))?,
            "times" => selection::times(bench, &mut selector, &rays)?,
            _ => {
                return Err(Error::UnknownSetting {
                    key: part.clone(),
                    known: "methods, selection, energy, divergence, times".into(),
                });
            }
        }
    }
    Ok(())
}

/// Every method with every number and size of maps.
fn methods(
    bench: &mut Bench<'_>,
    selector: &mut Selector,
    (rays, truths): (&[SurfaceRay], &[Option<judge::Truth>]),
    arguments: &Arguments,
) -> Result<(), Error> {
    println!(
        "\n| method | maps | size | correct | false (normal) | lost | ghost | again → hybrid | error, 50, 95 % | fetches: \
         mean, 50, 95, 99 % | µs a ray |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    let mut tracers = Vec::new();
    for method in TraceMethod::ALL {
        let usual = ImageSpaceTracerSettings::default();
        let mut add = |name: String, settings| {
            tracers.push((name, ImageSpaceTracer::new(&bench.gpu.device, method), settings));
        };
        match method {
            TraceMethod::Paper => {
                for iterations in [3, 5, 8] {
                    add(
                        format!("Paper, {iterations} iterations"),
                        ImageSpaceTracerSettings { iterations, ..usual },
                    );
                }
            }
            _ => add(format!("{method:?}"), usual),
        }
        if method == TraceMethod::VerifiedWalk {
            let doubting = ImageSpaceTracerSettings {
                doubts_normals: true,
                ..usual
            };
            add("VerifiedWalk, doubts normals".into(), doubting);
        }
    }
    for &count in &arguments.maps {
        let centers = selector.select(bench, count, CoverageMeasure::Photons)?.centers;
        for &size in &arguments.sizes {
            let maps = bench.capture(&centers, size)?;
            for (name, tracer, settings) in &tracers {
                let (hits, ms) = bench.trace(tracer, settings, &maps, rays)?;
                let verdict = judge(truths, &hits, bench.diagonal);
                println!(
                    "| {name} | {count} | {size} | {} | {} | {:.2} |",
                    shares(&verdict),
                    fetches(&hits),
                    ms * 1e3 / rays.len() as f64
                );
            }
        }
    }
    Ok(())
}

/// Correct to errors, as cells of a row.
fn shares(verdict: &Verdict) -> String {
    let v = verdict;
    let p = |share: f64| format!("{:.2}", 100.0 * share);
    let small = |share: f64| format!("{:.3}", 100.0 * share);
    format!(
        "{} | {} ({}) | {} | {} | {} → {} | {}, {}",
        p(v.correct),
        p(v.wrong),
        p(v.wrong_normal),
        p(v.lost),
        p(v.ghost),
        p(v.again),
        p(v.hybrid),
        small(v.error[0]),
        small(v.error[1])
    )
}

fn fetches(hits: &[SurfaceHit]) -> String {
    let mut all: Vec<f64> = hits.iter().map(|h| f64::from(h.fetches)).collect();
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    let [median, high, highest] = [0.5, 0.95, 0.99].map(|part| percentile(&mut all, part));
    format!("{mean:.0}, {median}, {high}, {highest}")
}

/// What the tables that compare something else than maps take: eight maps of 256² texels.
fn usual_maps(bench: &mut Bench<'_>, selector: &mut Selector) -> Result<Maps, Error> {
    let centers = selector.select(bench, 8, CoverageMeasure::Photons)?.centers;
    bench.capture(&centers, 256)
}
