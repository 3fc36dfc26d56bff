//! Renders a glTF file or a built-in sample with global illumination: the one command line for every figure.
//!
//! ```text
//! cargo run --release --example render -- scene.glb --preset balanced --out image.exr --stats image.json
//! cargo run --release --example render -- sample:cornell --component indirect --out indirect.png
//! ```
//!
//! Bad input gets one line on stderr, exit status 2, and no partial output file.

mod common;

use clap::{Parser, ValueEnum};
use common::adapter::{Gpu, Wishes};
use common::clock::Clock;
use common::offline::{Component, Offline};
use common::reference::{self, Reference};
use common::{arguments, environment_file, exr_file, named_scene, picture, progress};
use lightfall::frame::{Budget, BudgetController, GiRenderer, Plan, Rung, Settings};
use lightfall::reference::{PathComponent, PathEstimate, PathTracerSettings};
use lightfall::scene::{Scene, SceneSummary};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(Clone, Copy, ValueEnum)]
enum Part {
    All,
    /// Emission and direct light.
    Direct,
    /// All but direct.
    Indirect,
    /// Light that reached a diffuse surface through metals and glass alone.
    Caustic,
    /// What the eye sees of metals and glass.
    Specular,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Tracer {
    /// Through environment maps.
    ImageSpace,
    /// Against triangles.
    Bvh,
    /// Through environment maps, and against triangles what these lose.
    Hybrid,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Method {
    Splatting,
    /// By rays to lit environment maps
    FinalGather,
    /// By points on surfaces that stand for the light around them
    SurfaceLights,
    /// By irradiance kept at points of surfaces, gathered again where it changes
    IlluminationMaps,
}

/// Renders a scene with global illumination.
#[derive(Parser)]
#[command(args_override_self = true, after_help = "Not available yet: glTF skins.")]
struct Arguments {
    /// A .glb or .gltf file, or sample:NAME (cornell, cornell-spot, bumpy-floor, plane, furnace, two-rooms, pillars,
    /// penumbra, living-room, colonnade, nave, glass-sphere, ring-occluder, dimpled-mirror, water, courtyard)
    scene: String,
    /// Width in pixels
    #[arg(long, default_value_t = 512)]
    width: u32,
    /// Height in pixels
    #[arg(long, default_value_t = 512)]
    height: u32,
    /// Index of the file's camera
    #[arg(long, default_value_t = 0)]
    camera: usize,
    /// fast, balanced, accurate; reference: path tracing
    #[arg(long, default_value = "balanced")]
    preset: String,
    /// Which part of the light to keep
    #[arg(long, value_enum, default_value = "all")]
    component: Part,
    /// Surfaces that light scatters at before the one the eye sees (default: the preset's)
    #[arg(long)]
    bounces: Option<u32>,
    /// How photons find what they hit (default: the preset's)
    #[arg(long, value_enum)]
    tracer: Option<Tracer>,
    /// How indirect light comes to pixels (default: the preset's)
    #[arg(long, value_enum)]
    method: Option<Method>,
    /// Light from all around, instead of the scene's own: an equirectangular .exr or .hdr file, or radiance R,G,B
    #[arg(long, value_name = "FILE|R,G,B")]
    environment: Option<String>,
    /// Turns the environment, degrees, counter-clockwise seen from above
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, requires = "environment")]
    environment_rotation: f64,
    /// Any field of Settings, repeatable; an unknown key lists them all
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Time in seconds at which animations and samples are shown
    #[arg(long, default_value_t = 0.0)]
    time: f64,
    /// Writes numbered files over a span of time and reports the time per frame
    #[arg(long, value_name = "FROM:TO:FRAMES")]
    animate: Option<String>,
    /// Frames to accumulate, with jittered camera and fresh photons (default: the preset's)
    #[arg(long)]
    frames: Option<u32>,
    /// Chooses settings instead of a preset, so that a frame takes about so much time: of the GPU, or of a software adapter on
    /// the wall
    #[arg(long, conflicts_with_all = ["preset", "frames", "method"])]
    budget_ms: Option<f64>,
    /// Image to write: .exr (linear radiance) or .png (tone-mapped)
    #[arg(long)]
    out: Option<PathBuf>,
    /// Exposure of a PNG (default: brings its mean to a middle grey)
    #[arg(long)]
    exposure: Option<f32>,
    /// Machine-readable report to write, JSON
    #[arg(long)]
    stats: Option<PathBuf>,
    /// Adds to the report how far off the picture is, estimated without a truth, by rendering it four times
    #[arg(long, requires = "stats")]
    estimate_error: bool,
    /// Part of the adapter's name or backend (default: a discrete GPU, software last)
    #[arg(long)]
    adapter: Option<String>,
    /// Print the plan and stop
    #[arg(long)]
    explain: bool,
}

