//! How far off the irradiance of a texel is, by what gathers it, and how long it takes.
//!
//! The truth is path traced: paths that end at a texel, seen from just above it. All ways gather from the same light, of so many
//! photons at so many places. Times are of all texels at once, less a frame without, a texel.

use crate::Arguments;
use crate::common::adapter::Gpu;
use crate::common::clock::median;
use crate::common::offline::{self, Component, Offline};
use crate::common::reference::Reference;
use lightfall::frame::{IndirectMethod, Settings};
use lightfall::glam::{DAffine3, DVec3};
use lightfall::read_buffer_blocking;
use lightfall::reference::{PathComponent, PathTracerSettings};
use lightfall::scene::{Camera, Projection, Scene, SurfacePlace, samples};
use std::time::Instant;

const BOUNCES: u32 = 3;

/// Pixels of the picture of a point: each adds to the same mean.
const POINT_SIZE: u32 = 32;

type Overrides = &'static [(&'static str, &'static str)];

/// Name of a way, and settings that make it.
const WAYS: [(&str, Overrides); 14] = [
    ("cube of 8", &[("gather", "cube"), ("hemisphere_size", "8")]),
    ("cube of 16", &[("gather", "cube"), ("hemisphere_size", "16")]),
    ("cube of 32", &[("gather", "cube"), ("hemisphere_size", "32")]),
    ("cube of 64", &[("gather", "cube"), ("hemisphere_size", "64")]),
    ("plane of 32, half side 1", &[("gather", "plane"), ("half_side", "1")]),
    ("plane of 32, half side 2", &[("gather", "plane"), ("half_side", "2")]),
    ("plane of 32, half side 3", &[("gather", "plane"), ("half_side", "3")]),
    ("64 rays", &[("rays", "64"), ("guided", "0")]),
    ("256 rays", &[("rays", "256"), ("guided", "0")]),
    ("1024 rays", &[("rays", "1024"), ("guided", "0")]),
    ("64 rays, half guided", &[("rays", "64"), ("guided", "0.5")]),
    ("256 rays, half guided", &[("rays", "256"), ("guided", "0.5")]),
    ("1024 rays, half guided", &[("rays", "1024"), ("guided", "0.5")]),
    ("256 rays through environment maps", &[("rays", "256"), ("guided", "0")]),
];

fn settings(places: u32, photons: u32, overrides: Overrides) -> Result<Settings, String> {
    let mut settings = Settings {
        indirect_method: IndirectMethod::IlluminationMaps,
        bounces: BOUNCES,
        photons,
        ..Settings::balanced()
    };
    settings.illumination_maps.texels = places;
    settings.illumination_maps.gather.a_frame = 1000;
    for (key, value) in [("tracer.kind", "bvh"), ("emission.first_hits", "traced")] {
        settings.set(key, value).map_err(|e| e.to_string())?;
    }
    for (key, value) in overrides {
        let key = format!("illumination_maps.{key}");
        settings.set(&key, value).map_err(|e| e.to_string())?;
    }
    Ok(settings)
}

fn offline<'a>(gpu: &'a Gpu, scene: &Scene, settings: &Settings) -> Result<Offline<'a>, String> {
    Offline::new(gpu, scene.clone(), settings, 0, [16; 2], Component::Indirect).map_err(|e| e.to_string())
}

/// A point that light is gathered at.
struct Point {
    texel: usize,
    place: SurfacePlace,
    reflectance: [f32; 3],
}

