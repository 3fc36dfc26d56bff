//! Renders scenes with every preset and measures the images against references.
//!
//! ```text
//! cargo run --release --example accuracy -- SCENES TRUTH [--presets fast,balanced] [--tracers hybrid,bvh] [--docs docs]
//! ```
//!
//! SCENES holds `NAME.glb` or `NAME.gltf`, TRUTH holds `NAME.COMPONENT.exr`; every reference whose scene is there is
//! rendered with every preset, at the reference's size, through the file's first camera. COMPONENT is `direct`,
//! `indirect`, `caustic`, `all`, or `light_traced`: all light again, by a renderer that finds caustics. The preset `reference` is the
//! path tracer, whose frames are samples a pixel.
//!
//! With `--tracers` every preset is rendered once with each of these tracers (`image-space`, `hybrid`, `bvh`) in place of
//! its own, and the table names the tracer after the preset. What does not depend on it is rendered once: the component
//! `direct`, and the preset `reference`.
//!
//! Each finished row is kept in the folder `--out`: a line in `rows.jsonl` and the image. Rows that are there, rendered
//! on the same adapter, are not rendered again unless `--fresh` is given; after a change of the renderer it has to be.
//! A row and the name of its image carry the tracer where it is not the preset's own: a row that names none serves with
//! `--tracers` and without.
//!
//! The table goes to stdout and to `table.md`, a contact sheet to `sheet.png`; with `--docs` they also go to `accuracy.md`
//! between its two markers, and to `accuracy.png`. A scene that a preset does not model in full is rendered all the same;
//! the table says what was simplified.
//!
//! Exit status 1 if an image could not be rendered or is not finite. Bad input gets one line on stderr and exit status 2.

mod common;

use clap::Parser;
use common::adapter::{Gpu, Wishes};
use common::clock::Clock;
use common::contact_sheet::{self, Labelled, Line};
use common::offline::{Component, Offline};
use common::reference::{self, Reference as PathTraced};
use common::{arguments, exr_file, gltf_scene, progress, report, truth_file};
use indicatif::{ProgressBar, ProgressStyle};
use lightfall::frame::{GiRenderer, Settings};
use lightfall::reference::metrics::{self, Image, Truth};
use lightfall::reference::{PathComponent, PathTracerSettings};
use lightfall::scene::{Scene, SceneSummary};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// All presets, in the order of the table; [`render`] knows what they mean.
const PRESETS: [&str; 4] = ["fast", "balanced", "accurate", reference::PRESET];

/// The setting that says what photons are traced through.
const TRACER_KIND: &str = "tracer.kind";

/// All values of [`TRACER_KIND`], in the order of the table.
const TRACERS: [&str; 3] = ["image-space", "hybrid", "bvh"];

/// What a reference may hold, and what is rendered to compare with it.
const COMPONENTS: [(&str, Component); 5] = [
    ("direct", Component::Direct),
    ("indirect", Component::Indirect),
    ("caustic", Component::Caustic),
    ("all", Component::All),
    ("light_traced", Component::All),
];

const TABLE_BEGIN: &str = "<!-- accuracy table: begin -->";
const TABLE_END: &str = "<!-- accuracy table: end -->";

