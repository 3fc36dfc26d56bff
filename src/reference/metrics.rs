//! How far an image is from the truth, in numbers.
//!
//! With `x` the image, `r` the reference and `σ` the reference's own standard error, all in linear radiance
//! (W/m²/sr), the main figure is the relative mean squared error
//!
//! ```text
//! relMSE = mean of ((x − r)² − σ²) / (r² + (0.01 · mean r)²)
//! ```
//!
//! over the three channels of all compared pixels. The denominator is the usual one of the Monte Carlo rendering
//! literature (Rousselle, Knaus and Zwicker 2011, "Adaptive Sampling and Reconstruction using Greedy Error
//! Minimization"), except that its guard against black pixels is one percent of the mean instead of a
//! constant: errors therefore do not depend on the unit of radiance, and a power of two in the exposure cancels
//! exactly. A reference that was itself sampled differs from the true image by noise of variance σ², so that the
//! expectation of (x − r)² is too large by σ²; it is taken out. What remains may come out slightly below zero.
//!
//! Compared are diffuse, non-emitting pixels that see a single surface. A pixel that sees several is an average over
//! its area in the reference, which one sample through the centre of the pixel cannot match however right it is; such
//! pixels are reported apart ([`Comparison::relmse_mixed`]).
//!
//! One NaN or infinity anywhere in the image fails everything: [`Comparison::finite`] is false, all errors are NaN.

use crate::Error;
use crate::resource::BLACK_GUARD;

/// Depth step between neighbours, relative to the nearer one, above which they lie on different surfaces. A plane seen
/// at up to 80° from its normal stays below it at 256 pixels and a field of view of 60°: tan 80° · 1.15 / 256 = 0.026.
const DEPTH_EDGE: f64 = 0.03;
/// Cosine between the normals of neighbours below which there is an edge: 26°, above the facets of a curved mesh.
const NORMAL_EDGE: f64 = 0.9;
/// How far an edge reaches, in pixels, counted along rows and columns. A convention: figures stay comparable.
const EDGE_REACH: usize = 4;
/// Mean of a channel, relative to the mean of all channels, below which its bias is no longer a ratio of the two.
const BLACK_CHANNEL: f64 = 1e-12;

/// A picture in linear radiance, without exposure or tone mapping.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green and blue radiance in W/m²/sr; row after row, from the top left. `width · height` of them.
    pub rgb: Vec<[f32; 3]>,
}

impl Image {
    /// How many pixels `width` and `height` call for.
    #[must_use]
    pub fn pixel_count(&self) -> usize {
        (self.width as usize).saturating_mul(self.height as usize)
    }

    /// Whether every channel of every pixel is a finite number.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.rgb.iter().flatten().all(|radiance| radiance.is_finite())
    }
}

/// What the eye sees first through the centre of each pixel; tells pixels near edges from the others.
#[derive(Debug, Clone, PartialEq)]
pub struct Geometry {
    /// Distance from the eye, in any unit.
    pub depth: Vec<f32>,
    /// Unit normal of the surface, in any space; zero where there is no surface.
    pub normal: Vec<[f32; 3]>,
}

/// A reference image and what is known about its pixels. All lists have one element per pixel, in the image's order.
///
/// ```
/// use lightfall::reference::metrics::{Image, Truth};
///
/// let image = Image { width: 2, height: 1, rgb: vec![[1.0; 3], [5.0; 3]] };
/// // The right-hand pixel sees a lamp.
/// let truth = Truth { valid: vec![true, false], ..Truth::new(image) };
/// assert!(truth.is_compared(0) && !truth.is_compared(1));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// The reference image.
    pub image: Image,
    /// Standard error of each channel of the image, W/m²/sr; `None` for an exact reference.
    pub standard_error: Option<Vec<[f32; 3]>>,
    /// True where all of the pixel is diffuse and does not emit.
    pub valid: Vec<bool>,
    /// True where the pixel sees several surfaces.
    pub mixed: Vec<bool>,
    /// Splits errors into those near edges and the others, where given.
    pub geometry: Option<Geometry>,
}