/// Texels that see their surroundings and lie on flat diffuse surfaces of one colour, in an order of their own.
fn points(scene: &Scene, offline: &Offline<'_>, light: &[[f32; 4]], count: usize) -> Vec<Point> {
    let total = 2 * offline.points.len();
    let mut found = Vec::new();
    for i in 0..total {
        // Coprime to whatever number of texels is a power of two or of ten, twice a prime.
        let texel = i * 7919 % total;
        let point = &offline.points[texel / 2];
        let instance = &scene.instances[point.instance];
        let material = &scene.materials[instance.material];
        let is_plain =
            material.base_color_texture.is_none() && material.metallic == 0.0 && material.transmission == 0.0;
        if !is_plain || light[texel][3] < 0.999 || material.base_color.contains(&0.0) {
            continue;
        }
        let side = if texel % 2 == 0 { 1.0 } else { -1.0 };
        let place = point.in_world(&instance.transform);
        found.push(Point {
            texel,
            place: SurfacePlace {
                normal: side * place.normal,
                ..place
            },
            reflectance: material.base_color,
        });
        if found.len() == count {
            break;
        }
    }
    found
}

/// Irradiance that paths bring to a point, the sum of its channels, and its standard error.
fn truth(reference: &mut Reference<'_>, point: &Point, scale: f64, paths: u32) -> Result<[f64; 2], String> {
    let back = point.place.normal;
    let helper = if back.y.abs() < 0.9 { DVec3::Y } else { DVec3::X };
    let right = helper.cross(back).normalize();
    let from = point.place.position + 1e-4 * scale * back;
    reference.look(Camera {
        name: String::new(),
        transform: DAffine3::from_cols(right, back.cross(right), back, from),
        projection: Projection::Orthographic {
            half_height: 1e-5 * scale,
        },
    });
    for _ in 0..paths.div_ceil(POINT_SIZE * POINT_SIZE) {
        reference.render_sample(None).map_err(|e| e.to_string())?;
    }
    let estimate = reference.read().map_err(|e| e.to_string())?;
    let pixels = estimate.mean.len() as f64;
    let irradiance = |rgb: &[f32; 3]| {
        let of_channel = |c: usize| std::f64::consts::PI * f64::from(rgb[c]) / f64::from(point.reflectance[c]);
        (0..3).map(of_channel).sum::<f64>()
    };
    let mean = estimate.mean.iter().map(irradiance).sum::<f64>() / pixels;
    let squares = estimate
        .mean
        .iter()
        .map(|p| (irradiance(p) - mean).powi(2))
        .sum::<f64>();
    Ok([mean, (squares / (pixels - 1.0) / pixels).sqrt()])
}

/// Of all texels, as gathered.
fn gathered(gpu: &Gpu, offline: &Offline<'_>) -> Result<Vec<[f32; 4]>, String> {
    let map = offline.renderer.illumination_map().ok_or("no illumination map")?;
    read_buffer_blocking(&gpu.device, &gpu.queue, map.gathered()).map_err(|e| e.to_string())
}

/// The table of errors.
pub(crate) fn errors(gpu: &Gpu, arguments: &Arguments) -> Result<(), String> {
    println!("{} places, {} photons\n", arguments.places, arguments.photons);
    let mut rows: Vec<String> = WAYS.iter().map(|(name, _)| format!("| {name} |")).collect();
    let mut head = String::from("| error: median, 95th percentile, share within 1 % |");
    for name in &arguments.samples {
        let scene = samples::by_name(name, 0.3).ok_or_else(|| format!("there is no sample {name}"))?;
        let mut truths = Vec::new();
        let mut chosen = Vec::new();
        for ((way, overrides), row) in WAYS.iter().zip(&mut rows) {
            let mut settings = settings(arguments.places, arguments.photons, overrides)?;
            if way.contains("environment") {
                settings.set("tracer.kind", "image-space").map_err(|e| e.to_string())?;
            }
            let mut offline = offline(gpu, &scene, &settings)?;
            offline.render_frame(None).map_err(|e| e.to_string())?;
            let light = gathered(gpu, &offline)?;
            if chosen.is_empty() {
                chosen = points(&scene, &offline, &light, arguments.points);
                truths = all_truths(gpu, arguments, &scene, &chosen)?;
                let noise: Vec<f64> = truths.iter().map(|t| t[1] / t[0]).collect();
                head += &format!(" {name} (noise {:.2} %) |", 100.0 * median(&noise));
            }
            let frame = offline.renderer.frame().ok_or("no frame")?;
            // Of the unit frame, in world units.
            let scale = f64::from(frame.output_scale(1.0).map_err(|e| e.to_string())?);
            let errors: Vec<f64> = chosen
                .iter()
                .zip(&truths)
                .map(|(point, truth)| {
                    let own: f64 = light[point.texel][..3].iter().map(|&v| f64::from(v) * scale).sum();
                    (own / truth[0] - 1.0).abs()
                })
                .collect();
            *row += &format!(" {} |", summary(errors));
        }
    }
    println!("{head}\n|{}", "---|".repeat(arguments.samples.len() + 1));
    rows.iter().for_each(|row| println!("{row}"));
    Ok(())
}

