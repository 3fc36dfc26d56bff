//! Rows of the papers' tables that a scene here stands in for: the same photons, bounces and sizes, what the paper's took and
//! what ours take.
//!
//! ```text
//! cargo run --release --example papers
//! cargo run --release --example papers -- --scenes FOLDER --tables yao2010 --scale 0.5
//! ```
//!
//! Times are medians of whole frames in which everything may have moved, of GPU timestamps where the adapter is a GPU, else on
//! the wall. Adapters differ: what compares is time over that of a table's first row. Errors are those of indirect light, of
//! means over squares of which `--means` lie along a picture's height, against paths traced with as many bounces, where all
//! surfaces are diffuse; so few paths do not find caustics. What the truth's own noise hides is not shown.

#[path = "../common/mod.rs"]
mod common;

mod measure;
mod tables;

use clap::Parser;
use common::adapter::{Gpu, Wishes};
use common::{arguments, progress};
use measure::{Measured, Truths};
use std::path::PathBuf;
use tables::{Row, Table};

/// Measures rows of the papers' tables.
#[derive(Parser)]
struct Arguments {
    /// Folder with NAME.glb of scenes that are no samples; rows without get their second best, or are left out
    #[arg(long)]
    scenes: Option<PathBuf>,
    /// Which tables
    #[arg(long, value_delimiter = ',', default_values = tables::NAMES)]
    tables: Vec<String>,
    /// Width and height over the paper's
    #[arg(long, default_value_t = 1.0)]
    scale: f64,
    /// Squares along a picture's height that errors are of the means of
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..=1024))]
    means: u32,
    /// Paths of each of these means; 0: no errors
    #[arg(long, default_value_t = 1024)]
    samples: u32,
    /// Preset that rows are made from
    #[arg(long, default_value = "fast")]
    preset: String,
    /// Part of the adapter's name or backend
    #[arg(long)]
    adapter: Option<String>,
}

fn main() {
    let arguments: Arguments = arguments::parse("papers");
    if let Err(message) = run(&arguments) {
        eprintln!("papers: {message}");
        std::process::exit(2);
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    if !(arguments.scale > 0.0 && arguments.scale <= 4.0) {
        return Err(format!("--scale {}: expected above 0, at most 4", arguments.scale));
    }
    let chosen = arguments.tables.iter().map(|name| tables::by_name(name));
    let chosen = chosen.collect::<Result<Vec<_>, _>>()?;
    let wishes = Wishes {
        timestamps: true,
        large_buffers: true,
        ..Wishes::default()
    };
    let gpu = Gpu::open(arguments.adapter.as_deref(), wishes)?;
    println!("{}, preset {}", gpu.describe(), arguments.preset);
    let bar = progress::bar(chosen.iter().map(|table| table.rows.len() as u64).sum());
    let mut truths = Truths::default();
    for table in &chosen {
        print_head(table);
        let mut first = None;
        for row in &table.rows {
            bar.inc(1);
            let line = match measure::measure(&gpu, arguments, row, &mut truths)? {
                Ok(measured) => {
                    let [of_paper, own] = *first.get_or_insert([row.paper_ms, measured.ms]);
                    line(row, &measured, [row.paper_ms / of_paper, measured.ms / own])
                }
                Err(reason) => format!(
                    "| {} | {} | not measured: {reason} | | | | | | |",
                    row.name, row.triangles
                ),
            };
            bar.suspend(|| println!("{line}"));
        }
        println!("\n{}", table.left_out);
    }
    bar.finish_and_clear();
    gpu.check()
}

fn print_head(table: &Table) {
    println!("\n## {}\n\nThe paper's times: {}.\n", table.title, table.hardware);
    println!(
        "| row | triangles | here: scene, triangles | what is set | pixels | paper, ms (× first) | here, ms (× first) | relMSE, without its worst hundredth | energy bias |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
}

fn line(row: &Row, measured: &Measured, [paper, own]: [f64; 2]) -> String {
    let set: Vec<_> = row.set.iter().map(|(key, value)| format!("{key} {value}")).collect();
    let [width, height] = measured.size;
    let (error, bias) = match &measured.error {
        Some(error) if error.is_seen() => (
            format!("{:.4}, {:.4}", error.relmse, error.trimmed),
            format!("{:+.1} %", 100.0 * error.bias),
        ),
        Some(error) => (format!("below the truth's noise, {:.4}", error.noise), String::new()),
        None => Default::default(),
    };
    format!(
        "| {} | {} | {}, {} | {} | {width} × {height} | {:.1} ({paper:.2}) | {:.0} ({own:.2}) | {error} | {bias} |",
        row.name,
        row.triangles,
        measured.scene,
        measured.triangles,
        set.join(", "),
        row.paper_ms,
        measured.ms,
    )
}
