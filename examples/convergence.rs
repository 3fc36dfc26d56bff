//! How the path tracer's error falls with its samples, against reference images by another renderer.
//!
//! ```text
//! cargo run --release --example convergence -- scenes truth cornell_point.indirect sponza_dabrovic.indirect --frames 256
//! ```
//!
//! For each image `truth/SCENE.COMPONENT.exr` it renders `scenes/SCENE.glb` and prints, at every power of two of samples:
//! relMSE (the reference's own variance taken out), the noise that the path tracer expects of itself, what is left of the
//! one without the other, and the energy bias with its standard error. The last line of each image is the slope of
//! log(relMSE) over log(samples): −1 for an unbiased renderer with independent samples.

mod common;

use clap::Parser;
use common::adapter::{Gpu, Wishes};
use common::reference::{Reference, own_noise};
use common::{arguments, gltf_scene, progress, truth_file};
use lightfall::reference::metrics::{self, Image, Truth};
use lightfall::reference::{PathComponent, PathEstimate, PathTracerSettings};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Prints how the path tracer converges.
#[derive(Parser)]
struct Arguments {
    /// Folder of .glb files
    scenes: PathBuf,
    /// Folder of .exr files
    truth: PathBuf,
    /// SCENE.COMPONENT, with a component of all, direct, indirect, caustic or specular
    #[arg(required = true)]
    images: Vec<String>,
    /// Samples a pixel at the end
    #[arg(long, default_value_t = 256)]
    frames: u32,
    /// Samples from which on rows are printed and the slope is taken
    #[arg(long, default_value_t = 16)]
    from: u32,
    /// Surfaces that light scatters at before the one the eye sees
    #[arg(long, default_value_t = 3)]
    bounces: u32,
    /// Part of the adapter's name or backend
    #[arg(long)]
    adapter: Option<String>,
}

fn main() {
    let arguments: Arguments = arguments::parse("convergence");
    if let Err(message) = run(&arguments) {
        eprintln!("convergence: {message}");
        std::process::exit(2);
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    if arguments.from == 0 || arguments.from > arguments.frames {
        return Err("--from: expected 1 to --frames".into());
    }
    let wishes = Wishes {
        large_buffers: true,
        ..Default::default()
    };
    let gpu = Gpu::open(arguments.adapter.as_deref(), wishes)?;
    println!("| image | samples | relMSE | own noise | left | energy bias | seconds |");
    println!("|---|---|---|---|---|---|---|");
    let bar = progress::bar(arguments.images.len() as u64 * u64::from(arguments.frames));
    for name in &arguments.images {
        converge(&gpu, arguments, name, &bar)?;
    }
    bar.finish_and_clear();
    Ok(())
}

fn converge(gpu: &Gpu, arguments: &Arguments, name: &str, bar: &indicatif::ProgressBar) -> Result<(), String> {
    let (scene, component) = name
        .rsplit_once('.')
        .ok_or_else(|| format!("{name:?}: expected SCENE.COMPONENT"))?;
    let settings = PathTracerSettings {
        component: component_called(component)?,
        bounces: arguments.bounces,
        ..Default::default()
    };
    let truth = truth_file::read_truth(&arguments.truth.join(format!("{name}.exr")))?;
    let scene = gltf_scene::load(Path::new(&arguments.scenes.join(format!("{scene}.glb"))), 0.0)?;
    let size = [truth.image.width, truth.image.height];
    let mut reference = Reference::new(gpu, scene, &settings, 0, size).map_err(|e| e.to_string())?;
    let mut points = Vec::new();
    let start = Instant::now();
    for sample in 1..=arguments.frames {
        reference.render_sample(None).map_err(|e| e.to_string())?;
        bar.inc(1);
        let is_row = sample == arguments.frames || (sample >= arguments.from && sample.is_power_of_two());
        if is_row {
            let seconds = start.elapsed().as_secs_f64();
            let estimate = reference.read().map_err(|e| e.to_string())?;
            let relmse = row(name, sample, &estimate, (&truth, seconds))?;
            points.push((f64::from(sample).ln(), relmse.ln()));
        }
    }
    gpu.check()?;
    println!("| {name} | slope | {:.3} | | | | |", slope(&points));
    Ok(())
}

fn component_called(name: &str) -> Result<PathComponent, String> {
    Ok(match name {
        "all" => PathComponent::All,
        "direct" => PathComponent::Direct,
        "indirect" => PathComponent::Indirect,
        "caustic" => PathComponent::Caustic,
        "specular" => PathComponent::Specular,
        _ => return Err(format!("{name:?}: expected all, direct, indirect, caustic or specular")),
    })
}

/// Prints a row and returns its relMSE.
fn row(name: &str, samples: u32, estimate: &PathEstimate, (truth, seconds): (&Truth, f64)) -> Result<f64, String> {
    let image = Image {
        width: truth.image.width,
        height: truth.image.height,
        rgb: estimate.mean.clone(),
    };
    let comparison = metrics::compare(&image, truth).map_err(|e| e.to_string())?;
    if !comparison.finite {
        return Err(format!("{name}: the image is not finite"));
    }
    let noise = own_noise(estimate, truth);
    println!(
        "| {name} | {samples} | {:.3e} | {:.3e} | {:+.1e} | {:+.3} ± {:.3} % | {seconds:.1} |",
        comparison.relmse,
        noise.relative_variance,
        comparison.relmse - noise.relative_variance,
        100.0 * comparison.bias,
        100.0 * noise.of_mean,
    );
    Ok(comparison.relmse)
}

/// Least squares through (x, y).
fn slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let covariance: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    covariance / points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}
