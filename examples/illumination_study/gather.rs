//! How far off the irradiance of a texel is, by what gathers it, and how long it takes.
//!
//! The truth is path traced: paths that end at a texel, seen from just above it. All ways gather from the same light, of so
//! many photons at so many places. Times are of all texels at once, less a frame without, a texel.

use crate::Arguments;
use crate::common::adapter::Gpu;
use crate::common::arguments::key_and_value;
use crate::common::clock::median;
use crate::common::offline::{self, Component, Offline};
use crate::common::reference::Reference;
use lightfall::frame::{IlluminationMapSettings, IndirectMethod, Settings, TexelGatherMethod};
use lightfall::glam::{DVec3, Vec3};
use lightfall::pass::{HemisphereGather, HemisphereGatherInputs, HemisphereGatherResources};
use lightfall::reference::{PathComponent, PathTracerSettings};
use lightfall::resource::{GatherShape, Geometry, HemispherePlace, Hemispheres, PrepareContext};
use lightfall::scene::{Scene, samples};
use lightfall::{Error, read_buffer_blocking};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::time::Instant;

/// Pixels of each of the pictures that a point sees of its surroundings.
const POINT_SIZE: u32 = 64;

type Overrides = &'static [(&'static str, &'static str)];

/// Name of a way, and settings that make it.
const WAYS: [(&str, Overrides); 15] = [
    ("cube of 8", &[("method", "cube"), ("hemisphere_size", "8")]),
    ("cube of 16", &[("method", "cube"), ("hemisphere_size", "16")]),
    ("cube of 32", &[("method", "cube"), ("hemisphere_size", "32")]),
    ("cube of 64", &[("method", "cube"), ("hemisphere_size", "64")]),
    (
        "cube of 128",
        &[("method", "cube"), ("hemisphere_size", "128"), ("a_frame", "200")],
    ),
    ("plane of 32, half side 1", &[("method", "plane"), ("half_side", "1")]),
    ("plane of 32, half side 2", &[("method", "plane"), ("half_side", "2")]),
    ("plane of 32, half side 3", &[("method", "plane"), ("half_side", "3")]),
    ("64 rays", &[("rays", "64"), ("guided", "0")]),
    ("256 rays", &[("rays", "256"), ("guided", "0")]),
    ("1024 rays", &[("rays", "1024"), ("guided", "0")]),
    ("64 rays, half guided", &[("rays", "64"), ("guided", "0.5")]),
    ("256 rays, half guided", &[("rays", "256"), ("guided", "0.5")]),
    ("1024 rays, half guided", &[("rays", "1024"), ("guided", "0.5")]),
    ("256 rays through environment maps", &[("rays", "256"), ("guided", "0")]),
];

