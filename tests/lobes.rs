//! Lobes against an `f64` quadrature: do samplers draw what their densities say, and how much light is scattered?
//!
//! Rough lobes are integrated over facet normals h in the coordinates (s, φ), c = 1 − (1 − s)², tan²θ_h = α² c / (1 − c),
//! in which D(h) cosθ_h dω = dc dφ / 2π and visible normals have the bounded density 2 (1 − s) G₁(o) (o·h) / (o_z cosθ_h).

mod common;

use common::evaluate::run;
use common::gpu;
use lightfall::glam::DVec3;
use std::f64::consts::{PI, TAU};

const ROUGHNESS: [f64; 5] = [0.1, 0.25, 0.4, 0.6, 0.9];
const DEGREES: [f64; 5] = [5.0, 30.0, 55.0, 75.0, 85.0];
const CASES: usize = ROUGHNESS.len() * DEGREES.len();
/// Samples of each case.
const SAMPLES: u32 = 1 << 17;
const INDEX: f64 = 1.5;
/// Bins of s and of φ.
const BINS: usize = 12;
/// Points of the quadrature in a bin, along each axis.
const POINTS: usize = 16;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Lobe {
    Metal,
    /// From outside.
    Glass,
    /// From inside.
    GlassBack,
}

impl Lobe {
    /// The scatterer of a case, and the direction `o` that it is seen from.
    fn wgsl(self, case: &str) -> String {
        let list = |values: [f64; 5]| values.map(|v| format!("{v:.9}")).join(", ");
        let (metallic, transmission, is_front) = match self {
            Self::Metal => ("1.0", "0.0", "true"),
            Self::Glass => ("0.0", "1.0", "true"),
            Self::GlassBack => ("0.0", "1.0", "false"),
        };
        format!(
            "var roughness = array<f32, 5>({}); var angles = array<f32, 5>({});
            let a = angles[{case} % 5u]; let r = roughness[{case} / 5u];
            let o = vec3f(sin(a), 0.0, cos(a));
            let s = scatter_by(vec3f(0.0, 0.0, 1.0), {is_front}, vec3f(1.0), {metallic}, r, {transmission}, {INDEX});",
            list(ROUGHNESS),
            list(DEGREES.map(f64::to_radians)),
        )
    }

    /// Index of the far side over that of the near one.
    fn eta(self) -> f64 {
        match self {
            Self::GlassBack => 1.0 / INDEX,
            _ => INDEX,
        }
    }
}

fn eye(case: usize) -> DVec3 {
    let a = DEGREES[case % 5].to_radians();
    DVec3::new(a.sin(), 0.0, a.cos())
}

fn alpha(case: usize) -> f64 {
    ROUGHNESS[case / 5].powi(2)
}

/// Smith's share of facets that are lit from v.
fn lit(v: DVec3, alpha: f64) -> f64 {
    let tangent_squared = (v.x * v.x + v.y * v.y) / (v.z * v.z);
    2.0 / (1.0 + (1.0 + alpha * alpha * tangent_squared).sqrt())
}

/// Share that is reflected, and the cosine of the refracted direction.
fn fresnel(cosine: f64, eta: f64) -> (f64, f64) {
    let squared = 1.0 - (1.0 - cosine * cosine) / (eta * eta);
    if squared <= 0.0 {
        return (1.0, 0.0);
    }
    let refracted = squared.sqrt();
    let parallel = (eta * cosine - refracted) / (eta * cosine + refracted);
    let perpendicular = (cosine - eta * refracted) / (cosine + eta * refracted);
    (0.5 * (parallel * parallel + perpendicular * perpendicular), refracted)
}

/// A point of the quadrature: where light goes that the facet turns, by which way, and how much of it.
struct Point {
    bin: usize,
    direction: DVec3,
    /// Of all that is drawn.
    probability: f64,
    /// Solid angle of directions that it stands for.
    solid_angle: f64,
}

