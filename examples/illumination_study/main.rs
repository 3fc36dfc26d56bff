//! What it costs to keep light at texels, and how far off it is: the tables and the plot of `docs/methods.md`.
//!
//! ```text
//! cargo run --release --example illumination_study -- --parts cost --plot docs/illumination_cost.svg
//! cargo run --release --example illumination_study -- --parts gather,triangles,texels,moving
//! ```

#[path = "../common/mod.rs"]
mod common;

mod cost;
mod gather;
mod moving;
mod picture;
mod texels;

use clap::Parser;
use common::adapter::{Gpu, Wishes};
use common::arguments;
use std::path::PathBuf;

/// Prints tables about light that is kept at texels of surfaces.
#[derive(Parser)]
struct Arguments {
    /// Which tables
    #[arg(long, value_delimiter = ',', default_values = ["cost", "gather", "triangles", "texels", "moving"])]
    parts: Vec<String>,
    /// Width and height in pixels
    #[arg(long, default_value_t = 128)]
    size: u32,
    /// Frames of each point of `cost`
    #[arg(long, default_value_t = 12)]
    frames: usize,
    /// Plot of `cost` to write, SVG
    #[arg(long)]
    plot: Option<PathBuf>,
    /// Points of each sample that `gather` looks at
    #[arg(long, default_value_t = 200)]
    points: usize,
    /// Paths that the truth at each of them is the mean of
    #[arg(long, default_value_t = 131_072)]
    paths: u32,
    /// Samples of `gather`
    #[arg(long, value_delimiter = ',', default_values = ["cornell", "pillars", "bumpy-floor"])]
    samples: Vec<String>,
    /// Places of `gather`
    #[arg(long, default_value_t = 8000)]
    places: u32,
    /// Times that light is scattered before it is gathered: the truth of more is noisier
    #[arg(long, default_value_t = 1)]
    bounces: u32,
    /// Ways of `gather`, `triangles` and `moving`: those whose names contain this
    #[arg(long, default_value = "")]
    ways: String,
    /// Photons of `gather`
    #[arg(long, default_value_t = 1_300_000)]
    photons: u32,
    /// Settings of all ways of `gather`, repeatable
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Part of the adapter's name or backend
    #[arg(long)]
    adapter: Option<String>,
}

fn main() {
    let arguments: Arguments = arguments::parse("illumination_study");
    if let Err(message) = run(&arguments) {
        eprintln!("illumination_study: {message}");
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
    for part in &arguments.parts {
        println!("\n## {part}\n");
        match part.as_str() {
            "cost" => cost::table(&gpu, arguments)?,
            "gather" => gather::errors(&gpu, arguments)?,
            "triangles" => gather::times(&gpu, arguments)?,
            "texels" => texels::table(&gpu, arguments)?,
            "moving" => moving::table(&gpu, arguments)?,
            other => return Err(format!("{other} is no part: cost, gather, triangles, texels, moving")),
        }
    }
    gpu.check()
}
