//! What accuracy costs: error against time for every knob that trades one for the other, the front of the best, and where
//! presets lie.
//!
//! ```text
//! cargo run --release --example tradeoff -- sample:cornell sample:pillars
//! cargo run --release --example tradeoff -- SCENE.glb --truth SCENE.indirect.exr --base balanced
//! ```
//!
//! A point is one picture of indirect light (direct light where a knob is about shadows, all light where it is about metal,
//! glass or an environment): the settings of `--base`, traced one way, with one knob turned. The truth is path traced once,
//! with as many bounces as the base has, through the middle of each pixel, as passes see it; of pictures that are summed of
//! many frames all over each pixel. Or it comes from a file.
//!
//! Written to the folder `--out`: `tradeoff.csv`, a row for each point as soon as it is measured, which is not measured again
//! on the same adapter unless `--fresh` is given; and of all rows of each scene `NAME.svg`, error over time with the front
//! drawn and presets marked, and in `tradeoff.md` the tables that are printed: presets, the front, what a step of each knob
//! costs and gains, and how near estimates without a truth come. Times are medians of frames, of GPU timestamps where the
//! adapter is a GPU, else on the wall; ratios are of one run where rows are.

#[path = "../common/mod.rs"]
mod common;

mod measure;
mod plot;
mod rows;
mod sweep;
mod tables;

use clap::Parser;
use common::adapter::{Gpu, Wishes};
use common::{arguments, named_scene, progress};
use indicatif::ProgressStyle;
use lightfall::frame::GiRenderer;
use lightfall::wgpu::Features;
use measure::Subject;
use rows::Rows;
use std::path::PathBuf;

/// Measures error against time, knob by knob.
#[derive(Parser)]
struct Arguments {
    /// .glb or .gltf files, or sample:NAME
    #[arg(required = true)]
    scenes: Vec<String>,
    /// Reference of indirect light, NAME.indirect.exr, with which a single scene is compared
    #[arg(long)]
    truth: Option<PathBuf>,
    /// Width and height in pixels; a reference's are a multiple
    #[arg(long, default_value_t = 96, value_parser = clap::value_parser!(u32).range(8..=2048))]
    size: u32,
    /// Paths of each pixel that a truth of our own is the mean of
    #[arg(long, default_value_t = 2048)]
    samples: u32,
    /// Preset whose knobs are turned
    #[arg(long, default_value = "fast")]
    base: String,
    /// Tracers of the base
    #[arg(long, value_delimiter = ',', default_values = ["image-space", "hybrid", "bvh"])]
    tracers: Vec<String>,
    /// Presets to measure
    #[arg(long, value_delimiter = ',', default_values = sweep::PRESETS)]
    presets: Vec<String>,
    /// Only these knobs, or `preset`
    #[arg(long, value_delimiter = ',')]
    knobs: Vec<String>,
    /// Frames that are timed
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    rounds: u32,
    /// Folder to write to
    #[arg(long, default_value = "target/tradeoff")]
    out: PathBuf,
    /// Measure points again that are already there
    #[arg(long)]
    fresh: bool,
    /// Part of the adapter's name or backend
    #[arg(long)]
    adapter: Option<String>,
}

fn main() {
    let arguments: Arguments = arguments::parse("tradeoff");
    if let Err(message) = run(&arguments) {
        eprintln!("tradeoff: {message}");
        std::process::exit(2);
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    if arguments.truth.is_some() && arguments.scenes.len() > 1 {
        return Err("--truth: expected a single scene".into());
    }
    let points = sweep::points(arguments)?;
    if points.is_empty() {
        return Err("--tracers: none of the knobs has an effect on these".into());
    }
    let wishes = Wishes {
        timestamps: true,
        large_buffers: true,
        features: points
            .iter()
            .map(|p| GiRenderer::required_features(&p.settings))
            .fold(Features::empty(), |all, own| all | own),
    };
    let gpu = Gpu::open(arguments.adapter.as_deref(), wishes)?;
    let scenes = arguments.scenes.iter().map(|name| named_scene::load(name, 0.0));
    let scenes = scenes.collect::<Result<Vec<_>, _>>()?;
    std::fs::create_dir_all(&arguments.out).map_err(|e| format!("{}: {e}", arguments.out.display()))?;
    let mut rows = Rows::open(&arguments.out.join("tradeoff.csv"))?;
    let bar = progress::bar((scenes.len() * points.len()) as u64);
    bar.set_style(ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}").map_err(|e| e.to_string())?);
    let mut text = format!("{}, {} × {} pixels\n", gpu.describe(), arguments.size, arguments.size);
    for (name, scene) in arguments.scenes.iter().zip(scenes) {
        let name = &stem(name);
        let mut subject = Subject::new(&gpu, arguments, name, scene);
        for point in &points {
            bar.inc(1);
            if !subject.concerns(point) {
                continue;
            }
            bar.set_message(format!("{name} {}", point.name()));
            if arguments.fresh || !rows.has(&subject.unmeasured(point)) {
                rows.add(subject.measure(point)?)?;
            }
        }
        let own = rows.of_scene(&subject.unmeasured(&points[0]));
        plot::draw(&arguments.out.join(format!("{name}.svg")), name, &own)?;
        text += &tables::of_scene(name, &own);
    }
    bar.finish_and_clear();
    print!("{text}");
    let path = arguments.out.join("tradeoff.md");
    std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))?;
    gpu.check()
}

/// A scene's name without its folder.
fn stem(name: &str) -> String {
    let name = name.trim_start_matches("sample:");
    let stem = std::path::Path::new(name).file_stem();
    stem.map_or_else(|| name.to_owned(), |stem| stem.to_string_lossy().into_owned())
}
