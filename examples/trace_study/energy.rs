//! How much light the photon walk loses or puts in the wrong place, hop by hop.

use super::bench::{BOUNCES, Bench};
use super::judge::agrees;
use super::selection::Selector;
use lightfall::Error;
use lightfall::frame::{Settings, TracerKind};
use lightfall::glam::Vec3;
use lightfall::pass::{CoverageMeasure, ImageSpaceTracerSettings, TraceMethod};
use lightfall::resource::{Photon, PhotonState, SurfaceRay};

/// Paths of each walk, which take the same random numbers.
const PATHS: u32 = 60_000;

/// Flux over the three channels of photons that were stored.
fn stored(photons: &[Photon]) -> f64 {
    let arrived = photons.iter().filter(|p| p.state() == PhotonState::Stored);
    arrived.map(flux).sum()
}

fn flux(photon: &Photon) -> f64 {
    photon.flux.iter().map(|&f| f64::from(f)).sum()
}

/// Prints, for each tracer, what of the flux that should arrive at a hop does not, and what of that which arrives does so in
/// the wrong place, judged ray by ray from where it left.
pub(crate) fn table(bench: &mut Bench<'_>, selector: &mut Selector) -> Result<(), Error> {
    println!("\nFlux of {PATHS} paths, hops 1 to {BOUNCES}, %: lost, against the walk over triangles; misplaced.\n");
    println!("| tracer | maps | size | lost | misplaced |");
    println!("|---|---|---|---|---|");
    let base = Settings {
        photons: PATHS,
        bounces: BOUNCES,
        shadow_map_size: 1024,
        ..Settings::balanced()
    };
    let right = bench.photons(
        &Settings {
            tracer_kind: TracerKind::Bvh,
            ..base.clone()
        },
        &[],
    )?;
    let hops = |photons: &[Photon]| {
        photons
            .chunks_exact(PATHS as usize)
            .map(<[_]>::to_vec)
            .collect::<Vec<_>>()
    };
    let right: Vec<f64> = hops(&right).iter().map(|hop| stored(hop)).collect();
    for (count, size) in [(8, 256), (12, 512), (20, 512)] {
        let centers = selector.select(bench, count, CoverageMeasure::Photons)?.centers;
        let kinds = TraceMethod::ALL.map(|method| (TracerKind::ImageSpace, method));
        let sure = |(kind, method)| (kind, method, false);
        let hybrids = [
            (TracerKind::Hybrid, TraceMethod::OrderedMarch, false),
            (TracerKind::Hybrid, TraceMethod::OrderedWalk, false),
            (TracerKind::Hybrid, TraceMethod::VerifiedWalk, false),
            (TracerKind::Hybrid, TraceMethod::VerifiedWalk, true),
        ];
        for (tracer_kind, trace_method, doubts_normals) in kinds.map(sure).into_iter().chain(hybrids) {
            let settings = Settings {
                tracer: ImageSpaceTracerSettings {
                    doubts_normals,
                    ..base.tracer
                },
                env_map_count: count,
                env_map_size: size,
                tracer_kind,
                trace_method,
                ..base.clone()
            };
            let walked = hops(&bench.photons(&settings, &centers)?);
            let mut cells = [Vec::new(), Vec::new()];
            for hop in 1..=BOUNCES as usize {
                cells[0].push(format!("{:.2}", 100.0 * (1.0 - stored(&walked[hop]) / right[hop])));
                let misplaced = misplaced(bench, &walked[hop - 1], &walked[hop])?;
                cells[1].push(format!("{:.2}", 100.0 * misplaced));
            }
            let name = match (tracer_kind, doubts_normals) {
                (TracerKind::Hybrid, true) => format!("{trace_method:?}, hybrid that doubts normals"),
                (TracerKind::Hybrid, false) => format!("{trace_method:?}, hybrid"),
                _ => format!("{trace_method:?}"),
            };
            let [lost, misplaced] = cells.map(|c| c.join(", "));
            println!("| {name} | {count} | {size} | {lost} | {misplaced} |");
        }
    }
    Ok(())
}

/// Share of the flux stored at a hop that arrived elsewhere than the same ray does among triangles.
fn misplaced(bench: &Bench<'_>, from: &[Photon], to: &[Photon]) -> Result<f64, Error> {
    let arrived: Vec<_> = from
        .iter()
        .zip(to)
        .filter(|(_, p)| p.state() == PhotonState::Stored)
        .collect();
    let ray = |(from, to): &(&Photon, &Photon)| {
        let position = Vec3::from(from.position);
        SurfaceRay::new(
            position,
            Photon::unpack_unit_vector(from.normal),
            (Vec3::from(to.position) - position).normalize_or(Vec3::Y),
        )
    };
    let rays: Vec<_> = arrived.iter().map(ray).collect();
    let truths = bench.truths(&rays)?;
    let wrong = arrived.iter().zip(&rays).zip(&truths).filter(|((pair, ray), truth)| {
        let distance = (Vec3::from(pair.1.position) - Vec3::from(ray.position)).length();
        truth
            .as_ref()
            .is_none_or(|t| !agrees(t, distance, Photon::unpack_unit_vector(pair.1.normal), bench.diagonal)[1])
    });
    let wrong: f64 = wrong.map(|((pair, _), _)| flux(pair.1)).sum();
    Ok(wrong / stored(to).max(f64::MIN_POSITIVE))
}
