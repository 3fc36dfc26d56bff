//! A moving object over many frames: does light flicker where nothing moves?
//!
//! ```text
//! cargo run --release --example flicker -- sample:pillars --frames 300
//! ```
//!
//! Every tracer renders the indirect light of the same frames, one by one and without accumulation, as in real time:
//! the random sequence stands still, and the renderer is told before each frame that geometry has changed. What counts
//! is the luminance of pixels where nothing moves, and beside which nothing moves, in any frame.
//!
//! Light truly changes there too while an object moves, but smoothly; flicker is what is not smooth. The columns of the
//! table, relative to the mean radiance of all pixels and frames of the same tracer:
//!
//! - temporal variance: the variance of a pixel over the frames, mean over pixels, over the squared mean radiance. True
//!   changes are part of it.
//! - flicker: the squared second difference (x₋₁ − 2 x₀ + x₊₁)² / 6, mean over pixels and frames, over the squared mean
//!   radiance. White noise of some variance gives that variance; slow changes give nothing.
//! - largest step: the largest change of a pixel from one frame to the next, over the mean radiance; of a thousand
//!   pixels, one has a larger one.
//!
//! The last two columns are the first two over those of `bvh`, which loses no light and has no environment maps that
//! could jump.

mod common;

use clap::Parser;
use common::adapter::{Gpu, Wishes};
use common::offline::{Component, Offline};
use common::{arguments, named_scene, progress};
use indicatif::ProgressBar;
use lightfall::frame::{GiRenderer, Settings, TracerKind};
use lightfall::scene::{Instance, Light, Material, Scene};

/// Tracers that are compared if the command line names none.
const TRACERS: [&str; 3] = ["image-space", "hybrid", "bvh"];
/// The tracer that the others are measured by.
const BASELINE: &str = "bvh";
/// Share of the static pixels whose largest step is at most the one reported.
const STEP_QUANTILE: f64 = 0.999;

/// Measures how much indirect light flickers where nothing moves.
#[derive(Parser)]
struct Arguments {
    /// A .glb or .gltf file, or sample:NAME
    scene: String,
    /// How many frames, at least 3
    #[arg(long, default_value_t = 300, value_parser = clap::value_parser!(u32).range(3..))]
    frames: u32,
    /// Seconds of the scene's time that the frames are spread over
    #[arg(long, default_value_t = 4.0)]
    seconds: f64,
    /// Width and height in pixels
    #[arg(long, default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..=8192))]
    size: u32,
    /// fast, balanced, accurate; frames are not accumulated
    #[arg(long, default_value = "balanced")]
    preset: String,
    /// How photons find what they hit: image-space, hybrid, bvh; with :METHOD behind it, as in bvh:surface-lights, how light
    /// comes to pixels
    #[arg(long, value_delimiter = ',', default_values = TRACERS)]
    tracers: Vec<String>,
    /// Any field of Settings but frames and tracer.kind, repeatable; an unknown key lists them all
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// What moves is told apart by every Nth frame, between which nothing may move by more than a pixel
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    still_every: u32,
    /// Part of the adapter's name or backend (default: a discrete GPU, software last)
    #[arg(long)]
    adapter: Option<String>,
}

fn main() {
    let arguments: Arguments = arguments::parse("flicker");
    if let Err(message) = run(&arguments) {
        eprintln!("flicker: {message}");
        std::process::exit(2);
    }
}

/// Measures every tracer and prints the table.
fn run(arguments: &Arguments) -> Result<(), String> {
    let settings = settings(arguments)?;
    let tracers = with_tracers(&settings, &arguments.tracers)?;
    let motion = Motion::load(arguments)?;
    let wishes = Wishes {
        features: GiRenderer::required_features(&settings),
        large_buffers: true,
        ..Wishes::default()
    };
    let gpu = Gpu::open(arguments.adapter.as_deref(), wishes)?;
    let glowing = motion.with_glowing_still_parts(arguments.still_every as usize);
    let player = Player {
        gpu: &gpu,
        side: arguments.size,
        bar: progress::bar((glowing.moments.len() + tracers.len() * motion.moments.len()) as u64),
    };
    let is_static = player.static_pixels(&glowing)?;
    let mut rows = Vec::new();
    for (tracer, settings) in &tracers {
        let histories = player.histories(&motion, settings)?;
        let unsteadiness =
            Unsteadiness::of(&histories, &is_static).map_err(|problem| format!("{tracer}: {problem}"))?;
        rows.push((*tracer, unsteadiness));
    }
    player.bar.finish_and_clear();
    print_conditions(arguments, &gpu, &is_static);
    print_table(&rows);
    Ok(())
}