fn main() {
    let arguments: Arguments = arguments::parse("render");
    if let Err(message) = run(&arguments) {
        fail(&message);
    }
}

fn fail(message: &str) -> ! {
    eprintln!("render: {message}");
    std::process::exit(2);
}

fn run(arguments: &Arguments) -> Result<(), String> {
    if arguments.preset == reference::PRESET {
        return run_reference(arguments);
    }
    let component = component(arguments);
    let mut budget = arguments.budget_ms.map(|ms| budget(arguments, ms)).transpose()?;
    let settings = match &budget {
        Some(controller) => controller.settings().clone(),
        None => settings(arguments)?,
    };
    let times = times(arguments)?;
    let scene = load(arguments, times[0])?;
    let summary = SceneSummary::of(&scene).map_err(|e| format!("{}: {e}", arguments.scene))?;
    if arguments.explain {
        print!("{}", Plan::for_scene(&summary, &settings));
        return Ok(());
    }
    check_scene(arguments, &scene, &summary)?;
    let wishes = Wishes {
        timestamps: true,
        features: GiRenderer::required_features(&settings),
        large_buffers: true,
    };
    let gpu = Gpu::open(arguments.adapter.as_deref(), wishes)?;
    let setup = Instant::now();
    let size = [arguments.width, arguments.height];
    let mut offline =
        Offline::new(&gpu, scene, &settings, arguments.camera, size, component).map_err(|e| e.to_string())?;
    if times.len() == 1 {
        offline.stand_still();
    }
    let setup_ms = setup.elapsed().as_secs_f64() * 1e3;
    let mut clock = Clock::new(&gpu);
    let bar = progress::bar(times.len() as u64 * u64::from(settings.frames));
    for (number, &time) in times.iter().enumerate() {
        if number > 0 {
            offline.set_scene(load(arguments, time)?).map_err(|e| e.to_string())?;
        }
        match &mut budget {
            Some(controller) if times.len() == 1 => keep_to(controller, (&gpu, &mut offline), &mut clock)?,
            Some(controller) => follow(controller, (&gpu, &mut offline), &mut clock).map(drop)?,
            None => (0..settings.frames).try_for_each(|_| clock.frame(&gpu, &mut offline))?,
        }
        bar.inc(u64::from(settings.frames));
        gpu.check()?;
        if let Some(out) = &arguments.out {
            let path = if arguments.animate.is_some() {
                numbered(out, number)
            } else {
                out.clone()
            };
            write(&gpu, &offline, &path, arguments.exposure)?;
        }
    }
    bar.finish_and_clear();
    if arguments.stats.is_some() {
        clock.settle(&gpu, &mut offline)?;
    }
    gpu.check()?;
    if let Some(path) = &arguments.stats {
        let mut report = report(&gpu, &offline, (setup_ms, &clock))?;
        if let Some(controller) = &budget {
            report["budget"] = json!({"ms": arguments.budget_ms, "place": controller.place()});
        }
        if arguments.estimate_error {
            report["error_estimate"] = error_estimate(&mut offline)?;
        }
        let text = serde_json::to_string_pretty(&report).map_err(|e| e.to_string())?;
        exr_file::replace_file(path, text.as_bytes())?;
    }
    Ok(())
}