/// Facets by their normals, each with what it reflects and what it lets through.
fn quadrature(lobe: Lobe, case: usize) -> Vec<Point> {
    let (o, alpha, eta) = (eye(case), alpha(case), lobe.eta());
    let steps = BINS * POINTS;
    let mut points = Vec::with_capacity(2 * steps * steps);
    for (i, j) in (0..steps * steps).map(|k| (k / steps, k % steps)) {
        let s = (i as f64 + 0.5) / steps as f64;
        let phi = TAU * (j as f64 + 0.5) / steps as f64;
        let above = (1.0 - s) * (1.0 - s);
        let tangent = alpha * ((1.0 - above) / above).sqrt();
        let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
        let h = cosine * DVec3::new(tangent * phi.cos(), tangent * phi.sin(), 1.0);
        let facing = o.dot(h);
        if facing <= 0.0 {
            continue;
        }
        let projected = 2.0 * (1.0 - s) / (steps * steps) as f64;
        let seen = projected * lit(o, alpha) * facing / (o.z * cosine);
        // D = dc dφ / (2π cosθ dω)
        let spread = tangent * tangent + alpha * alpha;
        let density = alpha * alpha / (PI * cosine.powi(4) * spread * spread);
        let facet_angle = projected / (density * cosine);
        let bin = i / POINTS * BINS + j / POINTS;
        let (reflected, refracted) = match lobe {
            Lobe::Metal => (1.0, 0.0),
            _ => fresnel(facing, eta),
        };
        points.push(Point {
            bin,
            direction: 2.0 * facing * h - o,
            probability: seen * reflected,
            solid_angle: 4.0 * facing * facet_angle,
        });
        if reflected < 1.0 {
            let direction = (facing / eta - refracted) * h - o / eta;
            let bent = facing + eta * direction.dot(h);
            points.push(Point {
                bin: BINS * BINS + bin,
                direction,
                probability: seen * (1.0 - reflected),
                solid_angle: bent * bent / (eta * eta * direction.dot(h).abs()) * facet_angle,
            });
        }
    }
    // On the wrong side of the surface other facets are in the way.
    let is_free = |p: &Point| (p.direction.z > 0.0) == (p.bin < BINS * BINS);
    points.retain(is_free);
    points
}

/// The bin of a sampled direction.
fn bin_of(lobe: Lobe, case: usize, direction: DVec3) -> usize {
    let (o, eta) = (eye(case), lobe.eta());
    let is_reflected = direction.z > 0.0;
    let mut h = if is_reflected {
        o + direction
    } else {
        -(o + eta * direction)
    }
    .normalize();
    if h.z < 0.0 {
        h = -h;
    }
    let tangent_squared = (h.x * h.x + h.y * h.y) / (h.z * h.z);
    let above = alpha(case).powi(2) / (alpha(case).powi(2) + tangent_squared);
    let place = |u: f64| ((u * BINS as f64) as usize).min(BINS - 1);
    let bin = place(1.0 - above.sqrt()) * BINS + place(h.y.atan2(h.x).rem_euclid(TAU) / TAU);
    if is_reflected { bin } else { BINS * BINS + bin }
}

/// How many standard deviations χ² of so many degrees of freedom is above its mean (Wilson and Hilferty 1931).
fn deviations(chi_squared: f64, freedom: f64) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    ((chi_squared / freedom).cbrt() - (1.0 - spread)) / spread.sqrt()
}

/// χ² of counts against what is expected, rare bins put together; in standard deviations.
fn chi_square(counts: &[f64], expected: &[f64]) -> f64 {
    let (mut sum, mut freedom, mut rare) = (0.0, -1.0, [0.0; 2]);
    let mut add = |count: f64, expected: f64| {
        sum += (count - expected).powi(2) / expected;
        freedom += 1.0;
    };
    for (&count, &expected) in counts.iter().zip(expected) {
        if expected < 10.0 {
            rare[0] += count;
            rare[1] += expected;
        } else {
            add(count, expected);
        }
    }
    if rare[1] >= 10.0 {
        add(rare[0], rare[1]);
    } else {
        // Too few to say more than that there are few.
        assert!(rare[0] < rare[1] + 40.0, "{rare:?}");
    }
    deviations(sum, freedom)
}

