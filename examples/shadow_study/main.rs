//! How far off each way to a soft shadow is, and what it costs: the tables and the picture of `docs/shadows.md`.
//!
//! ```text
//! cargo run --release --example shadow_study -- --write docs/shadows.md --picture docs/shadows.png
//! ```
//!
//! The truth is 512 rays to the lamp from each pixel, or, for widths of penumbrae of a square lamp and the straight edge of a
//! plate, visibility that rises linearly. Errors are root mean squares of visibility over the pixels of the penumbra, those
//! that see a part of the lamp; *elsewhere* over all others. Times are of all of the pass, on the wall, medians of rounds in
//! which each way has its turn.

#[path = "../common/mod.rs"]
mod common;

mod bench;
mod fused;
mod scenes;

use bench::Bench;
use clap::Parser;
use common::adapter::{Gpu, Wishes};
use common::{arguments, exr_file, lettering};
use fused::Shading;
use image::{Rgb, RgbImage};
use lightfall::pass::{OccluderTest, PenumbraSearch, ShadowMethod, SoftShadowSettings};
use scenes::{Edge, Named};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Prints tables about soft shadows.
#[derive(Parser)]
struct Arguments {
    /// Which tables
    #[arg(long, value_delimiter = ',', default_values = ["width", "errors", "cheapest", "tiles", "fused", "maps", "bias"])]
    parts: Vec<String>,
    /// Pixels along an axis, a multiple of 64
    #[arg(long, default_value_t = 256, value_parser = multiple_of_64)]
    size: u32,
    /// Texels along a layer of the shadow maps
    #[arg(long, default_value_t = 1024)]
    map_size: u32,
    /// Rounds of times
    #[arg(long, default_value_t = 7)]
    rounds: usize,
    /// A file whose text between the lines `<!-- tables -->` and `<!-- end of tables -->` becomes what is printed
    #[arg(long)]
    write: Option<PathBuf>,
    /// A .png file for a sheet of what each way shows
    #[arg(long)]
    picture: Option<PathBuf>,
    /// Part of the adapter's name or backend
    #[arg(long)]
    adapter: Option<String>,
}

fn multiple_of_64(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(size) if size % 64 == 0 && size > 0 => Ok(size),
        _ => Err("a multiple of 64".to_owned()),
    }
}

fn main() {
    let arguments: Arguments = arguments::parse("shadow_study");
    if let Err(message) = run(&arguments) {
        eprintln!("shadow_study: {message}");
        std::process::exit(2);
    }
}

/// A way to soft shadows.
#[derive(Clone)]
struct Way {
    name: &'static str,
    settings: SoftShadowSettings,
}

/// Errors and times of all ways in one scene.
struct Row {
    scene: &'static str,
    /// In the penumbra.
    errors: Vec<f64>,
    elsewhere: Vec<f64>,
    times: Vec<f64>,
}

struct Study<'a> {
    arguments: &'a Arguments,
    gpu: Gpu,
    text: String,
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let gpu = Gpu::open(arguments.adapter.as_deref(), Wishes::default())?;
    let text = format!(
        "Adapter: {}. {} × {} pixels, shadow maps of {}² texels.\n",
        gpu.describe(),
        arguments.size,
        arguments.size,
        arguments.map_size
    );
    let mut study = Study { arguments, gpu, text };
    study.tables().map_err(|e| e.to_string())?;
    study.gpu.check()?;
    println!("{}", study.text);
    if let Some(path) = &arguments.write {
        write_between_marks(path, &study.text)?;
    }
    if let Some(path) = &arguments.picture {
        study.picture(path)?;
    }
    Ok(())
}