fn run_reference(arguments: &Arguments) -> Result<(), String> {
    let settings = reference_settings(arguments)?;
    let times = times(arguments)?;
    let scene = load(arguments, times[0])?;
    let summary = SceneSummary::of(&scene).map_err(|e| format!("{}: {e}", arguments.scene))?;
    check_scene(arguments, &scene, &summary)?;
    if arguments.explain {
        println!("every pixel is path traced: no stage of the plan runs");
        return Ok(());
    }
    let wishes = Wishes {
        timestamps: true,
        large_buffers: true,
        ..Default::default()
    };
    let gpu = Gpu::open(arguments.adapter.as_deref(), wishes)?;
    let frames = arguments.frames.unwrap_or(reference::SAMPLES);
    let size = [arguments.width, arguments.height];
    let mut clock = Clock::new(&gpu);
    let bar = progress::bar(times.len() as u64 * u64::from(frames));
    for (number, &time) in times.iter().enumerate() {
        let scene = if number > 0 {
            load(arguments, time)?
        } else {
            scene.clone()
        };
        let setup = Instant::now();
        let mut reference =
            Reference::new(&gpu, scene, &settings, arguments.camera, size).map_err(|e| e.to_string())?;
        let setup_ms = setup.elapsed().as_secs_f64() * 1e3;
        for _ in 0..frames {
            clock.time(&gpu, |timestamps| reference.render_sample(timestamps))?;
            bar.inc(1);
        }
        gpu.check()?;
        let estimate = reference.read().map_err(|e| e.to_string())?;
        if let Some(out) = &arguments.out {
            let path = if arguments.animate.is_some() {
                numbered(out, number)
            } else {
                out.clone()
            };
            write_reference(&gpu, &mut reference, &estimate, &path, arguments)?;
        }
        if let Some(path) = &arguments.stats {
            let report = reference_report(&gpu, &reference, (&settings, frames), (setup_ms, &clock), &estimate);
            let text = serde_json::to_string_pretty(&report).map_err(|e| e.to_string())?;
            exr_file::replace_file(path, text.as_bytes())?;
        }
    }
    bar.finish_and_clear();
    gpu.check()
}

fn reference_settings(arguments: &Arguments) -> Result<PathTracerSettings, String> {
    if arguments.estimate_error {
        return Err("--estimate-error: the reference tells its own noise".into());
    }
    if !arguments.set.is_empty() {
        return Err("--set: the reference has no settings; --bounces, --frames and --component are its options".into());
    }
    if arguments.frames == Some(0) {
        return Err("--frames 0: expected 1 or more".into());
    }
    let default = PathTracerSettings::default();
    Ok(PathTracerSettings {
        component: match arguments.component {
            Part::All => PathComponent::All,
            Part::Direct => PathComponent::Direct,
            Part::Indirect => PathComponent::Indirect,
            Part::Caustic => PathComponent::Caustic,
            Part::Specular => PathComponent::Specular,
        },
        bounces: arguments.bounces.unwrap_or(default.bounces),
        ..default
    })
}

/// An EXR file holds the standard error of each pixel beside its mean.
fn write_reference(
    gpu: &Gpu,
    reference: &mut Reference<'_>,
    estimate: &PathEstimate,
    path: &Path,
    arguments: &Arguments,
) -> Result<(), String> {
    let size = [arguments.width, arguments.height];
    if extension(path) == "exr" {
        let channel = |c: usize| estimate.standard_error.iter().map(|e| e[c]).collect();
        let errors = [
            ("stderr.R", channel(0)),
            ("stderr.G", channel(1)),
            ("stderr.B", channel(2)),
        ];
        return exr_file::write_rgb_and(path, size, &estimate.mean, &errors);
    }
    let exposure = arguments
        .exposure
        .unwrap_or_else(|| picture::exposure_for(&estimate.mean));
    let image = reference.resolve().map_err(|e| e.to_string())?;
    picture::write_png((&gpu.device, &gpu.queue), path, &image, exposure)
}

