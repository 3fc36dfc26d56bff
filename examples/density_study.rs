//! What density estimation costs and how far off it is: shapes, numbers of photons, accumulated frames, up-sampling and
//! blending, as tables of `docs/density.md`.
//!
//! ```text
//! cargo run --release --example density_study -- cornell_point.glb cornell_point.indirect.exr --tables shapes,frames
//! ```
//!
//! Photons are traced against triangles, so that tracing errors are told apart. Pictures larger than the reference are
//! compared by the mean of the pixels that fall on one of the reference's. *Estimate* is the wall-clock time of density
//! estimation and up-sampling alone, submitted by themselves; *frame* that of everything.

mod common;

use clap::{Parser, ValueEnum};
use common::adapter::{Gpu, Wishes};
use common::clock::{Clock, median};
use common::offline::{Component, Offline, wait};
use common::reference::Reference;
use common::{arguments, gltf_scene, truth_file};
use lightfall::frame::{GlossyMethod, Settings, TracerKind, Upsampling};
use lightfall::pass::{
    Bandwidth, BoundaryCorrection, MarkedSplatInputs, PhotonSplatter, PhotonSplatterInputs, PhotonSplatterResources,
    SplatShape, Upsampler, UpsamplerInputs, UpsamplerResources,
};
use lightfall::reference::metrics::{self, Comparison, Image, Truth};
use lightfall::reference::{PathComponent, PathTracerSettings};
use lightfall::resource::{Irradiance, MarkedPixels, Subsampling};
use lightfall::scene::{Material, Scene, SceneSummary};
use lightfall::wgpu;
use std::path::PathBuf;
use std::time::Instant;

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Table {
    /// Tiles, quads and volumes by photons and size
    Shapes,
    /// Numbers of photons
    Photons,
    /// Error by accumulated frames, with and without boundary correction
    Frames,
    /// Sub-sampling, at once and by levels
    Upsampling,
    /// Sixteen-bit sums against f32
    Blending,
    /// A scene's floor, if one is named so, with a Phong lobe: radii that are fixed against such that vary
    Glossy,
}

/// Prints tables about density estimation.
#[derive(Parser)]
struct Arguments {
    /// A .glb file
    scene: PathBuf,
    /// Its indirect light, .exr
    truth: PathBuf,
    /// Which tables
    #[arg(long, value_delimiter = ',', default_values = ["shapes", "photons", "frames", "upsampling", "blending"])]
    tables: Vec<Table>,
    /// Pixels along an axis, multiples of the reference's
    #[arg(long, value_delimiter = ',', default_values_t = [256, 512, 1024])]
    sizes: Vec<u32>,
    /// Most frames to accumulate
    #[arg(long, default_value_t = 64)]
    frames: u32,
    /// Surfaces that light scatters at before the one the eye sees
    #[arg(long, default_value_t = 3)]
    bounces: u32,
    /// Part of the adapter's name or backend
    #[arg(long)]
    adapter: Option<String>,
}

fn main() {
    let arguments: Arguments = arguments::parse("density_study");
    if let Err(message) = Study::new(&arguments).and_then(|study| study.run()) {
        eprintln!("density_study: {message}");
        std::process::exit(2);
    }
}

struct Study<'a> {
    arguments: &'a Arguments,
    gpu: Gpu,
    scene: Scene,
    truth: Truth,
}

/// What a configuration gives.
struct Outcome {
    error: Comparison,
    estimate_ms: f64,
    frame_ms: f64,
    /// Share of each level's pixels that was estimated anew.
    reestimated: Vec<f64>,
    pixels: Vec<[f32; 3]>,
}

impl<'a> Study<'a> {
    fn new(arguments: &'a Arguments) -> Result<Self, String> {
        let wishes = Wishes {
            timestamps: true,
            large_buffers: true,
            ..Default::default()
        };
        let gpu = Gpu::open(arguments.adapter.as_deref(), wishes)?;
        println!("Adapter: {}.\n", gpu.describe());
        Ok(Self {
            arguments,
            gpu,
            scene: gltf_scene::load(&arguments.scene, 0.0)?,
            truth: truth_file::read_truth(&arguments.truth)?,
        })
    }

