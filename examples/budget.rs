//! Keeps frames to a budget while their load changes: of time while it doubles and halves, or of error.
//!
//! ```text
//! cargo run --release --example budget -- sample:cornell --tracer bvh
//! cargo run --release --example budget -- SCENE.glb --budget-ms 16
//! cargo run --release --example budget -- sample:cornell sample:cornell-spot sample:cornell --error 0.02
//! ```
//!
//! One player looks into the scene, then two, each with a renderer of its own as on a split screen, then one again. After each
//! frame the controller is told what it took, and all renderers get the settings that it chooses. With `--error` one player
//! looks into one scene after the other, and the controller is told how far off a frame is, as `ErrorEstimate` has it from four
//! pictures. A line for each frame goes to standard output: players or scene, photons, the reading, the same over the budget;
//! then for each phase how soon frames keep to the budget, and how well.

mod common;

use clap::Parser;
use common::adapter::{Gpu, Wishes};
use common::clock::Clock;
use common::offline::{Component, Offline};
use common::{arguments, named_scene};
use lightfall::frame::{Budget, BudgetController, Rung, Settings};

/// Keeps to a budget while the load changes.
#[derive(Parser)]
struct Arguments {
    /// A .glb or .gltf file, or sample:NAME; of several, which `--error` takes, each is a phase
    #[arg(default_value = "sample:cornell")]
    scenes: Vec<String>,
    /// image-space, hybrid or bvh
    #[arg(long, default_value = "bvh")]
    tracer: String,
    /// Milliseconds of a frame; default: 2.5 times what `fast` takes for one player
    #[arg(long)]
    budget_ms: Option<f64>,
    /// Keep to this relMSE of indirect light instead
    #[arg(long, conflicts_with = "budget_ms")]
    error: Option<f64>,
    /// Width and height of a player's picture, pixels
    #[arg(long, default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..=4096))]
    size: u32,
    /// Frames of each phase
    #[arg(long, default_value_t = 40, value_parser = clap::value_parser!(u32).range(11..))]
    frames: u32,
    /// Part of the adapter's name or backend
    #[arg(long)]
    adapter: Option<String>,
}

/// Players in each phase, where time is kept to.
const PHASES: [usize; 3] = [1, 2, 1];

/// Frames of a phase that the controller has to find settings in.
const GRACE: u32 = 10;

/// How far from the budget a frame may be, as a share of it.
const NEAR: f64 = 0.2;

fn main() {
    let arguments: Arguments = arguments::parse("budget");
    if let Err(message) = run(&arguments) {
        eprintln!("budget: {message}");
        std::process::exit(2);
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let mut settings = Settings::fast();
    settings.set("tracer.kind", &arguments.tracer).map_err(text)?;
    let wishes = Wishes {
        timestamps: true,
        large_buffers: true,
        ..Wishes::default()
    };
    let gpu = Gpu::open(arguments.adapter.as_deref(), wishes)?;
    println!("{}", gpu.describe());
    let summary = match arguments.error {
        None => keep_time(arguments, &gpu, &settings)?,
        Some(error) => keep_error(arguments, &gpu, (&settings, error))?,
    };
    print!("\n{summary}");
    gpu.check()
}

/// How well the frames of a phase keep to a budget.
#[derive(Default)]
struct Kept {
    /// The last of the first ones that did not.
    settled: u32,
    /// Of the others.
    near: u32,
    all: u32,
    changes: u32,
}

impl Kept {
    fn count(&mut self, frame: u32, ratio: f64) {
        let is_near = (ratio - 1.0).abs() <= NEAR;
        if frame > GRACE {
            self.all += 1;
            self.near += u32::from(is_near);
        } else if !is_near {
            self.settled = frame;
        }
    }

    fn line(&self, phase: &str) -> String {
        format!(
            "{phase}: {} of the first {GRACE} frames until within {:.0} %; {} of the {} others are, with {} change(s) of settings\n",
            self.settled,
            100.0 * NEAR,
            self.near,
            self.all,
            self.changes
        )
    }
}

struct Player<'a> {
    offline: Offline<'a>,
    clock: Clock,
}