/// Renders scenes with every preset and measures the images against references.
#[derive(Parser)]
#[command(args_override_self = true)]
struct Arguments {
    /// Folder of the scenes, NAME.glb or NAME.gltf
    #[arg(value_name = "SCENES")]
    scene_folder: PathBuf,
    /// Folder of the references, NAME.COMPONENT.exr
    #[arg(value_name = "TRUTH")]
    truth_folder: PathBuf,
    /// Only these presets (default: fast, balanced, accurate, reference)
    #[arg(long, value_delimiter = ',')]
    presets: Vec<String>,
    /// Each preset with these tracers (image-space, hybrid, bvh) in place of its own
    #[arg(long, value_delimiter = ',')]
    tracers: Vec<String>,
    /// Only these scenes
    #[arg(long, value_delimiter = ',')]
    scenes: Vec<String>,
    /// Only these components (direct, indirect, caustic, all, light_traced)
    #[arg(long, value_delimiter = ',')]
    components: Vec<String>,
    /// Scenes that are measured but left out of the contact sheet, because their pictures may not be passed on
    #[arg(long, value_delimiter = ',')]
    unpictured: Vec<String>,
    /// Surfaces that light scatters at before the one the eye sees, as in the references
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(0..=64))]
    bounces: u32,
    /// Frames to accumulate (default: the preset's)
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    frames: Option<u32>,
    /// Folder of finished rows, table and contact sheet
    #[arg(long, default_value = "target/accuracy")]
    out: PathBuf,
    /// Folder of the accuracy.md to put the table into, and the contact sheet beside it
    #[arg(long)]
    docs: Option<PathBuf>,
    /// Render rows again that are already there
    #[arg(long)]
    fresh: bool,
    /// Part of the adapter's name or backend (default: a discrete GPU, software last)
    #[arg(long)]
    adapter: Option<String>,
}

fn main() -> ExitCode {
    let arguments: Arguments = arguments::parse("accuracy");
    match run(&arguments) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(problem) => {
            eprintln!("accuracy: {problem}");
            ExitCode::from(2)
        }
    }
}

/// Whether every image was rendered and is finite.
fn run(arguments: &Arguments) -> Result<bool, String> {
    let presets = presets(arguments)?;
    let tracers = tracers(arguments)?;
    let references = references(arguments)?;
    // Before hours of rendering.
    if let Some(docs) = &arguments.docs {
        with_table(docs, "")?;
    }
    std::fs::create_dir_all(&arguments.out).map_err(|error| format!("{}: {error}", arguments.out.display()))?;
    let wishes = Wishes {
        timestamps: true,
        features: required_features(),
        large_buffers: true,
    };
    let gpu = Gpu::open(arguments.adapter.as_deref(), wishes)?;
    let mut rows = Rows::read(&arguments.out)?;
    let jobs: Vec<Vec<Job<'_>>> = references
        .iter()
        .map(|reference| jobs(arguments, reference, &presets, &tracers))
        .collect();
    let bar = progress::bar(jobs.iter().map(Vec::len).sum::<usize>() as u64);
    bar.set_style(ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}").map_err(|error| error.to_string())?);
    let (mut table, mut sheet) = (Vec::new(), Vec::new());
    for (reference, jobs) in references.iter().zip(jobs) {
        let mut images = Vec::new();
        for job in jobs {
            bar.set_message(job.name());
            match finish(arguments, &gpu, &job, &mut rows, &bar) {
                Ok((row, image)) => {
                    images.push(Labelled {
                        label: label(&job, &row),
                        image,
                    });
                    table.push((job.title(), row));
                }
                Err(problem) => table.push((job.title(), job.row(json!({ "failed": problem })))),
            }
            bar.inc(1);
        }
        if !arguments.unpictured.contains(&reference.scene) {
            sheet.push(Line {
                title: format!("{} {}", reference.scene, reference.component.0),
                truth: &reference.truth,
                images,
            });
        }
    }
    bar.finish_and_clear();
    write(
        arguments,
        &markdown(arguments, &gpu, &table),
        &contact_sheet::png(&sheet)?,
    )?;
    Ok(table.iter().all(|(_, row)| row["figures"]["finite"] == true))
}

/// A row and its image, rendered now or before, compared and kept.
fn finish(
    arguments: &Arguments,
    gpu: &Gpu,
    job: &Job<'_>,
    rows: &mut Rows,
    bar: &ProgressBar,
) -> Result<(Value, Image), String> {
    let path = rows.image(job);
    let mut row = match rows.find(job, gpu).filter(|_| !arguments.fresh) {
        Some(row) => row.clone(),
        None => rendered(gpu, job, &path, bar)?,
    };
    let image = truth_file::read_image(&path)?;
    let truth = &job.reference.truth;
    let comparison = metrics::compare(&image, truth).map_err(|error| format!("{}: {error}", path.display()))?;
    row["figures"] = report::figures(&comparison, truth);
    rows.insert(job, row.clone())?;
    Ok((row, image))
}