/// The settings that all tracers share; one frame makes an image.
fn settings(arguments: &Arguments) -> Result<Settings, String> {
    let mut settings = Settings::preset(&arguments.preset)
        .ok_or_else(|| format!("--preset {:?}: expected fast, balanced or accurate", arguments.preset))?;
    for pair in &arguments.set {
        let (key, value) = arguments::key_and_value(pair)?;
        if ["frames", "tracer.kind"].contains(&key) {
            return Err(format!(
                "--set {key}: not here; frames are not accumulated, and --tracers names tracers"
            ));
        }
        settings.set(key, value).map_err(|error| error.to_string())?;
    }
    settings.frames = 1;
    Ok(settings)
}

/// The settings of each tracer, beside its name.
fn with_tracers<'a>(settings: &Settings, names: &'a [String]) -> Result<Vec<(&'a str, Settings)>, String> {
    let with_tracer = |name: &'a String| {
        let mut settings = settings.clone();
        let (tracer, method) = name.split_once(':').unzip();
        let mut set = |key, value| settings.set(key, value).map_err(|error| format!("--tracers: {error}"));
        set("tracer.kind", tracer.unwrap_or(name))?;
        method.map(|method| set("indirect.method", method)).transpose()?;
        Ok((name.as_str(), settings))
    };
    names.iter().map(with_tracer).collect()
}

/// Prints what was rendered, and with what.
fn print_conditions(arguments: &Arguments, gpu: &Gpu, is_static: &[bool]) {
    let static_count = is_static.iter().filter(|&&is_static| is_static).count();
    let changes: String = arguments.set.iter().map(|pair| format!(", {pair}")).collect();
    println!("{}, {}", arguments.scene, gpu.describe());
    println!(
        "\n{side} × {side} pixels, {:.1} % of them static; {} frames over {} s; preset {}{changes}.\n",
        100.0 * static_count as f64 / is_static.len() as f64,
        arguments.frames,
        arguments.seconds,
        arguments.preset,
        side = arguments.size,
    );
}

/// Prints a line for each tracer.
fn print_table(rows: &[(&str, Unsteadiness)]) {
    let baseline = rows.iter().find(|(tracer, _)| *tracer == BASELINE).map(|row| &row.1);
    println!(
        "| tracer | temporal variance | flicker | largest step, {} % | variance over {BASELINE} \
        | flicker over {BASELINE} |",
        100.0 * STEP_QUANTILE
    );
    println!("|---|---|---|---|---|---|");
    for (tracer, own) in rows {
        println!(
            "| {tracer} | {:.3e} | {:.3e} | {:.4} | {} | {} |",
            own.variance,
            own.flicker,
            own.largest_step,
            ratio(own.variance, baseline.map(|other| other.variance)),
            ratio(own.flicker, baseline.map(|other| other.flicker)),
        );
    }
}

/// How many times the baseline a value is; a dash where there is no baseline, or it is zero.
fn ratio(value: f64, baseline: Option<f64>) -> String {
    match baseline {
        Some(baseline) if baseline > 0.0 => format!("{:.2}", value / baseline),
        _ => "–".into(),
    }
}

/// A scene in motion, of which only what moves is kept for every frame.
struct Motion {
    /// The scene at time 0.
    first: Scene,
    /// One for each frame, in order; never empty.
    moments: Vec<Moment>,
}

/// What of a scene may differ from frame to frame.
struct Moment {
    /// In place of the scene's own, in the same order.
    instances: Vec<Instance>,
    /// In place of the scene's own.
    lights: Vec<Light>,
}

impl Motion {
    /// Loads the scene at the times of all frames. The first is at time 0; the end of the time span is not among them,
    /// so that the frames of a whole cycle could follow each other for ever.
    ///
    /// # Errors
    /// One line for a scene that cannot be loaded, has no camera or a moving one, and for a time span that is not
    /// positive.
    fn load(arguments: &Arguments) -> Result<Self, String> {
        let (name, seconds) = (&arguments.scene, arguments.seconds);
        if !seconds.is_finite() || seconds <= 0.0 {
            return Err(format!("--seconds {seconds}: expected a number above 0"));
        }
        let interval = seconds / f64::from(arguments.frames);
        let first = named_scene::load(name, 0.0)?;
        if first.cameras.is_empty() {
            return Err(format!("{name}: has no camera"));
        }
        let mut moments = Vec::new();
        for frame in 0..arguments.frames {
            let now = named_scene::load(name, interval * f64::from(frame))?;
            if now.cameras.first() != first.cameras.first() {
                return Err(format!("{name}: its camera moves, hence so does all that it sees"));
            }
            moments.push(Moment {
                instances: now.instances,
                lights: now.lights,
            });
        }
        Ok(Self { first, moments })
    }