fn settings([places, photons, bounces]: [u32; 3], overrides: Overrides) -> Result<Settings, String> {
    let mut settings = Settings {
        indirect_method: IndirectMethod::IlluminationMaps,
        bounces,
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
    position: DVec3,
    normal: DVec3,
}

/// Texels that see their surroundings, and light, in an order of their own.
fn points(gpu: &Gpu, offline: &Offline<'_>, count: usize) -> Result<Vec<Point>, String> {
    let light = gathered(gpu, offline)?;
    let mut texels: Vec<usize> = (0..2 * offline.points.len()).collect();
    texels.sort_by_cached_key(|&texel| {
        let mut hasher = DefaultHasher::new();
        texel.hash(&mut hasher);
        hasher.finish()
    });
    let sees = |&texel: &usize| light[texel][3] > 0.999 && light[texel][..3].iter().any(|&v| v > 0.0);
    let lights = offline.renderer.surface_lights().ok_or("no texels")?;
    let frame = offline.renderer.frame().ok_or("no frame")?;
    let records: Vec<[f32; 8]> =
        read_buffer_blocking(&gpu.device, &gpu.queue, lights.shining()).map_err(|e| e.to_string())?;
    let point = |texel: usize| {
        let [x, y, z, _, nx, ny, nz, _] = records[texel];
        Point {
            texel,
            position: frame.world_point(Vec3::new(x, y, z)),
            normal: DVec3::new(f64::from(nx), f64::from(ny), f64::from(nz)),
        }
    };
    Ok(texels.into_iter().filter(sees).take(count).map(point).collect())
}

/// Of all texels, as gathered.
fn gathered(gpu: &Gpu, offline: &Offline<'_>) -> Result<Vec<[f32; 4]>, String> {
    let map = offline.renderer.illumination_map().ok_or("no illumination map")?;
    read_buffer_blocking(&gpu.device, &gpu.queue, map.gathered()).map_err(|e| e.to_string())
}

/// The table of errors.
pub(crate) fn errors(gpu: &Gpu, arguments: &Arguments) -> Result<(), String> {
    println!(
        "{} places, {} photons, {} bounces\n",
        arguments.places, arguments.photons, arguments.bounces
    );
    let all_settings = |overrides| {
        let mut settings = settings([arguments.places, arguments.photons, arguments.bounces], overrides)?;
        for pair in &arguments.set {
            let (key, value) = key_and_value(pair)?;
            settings.set(key, value).map_err(|e| e.to_string())?;
        }
        Ok::<_, String>(settings)
    };
    let ways: Vec<_> = WAYS.iter().filter(|w| w.0.contains(&arguments.ways)).collect();
    let mut rows: Vec<String> = ways.iter().map(|(name, _)| format!("| {name} |")).collect();
    let mut head = String::from("| error: median, 95th percentile, share within 1 % |");
    for name in &arguments.samples {
        let scene = samples::by_name(name, 0.3).ok_or_else(|| format!("there is no sample {name}"))?;
        let filled = |way: &str, overrides| {
            let mut settings = all_settings(overrides)?;
            if way.contains("environment") {
                settings.set("tracer.kind", "image-space").map_err(|e| e.to_string())?;
            }
            let mut offline = offline(gpu, &scene, &settings)?;
            offline.stand_still();
            offline.render_frame(None).map_err(|e| e.to_string())?;
            Ok::<_, String>((settings, offline))
        };
        let (_, mut base) = filled("", &[])?;
        let points = points(gpu, &base, arguments.points)?;
        let truths = all_truths(gpu, arguments, &scene, &points)?;
        let noise: Vec<f64> = truths.iter().map(|t| t[1] / t[0]).collect();
        head += &format!(" {name} (noise {:.2} %) |", 100.0 * median(&noise));
        for ((way, overrides), row) in ways.iter().zip(&mut rows) {
            let settings = all_settings(overrides)?;
            let light = match shape(&settings) {
                Some(shape) => {
                    let tile = (shape, settings.illumination_maps.hemisphere_size);
                    let mut draw = || Draws::new(gpu, &base, tile, &points)?.gather(gpu, &mut base);
                    draw().map_err(|e| e.to_string())?;
                    gathered(gpu, &base)?
                }
                None => gathered(gpu, &filled(way, overrides)?.1)?,
            };
            let frame = base.renderer.frame().ok_or("no frame")?;
            // Of the unit frame, in world units.
            let scale = f64::from(frame.output_scale(1.0).map_err(|e| e.to_string())?);
            let error = |(point, truth): (&Point, &[f64; 2])| {
                let own: f64 = light[point.texel][..3].iter().map(|&v| f64::from(v) * scale).sum();
                (own / truth[0] - 1.0).abs()
            };
            *row += &format!(" {} |", summary(points.iter().zip(&truths).map(error).collect()));
            // Frees what the way held.
            offline::wait(&gpu.device).map_err(|e| e.to_string())?;
        }
    }
    println!("{head}\n|{}", "---|".repeat(arguments.samples.len() + 1));
    rows.iter().for_each(|row| println!("{row}"));
    Ok(())
}

/// What draws go onto, if they gather.
fn shape(settings: &Settings) -> Option<GatherShape> {
    let own = &settings.illumination_maps;
    match own.method {
        TexelGatherMethod::Rays => None,
        TexelGatherMethod::Cube => Some(GatherShape::Cube),
        TexelGatherMethod::Plane => Some(GatherShape::Plane {
            half_side: own.half_side,
        }),
    }
}

/// Draws of some points, in tiles of their own.
struct Draws {
    pass: HemisphereGather,
    resources: HemisphereGatherResources,
    hemispheres: Hemispheres,
}

impl Draws {
    fn new(gpu: &Gpu, offline: &Offline<'_>, tile: (GatherShape, u32), points: &[Point]) -> Result<Self, Error> {
        let (device, queue) = (&gpu.device, &gpu.queue);
        let mut hemispheres = Hemispheres::new(device, queue, tile, points.len() as u32)?;
        if let Some(frame) = offline.renderer.frame() {
            let place = |point: &Point| HemispherePlace {
                position: frame.point(point.position),
                normal: point.normal.as_vec3(),
                texel: point.texel as u32,
            };
            hemispheres.set(queue, &points.iter().map(place).collect::<Vec<_>>())?;
        }
        Ok(Self {
            pass: HemisphereGather::new(device),
            resources: HemisphereGatherResources::new(device)?,
            hemispheres,
        })
    }

    /// Gathers at all of the points from the light that there is, and waits.
    fn gather(&mut self, gpu: &Gpu, offline: &mut Offline<'_>) -> Result<(), Error> {
        let (device, queue) = (&gpu.device, &gpu.queue);
        let mut views = self.hemispheres.views();
        (0..).zip(&mut views).for_each(|(index, view)| view.index = index);
        let renderer = &offline.renderer;
        let (Some(frame), Some(lights), Some(map)) =
            (renderer.frame(), renderer.surface_lights(), renderer.illumination_map())
        else {
            return Ok(());
        };
        offline
            .geometry
            .prepare(&PrepareContext { device, queue, frame }, &views)?;
        let inputs = HemisphereGatherInputs {
            queue,
            hemispheres: &self.hemispheres,
            geometry: &offline.geometry,
            views: &views,
            lights,
            map,
            timestamps: None,
        };
        let mut encoder = device.create_command_encoder(&Default::default());
        self.pass.record(&mut encoder, &mut self.resources, &inputs)?;
        queue.submit([encoder.finish()]);
        offline::wait(device)
    }
}

fn all_truths(gpu: &Gpu, arguments: &Arguments, scene: &Scene, points: &[Point]) -> Result<Vec<[f64; 2]>, String> {
    let paths = PathTracerSettings {
        component: PathComponent::All,
        // The surface that is seen scatters, too.
        bounces: arguments.bounces.saturating_sub(1),
        ..PathTracerSettings::default()
    };
    let mut reference = Reference::new(gpu, scene.clone(), &paths, 0, [POINT_SIZE; 2]).map_err(|e| e.to_string())?;
    let of_point = |point: &Point| reference.irradiance((point.position, point.normal), arguments.paths);
    points
        .iter()
        .map(of_point)
        .collect::<Result<_, _>>()
        .map_err(|e| e.to_string())
}

/// Median, 95th percentile, share within one percent.
fn summary(mut errors: Vec<f64>) -> String {
    if errors.is_empty() {
        return "no point sees light".to_owned();
    }
    errors.sort_by(f64::total_cmp);
    let at = |share: f64| 100.0 * errors[((share * errors.len() as f64) as usize).min(errors.len() - 1)];
    let within = errors.iter().filter(|&&e| e <= 0.01).count() as f64 / errors.len() as f64;
    format!("{:.2} %, {:.1} %, {:.0} %", at(0.5), at(0.95), 100.0 * within)
}

/// The table of times: what a texel costs by the scene's triangles.
pub(crate) fn times(gpu: &Gpu, arguments: &Arguments) -> Result<(), String> {
    const CELLS: [[u32; 2]; 3] = [[3, 1], [80, 81], [258, 258]];
    let scenes: Vec<Scene> = CELLS.iter().map(|&cells| samples::bumpy_floor(cells, 0.3)).collect();
    let head: Vec<String> = scenes
        .iter()
        .map(|s| format!("{} triangles", s.triangle_count()))
        .collect();
    println!("| µs a texel | {} |\n|---|---|---|---|", head.join(" | "));
    for (way, overrides) in WAYS[..WAYS.len() - 1].iter().filter(|w| w.0.contains(&arguments.ways)) {
        let mut row = format!("| {way} |");
        for scene in &scenes {
            row += &format!(" {:.0} |", 1e6 * seconds_of_texel(gpu, scene, overrides)?);
        }
        println!("{row}");
    }
    Ok(())
}

/// Places, and texels that draws are timed with.
const TIMED_PLACES: u32 = 500;
const TIMED_TEXELS: usize = 50;

fn seconds_of_texel(gpu: &Gpu, scene: &Scene, overrides: Overrides) -> Result<f64, String> {
    let settings = settings([TIMED_PLACES, 1000, 1], overrides)?;
    let rays = Settings {
        illumination_maps: IlluminationMapSettings {
            method: TexelGatherMethod::Rays,
            ..settings.illumination_maps
        },
        ..settings.clone()
    };
    let mut offline = offline(gpu, scene, &rays)?;
    let frame = |offline: &mut Offline<'_>| offline.render_frame(None).map_err(|e| e.to_string());
    if let Some(shape) = shape(&settings) {
        frame(&mut offline)?;
        let points = points(gpu, &offline, TIMED_TEXELS)?;
        let tile = (shape, settings.illumination_maps.hemisphere_size);
        let mut draws = Draws::new(gpu, &offline, tile, &points).map_err(|e| e.to_string())?;
        let seconds = timed(&mut || draws.gather(gpu, &mut offline).map_err(|e| e.to_string()))?;
        return Ok(seconds / points.len() as f64);
    }
    let with = timed(&mut || {
        offline.refill();
        frame(&mut offline)
    })?;
    let without = timed(&mut || frame(&mut offline))?;
    Ok((with - without) / (2 * offline.points.len()) as f64)
}

/// Median of five times, of six.
fn timed(work: &mut dyn FnMut() -> Result<(), String>) -> Result<f64, String> {
    work()?;
    let once = |_| {
        let start = Instant::now();
        work().map(|()| start.elapsed().as_secs_f64())
    };
    let all = (0..5).map(once).collect::<Result<Vec<_>, _>>()?;
    Ok(median(&all))
}
