//! An environment as a few suns.

use super::{EnvironmentImage, Light, LightKind};
use glam::{DQuat, DVec2, DVec3, Vec3};
use std::f64::consts::PI;

/// Columns and rows that an image is divided into at least; texels of smaller ones are divided further.
const LEAST_CELLS: [usize; 2] = [64, 32];

/// Widest half angle of a sun, radians: a whole hemisphere has no tangent.
const WIDEST: f64 = 1.2;

/// A part of an environment as parallel light: where all of the part is seen, it gives a surface the same irradiance.
/// After Debevec 2005, "A Median Cut Algorithm for Light Probe Sampling", which places lights at the centroids of parts of
/// equal light; here the part whose light spreads most is divided next, and a light is as strong as its part's vector irradiance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sun {
    /// Unit vector towards the light, the image not turned.
    pub toward: DVec3,
    /// Irradiance on a perpendicular plane, of an environment of unit strength, linear RGB.
    pub irradiance: DVec3,
    /// Half angle of the disc in the sky whose light spreads as much, radians.
    pub angle: f64,
}

impl Sun {
    /// Divides an environment, a valid image or without one the same radiance from everywhere, into at most `count` suns: fewer where fewer
    /// texels shine. Cost: a few looks at each texel.
    pub fn divide(image: Option<&EnvironmentImage>, count: usize) -> Vec<Self> {
        let sky = Sky::new(image);
        let mut parts: Vec<Part> = Vec::new();
        if count > 0 {
            parts.extend(sky.part([0, sky.columns, 0, sky.rows]));
        }
        while parts.len() < count {
            let widest = parts.iter().enumerate().filter(|p| p.1.can_be_divided());
            let Some(widest) = widest.max_by(|a, b| a.1.spread().total_cmp(&b.1.spread())).map(|p| p.0) else {
                break;
            };
            let part = parts.swap_remove(widest);
            parts.extend(sky.halves(&part).into_iter().filter_map(|cells| sky.part(cells)));
        }
        parts.iter().map(Part::sun).collect()
    }

    /// As a light of the strength of an environment that is turned about +Y by `rotation`, radians.
    pub fn light(&self, strength: DVec3, rotation: f64) -> Light {
        Light {
            name: String::new(),
            kind: LightKind::Directional {
                direction: -(DQuat::from_rotation_y(rotation) * self.toward),
                angle: self.angle,
            },
            color: (strength * self.irradiance).as_vec3().to_array(),
            intensity: 1.0,
        }
    }
}

/// An image in cells, and what of their integrals is the same along a row or a column.
struct Sky<'a> {
    image: Option<&'a EnvironmentImage>,
    columns: usize,
    rows: usize,
    /// Cells along the width and the height of a texel.
    cells: [usize; 2],
    /// ∫ (sin φ, −cos φ) dφ of each column.
    across: Vec<DVec2>,
    /// ∫ sin²θ dθ, ∫ cosθ sinθ dθ and ∫ sinθ dθ of each row.
    along: Vec<[f64; 3]>,
}

/// A rectangle of cells.
struct Part {
    /// First column and the one behind the last, then rows.
    cells: [usize; 4],
    /// ∫ L dω, mean of channels.
    flux: f64,
    /// ∫ L ω dω of each channel.
    vectors: [DVec3; 3],
}

impl<'a> Sky<'a> {
    fn new(image: Option<&'a EnvironmentImage>) -> Self {
        let [width, height] = image.map_or([1, 1], |i| [i.width as usize, i.height as usize]);
        let cells = [LEAST_CELLS[0].div_ceil(width), LEAST_CELLS[1].div_ceil(height)];
        let (columns, rows) = (width * cells[0], height * cells[1]);
        let across = (0..columns).map(|column| {
            let phi = |edge: usize| 2.0 * PI * (edge as f64 / columns as f64 - 0.5);
            let (left, right) = (phi(column), phi(column + 1));
            // cos left − cos right and sin left − sin right as products, which keep their digits.
            let (middle, half) = (0.5 * (left + right), 0.5 * (right - left));
            2.0 * half.sin() * DVec2::new(middle.sin(), -middle.cos())
        });
        let along = (0..rows).map(|row| {
            let theta = |edge: usize| PI * edge as f64 / rows as f64;
            let (upper, lower) = (theta(row), theta(row + 1));
            let (middle, half) = (0.5 * (upper + lower), 0.5 * (lower - upper));
            let turned = (2.0 * middle).cos() * (2.0 * half).sin();
            [
                half - 0.5 * turned,
                0.5 * (2.0 * middle).sin() * (2.0 * half).sin(),
                2.0 * middle.sin() * half.sin(),
            ]
        });
        Self {
            image,
            columns,
            rows,
            cells,
            across: across.collect(),
            along: along.collect(),
        }
    }