#[test]
fn rough_lobes_are_drawn_as_their_densities_say_and_scatter_what_a_quadrature_finds() {
    let Some(gpu) = gpu() else { return };
    for lobe in [Lobe::Metal, Lobe::Glass, Lobe::GlassBack] {
        let inputs: Vec<[u32; 4]> = (0..CASES as u32)
            .flat_map(|case| (0..SAMPLES).map(move |i| [case, i, 7, 0]))
            .collect();
        let body = format!(
            "{}
            let random = vec4f(hash_pcg4d(input) >> vec4u(8u)) * 0x1p-24;
            let drawn = scatter_sample(s, o, random);
            return vec4f(drawn.direction, drawn.weight.x * drawn.squeeze);",
            lobe.wgsl("input.x")
        );
        let drawn = run(&gpu, &body, &inputs);
        let points: Vec<_> = (0..CASES).map(|case| quadrature(lobe, case)).collect();
        // One point in seven is enough for a density.
        let sparse = |case: usize| points[case].iter().step_by(7);
        let directions: Vec<[f32; 4]> = (0..CASES)
            .flat_map(|case| sparse(case).map(move |p| p.direction.as_vec3().extend(case as f32).to_array()))
            .collect();
        let body = format!(
            "{} return scatter_evaluate(s, o, input.xyz);",
            lobe.wgsl("u32(input.w)")
        );
        let mut evaluated = run(&gpu, &body, &directions).into_iter();
        let mut worst = [0f64; 3];
        for case in 0..CASES {
            let mut expected = vec![0.0; 2 * BINS * BINS + 1];
            let mut albedo = 0.0;
            for point in &points[case] {
                expected[point.bin] += point.probability * f64::from(SAMPLES);
                albedo += point.probability * lit(point.direction, alpha(case));
            }
            let free: f64 = expected.iter().sum();
            expected[2 * BINS * BINS] = f64::from(SAMPLES) - free;
            let mut counts = vec![0.0; expected.len()];
            let mut scattered = 0.0;
            for &[x, y, z, weight] in &drawn[case * SAMPLES as usize..][..SAMPLES as usize] {
                let direction = DVec3::new(x.into(), y.into(), z.into());
                let bin = match weight > 0.0 {
                    true => bin_of(lobe, case, direction),
                    false => 2 * BINS * BINS,
                };
                counts[bin] += 1.0;
                scattered += f64::from(weight) / f64::from(SAMPLES);
            }
            let (mut integral, mut wanted) = (0.0, 0.0);
            for (point, found) in sparse(case).zip(&mut evaluated) {
                integral += f64::from(found[3]) * point.solid_angle;
                wanted += point.probability;
            }
            let figures = [
                chi_square(&counts, &expected),
                (scattered / albedo - 1.0).abs(),
                (integral / wanted - 1.0).abs(),
            ];
            for (worst, figure) in worst.iter_mut().zip(figures) {
                *worst = worst.max(figure);
            }
            let name = format!("{lobe:?}, roughness {}, {}°", ROUGHNESS[case / 5], DEGREES[case % 5]);
            assert!(figures[0] < 4.0, "{name}: χ² is {:.1} deviations too large", figures[0]);
            assert!(figures[1] < 5e-3, "{name}: scatters {scattered}, expected {albedo}");
            assert!(
                figures[2] < 1e-3,
                "{name}: the density integrates to {integral}, expected {wanted}"
            );
        }
        println!(
            "{lobe:?}, 5 × 5: χ² at most {:.2} deviations, albedo off by {:.3} %, density by {:.4} %",
            worst[0],
            100.0 * worst[1],
            100.0 * worst[2]
        );
    }
}

/// Exponents of Phong lobes.
const EXPONENTS: [f64; 5] = [1.0, 10.0, 100.0, 1000.0, 20_000.0];