fn describe(gpu: &Gpu) -> Value {
    json!({
        "name": gpu.info.name, "backend": gpu.info.backend.to_string(),
        "kind": format!("{:?}", gpu.info.device_type), "driver": gpu.info.driver_info,
    })
}

fn reference_report(
    gpu: &Gpu,
    reference: &Reference<'_>,
    (settings, frames): (&PathTracerSettings, u32),
    (setup_ms, clock): (f64, &Clock),
    estimate: &PathEstimate,
) -> Value {
    let [median, min, max] = clock.frame_ms();
    let by_resource = reference.memory_by_resource();
    let stages: Vec<Value> = clock
        .stages_ms()
        .map(|(name, ms)| json!({"name": name.trim_start_matches("lightfall::"), "ms": ms}))
        .collect();
    json!({
        "adapter": describe(gpu),
        "size": reference.size(),
        "frames": frames,
        "settings": {"component": format!("{:?}", settings.component), "bounces": settings.bounces,
            "roulette_from": settings.roulette_from},
        "time": {
            "clock": clock.kind(), "setup_ms": setup_ms,
            "frame_ms": {"median": median, "min": min, "max": max}, "stages": stages,
        },
        "bytes": {
            "total": by_resource.iter().map(|r| r.1).sum::<u64>(),
            "by_resource": by_resource.into_iter().collect::<std::collections::BTreeMap<_, _>>(),
        },
        "error_estimate": {"relmse": estimate.relative_variance(), "noise": estimate.relative_variance(), "bias": 0.0},
    })
}

fn component(arguments: &Arguments) -> Component {
    match arguments.component {
        Part::All => Component::All,
        Part::Direct => Component::Direct,
        Part::Indirect => Component::Indirect,
        Part::Caustic => Component::Caustic,
        Part::Specular => Component::Specular,
    }
}

/// Chooses among the measured ladder of the tracer, with what else the command line asks for.
fn budget(arguments: &Arguments, ms: f64) -> Result<BudgetController, String> {
    let keys = || {
        arguments
            .set
            .iter()
            .filter_map(|pair| pair.split_once('='))
            .map(|pair| pair.0.trim())
    };
    if let Some(key) = keys().find(|key| ["photons", "frames", "indirect.method"].contains(key)) {
        return Err(format!("--set {key}: --budget-ms chooses it"));
    }
    let tracer = settings(arguments)?.tracer_kind;
    let mut ladder = Rung::ladder(tracer);
    for rung in &mut ladder {
        apply(arguments, &mut rung.settings)?;
    }
    BudgetController::new(Budget::Time(ms), ladder).map_err(|e| format!("--budget-ms: {e}"))
}