impl Truth {
    /// An exact reference of which every pixel is compared.
    #[must_use]
    pub fn new(image: Image) -> Self {
        let pixels = image.rgb.len();
        Self {
            image,
            standard_error: None,
            valid: vec![true; pixels],
            mixed: vec![false; pixels],
            geometry: None,
        }
    }

    /// Whether the pixel with this index takes part in the main figures: valid and not mixed.
    #[must_use]
    pub fn is_compared(&self, pixel: usize) -> bool {
        self.valid[pixel] && !self.mixed[pixel]
    }

    /// The same reference at 1/`factor` of the width and height, for images that are cheaper to render.
    ///
    /// Radiance is the mean over `factor` × `factor` pixels, as a box filter of the larger pixel gives it. Its standard
    /// error is that of a mean of independent pixels, √(Σσ²) / `factor`². A pixel is valid if all of its parts are, and
    /// mixed if one of them is or if two neighbours among them lie on different surfaces, where the geometry is known.
    /// Depth and normal are those of the part at the pixel's centre, for an even factor the one to its lower right, not
    /// means, which would lie between two surfaces. The step in depth from pixel to pixel grows with the factor, so that
    /// more of what is seen at a grazing angle counts as near an edge.
    ///
    /// ```
    /// use lightfall::reference::metrics::{Image, Truth};
    ///
    /// let image = Image { width: 2, height: 2, rgb: vec![[1.0; 3], [2.0; 3], [3.0; 3], [6.0; 3]] };
    /// let truth = Truth { standard_error: Some(vec![[0.2; 3]; 4]), ..Truth::new(image) };
    /// let coarse = truth.downsampled(2)?;
    /// assert_eq!(coarse.image, Image { width: 1, height: 1, rgb: vec![[3.0; 3]] });
    /// assert_eq!(coarse.standard_error, Some(vec![[0.1; 3]]));
    /// # Ok::<(), lightfall::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`Truth::validate`]; [`Error::InvalidReference`] if `factor` does not divide width and height.
    pub fn downsampled(&self, factor: u32) -> Result<Self, Error> {
        self.validate()?;
        let Image { width, height, .. } = self.image;
        if factor == 0 || width % factor != 0 || height % factor != 0 {
            return Err(invalid(format!(
                "of {width} × {height} pixels cannot be reduced {factor} times"
            )));
        }
        let blocks = Blocks {
            columns: (width / factor) as usize,
            rows: (height / factor) as usize,
            factor: factor as usize,
        };
        let area = f64::from(factor) * f64::from(factor);
        let channels = |block: usize, value: &dyn Fn(usize) -> [f64; 3]| {
            let sum = blocks
                .pixels(block)
                .map(value)
                .fold([0.0; 3], |sum, x| [0, 1, 2].map(|c| sum[c] + x[c]));
            sum.map(|sum| sum / area)
        };
        let single = |value: f64| value as f32;
        let is_mixed = |block: usize| {
            let crosses_edge = |geometry| blocks.neighbours(block).any(|(a, b)| is_edge(geometry, a, b));
            blocks.pixels(block).any(|pixel| self.mixed[pixel]) || self.geometry.as_ref().is_some_and(crosses_edge)
        };
        Ok(Self {
            image: Image {
                width: width / factor,
                height: height / factor,
                rgb: blocks.all(|block| channels(block, &|pixel| self.image.rgb[pixel].map(f64::from)).map(single)),
            },
            standard_error: self.standard_error.as_ref().map(|_| {
                blocks.all(|block| {
                    channels(block, &|pixel| self.variance(pixel)).map(|mean| single((mean / area).sqrt()))
                })
            }),
            valid: blocks.all(|block| blocks.pixels(block).all(|pixel| self.valid[pixel])),
            mixed: blocks.all(is_mixed),
            geometry: self.geometry.as_ref().map(|geometry| Geometry {
                depth: blocks.all(|block| geometry.depth[blocks.center(block)]),
                normal: blocks.all(|block| geometry.normal[blocks.center(block)]),
            }),
        })
    }

