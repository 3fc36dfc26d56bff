//! What it saves to model only what a scene requires: the table of `docs/plan.md`.
//!
//! ```text
//! cargo run --release --example plan_study
//! ```
//!
//! Seven scenes, planned by what is in them, and as a host would have to that cannot tell (`SceneSummary::presuming_all`; of the
//! last one, which stands still, every frame as if it moved). Passes are counted, bytes are those of the renderer and of a
//! view; the difference between both pictures is the root of the mean square over the mean.

mod common;

use clap::Parser;
use common::adapter::{Gpu, Wishes};
use common::arguments;
use common::clock::median;
use common::offline::{Component, Offline};
use lightfall::frame::{Plan, Settings};
use lightfall::glam::{DAffine3, DVec3};
use lightfall::scene::{Instance, Projection, Scene, SceneSummary, samples};
use lightfall::{Error, Timestamps};
use std::f64::consts::PI;
use std::time::Instant;

/// Prints what planning saves.
#[derive(Parser)]
struct Arguments {
    /// Width and height in pixels
    #[arg(long, default_value_t = 96, value_parser = clap::value_parser!(u32).range(1..=2048))]
    size: u32,
    /// Frames that times are the median of
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
    /// fast, balanced, accurate; frames are not accumulated
    #[arg(long, default_value = "fast")]
    preset: String,
    /// Print each plan as well
    #[arg(long)]
    plans: bool,
    /// Part of the adapter's name or backend
    #[arg(long)]
    adapter: Option<String>,
}

fn main() {
    let arguments: Arguments = arguments::parse("plan_study");
    if let Err(message) = run(&arguments) {
        eprintln!("plan_study: {message}");
        std::process::exit(2);
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let mut settings = Settings::preset(&arguments.preset)
        .ok_or_else(|| format!("--preset {:?}: expected fast, balanced or accurate", arguments.preset))?;
    settings.frames = 1;
    let wishes = Wishes {
        timestamps: true,
        large_buffers: true,
        ..Wishes::default()
    };
    let gpu = Gpu::open(arguments.adapter.as_deref(), wishes)?;
    println!(
        "{}, preset {}, {} x {} pixels\n",
        gpu.describe(),
        arguments.preset,
        arguments.size,
        arguments.size
    );
    println!(
        "| scene | planned: stages, passes, maps, MiB, ms | presumed: stages, passes, maps, MiB, ms | difference |"
    );
    println!("|---|---|---|---|");
    for (name, scene, stands_still) in scenes() {
        let planned = measure(&gpu, arguments, &settings, &scene, (false, stands_still));
        let presumed = measure(&gpu, arguments, &settings, &scene, (true, false));
        let (planned, presumed) = (
            planned.map_err(|e| e.to_string())?,
            presumed.map_err(|e| e.to_string())?,
        );
        println!(
            "| {name} | {} | {} | {:.1e} |",
            planned.cell(),
            presumed.cell(),
            difference(&planned.picture, &presumed.picture)
        );
    }
    if arguments.plans {
        for (name, scene, _) in scenes() {
            let summary = SceneSummary::of(&scene).map_err(|e| e.to_string())?;
            println!("\n{name}:\n\n{}", Plan::for_scene(&summary, &settings));
        }
    }
    gpu.check()
}

/// Name, scene, and whether the host says that it stands still.
fn scenes() -> Vec<(&'static str, Scene, bool)> {
    let cornell = || samples::cornell(0.0);
    let mut empty = cornell();
    empty.lights.clear();
    let mut box_alone = cornell();
    let is_block = |scene: &Scene, mesh: usize| scene.meshes[mesh].name.contains("block");
    let all = std::mem::take(&mut box_alone.instances);
    box_alone.instances = all.into_iter().filter(|i| !is_block(&box_alone, i.mesh)).collect();
    // A front wall, and the eye before it.
    let mut closed = box_alone.clone();
    let back = closed.instances.iter().position(|i| i.name == "back wall").unwrap_or(0);
    let (middle, depth) = (2.78, 5.592);
    closed.instances.push(Instance {
        name: "front wall".into(),
        transform: DAffine3::from_translation(DVec3::new(2.0 * middle, 0.0, depth)) * DAffine3::from_rotation_y(PI),
        ..closed.instances[back].clone()
    });
    closed.cameras[0].transform.translation = DVec3::new(middle, 2.73, 0.1);
    closed.cameras[0].projection = Projection::Perspective { fov_y: 0.5 * PI };
    let mut black = cornell();
    for material in &mut black.materials {
        material.base_color = [0.0; 3];
        material.base_color_texture = None;
    }
    vec![
        ("no light", empty, false),
        ("a box, open at its front", box_alone, false),
        ("a closed box", closed, false),
        ("nothing specular", cornell(), false),
        ("a ball of glass", samples::glass_sphere(0.0), false),
        ("all black", black, false),
        ("stands still", cornell(), true),
    ]
}

struct Measured {
    stages: usize,
    passes: usize,
    maps: usize,
    bytes: u64,
    ms: f64,
    picture: Vec<[f32; 3]>,
}

impl Measured {
    fn cell(&self) -> String {
        let mib = self.bytes as f64 / f64::from(1 << 20);
        format!(
            "{}, {}, {}, {mib:.1}, {:.0}",
            self.stages, self.passes, self.maps, self.ms
        )
    }
}

fn measure(
    gpu: &Gpu,
    arguments: &Arguments,
    settings: &Settings,
    scene: &Scene,
    (presumes_all, stands_still): (bool, bool),
) -> Result<Measured, Error> {
    let size = [arguments.size; 2];
    let mut summary = SceneSummary::of(scene)?;
    if presumes_all {
        summary = summary.presuming_all();
    }
    let mut offline = Offline::with_summary(gpu, (scene.clone(), summary), settings, 0, size, Component::All)?;
    let timestamps = Timestamps::new(&gpu.device)?;
    let (mut times, mut passes) = (Vec::new(), Vec::new());
    // All is captured first, and places of environment maps are chosen.
    for frame in 0..WARM_UP + arguments.frames {
        offline.in_motion = !stands_still;
        if stands_still && frame > 0 {
            offline.renderer.set_changes(&[]);
        }
        let start = Instant::now();
        offline.render_frame(Some(&timestamps))?;
        if frame >= WARM_UP {
            times.push(1e3 * start.elapsed().as_secs_f64());
            passes.push(timestamps.passes() as f64);
        }
        timestamps.take_blocking(&gpu.device, &gpu.queue)?;
    }
    let plan = offline.renderer.plan();
    Ok(Measured {
        stages: plan.map_or(0, |plan| plan.stages.iter().filter(|s| s.on).count()),
        passes: median(&passes) as usize,
        maps: offline.renderer.env_maps().map_or(0, |maps| maps.centers().len()),
        bytes: offline.renderer.memory_use() + offline.view.memory_use(),
        ms: median(&times),
        picture: offline.read()?,
    })
}

/// Frames before those that count.
const WARM_UP: u32 = 12;

fn difference(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let pairs = || a.as_flattened().iter().zip(b.as_flattened());
    let squares: f64 = pairs().map(|(&a, &b)| f64::from(a - b).powi(2)).sum();
    let mean: f64 = pairs().map(|(&a, _)| f64::from(a)).sum();
    let count = pairs().count().max(1) as f64;
    if mean > 0.0 {
        (squares / count).sqrt() / (mean / count)
    } else {
        squares.sqrt()
    }
}
