//! How fine texels are to lie: error, kinks and time by the number along a wall, where a host lays them out itself.
//!
//! The sample `cornell`, whose faces are quadrilaterals: rows and columns of texels on each, as a host's light map would have
//! them, as dense on blocks as on the floor. The truth is path traced; what its noise adds to errors is taken off.

use crate::Arguments;
use crate::common::adapter::Gpu;
use crate::common::clock::median;
use crate::common::offline::{self, Component, Offline};
use crate::picture::{SIZE, errors, truth};
use lightfall::frame::{IndirectMethod, Settings};
use lightfall::glam::Vec3;
use lightfall::reference::PathEstimate;
use lightfall::scene::{Scene, SurfacePoint, samples};
use std::time::Instant;

/// Texels along the floor.
const ALONG: [u32; 5] = [5, 10, 20, 30, 50];

const BOUNCES: u32 = 2;

/// Prints the table.
pub(crate) fn table(gpu: &Gpu, _: &Arguments) -> Result<(), String> {
    let scene = samples::cornell(0.3);
    let truth = truth(gpu, &scene, BOUNCES)?;
    println!("{SIZE} × {SIZE} pixels, {BOUNCES} bounces\n");
    println!("| along the floor | places | photons | relMSE | bias | kinks | ms to gather all | ms a frame |");
    println!("|---|---|---|---|---|---|---|---|");
    // Photons, and how many the light of a texel is taken from at least.
    for [photons, least] in [[200_000, 0], [20_000, 0], [20_000, 100]] {
        for along in ALONG {
            println!("{}", measure(gpu, &scene, &truth, [along, photons, least])?);
        }
    }
    Ok(())
}

/// A texel in the middle of each cell of the faces of a scene, all of which are quadrilaterals.
fn light_map(scene: &Scene, along: u32) -> Vec<SurfacePoint> {
    let mut points = Vec::new();
    let mut surface = 0;
    let floor = Vec3::from(scene.meshes[0].positions[2]).x;
    for (index, instance) in scene.instances.iter().enumerate() {
        let mesh = &scene.meshes[instance.mesh];
        for corners in mesh.positions.chunks_exact(4) {
            let [a, b, _, d] = [0, 1, 2, 3].map(|i| Vec3::from(corners[i]));
            let (right, up) = (d - a, b - a);
            let cells = |side: Vec3| ((along as f32 * side.length() / floor).round() as u32).max(1);
            let (columns, rows) = (cells(right), cells(up));
            let normal = up.cross(Vec3::from(corners[2]) - a).normalize();
            for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
                let part = |i: u32, count: u32| (i as f32 + 0.5) / count as f32;
                points.push(SurfacePoint {
                    instance: index,
                    position: a + part(column, columns) * right + part(row, rows) * up,
                    normal,
                    areas: [f64::from(right.cross(up).length()) / f64::from(columns * rows); 2],
                    surface,
                });
            }
            surface += 1;
        }
    }
    points
}

fn measure(
    gpu: &Gpu,
    scene: &Scene,
    truth: &PathEstimate,
    [along, photons, least]: [u32; 3],
) -> Result<String, String> {
    let mut settings = Settings {
        indirect_method: IndirectMethod::IlluminationMaps,
        bounces: BOUNCES,
        photons,
        ..Settings::balanced()
    };
    let points = light_map(scene, along);
    settings.illumination_maps.texels = points.len() as u32;
    settings.illumination_maps.gather.a_frame = 4000;
    settings.illumination_maps.gather.least_photons = least;
    for (key, value) in [
        ("tracer.kind", "bvh"),
        ("emission.first_hits", "traced"),
        ("splatter.subsampling", "1"),
    ] {
        settings.set(key, value).map_err(|e| e.to_string())?;
    }
    let size = [SIZE; 2];
    let offline = Offline::new(gpu, scene.clone(), &settings, 0, size, Component::Indirect);
    let mut offline = offline.map_err(|e| e.to_string())?;
    offline.points = points;
    let time = |offline: &mut Offline<'_>, is_filled: bool| {
        let mut all = Vec::new();
        for _ in 0..3 {
            if is_filled {
                offline.refill();
            }
            let start = Instant::now();
            offline.render_frame(None).map_err(|e| e.to_string())?;
            offline::wait(&gpu.device).map_err(|e| e.to_string())?;
            all.push(1e3 * start.elapsed().as_secs_f64());
        }
        Ok::<_, String>(median(&all))
    };
    let with = time(&mut offline, true)?;
    let without = time(&mut offline, false)?;
    let own = offline.read().map_err(|e| e.to_string())?;
    let [relative, bias] = errors(&own, truth)?;
    Ok(format!(
        "| {along} | {} | {photons}{} | {relative:.4} | {:+.1} % | {:.3} | {:.0} | {without:.0} |",
        offline.points.len(),
        if least > 0 {
            format!(", {least} at least")
        } else {
            String::new()
        },
        100.0 * bias,
        kinks(&own),
        with - without,
    ))
}

/// Median of how far a pixel is from the middle of those to its left and right, over its light, where it is not an edge.
fn kinks(image: &[[f32; 3]]) -> f64 {
    let rows = image.chunks_exact(SIZE as usize);
    let of_pixel = |w: &[[f32; 3]]| {
        let at = |i: usize| w[i].iter().map(|&v| f64::from(v)).sum::<f64>();
        (at(0) + at(2) - 2.0 * at(1)).abs() / at(1).max(1e-9)
    };
    let all: Vec<f64> = rows
        .flat_map(|row| row.windows(3).map(of_pixel))
        .filter(|k| *k < 0.3)
        .collect();
    median(&all)
}
