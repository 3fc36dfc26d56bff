//! How evenly the work is spread over invocations that run together, and what would spread it better.

use super::bench::Bench;
use super::judge::{Truth, judge};
use super::selection::Selector;
use lightfall::Error;
use lightfall::glam::Vec3;
use lightfall::pass::{ImageSpaceTracer, ImageSpaceTracerSettings, TraceMethod};
use lightfall::resource::{Photon, SurfaceHit, SurfaceRay};

/// Invocations that run together on usual GPUs.
const GROUP: usize = 32;

/// How much each ray took: mean of all rays, and mean over groups of the most in each, which is what a group takes.
fn a_ray_and_a_group(hits: &[SurfaceHit], taken: impl Fn(&SurfaceHit) -> u32) -> [f64; 2] {
    let mean = hits.iter().map(|hit| f64::from(taken(hit))).sum::<f64>() / hits.len() as f64;
    let groups = hits
        .chunks(GROUP)
        .map(|group| f64::from(group.iter().map(&taken).max().unwrap_or(0)));
    [mean, groups.clone().sum::<f64>() / groups.count() as f64]
}

/// Which octant a direction points to.
fn octant(ray: &SurfaceRay) -> usize {
    let bit = |axis: usize| usize::from(ray.direction[axis] < 0.0) << axis;
    bit(0) | bit(1) | bit(2)
}

/// Prints what rays sorted in several ways, and walks that give up, cost a group.
pub(crate) fn table(
    bench: &mut Bench<'_>,
    selector: &mut Selector,
    (rays, truths): (&[SurfaceRay], &[Option<Truth>]),
) -> Result<(), Error> {
    let maps = super::usual_maps(bench, selector)?;
    let nearest = |ray: &SurfaceRay| {
        let to = |&c: &Vec3| c.distance_squared(ray.position.into());
        let all = maps.maps.centers().iter().map(to).enumerate();
        all.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |n| n.0)
    };
    println!("\nOrderedWalk, 8 maps of 256²; groups of {GROUP}. µs are of this adapter.\n");
    println!("| rays | steps: a ray, a group | fetches: a ray, a group | lanes busy | µs a ray | again → hybrid |");
    println!("|---|---|---|---|---|---|");
    let tracer = ImageSpaceTracer::new(&bench.gpu.device, TraceMethod::OrderedWalk);
    type Order<'a> = (&'a str, &'a dyn Fn(&SurfaceRay) -> (usize, usize, usize));
    let cell = |ray: &SurfaceRay| {
        let axis = |a: usize| ((ray.position[a] + 1.0) * 4.0) as usize;
        axis(0) | axis(1) << 4 | axis(2) << 8
    };
    let facing = |ray: &SurfaceRay| {
        let n = Photon::unpack_unit_vector(ray.normal);
        n.abs().max_position() * 2 + usize::from(n[n.abs().max_position()] < 0.0)
    };
    let orders: [Order<'_>; 4] = [
        ("in order of paths", &|_| (0, 0, 0)),
        ("sorted by nearest map", &|r| (nearest(r), 0, 0)),
        ("sorted by nearest map and octant", &|r| (nearest(r), octant(r), 0)),
        ("sorted by place, side and octant", &|r| (cell(r), facing(r), octant(r))),
    ];
    for (name, key) in orders {
        let mut order: Vec<usize> = (0..rays.len()).collect();
        order.sort_by_key(|&i| key(&rays[i]));
        let sorted: Vec<_> = order.iter().map(|&i| rays[i]).collect();
        let sorted_truths: Vec<_> = order.iter().map(|&i| truths[i]).collect();
        let traced = bench.trace(&tracer, &ImageSpaceTracerSettings::default(), &maps, &sorted)?;
        row(bench, name, &traced, &sorted_truths);
    }
    for most_fetches in [400, 200, 100, 50] {
        let settings = ImageSpaceTracerSettings {
            most_fetches,
            ..Default::default()
        };
        let traced = bench.trace(&tracer, &settings, &maps, rays)?;
        row(
            bench,
            &format!("in order of paths, given up after {most_fetches} fetches"),
            &traced,
            truths,
        );
    }
    Ok(())
}

fn row(bench: &Bench<'_>, name: &str, (hits, ms): &(Vec<SurfaceHit>, f64), truths: &[Option<Truth>]) {
    let [steps, group_steps] = a_ray_and_a_group(hits, |hit| hit.steps);
    let [fetches, group_fetches] = a_ray_and_a_group(hits, |hit| hit.fetches);
    let verdict = judge(truths, hits, bench.diagonal);
    println!(
        "| {name} | {steps:.1}, {group_steps:.1} | {fetches:.1}, {group_fetches:.1} | {:.0} % | {:.2} | {:.2} → {:.2} |",
        100.0 * steps / group_steps,
        ms * 1e3 / hits.len() as f64,
        100.0 * verdict.again,
        100.0 * verdict.hybrid
    );
}