fn presets(arguments: &Arguments) -> Result<Vec<&str>, String> {
    if let Some(unknown) = arguments.presets.iter().find(|p| !PRESETS.contains(&p.as_str())) {
        return Err(format!("--presets {unknown:?}: there are {}", PRESETS.join(", ")));
    }
    let is_wanted = |preset: &&str| arguments.presets.is_empty() || arguments.presets.iter().any(|p| p == preset);
    Ok(PRESETS.into_iter().filter(is_wanted).collect())
}

/// Entries of [`TRACERS`]; none where every preset keeps its own.
fn tracers(arguments: &Arguments) -> Result<Vec<&'static str>, String> {
    if let Some(unknown) = arguments.tracers.iter().find(|t| !TRACERS.contains(&t.as_str())) {
        return Err(format!("--tracers {unknown:?}: there are {}", TRACERS.join(", ")));
    }
    let is_wanted = |tracer: &&str| arguments.tracers.iter().any(|t| t == tracer);
    Ok(TRACERS.into_iter().filter(is_wanted).collect())
}

/// A file to compare with.
struct Reference {
    scene: String,
    /// An entry of [`COMPONENTS`].
    component: (&'static str, Component),
    scene_path: PathBuf,
    /// Fit to compare with.
    truth: Truth,
}

/// Sorted by scene, then in the order of [`COMPONENTS`].
fn references(arguments: &Arguments) -> Result<Vec<Reference>, String> {
    let known = COMPONENTS.map(|component| component.0);
    if let Some(unknown) = arguments.components.iter().find(|c| !known.contains(&c.as_str())) {
        return Err(format!("--components {unknown:?}: there are {}", known.join(", ")));
    }
    let is_wanted = |list: &[String], name: &str| list.is_empty() || list.iter().any(|wanted| wanted == name);
    let mut found = Vec::new();
    for name in file_names(&arguments.truth_folder)? {
        let Some((scene, component)) = name.strip_suffix(".exr").and_then(|stem| stem.rsplit_once('.')) else {
            continue;
        };
        let Some(order) = known.iter().position(|&name| name == component) else {
            continue;
        };
        if !is_wanted(&arguments.scenes, scene) || !is_wanted(&arguments.components, component) {
            continue;
        }
        let file = |extension: &str| arguments.scene_folder.join(format!("{scene}.{extension}"));
        let Some(scene_path) = [file("glb"), file("gltf")].into_iter().find(|path| path.exists()) else {
            eprintln!("accuracy: {name} is left out: there is no {}", file("glb").display());
            continue;
        };
        let path = arguments.truth_folder.join(&name);
        let truth = truth_file::read_truth(&path)?;
        metrics::compare(&truth.image, &truth).map_err(|error| format!("{}: {error}", path.display()))?;
        let reference = Reference {
            scene: scene.to_owned(),
            component: COMPONENTS[order],
            scene_path,
            truth,
        };
        found.push((order, reference));
    }
    if let Some(missing) = arguments
        .scenes
        .iter()
        .find(|s| found.iter().all(|(_, r)| r.scene != **s))
    {
        return Err(format!(
            "--scenes {missing:?}: found no scene with a reference of that name"
        ));
    }
    if found.is_empty() {
        return Err(format!("{}: no reference fits", arguments.truth_folder.display()));
    }
    found.sort_by(|(a_order, a), (b_order, b)| (&a.scene, a_order).cmp(&(&b.scene, b_order)));
    Ok(found.into_iter().map(|(_, reference)| reference).collect())
}

fn file_names(folder: &Path) -> Result<Vec<String>, String> {
    let at = |error| format!("{}: {error}", folder.display());
    let entries = std::fs::read_dir(folder).map_err(at)?;
    entries
        .map(|entry| Ok(entry.map_err(at)?.file_name().to_string_lossy().into_owned()))
        .collect()
}

/// A row of the table, before it is rendered.
struct Job<'a> {
    reference: &'a Reference,
    preset: &'a str,
    /// An entry of [`TRACERS`], if one was asked for and the image depends on it.
    tracer: Option<&'static str>,
    bounces: u32,
    /// Instead of the preset's.
    frames: Option<u32>,
    size: [u32; 2],
}