    fn run(&self) -> Result<(), String> {
        for table in &self.arguments.tables {
            match table {
                Table::Shapes => self.shapes()?,
                Table::Photons => self.photons()?,
                Table::Frames => self.frames()?,
                Table::Upsampling => self.upsampling()?,
                Table::Blending => self.blending()?,
                Table::Glossy => self.glossy()?,
            }
            println!();
        }
        self.gpu.check()
    }

    /// One frame of `photons` photons with `under_kernel` of them under a kernel, a sixteenth of the pixels estimated.
    fn settings(&self, photons: u32, under_kernel: f32) -> Settings {
        let mut settings = Settings {
            photons,
            bounces: self.arguments.bounces,
            tracer_kind: TracerKind::Bvh,
            subsampling: Subsampling::Quarter,
            upsampling: Upsampling::AtOnce,
            ..Settings::balanced()
        };
        settings.splatter.bandwidth = Bandwidth::Density {
            photons: under_kernel,
            clamp: [0.25, 1.0],
        };
        settings
    }

    fn shapes(&self) -> Result<(), String> {
        println!("| size | photons | shape | estimate | frame | relMSE | bias |\n|---|---|---|---|---|---|---|");
        let shapes = [SplatShape::Tiled, SplatShape::Quads, SplatShape::Volumes];
        for &size in &self.arguments.sizes {
            for photons in [10_000, 30_000, 100_000, 300_000] {
                for shape in shapes {
                    let mut settings = self.settings(photons, 150.0);
                    settings.splatter_config.shape = shape;
                    let found = self.render(&settings, size, true)?;
                    println!(
                        "| {size}² | {photons} | {shape:?} | {:.0} ms | {:.0} ms | {:.4} | {:+.1} % |",
                        found.estimate_ms,
                        found.frame_ms,
                        found.error.relmse,
                        100.0 * found.error.bias
                    );
                }
            }
        }
        Ok(())
    }

    fn photons(&self) -> Result<(), String> {
        println!("| photons | under a kernel | estimate | frame | relMSE | interior | near edges |");
        println!("|---|---|---|---|---|---|---|");
        for (photons, under_kernel) in [(7_700, 60.0), (35_000, 120.0), (75_000, 200.0), (459_000, 600.0)] {
            let found = self.render(&self.settings(photons, under_kernel), self.truth.image.width, true)?;
            let (edge, interior) = zones(&found.error);
            println!(
                "| {photons} | {under_kernel} | {:.0} ms | {:.0} ms | {:.4} | {interior:.4} | {edge:.4} |",
                found.estimate_ms, found.frame_ms, found.error.relmse
            );
        }
        Ok(())
    }

    fn frames(&self) -> Result<(), String> {
        println!("| correction | frames | relMSE | interior | near edges | bias |\n|---|---|---|---|---|---|");
        for boundary in [BoundaryCorrection::KernelArea, BoundaryCorrection::Off] {
            let mut settings = Settings {
                frames: self.arguments.frames,
                bounces: self.arguments.bounces,
                tracer_kind: TracerKind::Bvh,
                ..Settings::accurate()
            };
            settings.splatter.boundary = boundary;
            let mut points: Vec<[f64; 4]> = Vec::new();
            let mut offline = self.offline(&settings, self.truth.image.width)?;
            for frame in 1..=self.arguments.frames {
                offline.render_frame(None).map_err(|e| e.to_string())?;
                if !frame.is_power_of_two() {
                    continue;
                }
                let error = self.compare(&offline.read().map_err(|e| e.to_string())?, self.truth.image.width)?;
                let (edge, interior) = zones(&error);
                println!(
                    "| {boundary:?} | {frame} | {:.5} | {interior:.5} | {edge:.5} | {:+.2} % |",
                    error.relmse,
                    100.0 * error.bias
                );
                points.push([f64::from(frame), error.relmse, interior, edge].map(f64::ln));
            }
            let [all, interior, edge] = [1, 2, 3].map(|column| slope(&points, column));
            println!("| {boundary:?} | slope | {all:.2} | {interior:.2} | {edge:.2} | |");
        }
        Ok(())
    }