    /// Checks that all lists fit the image and that what is compared with is finite.
    ///
    /// # Errors
    /// [`Error::CountMismatch`], [`Error::InvalidReference`].
    pub fn validate(&self) -> Result<(), Error> {
        let pixels = self.image.pixel_count();
        check_count("pixels of the reference image", pixels, self.image.rgb.len())?;
        check_count("pixels of the reference's valid mask", pixels, self.valid.len())?;
        check_count("pixels of the reference's mixed mask", pixels, self.mixed.len())?;
        if let Some(error) = &self.standard_error {
            check_count("pixels of the reference's standard error", pixels, error.len())?;
        }
        if let Some(geometry) = &self.geometry {
            check_count("pixels of the reference's depth", pixels, geometry.depth.len())?;
            check_count("pixels of the reference's normal", pixels, geometry.normal.len())?;
        }
        self.check_finite()
    }

    /// Only valid pixels have to be finite: what lies outside the mask is never used.
    fn check_finite(&self) -> Result<(), Error> {
        let is_finite = |values: &[f32; 3]| values.iter().all(|value| value.is_finite());
        for pixel in (0..self.valid.len()).filter(|&pixel| self.valid[pixel]) {
            let error = self.standard_error.as_ref().map(|error| &error[pixel]);
            if !is_finite(&self.image.rgb[pixel]) || !error.is_none_or(is_finite) {
                let width = self.image.width as usize;
                let (column, row) = (pixel % width, pixel / width);
                return Err(invalid(format!(
                    "radiance or standard error of column {column}, row {row} is not finite"
                )));
            }
        }
        Ok(())
    }

    fn variance(&self, pixel: usize) -> [f64; 3] {
        let error = self.standard_error.as_ref().map_or([0.0; 3], |error| error[pixel]);
        error.map(|error| f64::from(error) * f64::from(error))
    }
}

/// An image cut into squares of `factor` × `factor` pixels.
struct Blocks {
    columns: usize,
    rows: usize,
    factor: usize,
}

impl Blocks {
    fn all<T>(&self, value: impl Fn(usize) -> T) -> Vec<T> {
        (0..self.columns * self.rows).map(value).collect()
    }

    /// Index of the pixel at this column and row of a block.
    fn pixel(&self, block: usize, column: usize, row: usize) -> usize {
        let (left, top) = (block % self.columns * self.factor, block / self.columns * self.factor);
        (top + row) * self.columns * self.factor + left + column
    }

    fn pixels(&self, block: usize) -> impl Iterator<Item = usize> {
        (0..self.factor * self.factor).map(move |i| self.pixel(block, i % self.factor, i / self.factor))
    }

    fn center(&self, block: usize) -> usize {
        self.pixel(block, self.factor / 2, self.factor / 2)
    }

    /// All pairs of pixels of a block that share a side.
    fn neighbours(&self, block: usize) -> impl Iterator<Item = (usize, usize)> {
        neighbours(self.factor * self.factor, self.factor).map(move |(a, b)| {
            let pixel = |i: usize| self.pixel(block, i % self.factor, i / self.factor);
            (pixel(a), pixel(b))
        })
    }
}

