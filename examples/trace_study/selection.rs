//! Where maps stand: the places that the selector chooses against random ones and against the best that is known.

use super::bench::{BOUNCES, Bench};
use super::common::adapter::Gpu;
use lightfall::Error;
use lightfall::frame::{Settings, TracerKind};
use lightfall::glam::Vec3;
use lightfall::pass::{
    CoverageMeasure, EnvMapSelector, EnvMapSelectorInputs, EnvMapSelectorResources, EnvMapSelectorSettings,
    ImageSpaceTracer, ImageSpaceTracerSettings, SelectBlockingInputs, Selection, SelectionStep, Sight, TraceMethod,
};
use lightfall::resource::{CaptureView, Photons, SurfaceRay};

/// Photons that tell the selector what light reaches.
const PHOTONS: u32 = 100_000;
/// Most maps in the table.
const MOST: u32 = 16;

/// Candidates of a scene, captured, and photons to choose by.
pub(crate) struct Selector {
    pass: EnvMapSelector,
    resources: EnvMapSelectorResources,
    settings: EnvMapSelectorSettings,
    photons: Option<Photons>,
    tag: u32,
}

impl Selector {
    pub(crate) fn new(bench: &mut Bench<'_>, candidates: u32) -> Result<Self, Error> {
        let Gpu { device, queue, .. } = bench.gpu;
        let mut resources = EnvMapSelectorResources::new(device, candidates)?;
        let bounds = bench.scene.bounds()?;
        let (min, max) = (bench.frame.point(bounds.min), bench.frame.point(bounds.max));
        resources.set_candidates(queue, &EnvMapSelector::candidates(min, max, candidates))?;
        let mut selector = Self {
            pass: EnvMapSelector::new(device),
            resources,
            settings: EnvMapSelectorSettings {
                candidates,
                coverage_target: 1.0,
                ..Default::default()
            },
            photons: None,
            tag: 0,
        };
        let settings = Settings {
            tracer_kind: TracerKind::Bvh,
            photons: PHOTONS,
            bounces: BOUNCES,
            ..Settings::balanced()
        };
        let records = bench.photons(&settings, &[])?;
        let photons = Photons::new(device, PHOTONS, BOUNCES)?;
        queue.write_buffer(photons.buffer(), 0, bytemuck::cast_slice(&records));
        selector.photons = Some(photons);
        Ok(selector)
    }

    /// The best places for `limit` maps, by photons as soon as there are any.
    pub(crate) fn select(
        &mut self,
        bench: &mut Bench<'_>,
        limit: u32,
        measure: CoverageMeasure,
    ) -> Result<Selection, Error> {
        self.tag += 1;
        let inputs = SelectBlockingInputs {
            queue: &bench.gpu.queue,
            frame: &bench.frame,
            limit,
            tag: self.tag,
            photons: self.photons.as_ref().filter(|_| measure == CoverageMeasure::Photons),
            settings: &self.settings,
        };
        self.pass
            .select_blocking(&mut self.resources, &inputs, &mut bench.geometry)
    }

    pub(crate) fn candidates(&self) -> &[Vec3] {
        self.resources.candidates()
    }

    pub(crate) fn sights(&self, bench: &Bench<'_>) -> Result<Vec<Sight>, Error> {
        self.resources.sights_blocking(&bench.gpu.device, &bench.gpu.queue)
    }
}

/// For each candidate, a bit for each point that it truly sees.
struct Sights(Vec<Vec<u64>>);

impl Sights {
    fn union(&self, chosen: &[usize]) -> Vec<u64> {
        let mut union = vec![0; self.0[0].len()];
        for &candidate in chosen {
            union
                .iter_mut()
                .zip(&self.0[candidate])
                .for_each(|(u, bits)| *u |= bits);
        }
        union
    }

    fn covered(&self, chosen: &[usize]) -> u32 {
        self.union(chosen).iter().map(|bits| bits.count_ones()).sum()
    }

    /// Greedy, then the best exchange of one for another until there is none.
    fn best(&self, valid: &[usize], count: usize) -> Vec<usize> {
        let mut chosen: Vec<usize> = Vec::new();
        while chosen.len() < count.min(valid.len()) {
            let union = self.union(&chosen);
            let gain = |c: &&usize| -> u32 {
                let new = self.0[**c].iter().zip(&union).map(|(bits, u)| (bits & !u).count_ones());
                new.sum()
            };
            let free = valid.iter().filter(|c| !chosen.contains(c));
            chosen.extend(free.max_by_key(gain));
        }
        let mut covered = self.covered(&chosen);
        loop {
            let mut best = None;
            for place in 0..chosen.len() {
                let others: Vec<usize> = (0..chosen.len()).filter(|&p| p != place).map(|p| chosen[p]).collect();
                let union = self.union(&others);
                for &candidate in valid.iter().filter(|c| !chosen.contains(c)) {
                    let seen = self.0[candidate].iter().zip(&union);
                    let total: u32 = seen.map(|(bits, u)| (bits | u).count_ones()).sum();
                    if total > covered {
                        covered = total;
                        best = Some((place, candidate));
                    }
                }
            }
            match best {
                Some((place, candidate)) => chosen[place] = candidate,
                None => return chosen,
            }
        }
    }
}