/// All ways, those of a kind from cheap to dear.
fn ways() -> Vec<Way> {
    let by = |name, method, set: fn(&mut SoftShadowSettings)| {
        let mut settings = SoftShadowSettings {
            method,
            max_radius: 1024.0,
            ..Default::default()
        };
        set(&mut settings);
        Way { name, settings }
    };
    use ShadowMethod::{Cross, Disc, Hard, Pcf, Pcss, Rays};
    vec![
        by("hard", Hard, |_| {}),
        by("PCF 32", Pcf, |s| s.disc_taps = 32),
        by("PCSS 8 + 8", Pcss, |s| (s.search_taps, s.disc_taps) = (2, 8)),
        by("PCSS 16 + 16", Pcss, |s| (s.search_taps, s.disc_taps) = (4, 16)),
        by("PCSS 32 + 32", Pcss, |s| (s.search_taps, s.disc_taps) = (8, 32)),
        by("PCSS 64 + 128", Pcss, |s| (s.search_taps, s.disc_taps) = (16, 128)),
        by("cross 0 + 5", Cross, |s| {
            (s.search, s.blur_taps) = (PenumbraSearch::Off, 5);
        }),
        by("cross 2 + 3", Cross, |s| (s.search_taps, s.blur_taps) = (2, 3)),
        by("cross 4 + 5", Cross, |s| (s.search_taps, s.blur_taps) = (4, 5)),
        by("cross 4 + 7", Cross, |s| (s.search_taps, s.blur_taps) = (4, 7)),
        by("cross 8 + 10", Cross, |s| (s.search_taps, s.blur_taps) = (8, 10)),
        by("cross 16 + 20", Cross, |s| (s.search_taps, s.blur_taps) = (16, 20)),
        by("cross 4 + 5, test by rays", Cross, |s| s.test = OccluderTest::Triangles),
        by("disc 4 + 16", Disc, |s| (s.search_taps, s.disc_taps) = (4, 16)),
        by("disc 4 + 32", Disc, |s| (s.search_taps, s.disc_taps) = (4, 32)),
        by("disc 16 + 128", Disc, |s| (s.search_taps, s.disc_taps) = (16, 128)),
        by("rays 1", Rays, |s| s.rays = 1),
        by("rays 4", Rays, |s| s.rays = 4),
        by("rays 16", Rays, |s| s.rays = 16),
        by("rays 64", Rays, |s| s.rays = 64),
    ]
}

fn way(name: &str) -> Way {
    ways().into_iter().find(|w| w.name == name).expect("one of the ways")
}

/// Whether a part of the lamp is seen, by 512 rays.
fn is_penumbra(truth: f32) -> bool {
    truth > 0.004 && truth < 0.996
}

/// In the penumbra, and elsewhere.
fn errors(found: &[f32], truth: &[f32]) -> [f64; 2] {
    let mut sums = [(0.0, 0.0); 2];
    for (f, t) in found.iter().zip(truth) {
        let (sum, count) = &mut sums[usize::from(!is_penumbra(*t))];
        *sum += f64::from(f - t).powi(2);
        *count += 1.0;
    }
    sums.map(|(sum, count): (f64, f64)| (sum / count.max(1.0)).sqrt())
}