impl<'a> Job<'a> {
    fn new(arguments: &Arguments, reference: &'a Reference, preset: &'a str, tracer: Option<&'static str>) -> Self {
        let image = &reference.truth.image;
        Self {
            reference,
            preset,
            tracer,
            bounces: arguments.bounces,
            frames: arguments.frames,
            size: [image.width, image.height],
        }
    }

    /// Tells it from all others in a folder.
    fn name(&self) -> String {
        let tracer = self.other_tracer().map_or(String::new(), |tracer| format!(".{tracer}"));
        let frames = self.frames.map_or(String::new(), |frames| format!(".frames{frames}"));
        format!(
            "{}.{}.{}{tracer}.bounces{}{frames}",
            self.reference.scene, self.reference.component.0, self.preset, self.bounces
        )
    }

    /// "balanced", or "balanced, hybrid" where that tracer was asked for.
    fn title(&self) -> String {
        let tracer = self.tracer.map_or(String::new(), |tracer| format!(", {tracer}"));
        format!("{}{tracer}", self.preset)
    }

    /// The tracer, if it is not the preset's own.
    fn other_tracer(&self) -> Option<&'static str> {
        let own = Settings::preset(self.preset)?.entries();
        self.tracer
            .filter(|&tracer| !own.contains(&(TRACER_KIND, tracer.to_owned())))
    }

    /// `result` with what it is the result of.
    fn row(&self, mut result: Value) -> Value {
        result["name"] = json!(self.name());
        result["scene"] = json!(self.reference.scene);
        result["component"] = json!(self.reference.component.0);
        result["preset"] = json!(self.preset);
        if let Some(tracer) = self.other_tracer() {
            result["tracer"] = json!(tracer);
        }
        result["bounces"] = json!(self.bounces);
        result["size"] = json!(self.size);
        result
    }
}

/// What is compared with a reference: each preset, with each tracer that was asked for if the image depends on it.
fn jobs<'a>(
    arguments: &Arguments,
    reference: &'a Reference,
    presets: &[&'a str],
    tracers: &[&'static str],
) -> Vec<Job<'a>> {
    let is_direct = reference.component.1 == Component::Direct;
    let mut jobs = Vec::new();
    for &preset in presets {
        if tracers.is_empty() || is_direct || preset == reference::PRESET {
            jobs.push(Job::new(arguments, reference, preset, None));
        } else {
            let with = |&tracer| Job::new(arguments, reference, preset, Some(tracer));
            jobs.extend(tracers.iter().map(with));
        }
    }
    jobs
}

/// The finished rows of a folder.
struct Rows {
    folder: PathBuf,
    /// By the name of their job.
    rows: BTreeMap<String, Value>,
}

impl Rows {
    const FILE: &str = "rows.jsonl";

    fn read(folder: &Path) -> Result<Self, String> {
        let path = folder.join(Self::FILE);
        let text = match std::fs::read_to_string(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            text => text.map_err(|error| format!("{}: {error}", path.display()))?,
        };
        let mut rows = BTreeMap::new();
        for (number, line) in (1..).zip(text.lines()) {
            let row: Value =
                serde_json::from_str(line).map_err(|error| format!("{}, line {number}: {error}", path.display()))?;
            rows.insert(row["name"].as_str().unwrap_or_default().to_owned(), row);
        }
        Ok(Self {
            folder: folder.to_owned(),
            rows,
        })
    }