/// How an image differs from a [`Truth`]. Means are over the compared pixels unless said otherwise.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Comparison {
    /// Whether the whole image is finite, masked pixels included. If it is not, all errors below are NaN.
    pub finite: bool,
    /// How many pixels were compared: valid and not mixed. At least one.
    pub pixels: usize,
    /// Relative mean squared error with the reference's own variance taken out (see the [module](self)). No unit.
    pub relmse: f64,
    /// The same without the hundredth of the pixels that have the largest: what single pixels on the wrong side of an edge of
    /// something dark do not decide.
    pub relmse_trimmed: f64,
    /// Energy bias: mean x / mean r − 1 over all channels. 0.02 is two percent too bright.
    pub bias: f64,
    /// Energy bias of red, green and blue. Means nothing in a channel that is black in the reference.
    pub bias_rgb: [f64; 3],
    /// Root of the mean of (x − r)², W/m²/sr. The reference's variance is not taken out.
    pub rmse: f64,
    /// Mean of σ² / (r² + (0.01 · mean r)²): what was taken out of `relmse`. A `relmse` far below it is noise.
    pub truth_noise: f64,
    /// `relmse` over the valid pixels that see several surfaces, with the same mean r; `None` if there are none.
    pub relmse_mixed: Option<f64>,
    /// `relmse` over the compared pixels within 4 pixels (along rows and columns) of a step in depth or normal; `None`
    /// if there are none or the geometry is not known.
    pub relmse_edge: Option<f64>,
    /// `relmse` over the other compared pixels; `None` if there are none or the geometry is not known.
    pub relmse_interior: Option<f64>,
}

impl Comparison {
    /// The same without its numbers: an image with a NaN in it has no error, whatever the rest looks like.
    fn not_finite(self) -> Self {
        let nan = |_| f64::NAN;
        Self {
            finite: false,
            pixels: self.pixels,
            relmse: f64::NAN,
            relmse_trimmed: f64::NAN,
            bias: f64::NAN,
            bias_rgb: [f64::NAN; 3],
            rmse: f64::NAN,
            truth_noise: f64::NAN,
            relmse_mixed: self.relmse_mixed.map(nan),
            relmse_edge: self.relmse_edge.map(nan),
            relmse_interior: self.relmse_interior.map(nan),
        }
    }
}

/// Compares an image with the truth. Every sum is taken in `f64`.
///
/// ```
/// use lightfall::reference::metrics::{Image, Truth, compare};
///
/// let truth = Truth::new(Image { width: 2, height: 1, rgb: vec![[2.0; 3]; 2] });
/// let brighter = Image { width: 2, height: 1, rgb: vec![[2.5; 3]; 2] };
/// let comparison = compare(&brighter, &truth)?;
/// assert_eq!(comparison.bias, 0.25);
/// assert_eq!(comparison.rmse, 0.5);
/// # Ok::<(), lightfall::Error>(())
/// ```
///
/// # Errors
/// [`Error::CountMismatch`] if sizes differ or a list does not fit its image; [`Error::InvalidReference`] if the truth
/// is not finite, has no pixel to compare, or is black there, so that relative errors have no scale.
pub fn compare(image: &Image, truth: &Truth) -> Result<Comparison, Error> {
    truth.validate()?;
    check_count(
        "width of the image in pixels",
        truth.image.width as usize,
        image.width as usize,
    )?;
    check_count(
        "height of the image in pixels",
        truth.image.height as usize,
        image.height as usize,
    )?;
    check_count("pixels of the image", image.pixel_count(), image.rgb.len())?;

    let compared: Vec<usize> = (0..truth.valid.len())
        .filter(|&pixel| truth.is_compared(pixel))
        .collect();
    if compared.is_empty() {
        return Err(invalid(
            "has no pixel that is diffuse, does not emit and sees a single surface".into(),
        ));
    }
    let reference_mean = channel_means(&truth.image, &compared);
    let scale = average(reference_mean);
    if scale <= 0.0 {
        return Err(invalid(
            "is black where it is compared; relative errors have no scale".into(),
        ));
    }
    let comparison = measure(image, truth, &compared, reference_mean);
    Ok(if image.is_finite() {
        comparison
    } else {
        comparison.not_finite()
    })
}