    fn radiance(&self, column: usize, row: usize) -> DVec3 {
        self.image.map_or(DVec3::ONE, |image| {
            let index = row / self.cells[1] * image.width as usize + column / self.cells[0];
            Vec3::from(image.rgb[index]).as_dvec3()
        })
    }

    /// `None` where nothing shines.
    fn part(&self, cells: [usize; 4]) -> Option<Part> {
        let [left, right, top, bottom] = cells;
        let width = 2.0 * PI / self.columns as f64;
        let (mut flux, mut vectors) = (0.0, [DVec3::ZERO; 3]);
        for row in top..bottom {
            let [of_sides, of_up, of_all] = self.along[row];
            for column in left..right {
                let radiance = self.radiance(column, row);
                let sides = of_sides * self.across[column];
                let vector = DVec3::new(sides.x, of_up * width, sides.y);
                for (sum, radiance) in vectors.iter_mut().zip(radiance.to_array()) {
                    *sum += radiance * vector;
                }
                flux += radiance.element_sum() / 3.0 * of_all * width;
            }
        }
        (flux > 0.0).then_some(Part { cells, flux, vectors })
    }

    /// Cut across its longer way, where half of its light is on either side.
    fn halves(&self, part: &Part) -> [[usize; 4]; 2] {
        let [left, right, top, bottom] = part.cells;
        let width = (right - left) as f64 * 2.0 / self.columns as f64;
        let height = (bottom - top) as f64 / self.rows as f64;
        let middle = PI * (top + bottom) as f64 / (2.0 * self.rows as f64);
        let is_wide = bottom - top == 1 || (right - left > 1 && width * middle.sin() >= height);
        let light = |column: usize, row: usize| self.radiance(column, row).element_sum() * self.along[row][2];
        if is_wide {
            let of_column = |column| (top..bottom).map(|row| light(column, row)).sum();
            let cut = left + median((left..right).map(of_column).collect());
            [[left, cut, top, bottom], [cut, right, top, bottom]]
        } else {
            let of_row = |row| (left..right).map(|column| light(column, row)).sum();
            let cut = top + median((top..bottom).map(of_row).collect());
            [[left, right, top, cut], [left, right, cut, bottom]]
        }
    }
}

/// After how many of the values, at least one and not all, half of their sum is nearest.
fn median(values: Vec<f64>) -> usize {
    let half = 0.5 * values.iter().sum::<f64>();
    let mut so_far = 0.0;
    let mut best = (1, f64::INFINITY);
    for (index, value) in values[..values.len() - 1].iter().enumerate() {
        so_far += value;
        if (so_far - half).abs() < best.1 {
            best = (index + 1, (so_far - half).abs());
        }
    }
    best.0
}

impl Part {
    fn can_be_divided(&self) -> bool {
        let [left, right, top, bottom] = self.cells;
        right - left > 1 || bottom - top > 1
    }

    fn vector(&self) -> DVec3 {
        self.vectors.iter().sum::<DVec3>() / 3.0
    }

    /// What one direction for all of its light leaves out.
    fn spread(&self) -> f64 {
        self.flux - self.vector().length()
    }