    /// Where the image of a job is kept.
    fn image(&self, job: &Job<'_>) -> PathBuf {
        self.folder.join(format!("{}.exr", job.name()))
    }

    /// A row that need not be rendered again.
    fn find(&self, job: &Job<'_>, gpu: &Gpu) -> Option<&Value> {
        self.rows.get(&job.name()).filter(|row| {
            row["adapter"] == gpu.describe() && row["size"] == json!(job.size) && self.image(job).exists()
        })
    }

    /// Keeps a row in place of an older one of the same job. The file is replaced as a whole: there is never a part of a
    /// line in it.
    fn insert(&mut self, job: &Job<'_>, row: Value) -> Result<(), String> {
        self.rows.insert(job.name(), row);
        let lines: String = self.rows.values().map(|row| format!("{row}\n")).collect();
        exr_file::replace_file(&self.folder.join(Self::FILE), lines.as_bytes())
    }
}

/// Renders an image, puts it into a file, and returns its row, without figures yet.
fn rendered(gpu: &Gpu, job: &Job<'_>, path: &Path, bar: &ProgressBar) -> Result<Value, String> {
    // What a row that failed has left is not this one's.
    gpu.take_errors();
    let scene = gltf_scene::load(&job.reference.scene_path, 0.0)?;
    if scene.cameras.is_empty() {
        return Err(format!("{}: has no camera", job.reference.scene_path.display()));
    }
    let rendering = render(gpu, scene, job, &|frame, frames| {
        if frames > 1 {
            bar.set_message(format!("{}, frame {frame} of {frames}", job.name()));
        }
    })?;
    exr_file::write_rgb(path, job.size[0], job.size[1], &rendering.pixels)?;
    Ok(job.row(json!({
        "adapter": gpu.describe(),
        "frames": rendering.frames,
        "frame_ms": rendering.frame_ms,
        "clock": rendering.clock,
        "simplifications": rendering.simplifications,
    })))
}

/// What [`render`] gives.
struct Rendering {
    pixels: Vec<[f32; 3]>,
    /// How many were accumulated.
    frames: u32,
    /// Median time of a frame in the steady state.
    frame_ms: f64,
    /// What it was taken with, "gpu" or "wall".
    clock: &'static str,
    /// What the scene has that the preset does not model.
    simplifications: Vec<String>,
}

/// Features that a preset needs of the device.
fn required_features() -> lightfall::wgpu::Features {
    PRESETS
        .iter()
        .filter_map(|preset| Settings::preset(preset))
        .map(|settings| GiRenderer::required_features(&settings))
        .fold(Default::default(), |all, features| all | features)
}

/// Renders a scene as its first camera sees it. `on_frame` is told the number of each frame, from 1, and of how many.
fn render(gpu: &Gpu, scene: Scene, job: &Job<'_>, on_frame: &dyn Fn(u32, u32)) -> Result<Rendering, String> {
    match Settings::preset(job.preset) {
        Some(settings) => render_frames(gpu, scene, settings, job, on_frame),
        None if job.preset == reference::PRESET => trace_paths(gpu, scene, job, on_frame),
        None => Err(format!("there is no preset {:?}", job.preset)),
    }
}

fn render_frames(
    gpu: &Gpu,
    scene: Scene,
    preset: Settings,
    job: &Job<'_>,
    on_frame: &dyn Fn(u32, u32),
) -> Result<Rendering, String> {
    let mut settings = Settings {
        bounces: job.bounces,
        frames: job.frames.unwrap_or(preset.frames),
        ..preset
    };
    if let Some(tracer) = job.tracer {
        settings.set(TRACER_KIND, tracer).map_err(|error| error.to_string())?;
    }
    settings.validate().map_err(|error| error.to_string())?;
    let (_, component) = job.reference.component;
    let mut offline = Offline::new(gpu, scene, &settings, 0, job.size, component).map_err(|error| error.to_string())?;
    let mut clock = Clock::new(gpu);
    for frame in 1..=settings.frames {
        on_frame(frame, settings.frames);
        clock.frame(gpu, &mut offline)?;
    }
    let pixels = offline.read().map_err(|error| error.to_string())?;
    clock.settle(gpu, &mut offline)?;
    gpu.check()?;
    let simplifications = offline.renderer.plan().map(|plan| plan.simplifications.clone());
    Ok(Rendering {
        pixels,
        frames: settings.frames,
        frame_ms: clock.frame_ms()[0],
        clock: clock.kind(),
        simplifications: simplifications.unwrap_or_default(),
    })
}