impl Study<'_> {
    fn tables(&mut self) -> Result<(), Box<dyn std::error::Error>> {
        let mut rows = None;
        for part in &self.arguments.parts {
            match part.as_str() {
                "width" => self.width()?,
                "errors" | "cheapest" => {
                    let measured = match rows.take() {
                        Some(known) => known,
                        None => self.measure()?,
                    };
                    if part == "errors" {
                        self.errors(&measured)?;
                        self.edges()?;
                    } else {
                        self.cheapest(&measured)?;
                    }
                    rows = Some(measured);
                }
                "tiles" => self.tiles()?,
                "fused" => self.fused()?,
                "maps" => self.maps()?,
                "bias" => self.bias()?,
                _ => return Err(format!("no part named {part}").into()),
            }
        }
        Ok(())
    }

    fn head(&mut self, title: &str, columns: &[&str]) {
        let text = &mut self.text;
        let _ = writeln!(text, "\n### {title}\n");
        let _ = writeln!(text, "| {} |", columns.join(" | "));
        let _ = writeln!(text, "|{}", "---|".repeat(columns.len()));
    }

    fn row(&mut self, cells: &[String]) {
        let _ = writeln!(self.text, "| {} |", cells.join(" | "));
    }

    /// Of a penumbra, by the occluder's distance.
    fn width(&mut self) -> Result<(), Box<dyn std::error::Error>> {
        const WIDTHS: f64 = 3.0;
        let names = [
            "PCF 32",
            "PCSS 16 + 16",
            "cross 0 + 5",
            "cross 4 + 5",
            "cross 4 + 7",
            "cross 16 + 20",
            "cross 4 + 5, test by rays",
            "disc 16 + 128",
            "rays 64",
        ];
        let gaps = [0.1, 0.3, 1.0, 3.0, 10.0];
        let mut columns = vec!["width over the exact one, d =".to_owned()];
        columns.extend(gaps.map(|g| g.to_string()));
        let columns: Vec<_> = columns.iter().map(String::as_str).collect();
        self.head("Width", &columns);
        let mut lines: Vec<Vec<String>> = names.iter().map(|n| vec![n.to_string()]).collect();
        for gap in gaps {
            let edge = Edge {
                side: 1.0,
                height: 12.0,
                gap,
            };
            let size = self.arguments.size;
            let mut bench = Bench::new(&self.gpu, &edge.scene(WIDTHS), size, self.arguments.map_size)?;
            for (name, line) in names.iter().zip(&mut lines) {
                let found = bench.visibility(&way(name).settings)?;
                let profile: Vec<(f64, f64)> = (0..size)
                    .map(|column| {
                        let sum: f64 = (0..size)
                            .map(|row| f64::from(found[(row * size + column) as usize]))
                            .sum();
                        (edge.x(WIDTHS, size, column), sum / f64::from(size))
                    })
                    .collect();
                // Four standard deviations of a linear rise are 4 / √12 widths.
                line.push(format!(
                    "{:.2}",
                    four_deviations(&profile) / (edge.width() * 4.0 / 12f64.sqrt())
                ));
            }
        }
        lines.iter().for_each(|line| self.row(line));
        Ok(())
    }

    fn measure(&mut self) -> Result<Vec<Row>, Box<dyn std::error::Error>> {
        let ways = ways();
        let settings: Vec<_> = ways.iter().map(|w| w.settings).collect();
        let mut rows = Vec::new();
        for Named { name, scene } in scenes::all() {
            let mut bench = Bench::new(&self.gpu, &scene, self.arguments.size, self.arguments.map_size)?;
            let truth = bench.truth()?;
            let mut row = Row {
                scene: name,
                errors: Vec::new(),
                elsewhere: Vec::new(),
                times: bench.times(&settings, self.arguments.rounds)?,
            };
            for settings in &settings {
                let [inside, outside] = errors(&bench.visibility(settings)?, &truth);
                row.errors.push(inside);
                row.elsewhere.push(outside);
            }
            rows.push(row);
        }
        Ok(rows)
    }

    fn errors(&mut self, rows: &[Row]) -> Result<(), Box<dyn std::error::Error>> {
        let mut columns = vec!["error in the penumbra, elsewhere"];
        columns.extend(rows.iter().map(|r| r.scene));
        columns.push("time over hard");
        self.head("Errors", &columns);
        for (i, way) in ways().iter().enumerate() {
            let mut cells = vec![way.name.to_owned()];
            cells.extend(
                rows.iter()
                    .map(|r| format!("{:.3}, {:.3}", r.errors[i], r.elsewhere[i])),
            );
            let times: Vec<_> = rows.iter().map(|r| r.times[i] / r.times[0]).collect();
            let extreme = |f: fn(f64, f64) -> f64| times.iter().copied().reduce(f).unwrap_or(0.0);
            cells.push(format!("{:.1} to {:.1}", extreme(f64::min), extreme(f64::max)));
            self.row(&cells);
        }
        Ok(())
    }

    /// By the lamp's size and the occluder's distance.
    fn edges(&mut self) -> Result<(), Box<dyn std::error::Error>> {
        const WIDTHS: f64 = 1.5;
        let shapes = [
            (0.02, 0.1),
            (0.02, 0.5),
            (0.02, 0.9),
            (0.2, 0.1),
            (0.2, 0.5),
            (0.2, 0.9),
            (0.8, 0.1),
            (0.8, 0.5),
        ];
        let mut columns =
            vec!["error in the penumbra, time over hard: side of the lamp, d, over its height".to_owned()];
        columns.extend(shapes.map(|(side, gap)| format!("{side}, {gap}")));
        let columns: Vec<_> = columns.iter().map(String::as_str).collect();
        self.head("A straight edge", &columns);
        let ways = ways();
        let mut lines: Vec<Vec<String>> = ways.iter().map(|w| vec![w.name.to_owned()]).collect();
        for (side, gap) in shapes {
            let height = 2.0;
            let edge = Edge {
                side: side * height,
                height,
                gap: gap * height,
            };
            let mut bench = Bench::new(
                &self.gpu,
                &edge.scene(WIDTHS),
                self.arguments.size,
                self.arguments.map_size,
            )?;
            let truth = bench.truth()?;
            let settings: Vec<_> = ways.iter().map(|w| w.settings).collect();
            let times = bench.times(&settings, 3)?;
            for ((way, line), time) in ways.iter().zip(&mut lines).zip(&times) {
                let error = errors(&bench.visibility(&way.settings)?, &truth)[0];
                line.push(format!("{error:.3}, {:.1}", time / times[0]));
            }
        }
        lines.iter().for_each(|line| self.row(line));
        Ok(())
    }

    fn cheapest(&mut self, rows: &[Row]) -> Result<(), Box<dyn std::error::Error>> {
        let goals = [0.2, 0.11, 0.1, 0.07, 0.05, 0.03];
        let mut columns = vec!["error of at most".to_owned()];
        columns.extend(goals.map(|g| g.to_string()));
        let columns: Vec<_> = columns.iter().map(String::as_str).collect();
        for (title, admits) in [
            ("The cheapest way", (|_| true) as fn(&Way) -> bool),
            ("The cheapest way without triangles", |w| !w.settings.uses_triangles()),
        ] {
            self.head(title, &columns);
            let ways = ways();
            for row in rows {
                let mut cells = vec![row.scene.to_owned()];
                for goal in goals {
                    let best = (0..ways.len())
                        .filter(|&i| row.errors[i] <= goal && admits(&ways[i]))
                        .min_by(|&a, &b| row.times[a].total_cmp(&row.times[b]));
                    cells.push(best.map_or("none".to_owned(), |i| {
                        format!("{}: {:.1}", ways[i].name, row.times[i] / row.times[0])
                    }));
                }
                self.row(&cells);
            }
            // One way for all: its largest error, its mean time over hard shadows.
            let mean = |i: usize| rows.iter().map(|r| r.times[i] / r.times[0]).sum::<f64>() / rows.len() as f64;
            let worst = |i: usize| rows.iter().map(|r| r.errors[i]).fold(0.0, f64::max);
            let mut cells = vec!["in all of them".to_owned()];
            for goal in goals {
                let fits = (0..ways.len()).filter(|&i| worst(i) <= goal && admits(&ways[i]));
                let best = fits.min_by(|&a, &b| mean(a).total_cmp(&mean(b)));
                cells.push(best.map_or("none".to_owned(), |i| format!("{}: {:.1}", ways[i].name, mean(i))));
            }
            self.row(&cells);
        }
        Ok(())
    }

    /// Pictures that are all penumbra, or hold none.
    fn tiles(&mut self) -> Result<(), Box<dyn std::error::Error>> {
        let size = 2 * self.arguments.size;
        let names = [
            "hard",
            "PCSS 16 + 16",
            "PCSS 32 + 32",
            "cross 4 + 5",
            "cross 4 + 7",
            "cross 16 + 20",
            "disc 4 + 16",
            "disc 4 + 32",
            "disc 16 + 128",
        ];
        let settings: Vec<_> = names.iter().map(|n| way(n).settings).collect();
        let title = format!("Pictures of nothing but penumbra, and of none, {size} × {size}");
        let columns = [
            "",
            "error",
            "all penumbra: ns a pixel",
            "all lit",
            "all shadow",
            "lit over penumbra",
        ];
        self.head(&title, &columns);
        let mut times = Vec::new();
        let mut found = Vec::new();
        for beside in [0.0, 1.6, -1.6] {
            let mut bench = Bench::new(&self.gpu, &scenes::slats(beside), size, self.arguments.map_size)?;
            times.push(bench.times(&settings, self.arguments.rounds)?);
            if beside == 0.0 {
                let truth = bench.truth()?;
                for settings in &settings {
                    found.push(errors(&bench.visibility(settings)?, &truth)[0]);
                }
            }
        }
        for (i, name) in names.iter().enumerate() {
            let per_pixel = |t: usize| times[t][i] * 1e6 / f64::from(size * size);
            let [soft, lit, dark] = [per_pixel(0), per_pixel(1), per_pixel(2)];
            self.row(&[
                name.to_string(),
                format!("{:.3}", found[i]),
                format!("{soft:.0}"),
                format!("{lit:.0}"),
                format!("{dark:.0}"),
                format!("{:.2}", lit / soft),
            ]);
        }
        Ok(())
    }

    /// From the test to the picture.
    fn fused(&mut self) -> Result<(), Box<dyn std::error::Error>> {
        let size = 2 * self.arguments.size;
        let title = format!(
            "One pass after the other, or all in one, {size} × {size}, indirect light at a quarter along each axis"
        );
        let columns = [
            "lights, penumbra",
            "cross 4 + 5: ns a pixel",
            "disc 4 + 32",
            "disc 4 + 32 in one pass",
            "bytes a pixel allocated: cross or disc, in one pass",
            "moved at the least: cross, disc, in one pass",
        ];
        self.head(&title, &columns);
        let settings = ["cross 4 + 5", "disc 4 + 32"].map(|n| way(n).settings);
        let pixels = f64::from(size * size);
        for scenes::Shaded {
            what,
            scene,
            is_penumbra,
        } in scenes::shaded()
        {
            let mut bench = Bench::new(&self.gpu, &scene, size, self.arguments.map_size)?;
            let costs = Shading::new(&mut bench)?.costs(&settings, self.arguments.rounds)?;
            let mut cells = vec![what];
            cells.extend(costs.iter().map(|c| format!("{:.0}", c.ms * 1e6 / pixels)));
            let allocated = [0, 2].map(|i| format!("{:.0}", costs[i].allocated as f64 / pixels));
            cells.push(allocated.join(", "));
            let moved: Vec<_> = costs
                .iter()
                .map(|c| c.moved[usize::from(is_penumbra)].to_string())
                .collect();
            cells.push(moved.join(", "));
            self.row(&cells);
        }
        Ok(())
    }

    /// Of the shadow maps' resolution.
    fn maps(&mut self) -> Result<(), Box<dyn std::error::Error>> {
        let sizes = [128, 256, 512, 1024, 2048];
        let mut columns = vec!["error in the penumbra, elsewhere: texels".to_owned()];
        columns.extend(sizes.map(|s| s.to_string()));
        let columns: Vec<_> = columns.iter().map(String::as_str).collect();
        self.head("Resolution of the shadow maps", &columns);
        let ways = ["cross 4 + 5", "PCSS 16 + 16"];
        for Named { name, scene } in scenes::all() {
            let truth = Bench::new(&self.gpu, &scene, self.arguments.size, sizes[0])?.truth()?;
            let mut lines = ways.map(|way| vec![format!("{name}, {way}")]);
            for size in sizes {
                let mut bench = Bench::new(&self.gpu, &scene, self.arguments.size, size)?;
                for (by, line) in ways.iter().zip(&mut lines) {
                    let [inside, outside] = errors(&bench.visibility(&way(by).settings)?, &truth);
                    line.push(format!("{inside:.3}, {outside:.3}"));
                }
            }
            lines.iter().for_each(|line| self.row(line));
        }
        Ok(())
    }

    /// Hard shadows of the maps against hard shadows by rays: what is dark though nothing is in the way (acne), and lit though
    /// something is (light that leaks, shadows that detach).
    fn bias(&mut self) -> Result<(), Box<dyn std::error::Error>> {
        let sizes = [128, 512, 2048];
        let mut columns = vec!["dark by mistake, lit by mistake, ‰ of the pixels: texels".to_owned()];
        columns.extend(sizes.map(|s| s.to_string()));
        let columns: Vec<_> = columns.iter().map(String::as_str).collect();
        self.head("Bias", &columns);
        let hard = way("hard").settings;
        let exact = SoftShadowSettings {
            test: OccluderTest::Triangles,
            ..hard
        };
        for Named { name, scene } in scenes::all() {
            let mut cells = vec![name.to_owned()];
            for size in sizes {
                let mut bench = Bench::new(&self.gpu, &scene, self.arguments.size, size)?;
                let truth = bench.visibility(&exact)?;
                let found = bench.visibility(&hard)?;
                let share = |wrong: fn(f32, f32) -> bool| {
                    let count = found.iter().zip(&truth).filter(|(f, t)| wrong(**f, **t)).count();
                    1e3 * count as f64 / truth.len() as f64
                };
                cells.push(format!("{:.1}, {:.1}", share(|f, t| f < t), share(|f, t| f > t)));
            }
            self.row(&cells);
        }
        Ok(())
    }

    /// A line for each scene: the truth, and some ways.
    fn picture(&self, path: &Path) -> Result<(), String> {
        const LABEL: u32 = 20;
        const GAP: u32 = 4;
        let names = ["hard", "PCSS 16 + 16", "cross 4 + 5", "disc 16 + 128", "rays 4"];
        let size = self.arguments.size;
        let scenes = scenes::all();
        let (columns, lines) = (names.len() as u32 + 1, scenes.len() as u32);
        let (width, height) = (columns * (size + GAP), lines * (size + LABEL));
        let mut sheet = RgbImage::from_pixel(width, height, Rgb([0; 3]));
        for (line, Named { name, scene }) in (0..).zip(&scenes) {
            let mut bench = Bench::new(&self.gpu, scene, size, self.arguments.map_size).map_err(|e| e.to_string())?;
            let mut images = vec![("truth", bench.truth().map_err(|e| e.to_string())?)];
            for way_name in names {
                let found = bench.visibility(&way(way_name).settings).map_err(|e| e.to_string())?;
                images.push((way_name, found));
            }
            for (column, (label, image)) in (0..).zip(&images) {
                let corner = [column * (size + GAP), line * (size + LABEL)];
                lettering::write(&mut sheet, (corner[0], corner[1]), &format!("{name}: {label}"));
                for (i, visibility) in (0..).zip(image) {
                    let grey = (visibility * 255.0).round() as u8;
                    sheet.put_pixel(corner[0] + i % size, corner[1] + LABEL + i / size, Rgb([grey; 3]));
                }
            }
        }
        let mut bytes = std::io::Cursor::new(Vec::new());
        image::DynamicImage::from(sheet)
            .to_luma8()
            .write_to(&mut bytes, image::ImageFormat::Png)
            .map_err(|e| e.to_string())?;
        exr_file::replace_file(path, &bytes.into_inner())
    }
}