    /// The scene in a frame, counted from 0.
    fn at(&self, frame: usize) -> Scene {
        let moment = &self.moments[frame];
        Scene {
            instances: moment.instances.clone(),
            lights: moment.lights.clone(),
            ..self.first.clone()
        }
    }

    /// Whether each instance is ever elsewhere than at time 0.
    fn moving_instances(&self) -> Vec<bool> {
        let mut moves = vec![false; self.first.instances.len()];
        for moment in &self.moments {
            let pairs = moment.instances.iter().zip(&self.first.instances);
            for (moves, (now, first)) in moves.iter_mut().zip(pairs) {
                *moves |= now.transform != first.transform;
            }
        }
        moves
    }

    /// Every so many frames of the same motion, without lights; what never moves emits a radiance of 1 W/m²/sr and all
    /// else is dark.
    fn with_glowing_still_parts(&self, every: usize) -> Self {
        let own_materials = &self.first.materials;
        let emitting = |radiance: f32| {
            own_materials.iter().map(move |material| Material {
                emission: [radiance; 3],
                emission_texture: None,
                ..material.clone()
            })
        };
        // The glowing materials, then the dark ones.
        let materials = emitting(1.0).chain(emitting(0.0)).collect();
        let moves = self.moving_instances();
        let mark = |(instance, &moves): (&Instance, &bool)| Instance {
            material: instance.material + if moves { own_materials.len() } else { 0 },
            ..instance.clone()
        };
        let moments = self.moments.iter().step_by(every).map(|moment| Moment {
            instances: moment.instances.iter().zip(&moves).map(mark).collect(),
            lights: Vec::new(),
        });
        Self {
            moments: moments.collect(),
            first: Scene {
                materials,
                ..self.first.clone()
            },
        }
    }
}

/// Renders motions frame by frame.
struct Player<'a> {
    /// Where they are rendered.
    gpu: &'a Gpu,
    /// Pixels along each side of the image.
    side: u32,
    /// Moves on with each frame.
    bar: ProgressBar,
}

impl Player<'_> {
    /// Renders all frames and hands on the luminance of the pixels of each, W/m²/sr, row by row from the top.
    fn play(
        &self,
        motion: &Motion,
        settings: &Settings,
        component: Component,
        mut see: impl FnMut(&[f64]),
    ) -> Result<(), String> {
        let mut render = || -> Result<(), lightfall::Error> {
            let size = [self.side; 2];
            let mut offline = Offline::new(self.gpu, motion.at(0), settings, 0, size, component)?;
            for frame in 0..motion.moments.len() {
                offline.set_scene(motion.at(frame))?;
                offline.render_frame(None)?;
                let pixels: Vec<f64> = offline.read()?.into_iter().map(luminance).collect();
                see(&pixels);
                self.bar.inc(1);
            }
            Ok(())
        };
        render().map_err(|error| error.to_string())?;
        self.gpu.check()
    }

    /// Whether a pixel and its eight neighbours see nothing but still surfaces in all frames of a motion in which only
    /// still surfaces glow.
    ///
    /// Depth and colour in a G-buffer would not do: they stay the same where an object slides along a plane of its
    /// own. Nor would direct light: it is as black on an object that moves in the shade as on the floor there. Surfaces
    /// do not glow on their backs, so that still ones seen from behind are left out, which only makes the region
    /// smaller; the sky is left out too. No photon is traced for it, so that it is the same for all tracers.
    ///
    /// # Errors
    /// One line if rendering fails or there is no such pixel.
    fn static_pixels(&self, glowing: &Motion) -> Result<Vec<bool>, String> {
        // The tracer that asks for no places of environment maps; without lights it does not run.
        let settings = Settings {
            tracer_kind: TracerKind::Bvh,
            ..Settings::fast()
        };
        let side = self.side as usize;
        let mut is_still = vec![true; side * side];
        self.play(glowing, &settings, Component::Direct, |pixels| {
            for (is_still, &radiance) in is_still.iter_mut().zip(pixels) {
                *is_still &= radiance > 0.5;
            }
        })?;
        let is_static = without_border(&is_still, side);
        if is_static.contains(&true) {
            Ok(is_static)
        } else {
            Err("no pixel sees the front of a still surface in all frames".into())
        }
    }

    /// How the indirect light of each pixel goes on, row by row from the top.
    fn histories(&self, motion: &Motion, settings: &Settings) -> Result<Vec<History>, String> {
        let side = self.side as usize;
        let mut histories = vec![History::default(); side * side];
        self.play(motion, settings, Component::Indirect, |pixels| {
            for (history, &value) in histories.iter_mut().zip(pixels) {
                history.add(value);
            }
        })?;
        Ok(histories)
    }
}