fn player<'a>(
    arguments: &Arguments,
    gpu: &'a Gpu,
    settings: &Settings,
    (scene, component): (&str, Component),
) -> Result<Player<'a>, String> {
    let scene = named_scene::load(scene, 0.0)?;
    let offline = Offline::new(gpu, scene, settings, 0, [arguments.size; 2], component).map_err(text)?;
    let clock = Clock::new(gpu);
    Ok(Player { offline, clock })
}

fn keep_time(arguments: &Arguments, gpu: &Gpu, settings: &Settings) -> Result<String, String> {
    let [scene] = &arguments.scenes[..] else {
        return Err("several scenes: expected one, or --error".into());
    };
    let player = |_| player(arguments, gpu, settings, (scene, Component::All));
    let mut players = (0..2).map(player).collect::<Result<Vec<_>, _>>()?;
    let budget = match arguments.budget_ms {
        Some(ms) => ms,
        None => {
            let Player { offline, clock } = &mut players[0];
            clock.settle(gpu, offline)?;
            2.5 * clock.frame_ms()[0]
        }
    };
    let ladder = Rung::ladder(settings.tracer_kind);
    let mut controller = BudgetController::new(Budget::Time(budget), ladder).map_err(text)?;
    println!("budget {budget:.0} ms ({})\n", players[0].clock.kind());
    println!("| frame | players | photons | ms | over the budget |\n|---|---|---|---|---|");
    apply(controller.settings(), &mut players)?;
    let mut summary = String::new();
    for (phase, &count) in PHASES.iter().enumerate() {
        let mut kept = Kept::default();
        for frame in 1..=arguments.frames {
            let photons = controller.settings().photons;
            for Player { offline, clock } in &mut players[..count] {
                clock.frame(gpu, offline)?;
            }
            // The first frame of other settings makes pipelines, and has no time.
            let Some(ms) = players[..count].iter().map(|p| p.clock.last_ms()).sum::<Option<f64>>() else {
                continue;
            };
            println!(
                "| {} | {count} | {photons} | {ms:.0} | {:.2} |",
                phase as u32 * arguments.frames + frame,
                ms / budget
            );
            kept.count(frame, ms / budget);
            if let Some(settings) = controller.observe(ms) {
                kept.changes += u32::from(frame > GRACE);
                apply(&settings.clone(), &mut players)?;
            }
        }
        summary += &kept.line(&format!("{count} player(s)"));
    }
    Ok(summary)
}

fn apply(settings: &Settings, players: &mut [Player<'_>]) -> Result<(), String> {
    for Player { offline, clock } in players {
        offline.set_settings(settings).map_err(text)?;
        clock.restart();
    }
    Ok(())
}

fn keep_error(arguments: &Arguments, gpu: &Gpu, (settings, budget): (&Settings, f64)) -> Result<String, String> {
    let ladder = Rung::ladder(settings.tracer_kind);
    let mut controller = BudgetController::new(Budget::Error(budget), ladder).map_err(text)?;
    println!("budget {budget} relMSE\n");
    println!("| frame | scene | photons | relMSE | over the budget |\n|---|---|---|---|---|");
    let mut summary = String::new();
    for (phase, scene) in arguments.scenes.iter().enumerate() {
        let mut own = player(arguments, gpu, controller.settings(), (scene, Component::Indirect))?.offline;
        let mut kept = Kept::default();
        for frame in 1..=arguments.frames {
            // The next photons of the random sequence: readings are those of frames, not of one that is repeated.
            own.pictures_before = 2 * frame;
            let Some(estimate) = own.estimate_error().map_err(text)? else {
                return Err("--error: settings of the ladder have no estimate".into());
            };
            let relmse = estimate.relmse();
            println!(
                "| {} | {scene} | {} | {relmse:.4} | {:.2} |",
                phase as u32 * arguments.frames + frame,
                controller.settings().photons,
                relmse / budget
            );
            kept.count(frame, relmse / budget);
            if let Some(settings) = controller.observe(relmse) {
                kept.changes += u32::from(frame > GRACE);
                own.set_settings(settings).map_err(text)?;
            }
        }
        summary += &kept.line(scene);
    }
    Ok(summary)
}

fn text(error: lightfall::Error) -> String {
    error.to_string()
}
