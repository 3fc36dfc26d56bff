//! How well rays are traced through environment maps.
//!
//! ```text
//! cargo run --release --example trace_study -- sample:cornell sample:living-room sample:colonnade
//! ```

#[path = "../common/mod.rs"]
mod common;

mod bench;
mod judge;
mod selection;

use bench::{Bench, Maps};
use clap::Parser;
use common::adapter::{Gpu, Wishes};
use common::{arguments, named_scene};
use judge::{judge, percentile};
use lightfall::glam::Vec3;
use lightfall::pass::{CoverageMeasure, ImageSpaceTracer, ImageSpaceTracerSettings, TraceMethod};
use lightfall::resource::SurfaceHit;
use selection::Selector;

/// Prints how well rays are traced through environment maps.
#[derive(Parser)]
struct Arguments {
    /// .glb or .gltf files, or sample:NAME
    #[arg(required = true)]
    scenes: Vec<String>,
    /// How many rays
    #[arg(long, default_value_t = 100_000)]
    rays: usize,
    /// How many maps
    #[arg(long, value_delimiter = ',', default_values_t = [4, 8, 12])]
    maps: Vec<u32>,
    /// Texels along a face
    #[arg(long, value_delimiter = ',', default_values_t = [128, 256, 512])]
    sizes: Vec<u32>,
    /// Candidates that the places of maps are chosen from
    #[arg(long, default_value_t = 100)]
    candidates: u32,
    #[arg(long, value_delimiter = ',')]
    methods: Vec<String>,
    #[arg(long)]
    area: bool,
    #[arg(long)]
    selection: bool,
    /// Part of the adapter's name or backend
    #[arg(long)]
    adapter: Option<String>,
}

impl Arguments {
    fn measure(&self) -> CoverageMeasure {
        if self.area {
            CoverageMeasure::Area
        } else {
            CoverageMeasure::Photons
        }
    }
}