/// All figures; `reference_mean` holds the channel means of the truth over the compared pixels.
fn measure(image: &Image, truth: &Truth, compared: &[usize], reference_mean: [f64; 3]) -> Comparison {
    let scale = average(reference_mean);
    let image_mean = channel_means(image, compared);
    let relmse = |pixel: usize| relative_squared_error(image, truth, pixel, scale);
    let near_edge = truth
        .geometry
        .as_ref()
        .map(|geometry| edges(geometry, truth.image.width as usize));
    let split = |near: bool| {
        let near_edge = near_edge.as_ref()?;
        mean(
            compared
                .iter()
                .copied()
                .filter(|&pixel| near_edge[pixel] == near)
                .map(relmse),
        )
    };
    let mixed = (0..truth.valid.len()).filter(|&pixel| truth.valid[pixel] && truth.mixed[pixel]);
    let over_compared = |figure: &dyn Fn(usize) -> f64| mean(compared.iter().map(|&pixel| figure(pixel)));
    Comparison {
        finite: true,
        pixels: compared.len(),
        relmse: over_compared(&relmse).unwrap_or(f64::NAN),
        relmse_trimmed: mean(without_largest(compared.iter().map(|&pixel| relmse(pixel)).collect()))
            .unwrap_or(f64::NAN),
        bias: average(image_mean) / scale - 1.0,
        bias_rgb: [0, 1, 2].map(|c| image_mean[c] / reference_mean[c].max(BLACK_CHANNEL * scale) - 1.0),
        rmse: over_compared(&|pixel| squared_error(image, truth, pixel))
            .unwrap_or(f64::NAN)
            .sqrt(),
        truth_noise: over_compared(&|pixel| relative_variance(truth, pixel, scale)).unwrap_or(f64::NAN),
        relmse_mixed: mean(mixed.map(relmse)),
        relmse_edge: split(true),
        relmse_interior: split(false),
    }
}

/// All but the largest hundredth, rounded down.
fn without_largest(mut values: Vec<f64>) -> impl Iterator<Item = f64> {
    values.sort_by(f64::total_cmp);
    values.truncate(values.len() - values.len() / 100);
    values.into_iter()
}

/// ((x − r)² − σ²) / (r² + (0.01 · mean r)²) of a pixel, averaged over its channels.
fn relative_squared_error(image: &Image, truth: &Truth, pixel: usize, scale: f64) -> f64 {
    let (x, r, variance) = (image.rgb[pixel], truth.image.rgb[pixel], truth.variance(pixel));
    average([0, 1, 2].map(|c| (squared_difference(x[c], r[c]) - variance[c]) / guarded_square(r[c], scale)))
}

/// σ² / (r² + (0.01 · mean r)²) of a pixel, averaged over its channels.
fn relative_variance(truth: &Truth, pixel: usize, scale: f64) -> f64 {
    let (r, variance) = (truth.image.rgb[pixel], truth.variance(pixel));
    average([0, 1, 2].map(|c| variance[c] / guarded_square(r[c], scale)))
}

/// (x − r)² of a pixel, averaged over its channels.
fn squared_error(image: &Image, truth: &Truth, pixel: usize) -> f64 {
    let (x, r) = (image.rgb[pixel], truth.image.rgb[pixel]);
    average([0, 1, 2].map(|c| squared_difference(x[c], r[c])))
}

fn squared_difference(x: f32, r: f32) -> f64 {
    let difference = f64::from(x) - f64::from(r);
    difference * difference
}

fn guarded_square(r: f32, scale: f64) -> f64 {
    let (r, guard) = (f64::from(r), BLACK_GUARD * scale);
    r * r + guard * guard
}

/// Mean of each channel over these pixels, of which there is at least one.
fn channel_means(image: &Image, pixels: &[usize]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for &pixel in pixels {
        for (sum, &radiance) in sum.iter_mut().zip(&image.rgb[pixel]) {
            *sum += f64::from(radiance);
        }
    }
    sum.map(|sum| sum / pixels.len() as f64)
}

fn average(channels: [f64; 3]) -> f64 {
    channels.iter().sum::<f64>() / 3.0
}

/// `None` where there is nothing to average.
fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0_usize), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / count as f64)
}