#[test]
fn phong_lobes_are_drawn_as_their_densities_say_and_scatter_what_a_quadrature_finds() {
    let Some(gpu) = gpu() else { return };
    let inputs: Vec<[u32; 4]> = (0..CASES as u32)
        .flat_map(|case| (0..SAMPLES).map(move |i| [case, i, 13, 0]))
        .collect();
    let scatterer = |case: &str| {
        let list = |values: [f64; 5]| values.map(|v| format!("{v:.9}")).join(", ");
        format!(
            "var exponents = array<f32, 5>({}); var angles = array<f32, 5>({});
            let a = angles[{case} % 5u]; let o = vec3f(sin(a), 0.0, cos(a));
            let s = scatter_by(vec3f(0.0, 0.0, 1.0), true, vec3f(1.0), 1.0, -exponents[{case} / 5u], 0.0, {INDEX});",
            list(EXPONENTS),
            list(DEGREES.map(f64::to_radians)),
        )
    };
    let body = format!(
        "{}
        let random = vec4f(hash_pcg4d(input) >> vec4u(8u)) * 0x1p-24;
        let drawn = scatter_sample(s, o, random);
        return vec4f(drawn.direction, drawn.weight.x);",
        scatterer("input.x")
    );
    let drawn = run(&gpu, &body, &inputs);
    // The lobe about the mirrored direction, in u = cosⁿ⁺¹ and φ, in which it is uniform.
    let steps = BINS * POINTS;
    let points: Vec<Vec<(usize, DVec3, f64)>> = (0..CASES)
        .map(|case| {
            let (o, n) = (eye(case), EXPONENTS[case / 5]);
            let mirrored = DVec3::new(-o.x, -o.y, o.z);
            let (across, up) = (DVec3::Y, mirrored.cross(DVec3::Y));
            let point = |k: usize| {
                let (i, j) = (k / steps, k % steps);
                let cosine = ((i as f64 + 0.5) / steps as f64).powf(1.0 / (n + 1.0));
                let (sin, cos) = (TAU * (j as f64 + 0.5) / steps as f64).sin_cos();
                let direction = cosine * mirrored + (1.0 - cosine * cosine).sqrt() * (cos * across + sin * up);
                (i / POINTS * BINS + j / POINTS, direction, cosine)
            };
            (0..steps * steps).map(point).collect()
        })
        .collect();
    let directions: Vec<[f32; 4]> = (0..CASES)
        .flat_map(|case| {
            points[case]
                .iter()
                .step_by(7)
                .map(move |p| p.1.as_vec3().extend(case as f32).to_array())
        })
        .collect();
    let body = format!(
        "{} return scatter_evaluate(s, o, normalize(input.xyz));",
        scatterer("u32(input.w)")
    );
    let mut evaluated = run(&gpu, &body, &directions).into_iter();
    let mut worst = [0f64; 3];
    for case in 0..CASES {
        let (o, n) = (eye(case), EXPONENTS[case / 5]);
        let mirrored = DVec3::new(-o.x, -o.y, o.z);
        let up = mirrored.cross(DVec3::Y);
        let each = f64::from(SAMPLES) / (steps * steps) as f64;
        let mut expected = vec![0.0; BINS * BINS + 1];
        let mut albedo = 0.0;
        for &(bin, direction, _) in &points[case] {
            let is_free = direction.z > 0.0;
            expected[if is_free { bin } else { BINS * BINS }] += each;
            albedo += (n + 2.0) / (n + 1.0) * direction.z.max(0.0) / (steps * steps) as f64;
        }
        let (mut counts, mut scattered) = (vec![0.0; expected.len()], 0.0);
        for &[x, y, z, weight] in &drawn[case * SAMPLES as usize..][..SAMPLES as usize] {
            let direction = DVec3::new(x.into(), y.into(), z.into());
            // 1 - cos, which keeps its digits.
            let off = 0.5 * (direction - mirrored).length_squared();
            let u = ((n + 1.0) * (-off).ln_1p()).exp();
            let phi = direction.dot(up).atan2(direction.dot(DVec3::Y)).rem_euclid(TAU) / TAU;
            let place = |u: f64| ((u * BINS as f64) as usize).min(BINS - 1);
            let bin = if weight > 0.0 {
                place(u) * BINS + place(phi)
            } else {
                BINS * BINS
            };
            counts[bin] += 1.0;
            scattered += f64::from(weight) / f64::from(SAMPLES);
        }
        // Over the directions that are not blocked, 2π/(n + 1) of u and φ at u^(n/(n + 1)).
        let (mut integral, mut wanted) = (0.0, 0.0);
        for (&(_, direction, cosine), found) in points[case].iter().step_by(7).zip(&mut evaluated) {
            if direction.z > 0.0 {
                integral += f64::from(found[3]) * TAU / (n + 1.0) / cosine.powf(n);
                wanted += 1.0;
            }
        }
        let figures = [
            chi_square(&counts, &expected),
            (scattered / albedo - 1.0).abs(),
            (integral / wanted - 1.0).abs(),
        ];
        for (worst, figure) in worst.iter_mut().zip(figures) {
            *worst = worst.max(figure);
        }
        let name = format!("exponent {n}, {}°", DEGREES[case % 5]);
        assert!(figures[0] < 4.0, "{name}: χ² is {:.1} deviations too large", figures[0]);
        assert!(figures[1] < 5e-3, "{name}: scatters {scattered}, expected {albedo}");
        assert!(
            figures[2] < 1e-3,
            "{name}: the density integrates to {integral}, expected {wanted}"
        );
        assert!(o.z > 0.0 && albedo < 1.0 + 1e-3, "{name}: {albedo}");
    }
    println!(
        "Phong, 5 × 5: χ² at most {:.2} deviations, albedo off by {:.3} %, density by {:.4} %",
        worst[0],
        100.0 * worst[1],
        100.0 * worst[2]
    );
}

