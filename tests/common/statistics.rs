//! Random numbers and the chi-square test.

use lightfall::glam::DVec3;
use std::f64::consts::{PI, TAU};

/// PCG-XSH-RR 64/32 (O'Neill 2014): no relation of the generators under test but the author.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn bits(&mut self) -> u32 {
        let state = self.0;
        self.0 = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((((state >> 18) ^ state) >> 27) as u32).rotate_right((state >> 59) as u32)
    }

    /// In [0, 1), one of 2^24 values, as the shaders have them.
    pub(crate) fn unit(&mut self) -> f32 {
        (self.bits() >> 8) as f32 / (1 << 24) as f32
    }

    /// Uniform on the sphere.
    pub(crate) fn direction(&mut self) -> DVec3 {
        let z = 1.0 - 2.0 * f64::from(self.unit());
        let (sin, cos) = (TAU * f64::from(self.unit())).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(r * cos, r * sin, z)
    }
}

/// Bins along each side of the unit square in [`chi_square_2d`].
const BINS: usize = 32;
/// Points of the midpoint rule in a bin. Features of a density as narrow as a ten-thousandth of its range, such as the
/// penumbra of a sharp spot, still span a dozen of them.
const POINTS: usize = 4096;
/// Below an expectation of 5 a count is not near enough to normal (Cochran 1954), so such bins are counted together.
const LEAST_EXPECTED: f64 = 5.0;

/// Probability that points of the unit square, drawn from the density `across(x) along(y)`, are at least as unlike it
/// as these.
pub(crate) fn chi_square_2d(points: &[[f64; 2]], across: impl Fn(f64) -> f64, along: impl Fn(f64) -> f64) -> f64 {
    let mut observed = vec![0.0; BINS * BINS];
    let bin = |x: f64| ((x * BINS as f64) as usize).min(BINS - 1);
    points
        .iter()
        .for_each(|&[x, y]| observed[bin(y) * BINS + bin(x)] += 1.0);
    let (columns, rows) = (bin_probabilities(across), bin_probabilities(along));
    let expected = rows
        .iter()
        .flat_map(|row| columns.map(|column| row * column * points.len() as f64));
    chi_square(&observed, &expected.collect::<Vec<_>>())
}

fn bin_probabilities(density: impl Fn(f64) -> f64) -> [f64; BINS] {
    let step = 1.0 / (BINS * POINTS) as f64;
    let middle = |bin: usize, point: usize| ((bin * POINTS + point) as f64 + 0.5) * step;
    let integral = |bin| (0..POINTS).map(|point| density(middle(bin, point))).sum::<f64>() * step;
    let probabilities = std::array::from_fn(integral);
    let total: f64 = probabilities.iter().sum();
    // A jump within a step is the worst for the midpoint rule: half a step of the density's peak, some 1e-5.
    assert!((total - 1.0).abs() < 2e-5, "the density integrates to {total}");
    probabilities
}

/// Probability that counts are at least as unlike their expectations, of the same sum, as these.
pub(crate) fn chi_square(observed: &[f64], expected: &[f64]) -> f64 {
    let mut cells: Vec<(f64, f64)> = Vec::new();
    let mut pool = (0.0, 0.0);
    for (&count, &mean) in observed.iter().zip(expected) {
        pool = (pool.0 + count, pool.1 + mean);
        if pool.1 >= LEAST_EXPECTED {
            cells.push(std::mem::take(&mut pool));
        }
    }
    let last = cells.last_mut().expect("there are enough samples");
    *last = (last.0 + pool.0, last.1 + pool.1);
    let statistic: f64 = cells.iter().map(|(count, mean)| (count - mean).powi(2) / mean).sum();
    gamma_tail(0.5 * (cells.len() - 1) as f64, 0.5 * statistic)
}

/// The regularised upper incomplete gamma function Q(a, x) = Γ(a, x) / Γ(a): by its series below the mode, where that
/// converges fast, and by its continued fraction above (NIST DLMF 8.11.4, 8.9.2).
pub(crate) fn gamma_tail(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > f64::EPSILON * sum {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        return 1.0 - front * sum;
    }
    // Lentz's algorithm. Of the numerators −n(n − a), one is zero for integer a; then the fraction ends.
    let (mut b, mut d) = (x + 1.0 - a, 1.0 / (x + 1.0 - a));
    let (mut c, mut fraction) = (f64::INFINITY, d);
    for n in 1.. {
        let numerator = -f64::from(n) * (f64::from(n) - a);
        b += 2.0;
        d = 1.0 / (b + numerator * d);
        c = b + numerator / c;
        fraction *= c * d;
        if (c * d - 1.0).abs() < f64::EPSILON || numerator == 0.0 {
            break;
        }
    }
    front * fraction
}

/// Stirling's series, whose first omitted term is below 1e-12 from 12 on.
fn ln_gamma(a: f64) -> f64 {
    if a < 12.0 {
        return ln_gamma(a + 1.0) - a.ln();
    }
    let q = 1.0 / (a * a);
    let series = (1.0 / 12.0 - q * (1.0 / 360.0 - q * (1.0 / 1260.0 - q / 1680.0))) / a;
    (a - 0.5) * a.ln() - a + 0.5 * (2.0 * PI).ln() + series
}