fn main() {
    let arguments: Arguments = arguments::parse("trace_study");
    if let Err(message) = run(&arguments) {
        eprintln!("trace_study: {message}");
        std::process::exit(2);
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let gpu = Gpu::open(arguments.adapter.as_deref(), Wishes::default())?;
    println!("{}", gpu.describe());
    for name in &arguments.scenes {
        let scene = named_scene::load(name, 0.0)?;
        let mut bench = Bench::new(&gpu, scene).map_err(|e| e.to_string())?;
        study(&mut bench, name, arguments).map_err(|e| e.to_string())?;
    }
    gpu.check()
}

fn study(bench: &mut Bench<'_>, name: &str, arguments: &Arguments) -> Result<(), lightfall::Error> {
    let rays = bench.rays(arguments.rays)?;
    let truths = bench.truths(&rays)?;
    println!("\n{name}: {} rays\n", rays.len());
    println!(
        "| method | k | size | correct | false (normal) | lost | ghost | again → hybrid | error 50, 95 % | fetches mean, 50, 95, 99 % | µs a ray |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    let mut selector = Selector::new(bench, arguments.candidates)?;
    if arguments.selection {
        let ends: Vec<_> = rays
            .iter()
            .zip(&truths)
            .filter_map(|(r, t)| {
                t.as_ref()
                    .map(|t| (Vec3::from(r.position) + t.distance * Vec3::from(r.direction), t.normal))
            })
            .collect();
        selection::table(bench, &mut selector, &ends, arguments.maps[0])?;
        return Ok(());
    }
    for &k in &arguments.maps {
        let centers = selector.select(bench, k, arguments.measure())?.centers;
        for &size in &arguments.sizes {
            let maps = bench.capture(&centers, size)?;
            for method in TraceMethod::ALL
                .into_iter()
                .filter(|m| arguments.methods.is_empty() || arguments.methods.contains(&format!("{m:?}")))
            {
                let tracer = ImageSpaceTracer::new(&bench.gpu.device, method);
                let (hits, ms) = bench.trace(&tracer, &ImageSpaceTracerSettings::default(), &maps, &rays)?;
                let v = judge(&truths, &hits, bench.diagonal);
                let percent = |x: f64| format!("{:.2}", 100.0 * x);
                println!(
                    "| {method:?} | {k} | {size} | {} | {} ({}) | {} | {} | {} → {} | {}, {} | {} | {:.2} |",
                    percent(v.correct),
                    percent(v.wrong),
                    percent(v.wrong_normal),
                    percent(v.lost),
                    percent(v.ghost),
                    percent(v.again),
                    percent(v.hybrid),
                    percent(v.error[0]),
                    percent(v.error[1]),
                    fetches(&hits),
                    ms * 1e3 / rays.len() as f64,
                );
            }
            let _: &Maps = &maps;
            let tracer = ImageSpaceTracer::new(&bench.gpu.device, TraceMethod::OrderedWalk);
            let (hits, _) = bench.trace(&tracer, &ImageSpaceTracerSettings::default(), &maps, &rays)?;
            let origins: Vec<_> = rays
                .iter()
                .map(|r| (Vec3::from(r.position), judge::unpack(r.normal)))
                .collect();
            let ends: Vec<_> = rays
                .iter()
                .zip(&truths)
                .map(|(r, t)| match t {
                    Some(t) => (Vec3::from(r.position) + t.distance * Vec3::from(r.direction), t.normal),
                    None => (Vec3::splat(9.0), Vec3::X),
                })
                .collect();
            let a = bench.seen_from(&origins, &centers)?;
            let b = bench.seen_from(&ends, &centers)?;
            {
                let mut table = std::collections::HashMap::new();
                for i in 0..rays.len() {
                    let Some(t) = truths[i] else { continue };
                    if a[i] & b[i] == 0 {
                        continue;
                    }
                    let name = bench.scene.meshes[bench.scene.instances[t.instance as usize].mesh]
                        .name
                        .clone();
                    let e = table.entry(name).or_insert([0usize; 6]);
                    e[0] += 1;
                    let kind = hits[i].kind();
                    use lightfall::resource::SurfaceHitKind as K;
                    let hit = matches!(kind, K::Surface | K::Tentative);
                    let [near, same] =
                        judge::agrees(&t, hits[i].distance, judge::unpack(hits[i].normal), bench.diagonal);
                    if hit && same {
                        e[1] += 1
                    } else if hit && near {
                        e[2] += 1
                    } else if hit && hits[i].distance < t.distance {
                        e[3] += 1
                    } else if hit {
                        e[4] += 1
                    } else {
                        e[5] += 1
                    }
                }
                let mut rows: Vec<_> = table.into_iter().collect();
                rows.sort_by_key(|r| std::cmp::Reverse(r.1[0] - r.1[1]));
                for (n, e) in rows.iter().take(14) {
                    println!(
                        "      {n}: {} rays, wrong {:.1}% : normal {} early {} late {} lost {}",
                        e[0],
                        100.0 * (1.0 - e[1] as f64 / e[0] as f64),
                        e[2],
                        e[3],
                        e[4],
                        e[5]
                    );
                }
            }
            for (name, f) in [
                ("origin&end same map", 0),
                ("origin, end other", 1),
                ("origin only", 2),
                ("end only", 3),
                ("neither", 4),
            ] {
                let pick: Vec<usize> = (0..rays.len())
                    .filter(|&i| {
                        truths[i].is_some()
                            && (match (a[i] != 0, b[i] != 0) {
                                (true, true) => {
                                    if a[i] & b[i] != 0 {
                                        0
                                    } else {
                                        1
                                    }
                                }
                                (true, false) => 2,
                                (false, true) => 3,
                                _ => 4,
                            }) == f
                    })
                    .collect();
                let t: Vec<_> = pick.iter().map(|&i| truths[i]).collect();
                let h: Vec<_> = pick.iter().map(|&i| hits[i]).collect();
                let v = judge(&t, &h, bench.diagonal);
                println!(
                    "   {name}: {:.2} % of rays; correct {:.2} wrong {:.2} ({:.2}) lost {:.2} again {:.2} hybrid {:.2}",
                    100.0 * pick.len() as f64 / rays.len() as f64,
                    100.0 * v.correct,
                    100.0 * v.wrong,
                    100.0 * v.wrong_normal,
                    100.0 * v.lost,
                    100.0 * v.again,
                    100.0 * v.hybrid
                );
            }
        }
    }
    Ok(())
}

fn fetches(hits: &[SurfaceHit]) -> String {
    let mut all: Vec<f64> = hits.iter().map(|h| f64::from(h.fetches)).collect();
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    let [a, b, c] = [0.5, 0.95, 0.99].map(|part| percentile(&mut all, part));
    format!("{mean:.0}, {a}, {b}, {c}")
}