/// Luminance of linear RGB with the primaries of sRGB, in the unit of its channels.
fn luminance([red, green, blue]: [f32; 3]) -> f64 {
    0.2126 * f64::from(red) + 0.7152 * f64::from(green) + 0.0722 * f64::from(blue)
}

/// The pixels of a square mask whose neighbours inside the image are all in the mask as well.
fn without_border(mask: &[bool], side: usize) -> Vec<bool> {
    let around = |at: usize| at.saturating_sub(1)..=(at + 1).min(side - 1);
    let is_inside = |pixel: usize| {
        let (x, y) = (pixel % side, pixel / side);
        around(y).all(|y| around(x).all(|x| mask[y * side + x]))
    };
    (0..mask.len()).map(is_inside).collect()
}

/// What is kept of a pixel's luminance over the frames.
#[derive(Clone, Default)]
struct History {
    /// How many frames there have been.
    frames: u32,
    /// Mean of the frames, W/m²/sr.
    mean: f64,
    /// Sum of the squared differences from the mean.
    squared_differences: f64,
    /// Sum of the squared second differences of successive frames.
    squared_bends: f64,
    /// Largest change from one frame to the next, W/m²/sr.
    largest_step: f64,
    /// The last two frames, the older one first, W/m²/sr.
    last: [f64; 2],
}

impl History {
    /// Takes the next frame.
    fn add(&mut self, value: f64) {
        let [older, newer] = self.last;
        if self.frames >= 1 {
            self.largest_step = self.largest_step.max((value - newer).abs());
        }
        if self.frames >= 2 {
            self.squared_bends += (older - 2.0 * newer + value).powi(2);
        }
        self.last = [newer, value];
        self.frames += 1;
        // Welford's update: sums of squares would cancel.
        let difference = value - self.mean;
        self.mean += difference / f64::from(self.frames);
        self.squared_differences += difference * (value - self.mean);
    }

    /// Variance over the frames, of which there are at least two.
    fn variance(&self) -> f64 {
        self.squared_differences / f64::from(self.frames - 1)
    }

    /// Mean squared second difference over 6, which is the variance of white noise; of at least three frames.
    fn flicker(&self) -> f64 {
        self.squared_bends / (6.0 * f64::from(self.frames - 2))
    }
}

/// How unsteady light is where nothing moves.
struct Unsteadiness {
    /// Mean variance of a pixel, over the squared mean radiance.
    variance: f64,
    /// Mean flicker of a pixel, over the squared mean radiance.
    flicker: f64,
    /// Quantile of the pixels' largest steps, over the mean radiance.
    largest_step: f64,
}

impl Unsteadiness {
    /// Of the static pixels, of which there is at least one; relative to the mean of all pixels.
    ///
    /// # Errors
    /// One line if there is no light, or an image was not finite.
    fn of(histories: &[History], is_static: &[bool]) -> Result<Self, String> {
        let radiance = mean(histories.iter().map(|history| history.mean));
        if !radiance.is_finite() {
            return Err("an image is not finite".into());
        }
        if radiance <= 0.0 {
            return Err("there is no indirect light".into());
        }
        let static_ones = || {
            let pairs = histories.iter().zip(is_static);
            pairs.filter(|&(_, &is_static)| is_static).map(|(history, _)| history)
        };
        let steps = static_ones().map(|history| history.largest_step).collect();
        Ok(Self {
            variance: mean(static_ones().map(History::variance)) / radiance.powi(2),
            flicker: mean(static_ones().map(History::flicker)) / radiance.powi(2),
            largest_step: quantile(steps, STEP_QUANTILE) / radiance,
        })
    }
}

/// Arithmetic mean; not a number if there are no values.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / count
}

/// The value that this share of the values does not exceed; there is at least one.
fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[(share * (values.len() - 1) as f64).round() as usize]
}