    fn upsampling(&self) -> Result<(), String> {
        println!("| size | sub-sampling | levels | estimated anew | estimate | frame | relMSE | near edges |");
        println!("|---|---|---|---|---|---|---|---|");
        for &size in &self.arguments.sizes {
            for subsampling in [
                Subsampling::Full,
                Subsampling::Half,
                Subsampling::Quarter,
                Subsampling::Eighth,
            ] {
                for upsampling in [Upsampling::AtOnce, Upsampling::ByLevels] {
                    if subsampling == Subsampling::Full && upsampling == Upsampling::ByLevels {
                        continue;
                    }
                    let settings = Settings {
                        bounces: self.arguments.bounces,
                        tracer_kind: TracerKind::Bvh,
                        subsampling,
                        upsampling,
                        ..Settings::balanced()
                    };
                    let found = self.render(&settings, size, true)?;
                    let shares: Vec<_> = found
                        .reestimated
                        .iter()
                        .map(|s| format!("{:.1} %", 100.0 * s))
                        .collect();
                    println!(
                        "| {size}² | {subsampling:?} | {upsampling:?} | {} | {:.0} ms | {:.0} ms | {:.5} | {:.5} |",
                        shares.join(", "),
                        found.estimate_ms,
                        found.frame_ms,
                        found.error.relmse,
                        zones(&found.error).0
                    );
                }
            }
        }
        Ok(())
    }

    fn blending(&self) -> Result<(), String> {
        println!(
            "| photons | under a kernel | light in 16 bits over f32 | RMS difference, of the mean |\n|---|---|---|---|"
        );
        let size = self.truth.image.width;
        for (photons, under_kernel) in [
            (10_000, 10.0),
            (10_000, 100.0),
            (100_000, 100.0),
            (100_000, 1000.0),
            (600_000, 1000.0),
            (600_000, 6000.0),
        ] {
            let mut settings = self.settings(photons, under_kernel);
            // Else kernels clipped at a rim of the image would tell.
            settings.subsampling = Subsampling::Full;
            let exact = self.render(&settings, size, false)?.pixels;
            settings.splatter_config.shape = SplatShape::Quads;
            let blended = self.render(&settings, size, false)?.pixels;
            let channels = || exact.iter().flatten().zip(blended.iter().flatten());
            let total: f64 = exact.iter().flatten().map(|v| f64::from(*v)).sum();
            let light: f64 = channels().map(|(_, b)| f64::from(*b)).sum();
            let squares: f64 = channels().map(|(a, b)| f64::from(a - b).powi(2)).sum();
            let count = (3 * exact.len()) as f64;
            println!(
                "| {photons} | {under_kernel} | {:.4} | {:.2} % |",
                light / total,
                100.0 * (squares / count).sqrt() / (total / count)
            );
        }
        Ok(())
    }