/// True within [`EDGE_REACH`] of two neighbours, in a row or a column, that lie on different surfaces.
fn edges(geometry: &Geometry, width: usize) -> Vec<bool> {
    let mut edge = vec![false; geometry.depth.len()];
    for (a, b) in neighbours(edge.len(), width) {
        if is_edge(geometry, a, b) {
            edge[a] = true;
            edge[b] = true;
        }
    }
    (0..EDGE_REACH).fold(edge, |edge, _| grown(&edge, width))
}

/// The same mask with every neighbour of a true pixel true as well.
fn grown(mask: &[bool], width: usize) -> Vec<bool> {
    let mut result = mask.to_vec();
    for (a, b) in neighbours(mask.len(), width) {
        result[a] |= mask[b];
        result[b] |= mask[a];
    }
    result
}

/// All pairs of pixels that share a side.
fn neighbours(pixels: usize, width: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..pixels).flat_map(move |pixel| {
        let right = ((pixel + 1) % width != 0).then_some(pixel + 1);
        let below = (pixel + width < pixels).then_some(pixel + width);
        right.into_iter().chain(below).map(move |other| (pixel, other))
    })
}

fn is_edge(geometry: &Geometry, a: usize, b: usize) -> bool {
    let (depth_a, depth_b) = (f64::from(geometry.depth[a]), f64::from(geometry.depth[b]));
    let (normal_a, normal_b) = (geometry.normal[a], geometry.normal[b]);
    let cosine: f64 = (0..3)
        .map(|axis| f64::from(normal_a[axis]) * f64::from(normal_b[axis]))
        .sum();
    (depth_b - depth_a).abs() > DEPTH_EDGE * depth_a.min(depth_b) || cosine < NORMAL_EDGE
}

fn check_count(what: &'static str, expected: usize, found: usize) -> Result<(), Error> {
    if expected == found {
        Ok(())
    } else {
        Err(Error::CountMismatch { what, expected, found })
    }
}

fn invalid(problem: String) -> Error {
    Error::InvalidReference { problem }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 12;

    /// Twelve columns, three rows; from column 6 on, depth and normal are those given.
    fn step(depth: f32, normal: [f32; 3]) -> Geometry {
        let column = |pixel: usize| pixel % WIDTH;
        Geometry {
            depth: (0..WIDTH * 3)
                .map(|pixel| if column(pixel) < 6 { 1.0 } else { depth })
                .collect(),
            normal: (0..WIDTH * 3)
                .map(|pixel| if column(pixel) < 6 { [0.0, 0.0, 1.0] } else { normal })
                .collect(),
        }
    }

    fn first_row(mask: &[bool]) -> String {
        mask[..WIDTH].iter().map(|&edge| if edge { '#' } else { '.' }).collect()
    }

    #[test]
    fn a_flat_wall_has_no_edge() {
        assert_eq!(first_row(&edges(&step(1.02, [0.0, 0.0, 1.0]), WIDTH)), "............");
    }

    #[test]
    fn an_edge_reaches_four_pixels_beyond_the_two_that_differ() {
        assert_eq!(first_row(&edges(&step(1.1, [0.0, 0.0, 1.0]), WIDTH)), ".##########.");
        assert_eq!(first_row(&edges(&step(1.0, [0.0, 1.0, 0.0]), WIDTH)), ".##########.");
    }

    #[test]
    fn the_end_of_a_row_does_not_touch_the_next() {
        assert!(neighbours(6, 3).all(|(a, b)| b == a + 3 || (b == a + 1 && a / 3 == b / 3)));
        assert_eq!(neighbours(6, 3).count(), 4 + 3);
        assert_eq!(neighbours(4, 1).count(), 3);
    }

    #[test]
    fn growth_is_by_sides_not_by_corners() {
        let mut mask = vec![false; 9];
        mask[4] = true;
        assert_eq!(
            grown(&mask, 3),
            [false, true, false, true, true, true, false, true, false]
        );
    }

    #[test]
    fn the_mean_of_nothing_is_not_a_number_but_none() {
        assert_eq!(mean(std::iter::empty()), None);
    }
}