fn all_truths(gpu: &Gpu, arguments: &Arguments, scene: &Scene, points: &[Point]) -> Result<Vec<[f64; 2]>, String> {
    let paths = PathTracerSettings {
        component: PathComponent::Indirect,
        bounces: BOUNCES,
        ..PathTracerSettings::default()
    };
    let mut reference = Reference::new(gpu, scene.clone(), &paths, 0, [POINT_SIZE; 2]).map_err(|e| e.to_string())?;
    let bounds = scene.bounds().map_err(|e| e.to_string())?;
    let scale = (bounds.max - bounds.min).length();
    let of_point = |point| truth(&mut reference, point, scale, arguments.paths);
    points.iter().map(of_point).collect()
}

/// Median, 95th percentile, share within one percent.
fn summary(mut errors: Vec<f64>) -> String {
    errors.sort_by(f64::total_cmp);
    let at = |share: f64| 100.0 * errors[((share * errors.len() as f64) as usize).min(errors.len() - 1)];
    let within = errors.iter().filter(|&&e| e <= 0.01).count() as f64 / errors.len() as f64;
    format!("{:.2} %, {:.1} %, {:.0} %", at(0.5), at(0.95), 100.0 * within)
}

/// The table of times: what a texel costs by the scene's triangles.
pub(crate) fn times(gpu: &Gpu) -> Result<(), String> {
    const CELLS: [[u32; 2]; 3] = [[3, 1], [80, 81], [258, 258]];
    let scenes: Vec<Scene> = CELLS.iter().map(|&cells| samples::bumpy_floor(cells, 0.3)).collect();
    let head: Vec<String> = scenes
        .iter()
        .map(|s| format!("{} triangles", s.triangle_count()))
        .collect();
    println!("| µs a texel | {} |\n|---|---|---|---|", head.join(" | "));
    for (way, overrides) in &WAYS[..WAYS.len() - 1] {
        let mut row = format!("| {way} |");
        for scene in &scenes {
            row += &format!(" {:.0} |", 1e6 * seconds_of_texel(gpu, scene, overrides)?);
        }
        println!("{row}");
    }
    Ok(())
}

/// Places of the table of times.
const TIMED_PLACES: u32 = 500;

fn seconds_of_texel(gpu: &Gpu, scene: &Scene, overrides: Overrides) -> Result<f64, String> {
    let settings = settings(TIMED_PLACES, 1000, overrides)?;
    let mut offline = offline(gpu, scene, &settings)?;
    let mut time = |is_filled: bool| {
        let mut all = Vec::new();
        for _ in 0..5 {
            if is_filled {
                offline.refill();
            }
            let start = Instant::now();
            offline.render_frame(None).map_err(|e| e.to_string())?;
            offline::wait(&gpu.device).map_err(|e| e.to_string())?;
            all.push(start.elapsed().as_secs_f64());
        }
        Ok::<_, String>(median(&all))
    };
    let with = time(true)?;
    let without = time(false)?;
    let texels = 2 * offline.points.len();
    Ok((with - without) / texels as f64)
}