/// Of the derivative of a profile.
fn four_deviations(profile: &[(f64, f64)]) -> f64 {
    let steps = || profile.windows(2).map(|w| (0.5 * (w[0].0 + w[1].0), w[1].1 - w[0].1));
    let total: f64 = steps().map(|s| s.1).sum();
    let mean = steps().map(|(x, d)| x * d).sum::<f64>() / total;
    let variance = steps().map(|(x, d)| (x - mean).powi(2) * d).sum::<f64>() / total;
    4.0 * variance.sqrt()
}

/// Replaces what stands between the marks of a file.
fn write_between_marks(path: &Path, text: &str) -> Result<(), String> {
    const MARKS: [&str; 2] = ["<!-- tables -->\n", "<!-- end of tables -->\n"];
    let name = path.display();
    let old = std::fs::read_to_string(path).map_err(|e| format!("{name}: {e}"))?;
    let found = old.split_once(MARKS[0]).and_then(|(before, rest)| {
        let (_, after) = rest.split_once(MARKS[1])?;
        Some((before, after))
    });
    let (before, after) = found.ok_or_else(|| format!("{name} has no lines {MARKS:?}"))?;
    let [start, end] = MARKS;
    let new = format!("{before}{start}\n{}\n{end}{after}", text.trim());
    exr_file::replace_file(path, new.as_bytes())
}