    /// Yao et al. 2010, section 6: photons on a floor of exponent 100, seen at full resolution, against paths of the eye.
    fn glossy(&self) -> Result<(), String> {
        const SIZE: u32 = 128;
        const SAMPLES: u32 = 1024;
        let mut scene = self.scene.clone();
        let floor = scene.instances.iter().position(|i| i.name == "floor");
        let floor = floor.ok_or("the scene has nothing that is named floor")?;
        scene.instances[floor].material = scene.materials.len();
        scene.materials.push(Material {
            metallic: 1.0,
            phong_exponent: Some(100.0),
            ..Material::diffuse("Phong", [0.7; 3])
        });
        let paths = PathTracerSettings {
            component: PathComponent::Specular,
            bounces: self.arguments.bounces,
            ..Default::default()
        };
        let text = |e: lightfall::Error| e.to_string();
        let mut reference = Reference::new(&self.gpu, scene.clone(), &paths, 0, [SIZE; 2]).map_err(text)?;
        for _ in 0..SAMPLES {
            reference.render_sample(None).map_err(text)?;
        }
        let estimate = reference.read().map_err(text)?;
        let truth = Truth {
            valid: estimate.mean.iter().map(|p| p.iter().any(|&v| v > 0.0)).collect(),
            standard_error: Some(estimate.standard_error),
            ..Truth::new(Image {
                width: SIZE,
                height: SIZE,
                rgb: estimate.mean,
            })
        };
        let mean: f64 = truth.image.rgb.iter().flatten().map(|&v| f64::from(v)).sum();
        let mean = mean / (3 * truth.valid.iter().filter(|valid| **valid).count()) as f64;
        println!("| photons | radius | frame | RMSE over mean | bias |\n|---|---|---|---|---|");
        for photons in [100_000, 400_000] {
            let fixed = [0.02, 0.04, 0.08, 0.16].map(|radius| (format!("fixed, {radius}"), Bandwidth::Fixed(radius)));
            let by_hop = [
                (100.0, 1.0),
                (100.0, 4.0),
                (100.0, 16.0),
                (400.0, 1.0),
                (400.0, 4.0),
                (400.0, 16.0),
            ];
            let by_hop = by_hop.map(|(photons, highest)| {
                let clamp = [1.0 / highest, highest];
                let name = format!("by hop, k = {photons}, p̂ from 1/{highest} to {highest}");
                (name, Bandwidth::Density { photons, clamp })
            });
            for (name, bandwidth) in fixed.into_iter().chain(by_hop) {
                let mut settings = self.settings(photons, 0.0);
                settings.glossy_method = GlossyMethod::Photons;
                settings.splatter.bandwidth = bandwidth;
                let mut offline = Offline::new(&self.gpu, scene.clone(), &settings, 0, [SIZE; 2], Component::Specular)
                    .map_err(text)?;
                let mut clock = Clock::new(&self.gpu);
                for _ in 0..4 {
                    clock.frame(&self.gpu, &mut offline)?;
                }
                let rgb = offline.read().map_err(text)?;
                let image = Image {
                    width: SIZE,
                    height: SIZE,
                    rgb,
                };
                let error = metrics::compare(&image, &truth).map_err(text)?;
                println!(
                    "| {photons} | {name} | {:.0} ms | {:.3} | {:+.1} % |",
                    clock.frame_ms()[0],
                    error.rmse / mean,
                    100.0 * error.bias
                );
            }
        }
        Ok(())
    }