#[test]
fn diffuse_and_smooth_surfaces_scatter_all_light_in_a_white_furnace() {
    let Some(gpu) = gpu() else { return };
    let inputs: Vec<[u32; 4]> = (0..5)
        .flat_map(|angle| (0..SAMPLES).map(move |i| [angle, i, 11, 0]))
        .collect();
    for (name, material) in [
        ("diffuse", "true, vec3f(1.0), 0.0, 1.0, 0.0"),
        ("mirror", "true, vec3f(1.0), 1.0, 0.0, 0.0"),
        ("glass", "true, vec3f(1.0), 0.0, 0.0, 1.0"),
        ("glass from inside", "false, vec3f(1.0), 0.0, 0.0, 1.0"),
    ] {
        let body = format!(
            "var angles = array<f32, 5>({});
            let a = angles[input.x];
            let s = scatter_by(vec3f(0.0, 0.0, 1.0), {material}, {INDEX});
            let random = vec4f(hash_pcg4d(input) >> vec4u(8u)) * 0x1p-24;
            let drawn = scatter_sample(s, vec3f(sin(a), 0.0, cos(a)), random);
            return vec4f(drawn.direction, drawn.weight.x * drawn.squeeze);",
            DEGREES.map(|d| format!("{:.9}", d.to_radians())).join(", ")
        );
        let drawn = run(&gpu, &body, &inputs);
        for (degrees, samples) in DEGREES.iter().zip(drawn.chunks(SAMPLES as usize)) {
            let sum: f64 = samples.iter().map(|s| f64::from(s[3])).sum();
            assert!(
                (sum / f64::from(SAMPLES) - 1.0).abs() < 5e-3,
                "{name}, {degrees}°: {sum}"
            );
            let reflected = samples.iter().filter(|s| s[2] > 0.0).count() as f64 / f64::from(SAMPLES);
            let expected = match name {
                "glass" => fresnel(degrees.to_radians().cos(), INDEX).0,
                "glass from inside" => fresnel(degrees.to_radians().cos(), 1.0 / INDEX).0,
                _ => 1.0,
            };
            assert!(
                (reflected - expected).abs() < 5e-3,
                "{name}, {degrees}°: {reflected}, {expected}"
            );
        }
        if name == "diffuse" {
            // Its density over the hemisphere, in cos² and φ: dω = d(cos²) dφ / (2 cos).
            let inputs: Vec<[f32; 4]> = (0..4096)
                .map(|i| [((i / 64) as f32 + 0.5) / 64.0, ((i % 64) as f32 + 0.5) / 64.0, 0.0, 0.0])
                .collect();
            let body = format!(
                "let s = scatter_by(vec3f(0.0, 0.0, 1.0), {material}, {INDEX});
                let z = sqrt(input.x); let r = sqrt(1.0 - input.x); let phi = 6.2831853 * input.y;
                let i = vec3f(r * cos(phi), r * sin(phi), z);
                return scatter_evaluate(s, vec3f(0.6, 0.0, 0.8), i) * (3.14159265 / z);"
            );
            let evaluated = run(&gpu, &body, &inputs);
            for channel in [0, 3] {
                let integral: f64 = evaluated.iter().map(|e| f64::from(e[channel])).sum::<f64>() / 4096.0;
                assert!((integral - 1.0).abs() < 1e-3, "{name}, channel {channel}: {integral}");
            }
            // cos² and φ are uniform.
            let mut counts = vec![0.0; BINS * BINS];
            for [x, y, z, _] in &drawn {
                let place = |u: f32| ((u * BINS as f32) as usize).min(BINS - 1);
                counts[place(z * z) * BINS + place(y.atan2(*x).rem_euclid(TAU as f32) / TAU as f32)] += 1.0;
            }
            let expected = vec![drawn.len() as f64 / (BINS * BINS) as f64; BINS * BINS];
            let deviations = chi_square(&counts, &expected);
            println!("diffuse: χ² {deviations:.2} deviations");
            assert!(deviations < 4.0);
        }
    }
}