fn trace_paths(gpu: &Gpu, scene: Scene, job: &Job<'_>, on_frame: &dyn Fn(u32, u32)) -> Result<Rendering, String> {
    let settings = PathTracerSettings {
        component: match job.reference.component.1 {
            Component::All => PathComponent::All,
            Component::Direct => PathComponent::Direct,
            Component::Indirect => PathComponent::Indirect,
            Component::Caustic => PathComponent::Caustic,
            Component::Specular => PathComponent::Specular,
        },
        bounces: job.bounces,
        ..Default::default()
    };
    let summary = SceneSummary::of(&scene).map_err(|error| error.to_string())?;
    let samples = job.frames.unwrap_or(reference::SAMPLES);
    let mut traced = PathTraced::new(gpu, scene, &settings, 0, job.size).map_err(|error| error.to_string())?;
    let mut clock = Clock::new(gpu);
    for sample in 1..=samples {
        on_frame(sample, samples);
        clock.time(gpu, |timestamps| traced.render_sample(timestamps))?;
    }
    let pixels = traced.read().map_err(|error| error.to_string())?.mean;
    // The first one does not count.
    for _ in samples..4 {
        clock.time(gpu, |timestamps| traced.render_sample(timestamps))?;
    }
    gpu.check()?;
    let is_specular = !summary.metals.is_empty() || !summary.dielectrics.is_empty();
    let missing = "caustics of lights without extent are not found".to_owned();
    Ok(Rendering {
        pixels,
        frames: samples,
        frame_ms: clock.frame_ms()[0],
        clock: clock.kind(),
        simplifications: (is_specular && summary.lights > 0)
            .then_some(missing)
            .into_iter()
            .collect(),
    })
}

/// "fast 0.0589 -9.0%", or "fast, hybrid 0.0589": what there is room for on the contact sheet.
fn label(job: &Job<'_>, row: &Value) -> String {
    let (title, figures) = (job.title(), &row["figures"]);
    match (figures["relmse"].as_f64(), figures["bias"].as_f64()) {
        (Some(relmse), Some(_)) if job.tracer.is_some() => format!("{title} {}", short(relmse)),
        (Some(relmse), Some(bias)) => format!("{title} {} {:+.1}%", short(relmse), 100.0 * bias),
        _ => format!("{title} not finite"),
    }
}

/// The table, with what it was made with above it. `rows` come with their [`Job::title`].
fn markdown(arguments: &Arguments, gpu: &Gpu, rows: &[(String, Value)]) -> String {
    let mut sizes: Vec<String> = rows
        .iter()
        .map(|(_, row)| format!("{} × {}", row["size"][0], row["size"][1]))
        .collect();
    sizes.sort();
    sizes.dedup();
    let mut text = format!(
        "Adapter: {}. Size: {}. Time: median of a frame in the steady state, by GPU timestamps unless marked.\n\n\
        ```sh\n{}\n```\n\n",
        gpu.describe(),
        sizes.join(", "),
        command(arguments)
    );
    text += "| scene | preset | frames | component | relMSE | near edges | interior | mixed | energy bias | red, green, \
        blue | RMSE | reference's noise | time per frame | simplified |\n";
    text += "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    for (title, row) in rows {
        // Writing to a string does not fail.
        let _ = writeln!(text, "| {} |", cells(title, row).join(" | "));
    }
    text
}