/// Renders a frame and tells the controller of it; whether settings are others now.
fn follow(
    controller: &mut BudgetController,
    (gpu, offline): (&Gpu, &mut Offline<'_>),
    clock: &mut Clock,
) -> Result<bool, String> {
    clock.frame(gpu, offline)?;
    let Some(settings) = clock.last_ms().and_then(|ms| controller.observe(ms)) else {
        return Ok(false);
    };
    offline.set_settings(settings).map_err(|e| e.to_string())?;
    clock.restart();
    Ok(true)
}

/// Renders frames until settings have stayed for a while.
fn keep_to(
    controller: &mut BudgetController,
    (gpu, offline): (&Gpu, &mut Offline<'_>),
    clock: &mut Clock,
) -> Result<(), String> {
    const MOST: usize = 60;
    const SETTLED: usize = 8;
    let mut since = 0;
    for _ in 0..MOST {
        since = if follow(controller, (gpu, offline), clock)? {
            0
        } else {
            since + 1
        };
        if since > SETTLED {
            return Ok(());
        }
    }
    // What is shown is of the last settings.
    clock.frame(gpu, offline)
}

fn error_estimate(offline: &mut Offline<'_>) -> Result<Value, String> {
    let text = |e: lightfall::Error| e.to_string();
    if let Some(noise) = offline.accumulated_noise().map_err(text)? {
        return Ok(json!({"relmse": null, "noise": noise, "bias": null}));
    }
    Ok(match offline.estimate_error().map_err(text)? {
        Some(estimate) => json!({"relmse": estimate.relmse(), "noise": estimate.noise, "bias": estimate.blur}),
        None => Value::Null,
    })
}

fn settings(arguments: &Arguments) -> Result<Settings, String> {
    let mut settings = Settings::preset(&arguments.preset).ok_or_else(|| {
        format!(
            "--preset {:?}: expected fast, balanced, accurate or reference",
            arguments.preset
        )
    })?;
    apply(arguments, &mut settings)?;
    if let Some(frames) = arguments.frames {
        settings.set("frames", &frames.to_string()).map_err(|e| e.to_string())?;
    }
    Ok(settings)
}

/// What the command line says beside a preset.
fn apply(arguments: &Arguments, settings: &mut Settings) -> Result<(), String> {
    let mut set = |key: &str, value: &str| settings.set(key, value).map_err(|e| e.to_string());
    for pair in &arguments.set {
        let (key, value) = arguments::key_and_value(pair)?;
        set(key, value)?;
    }
    if let Some(tracer) = arguments.tracer.and_then(|t| t.to_possible_value()) {
        set("tracer.kind", tracer.get_name())?;
    }
    if let Some(method) = arguments.method.and_then(|m| m.to_possible_value()) {
        set("indirect.method", method.get_name())?;
    }
    if let Some(bounces) = arguments.bounces {
        set("bounces", &bounces.to_string())?;
    }
    Ok(())
}

/// The times to show: one, or a span.
fn times(arguments: &Arguments) -> Result<Vec<f64>, String> {
    let Some(span) = &arguments.animate else {
        return Ok(vec![arguments.time]);
    };
    let bad = || format!("--animate {span:?}: expected FROM:TO:FRAMES, as in 0:2:48");
    let parts: Vec<&str> = span.split(':').collect();
    let [from, to, count] = parts[..] else {
        return Err(bad());
    };
    let (from, to): (f64, f64) = (from.parse().map_err(|_| bad())?, to.parse().map_err(|_| bad())?);
    let count: u32 = count.parse().map_err(|_| bad())?;
    if count == 0 || !from.is_finite() || !to.is_finite() {
        return Err(bad());
    }
    let step = (to - from) / f64::from(count);
    Ok((0..count).map(|i| from + step * f64::from(i)).collect())
}

fn load(arguments: &Arguments, time: f64) -> Result<Scene, String> {
    if !time.is_finite() {
        return Err("--time: expected a finite number of seconds".into());
    }
    let mut scene = named_scene::load(&arguments.scene, time)?;
    if let Some(environment) = &arguments.environment {
        environment_file::add(&mut scene, environment, arguments.environment_rotation)?;
    }
    Ok(scene)
}

fn check_scene(arguments: &Arguments, scene: &Scene, summary: &SceneSummary) -> Result<(), String> {
    let name = &arguments.scene;
    match scene.cameras.len() {
        0 => return Err(format!("{name}: has no camera")),
        n if arguments.camera >= n => return Err(format!("{name}: has {n} camera(s), --camera counts from 0")),
        _ => {}
    }
    if summary.lights == 0 && summary.emissive.is_empty() {
        return Err(format!("{name}: has no light"));
    }
    if arguments.width == 0 || arguments.height == 0 {
        return Err("--width and --height: expected at least 1".into());
    }
    match &arguments.out {
        Some(path) if !["exr", "png"].contains(&extension(path).as_str()) => {
            Err(format!("{}: expected a name ending in .exr or .png", path.display()))
        }
        _ => Ok(()),
    }
}

fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// "image.png" with a number before its extension.
fn numbered(path: &Path, number: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    path.with_file_name(format!("{stem}.{number:04}.{}", extension(path)))
}

fn write(gpu: &Gpu, offline: &Offline<'_>, path: &Path, exposure: Option<f32>) -> Result<(), String> {
    let pixels = offline.read().map_err(|e| e.to_string())?;
    let size = offline.view.g_buffer().size();
    if extension(path) == "exr" {
        return exr_file::write_rgb(path, size[0], size[1], &pixels);
    }
    let exposure = exposure.unwrap_or_else(|| picture::exposure_for(&pixels));
    picture::write_png((&gpu.device, &gpu.queue), path, offline.radiance(), exposure)
}

fn report(gpu: &Gpu, offline: &Offline<'_>, (setup_ms, clock): (f64, &Clock)) -> Result<Value, String> {
    let settings = offline.renderer.settings();
    let flux_scale = offline.renderer.frame().map_or(1.0, |f| f.flux_scale());
    let watts = |flux: [f32; 3]| flux.map(|v| f64::from(v) * flux_scale);
    let hops = offline.statistics().map_err(|e| e.to_string())?;
    let energy: Vec<Value> = (0..)
        .zip(&hops)
        .map(|(bounce, hop): (u32, _)| {
            json!({
                "bounce": bounce, "in": watts(hop.emitted), "absorbed": watts(hop.absorbed),
                "stored": watts(hop.stored), "tentative": watts(hop.tentative), "escaped": watts(hop.escaped), "lost": watts(hop.lost),
            })
        })
        .collect();
    let by_resource = offline.memory_by_resource();
    let plan = offline.renderer.plan().map(|p| p.stages.clone()).unwrap_or_default();
    let [median, min, max] = clock.frame_ms();
    let stages: Vec<Value> = clock
        .stages_ms()
        .map(|(name, ms)| json!({"name": name.trim_start_matches("lightfall::"), "ms": ms}))
        .collect();
    Ok(json!({
        "adapter": describe(gpu),
        "size": offline.view.g_buffer().size(),
        "frames": settings.frames,
        "settings": settings.entries().into_iter().collect::<std::collections::BTreeMap<_, _>>(),
        "time": {
            "clock": clock.kind(),
            "setup_ms": setup_ms,
            "frame_ms": {"median": median, "min": min, "max": max},
            "stages": stages,
        },
        "photons": {
            "emitted": offline.renderer.photons().map_or(0, |p| p.count()),
            "stored": hops.iter().map(|h| h.stored_count).sum::<u64>(),
            "caustic": 0,
        },
        "energy": energy,
        "env_maps": {
            "candidates": if offline.renderer.env_maps().is_some() {
                settings.selector.candidates.max(settings.env_map_count)
            } else {
                0
            },
            "used": offline.renderer.env_maps().map_or(0, |m| m.centers().len()),
            "coverage": offline.renderer.env_map_coverage(),
        },
        "reestimated": offline.reestimated().map_err(|e| e.to_string())?,
        "bytes": {
            "total": by_resource.iter().map(|r| r.1).sum::<u64>(),
            "by_resource": by_resource.into_iter().collect::<std::collections::BTreeMap<_, _>>(),
        },
        "plan": plan.iter().map(|s| json!({"stage": s.stage.name(), "on": s.on, "reason": s.reason})).collect::<Vec<_>>(),
        "simplifications": offline.renderer.plan().map(|p| p.simplifications.clone()).unwrap_or_default(),
        "error_estimate": null,
    }))
}