#[test]
fn metal_whose_facets_scatter_more_than_once_loses_no_light() {
    let Some(gpu) = gpu() else { return };
    let inputs: Vec<[u32; 4]> = (0..CASES as u32)
        .flat_map(|case| (0..SAMPLES).map(move |i| [case, i, 17, 0]))
        .collect();
    // A white metal and one of colour 0.5; light, and what is evaluated over the density, which must be the same.
    let body = format!(
        "{}
        let multiple = scatter_by(vec3f(0.0, 0.0, 1.0), true, vec3f(1.0, 0.5, 0.5), 1.0, LOBE_MULTIPLE + r, 0.0, {INDEX});
        let drawn = scatter_sample(multiple, o, vec4f(hash_pcg4d(input) >> vec4u(8u)) * 0x1p-24);
        let evaluated = scatter_evaluate(multiple, o, drawn.direction);
        let again = select(0.0, evaluated.x / evaluated.w, drawn.weight.x > 0.0);
        return vec4f(drawn.weight.xy, abs(again - drawn.weight.x), 0.0);",
        Lobe::Metal.wgsl("input.x")
    );
    let drawn = run(&gpu, &body, &inputs);
    let mut worst = [0.0f64; 2];
    for (case, samples) in drawn.chunks(SAMPLES as usize).enumerate() {
        let mean = |c: usize| samples.iter().map(|s| f64::from(s[c])).sum::<f64>() / f64::from(SAMPLES);
        let [white, half] = [mean(0), mean(1)];
        let points = quadrature(Lobe::Metal, case);
        let single: f64 = points
            .iter()
            .map(|p| p.probability * lit(p.direction, alpha(case)))
            .sum();
        let expected = 0.5 * single / (1.0 - 0.5 * (1.0 - single));
        for (worst, error) in worst.iter_mut().zip([white - 1.0, half / expected - 1.0]) {
            *worst = worst.max(error.abs());
        }
        let name = format!("roughness {}, {}°", ROUGHNESS[case / 5], DEGREES[case % 5]);
        assert!((white - 1.0).abs() < 0.015, "{name}: white scatters {white}");
        assert!(
            (half / expected - 1.0).abs() < 0.015,
            "{name}: {half}, expected {expected}"
        );
        let apart = samples.iter().map(|s| s[2]).fold(0.0, f32::max);
        assert!(apart < 1e-3, "{name}: sampled and evaluated differ by {apart}");
    }
    println!(
        "multiple scattering, 5 × 5: white off by at most {:.2} %, colour 0.5 by {:.2} %",
        100.0 * worst[0],
        100.0 * worst[1]
    );
}