fn cells(title: &str, row: &Value) -> Vec<String> {
    let word = |name: &str| row[name].as_str().unwrap_or_default().to_owned();
    let mut cells = vec![
        word("scene"),
        title.to_owned(),
        row["frames"].to_string(),
        word("component"),
    ];
    if let Some(problem) = row["failed"].as_str() {
        cells[2].clear();
        cells.push(format!("failed: {}", problem.replace('|', "/")));
        cells.resize(14, String::new());
        return cells;
    }
    let figures = &row["figures"];
    let figure = |name: &str| match &figures[name] {
        // Nothing of that kind in the image, which is not the same as not being finite.
        Value::Null if figures["finite"] == true => String::new(),
        value => value.as_f64().map_or("not finite".to_owned(), short),
    };
    let percent = |value: &Value| {
        value
            .as_f64()
            .map_or("not finite".to_owned(), |v| format!("{:+.2}", 100.0 * v))
    };
    let notes: Vec<&str> = row["simplifications"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_str)
        .collect();
    cells.extend(["relmse", "relmse_edge", "relmse_interior", "relmse_mixed"].map(figure));
    cells.push(format!("{} %", percent(&figures["bias"])));
    cells.push(
        [0, 1, 2]
            .map(|channel| percent(&figures["bias_rgb"][channel]))
            .join(", "),
    );
    cells.extend(["rmse", "truth_noise"].map(figure));
    let clock = if row["clock"] == "gpu" { "" } else { " (wall)" };
    let frame_ms = row["frame_ms"].as_f64().unwrap_or_default();
    cells.push(format!("{} ms{clock}", short(frame_ms)));
    cells.push(notes.join("; ").replace('|', "/"));
    cells
}

/// Enough digits to compare rows by.
fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        size if size >= 100.0 => format!("{value:.0}"),
        size if size >= 1.0 => format!("{value:.1}"),
        size if size >= 1e-3 => format!("{value:.4}"),
        _ => format!("{value:.1e}"),
    }
}

/// What makes the same table elsewhere.
fn command(arguments: &Arguments) -> String {
    let mut command = "cargo run --release --example accuracy -- SCENES TRUTH".to_owned();
    for (option, names) in [
        ("presets", &arguments.presets),
        ("tracers", &arguments.tracers),
        ("scenes", &arguments.scenes),
        ("components", &arguments.components),
        ("unpictured", &arguments.unpictured),
    ] {
        if !names.is_empty() {
            command += &format!(" --{option} {}", names.join(","));
        }
    }
    command += &format!(" --bounces {}", arguments.bounces);
    if let Some(frames) = arguments.frames {
        command += &format!(" --frames {frames}");
    }
    command
}

fn write(arguments: &Arguments, table: &str, sheet: &[u8]) -> Result<(), String> {
    print!("{table}");
    exr_file::replace_file(&arguments.out.join("table.md"), table.as_bytes())?;
    exr_file::replace_file(&arguments.out.join("sheet.png"), sheet)?;
    if let Some(docs) = &arguments.docs {
        let page = with_table(docs, table)?;
        exr_file::replace_file(&docs.join("accuracy.md"), page.as_bytes())?;
        exr_file::replace_file(&docs.join("accuracy.png"), sheet)?;
    }
    Ok(())
}

/// The page `accuracy.md` with a table between its markers.
fn with_table(docs: &Path, table: &str) -> Result<String, String> {
    let path = docs.join("accuracy.md");
    let page = std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let parts = page
        .split_once(TABLE_BEGIN)
        .and_then(|(before, rest)| rest.split_once(TABLE_END).map(|(_, after)| (before, after)));
    let (before, after) =
        parts.ok_or_else(|| format!("{}: expected {TABLE_BEGIN} and {TABLE_END} after it", path.display()))?;
    Ok(format!("{before}{TABLE_BEGIN}\n\n{table}\n{TABLE_END}{after}"))
}