/// Prints, for each number of maps, which share of the points that light reaches they truly see.
pub(crate) fn table(bench: &mut Bench<'_>, selector: &mut Selector, points: &[(Vec3, Vec3)]) -> Result<(), Error> {
    let mut sights = Sights(vec![vec![0; points.len().div_ceil(64)]; selector.candidates().len()]);
    for (first, group) in (0..).step_by(32).zip(selector.candidates().chunks(32)) {
        for (point, seen) in bench.seen_from(points, group)?.into_iter().enumerate() {
            for offset in (0..group.len()).filter(|&o| seen >> o & 1 == 1) {
                sights.0[first + offset][point / 64] |= 1 << (point % 64);
            }
        }
    }
    selector.select(bench, 1, CoverageMeasure::Area)?;
    let valid: Vec<usize> = (0..)
        .zip(selector.sights(bench)?)
        .filter(|(_, s)| s.is_valid)
        .map(|(c, _)| c)
        .collect();
    let percent = |chosen: &[usize]| 100.0 * f64::from(sights.covered(chosen)) / points.len() as f64;
    println!(
        "\nSeen, %: {} candidates, {} valid, which together see {:.2}.\n",
        selector.candidates().len(),
        valid.len(),
        percent(&valid)
    );
    println!("| k | random, mean of 100 and least | Eq. 1 | photons | exact | photons against exact |");
    println!("|---|---|---|---|---|---|");
    let mut random = 1u64;
    for k in 1..=MOST {
        let draws: Vec<f64> = (0..100)
            .map(|_| {
                let mut pool = valid.clone();
                let drawn: Vec<usize> = (0..k as usize)
                    .map_while(|_| {
                        // A linear congruential sequence (Knuth's constants).
                        random = random
                            .wrapping_mul(6_364_136_223_846_793_005)
                            .wrapping_add(1_442_695_040_888_963_407);
                        (!pool.is_empty()).then(|| pool.swap_remove((random >> 33) as usize % pool.len()))
                    })
                    .collect();
                percent(&drawn)
            })
            .collect();
        let mean = draws.iter().sum::<f64>() / draws.len() as f64;
        let least = draws.iter().copied().fold(f64::INFINITY, f64::min);
        let area = percent(&selector.select(bench, k, CoverageMeasure::Area)?.candidates);
        let photons = percent(&selector.select(bench, k, CoverageMeasure::Photons)?.candidates);
        let exact = percent(&sights.best(&valid, k as usize));
        println!(
            "| {k} | {mean:.2}, {least:.2} | {area:.2} | {photons:.2} | {exact:.2} | {:.2} |",
            100.0 * photons / exact
        );
    }
    Ok(())
}

/// Prints what each step takes: selection, maintenance, capture, hierarchies, tracing.
pub(crate) fn times(bench: &mut Bench<'_>, selector: &mut Selector, rays: &[SurfaceRay]) -> Result<(), Error> {
    let maps = super::usual_maps(bench, selector)?;
    let all = selector.candidates().len();
    let mut views: Vec<CaptureView> = selector.resources.views(0..all).collect();
    bench.prepare(&mut views)?;
    println!(
        "\nMilliseconds on the wall; 8 maps of 256², {all} candidates, {} rays.\n",
        rays.len()
    );
    println!("| step | ms |");
    println!("|---|---|");
    let part = all.div_ceil(selector.settings.interval as usize);
    for (name, candidates, step) in [
        ("capture of all candidates", 0..all, SelectionStep::Capture),
        ("selection of 8, by photons", 0..0, SelectionStep::Select),
        (
            "capture of a fifth of the candidates, each frame of a scene that changes",
            0..part,
            SelectionStep::Capture,
        ),
        ("one maintenance step, each fifth frame", 0..0, SelectionStep::Maintain),
    ] {
        let inputs = EnvMapSelectorInputs {
            queue: &bench.gpu.queue,
            geometry: &bench.geometry,
            views: &views[..6 * candidates.len()],
            candidates,
            step,
            limit: 8,
            radius: bench.frame.radius(),
            tag: selector.tag,
            provisional: None,
            photons: selector.photons.as_ref(),
            settings: &selector.settings,
            timestamps: None,
        };
        let ms = bench.time(|encoder| {
            selector.pass.record(encoder, &mut selector.resources, &inputs);
            Ok(())
        })?;
        println!("| {name} | {ms:.1} |");
    }
    println!("| capture of 8 maps | {:.1} |", maps.capture_ms);
    println!("| their hierarchies | {:.1} |", maps.build_ms);
    for method in TraceMethod::ALL {
        let tracer = ImageSpaceTracer::new(&bench.gpu.device, method);
        let (_, ms) = bench.trace(&tracer, &ImageSpaceTracerSettings::default(), &maps, rays)?;
        println!("| rays, {method:?} | {ms:.1} |");
    }
    Ok(())
}