    fn sun(&self) -> Sun {
        let toward = self.vector().normalize_or(DVec3::Y);
        // A disc of half angle a has (1 + cos a) / 2 for the length of its vector over its flux.
        let left_out = (self.spread() / self.flux).clamp(0.0, 1.0);
        Sun {
            toward,
            irradiance: DVec3::from(self.vectors.map(|v| v.dot(toward).max(0.0))),
            angle: (2.0 * left_out.sqrt().asin()).min(WIDEST),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32, radiance: impl Fn(u32, u32) -> [f32; 3]) -> EnvironmentImage {
        let texels = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
        EnvironmentImage {
            name: "sky".into(),
            width,
            height,
            rgb: texels.map(|(column, row)| radiance(column, row)).collect(),
        }
    }

    /// Irradiance of an upward plane and vector irradiance.
    fn sums(suns: &[Sun]) -> (DVec3, DVec3) {
        let up = suns.iter().map(|s| s.irradiance * s.toward.y.max(0.0)).sum();
        (up, suns.iter().map(|s| s.irradiance.y * s.toward).sum())
    }

    /// Irradiance of a plane by a sun's disc over that across it (Snyder 1996).
    fn cosine_over_horizon(sun: &Sun, normal: DVec3) -> f64 {
        let (cosine, t) = (sun.toward.dot(normal), sun.angle.tan());
        let disc_sine = sun.angle.sin();
        if cosine.abs() >= disc_sine {
            return cosine.max(0.0);
        }
        let sine = (1.0 - cosine * cosine).sqrt();
        let y = -cosine / (t * sine);
        let s = sine * (1.0 - y * y).max(0.0).sqrt();
        (cosine * y.acos() - s / t + (s * t).atan() / (disc_sine * disc_sine)) / PI
    }

    #[test]
    fn a_uniform_sky_gives_a_plane_pi_and_no_direction_more_than_another() {
        for count in [8, 16, 32, 48] {
            let suns = Sun::divide(None, count);
            assert_eq!(suns.len(), count);
            let (up, vector) = sums(&suns);
            // The first cut across rows is at the horizon, where exact halves lie.
            assert!((up.x / PI - 1.0).abs() < 1e-12, "{count}: {up}");
            assert!(vector.length() < 1e-12, "{vector}");
            assert!(suns.iter().all(|s| s.angle > 0.0 && s.angle < WIDEST));
        }
        // Any plane: of suns on its horizon the part above it counts.
        for (count, most) in [(8, 0.03), (16, 0.1), (24, 0.02), (48, 0.02)] {
            let suns = Sun::divide(None, count);
            let mut worst = 0.0f64;
            for i in 0..500 {
                let y = 1.0 - (2.0 * f64::from(i) + 1.0) / 500.0;
                let (sin, cos) = (2.399_963 * f64::from(i)).sin_cos();
                let n = DVec3::new((1.0 - y * y).sqrt() * cos, y, (1.0 - y * y).sqrt() * sin);
                let e: f64 = suns.iter().map(|s| s.irradiance.x * cosine_over_horizon(s, n)).sum();
                worst = worst.max((e / PI - 1.0).abs());
            }
            println!(
                "{count} suns of a uniform sky: irradiance of any plane within {:.2} %",
                100.0 * worst
            );
            assert!(worst < most, "{count}: {worst}");
        }
    }

    #[test]
    fn no_light_is_lost_or_turned_by_dividing() {
        // Another colour in each texel, and dark ones between.
        let sky = image(37, 19, |x, y| match (x + 3 * y) % 5 {
            0 => [0.0; 3],
            n => [n as f32, (x as f32 * 0.7).sin().abs(), y as f32],
        });
        let vector = |suns: &[Sun]| {
            let gray = |s: &Sun| s.irradiance.element_sum() / 3.0 * s.toward;
            suns.iter().map(gray).sum::<DVec3>()
        };
        // Of wide parts a colour may lie on the far side.
        let finest = vector(&Sun::divide(Some(&sky), 48));
        for count in [7, 16, 30] {
            let suns = Sun::divide(Some(&sky), count);
            assert_eq!(suns.len(), count);
            let off = (vector(&suns) - finest).length();
            assert!(off < 1e-10 * finest.length(), "{count}: {off}");
        }
    }

    #[test]
    fn one_bright_texel_is_one_small_sun_where_the_image_has_it() {
        let (column, row, rotation) = (300, 40, 0.7);
        let sky = image(512, 256, |x, y| {
            if (x, y) == (column, row) {
                [2.0, 1.0, 0.5]
            } else {
                [0.0; 3]
            }
        });
        let suns = Sun::divide(Some(&sky), 5);
        assert_eq!(suns.len(), 1);
        let solid_angle = sky.texel_solid_angle(row);
        assert!((suns[0].irradiance / solid_angle - DVec3::new(2.0, 1.0, 0.5)).length() < 1e-4);
        // As wide as a texel.
        assert!(suns[0].angle > 0.3 * solid_angle.sqrt() && suns[0].angle < solid_angle.sqrt());
        let light = suns[0].light(DVec3::new(3.0, 4.0, 5.0), rotation);
        light.validate(0).unwrap();
        let LightKind::Directional { direction, .. } = light.kind else {
            panic!("{light:?}");
        };
        assert_eq!(sky.texel_at(-direction, rotation), [column, row]);
        let expected = suns[0].irradiance * DVec3::new(3.0, 4.0, 5.0);
        assert!((light.strength() - expected).length() < 1e-6 * expected.length());
    }

    #[test]
    fn nothing_shines_in_a_black_sky_and_none_are_wanted_of_none() {
        assert!(Sun::divide(Some(&image(4, 2, |_, _| [0.0; 3])), 16).is_empty());
        assert!(Sun::divide(None, 0).is_empty());
    }
}