    fn offline(&self, settings: &Settings, size: u32) -> Result<Offline<'_>, String> {
        let scene = self.scene.clone();
        Offline::new(&self.gpu, scene, settings, 0, [size; 2], Component::Indirect).map_err(|e| e.to_string())
    }

    /// One frame, and the times of three more.
    fn render(&self, settings: &Settings, size: u32, is_timed: bool) -> Result<Outcome, String> {
        let mut offline = self.offline(settings, size)?;
        let mut clock = Clock::new(&self.gpu);
        for _ in 0..if is_timed { 4 } else { 1 } {
            clock.frame(&self.gpu, &mut offline)?;
        }
        let pixels = offline.read().map_err(|e| e.to_string())?;
        Ok(Outcome {
            error: self.compare(&pixels, size)?,
            estimate_ms: if is_timed {
                self.estimate_ms(&offline, settings)?
            } else {
                0.0
            },
            frame_ms: clock.frame_ms()[0],
            reestimated: offline.reestimated().map_err(|e| e.to_string())?,
            pixels,
        })
    }

    /// Against the reference, by means over the pixels that fall on one of its own.
    fn compare(&self, pixels: &[[f32; 3]], size: u32) -> Result<Comparison, String> {
        let [width, height] = [self.truth.image.width, self.truth.image.height];
        if width != height || !size.is_multiple_of(width) {
            return Err(format!(
                "--sizes: expected multiples of the reference's {width} × {height} pixels"
            ));
        }
        let factor = size / width;
        let mut rgb = vec![[0f32; 3]; (width * height) as usize];
        for (i, pixel) in (0..).zip(pixels) {
            let (x, y) = (i % size / factor, i / size / factor);
            let mean = &mut rgb[(y * width + x) as usize];
            for (sum, value) in mean.iter_mut().zip(pixel) {
                *sum += value / (factor * factor) as f32;
            }
        }
        let comparison = metrics::compare(&Image { width, height, rgb }, &self.truth).map_err(|e| e.to_string())?;
        if comparison.finite {
            Ok(comparison)
        } else {
            Err("the image is not finite".into())
        }
    }

    /// Median wall-clock time of the estimate and of all levels of up-sampling, by themselves.
    fn estimate_ms(&self, offline: &Offline<'_>, settings: &Settings) -> Result<f64, String> {
        let (Some(photons), Some(frame)) = (offline.renderer.photons(), offline.renderer.frame()) else {
            return Err("the scene has no indirect light".into());
        };
        let Gpu { device, queue, .. } = &self.gpu;
        let text = |e: lightfall::Error| e.to_string();
        let g_buffer = offline.view.g_buffer();
        let pass = PhotonSplatter::new(device, &settings.splatter_config).map_err(text)?;
        let upsampler = Upsampler::new(device);
        let format = wgpu::TextureFormat::Rgba32Float;
        let irradiance = |s: Subsampling| Irradiance::new(device, s.size(g_buffer.size()), format).map_err(text);
        let estimated = irradiance(settings.subsampling)?;
        let mut own =
            PhotonSplatterResources::new(device, &settings.splatter_config, photons, estimated.size()).map_err(text)?;
        let mut levels = Vec::new();
        let mut finer = settings.subsampling.finer();
        while let Some(target) = finer {
            finer = target.finer();
            let is_marked = settings.upsampling == Upsampling::ByLevels;
            if is_marked || finer.is_none() {
                let marked = MarkedPixels::new(device, target.size(g_buffer.size())).map_err(text)?;
                let resources = UpsamplerResources::new(device).map_err(text)?;
                levels.push((target, irradiance(target)?, resources, is_marked.then_some(marked)));
            }
        }
        let summary = SceneSummary::of(&self.scene).map_err(text)?;
        let inputs = PhotonSplatterInputs {
            queue,
            photons,
            g_buffer,
            subsampling: settings.subsampling,
            irradiance: &estimated,
            area: frame.area(summary.area),
            radius: frame.radius(),
            sample_offset: 0,
            settings: &settings.splatter,
            timestamps: None,
        };
        let mut times = Vec::new();
        // The first time warms up.
        for run in 0..6 {
            let start = Instant::now();
            let mut encoder = device.create_command_encoder(&Default::default());
            pass.record(&mut encoder, &mut own, &inputs);
            let (mut coarse, mut subsampling) = (&estimated, settings.subsampling);
            for (target, irradiance, resources, marked) in &mut levels {
                let inputs = UpsamplerInputs {
                    queue,
                    g_buffer,
                    coarse,
                    subsampling,
                    target: *target,
                    irradiance,
                    marked: marked.as_ref(),
                    settings: &settings.upsampler,
                    timestamps: None,
                };
                upsampler.record(&mut encoder, resources, &inputs);
                if let Some(marked) = marked {
                    let inputs = MarkedSplatInputs {
                        queue,
                        g_buffer,
                        subsampling: *target,
                        irradiance,
                        marked,
                        timestamps: None,
                    };
                    pass.record_marked(&mut encoder, &mut own, &inputs);
                }
                (coarse, subsampling) = (irradiance, *target);
            }
            queue.submit([encoder.finish()]);
            wait(device).map_err(text)?;
            if run > 0 {
                times.push(start.elapsed().as_secs_f64() * 1e3);
            }
        }
        Ok(median(&times))
    }
}

/// Errors near edges and inside; 0 where the reference does not tell.
fn zones(error: &Comparison) -> (f64, f64) {
    (error.relmse_edge.unwrap_or(0.0), error.relmse_interior.unwrap_or(0.0))
}

/// Least squares of a column over the first.
fn slope(points: &[[f64; 4]], column: usize) -> f64 {
    let count = points.len() as f64;
    let mean = |column: usize| points.iter().map(|p| p[column]).sum::<f64>() / count;
    let (x, y) = (mean(0), mean(column));
    let covariance: f64 = points.iter().map(|p| (p[0] - x) * (p[column] - y)).sum();
    covariance / points.iter().map(|p| (p[0] - x).powi(2)).sum::<f64>()
}
