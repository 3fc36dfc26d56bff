//! Keeps frames to a budget of time while their load doubles and halves.
//!
//! ```text
//! cargo run --release --example budget -- sample:cornell --tracer bvh
//! cargo run --release --example budget -- SCENE.glb --budget-ms 16
//! ```
//!
//! One player looks into the scene, then two, each with a renderer of its own as on a split screen, then one again. After each
//! frame the controller is told what it took, and all renderers get the settings that it chooses. A line for each frame goes to
//! standard output: players, photons, milliseconds, the same over the budget; then for each phase how soon frames keep to the
//! budget, and how well.

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
    /// A .glb or .gltf file, or sample:NAME
    #[arg(default_value = "sample:cornell")]
    scene: String,
    /// image-space, hybrid or bvh
    #[arg(long, default_value = "bvh")]
    tracer: String,
    /// Milliseconds of a frame; default: 2.5 times what `fast` takes for one player
    #[arg(long)]
    budget_ms: Option<f64>,
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

/// Players in each phase.
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

struct Player<'a> {
    offline: Offline<'a>,
    clock: Clock,
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let text = |e: lightfall::Error| e.to_string();
    let mut settings = Settings::fast();
    settings.set("tracer.kind", &arguments.tracer).map_err(text)?;
    let wishes = Wishes {
        timestamps: true,
        large_buffers: true,
        ..Wishes::default()
    };
    let gpu = Gpu::open(arguments.adapter.as_deref(), wishes)?;
    let scene = named_scene::load(&arguments.scene, 0.0)?;
    let player = |_| {
        let size = [arguments.size; 2];
        let offline = Offline::new(&gpu, scene.clone(), &settings, 0, size, Component::All).map_err(text)?;
        let clock = Clock::new(&gpu);
        Ok::<_, String>(Player { offline, clock })
    };
    let mut players = (0..2).map(player).collect::<Result<Vec<_>, _>>()?;
    let budget = match arguments.budget_ms {
        Some(ms) => ms,
        None => {
            let Player { offline, clock } = &mut players[0];
            clock.settle(&gpu, offline)?;
            2.5 * clock.frame_ms()[0]
        }
    };
    let ladder = Rung::ladder(settings.tracer_kind);
    let mut controller = BudgetController::new(Budget::Time(budget), ladder).map_err(text)?;
    println!(
        "{}, budget {budget:.0} ms ({})\n",
        gpu.describe(),
        players[0].clock.kind()
    );
    println!("| frame | players | photons | ms | over the budget |\n|---|---|---|---|---|");
    apply(controller.settings(), &mut players)?;
    let mut summary = String::new();
    for (phase, &count) in PHASES.iter().enumerate() {
        let (mut near, mut timed, mut changes, mut settled) = (0, 0, 0, 0);
        for frame in 1..=arguments.frames {
            let photons = controller.settings().photons;
            for Player { offline, clock } in &mut players[..count] {
                clock.frame(&gpu, offline)?;
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
            let is_near = (ms / budget - 1.0).abs() <= NEAR;
            if !is_near && frame <= GRACE {
                settled = frame;
            }
            if frame > GRACE {
                timed += 1;
                near += u32::from(is_near);
            }
            if let Some(settings) = controller.observe(ms) {
                changes += u32::from(frame > GRACE);
                apply(&settings.clone(), &mut players)?;
            }
        }
        summary += &format!(
            "{count} player(s): {settled} of the first {GRACE} frames until within {:.0} %; {near} of the {timed} others are, with {changes} \
             change(s) of settings\n",
            100.0 * NEAR
        );
    }
    print!("\n{summary}");
    gpu.check()
}

fn apply(settings: &Settings, players: &mut [Player<'_>]) -> Result<(), String> {
    for Player { offline, clock } in players {
        offline.set_settings(settings).map_err(|e| e.to_string())?;
        clock.restart();
    }
    Ok(())
}
