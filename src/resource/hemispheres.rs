//! What points of surfaces see of the scene, drawn into tiles of one image.

use super::cube_face::CubeFace;
use super::view::axes_along;
use super::{CaptureMask, CapturePurpose, CaptureTargets, CaptureView, SURFACE_FORMAT};
use crate::{Error, gpu as device};
use glam::Vec3;
use std::f64::consts::PI;

/// Distance of the eye above its surface, unit frame: in front of it by more than rounding, and beyond the near plane.
const ABOVE: f32 = 1.0 / 4096.0;

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Hemisphere` in `shaders/pass/hemisphere_gather.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Hemisphere {
        pub(crate) eye: [f32; 3],
        pub(crate) texel: u32,
        pub(crate) right: [f32; 3],
        pub(crate) column: u32,
        pub(crate) up: [f32; 3],
        pub(crate) row: u32,
        pub(crate) normal: [f32; 3],
        pub(crate) _pad: u32,
    }
}

/// What the hemisphere over a point is drawn onto.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GatherShape {
    /// A square at distance 1 that reaches so far to each side, above 0. It covers 55.4 %, 83.1 % and 91.7 % of the
    /// cosine-weighted hemisphere at 1, 2 and 3; what is seen there stands for the rest. One view a point.
    Plane {
        /// Half its side, in distances from the point.
        half_side: f32,
    },
    /// The upper half of a cube: all of it. Five views a point.
    Cube,
}

impl GatherShape {
    /// Views of a point.
    pub fn views(self) -> u32 {
        match self {
            Self::Plane { .. } => 1,
            Self::Cube => 5,
        }
    }

    /// Share of the cosine-weighted hemisphere that it covers.
    pub fn covered(self) -> f64 {
        match self {
            Self::Plane { half_side } => 4.0 * corner(f64::from(half_side), f64::from(half_side)),
            Self::Cube => 1.0,
        }
    }

    /// Rows of a tile, in halves of its width.
    fn half_heights(self) -> u32 {
        match self {
            Self::Plane { .. } => 2,
            Self::Cube => 6,
        }
    }

    /// Half side of the face above.
    fn half_side(self) -> f32 {
        match self {
            Self::Plane { half_side } => half_side,
            Self::Cube => 1.0,
        }
    }

    /// Share of the cosine-weighted hemisphere that each pixel of a tile covers, in rows: exact.
    fn form_factors(self, size: u32) -> Vec<f64> {
        let (h, n) = (f64::from(self.half_side()), f64::from(size));
        let edge = |i: u32| h * (2.0 * f64::from(i) / n - 1.0);
        let top = |x: u32, y: u32| {
            let corners = [(x + 1, y + 1, 1.0), (x, y + 1, -1.0), (x + 1, y, -1.0), (x, y, 1.0)];
            corners.iter().map(|&(x, y, s)| s * corner(edge(x), edge(y))).sum()
        };
        let height = |i: u32| 1.0 - 2.0 * f64::from(i) / n;
        let side = |x: u32, y: u32| {
            let strip = |z: f64| strip(edge(x + 1), z) - strip(edge(x), z);
            strip(height(y + 1)) - strip(height(y))
        };
        let pixels = |rows: u32| (0..rows).flat_map(move |y| (0..size).map(move |x| (x, y)));
        let mut all: Vec<f64> = pixels(size).map(|(x, y)| top(x, y)).collect();
        for _ in 1..self.views() {
            all.extend(pixels(size / 2).map(|(x, y)| side(x, y)));
        }
        all
    }
}

/// Form factor from a point to a rectangle at height 1 above it, facing it, from its foot to (x, y).
fn corner(x: f64, y: f64) -> f64 {
    let part = |a: f64, b: f64| {
        let root = (1.0 + a * a).sqrt();
        a / root * (b / root).atan()
    };
    (part(x, y) + part(y, x)) / (2.0 * PI)
}

/// The same, with a constant left out that differences are free of, to a wall at distance 1 from y = 0 to y, above height z.
fn strip(y: f64, z: f64) -> f64 {
    let root = (1.0 + z * z).sqrt();
    (y / root).atan() / (2.0 * PI * root)
}

/// Where a hemisphere stands, unit frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HemispherePlace {
    /// On a surface.
    pub position: Vec3,
    /// Unit; of the side that light is gathered for.
    pub normal: Vec3,
    /// Where its irradiance goes: the index of a texel.
    pub texel: u32,
}

/// Tiles of surface texels, `rgba32uint` as in [`EnvMaps`](super::EnvMaps), with distances from the eye of a tile: what points
/// of surfaces see. A tile is as wide as it is set to be; on top what lies above the point, and below it, of a cube, the upper
/// halves of its four sides. All tiles lie in one image, so that all of them are drawn in one render pass. The eye is 2^-12
/// above its surface.
#[derive(Debug)]
pub struct Hemispheres {
    shape: GatherShape,
    size: u32,
    columns: u32,
    capacity: u32,
    image: wgpu::TextureView,
    depth: wgpu::TextureView,
    weights: wgpu::Buffer,
    records: wgpu::Buffer,
    places: Vec<HemispherePlace>,
    texture_bytes: u64,
}

impl Hemispheres {
    /// Room for `capacity` points at once, each of `size` pixels in width: even, from 2.
    ///
    /// # Errors
    /// [`Error::InvalidSetting`] for a plane that is not larger than nothing, or a size that is odd; [`Error::LimitExceeded`]
    /// if the tiles do not fit a texture.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        (shape, size): (GatherShape, u32),
        capacity: u32,
    ) -> Result<Self, Error> {
        use wgpu::BufferUsages as B;
        let half_side = shape.half_side();
        if !(half_side > 0.0 && half_side.is_finite()) {
            return Err(invalid("GatherShape::half_side", half_side, "above 0"));
        }
        if size < 2 || size % 2 == 1 {
            return Err(invalid("Hemispheres::size", size, "even, from 2"));
        }
        let capacity = capacity.max(1);
        let limits = device.limits();
        for (what, needed, limit) in [
            ("hemispheres", capacity, limits.max_compute_workgroups_per_dimension),
            ("pixels of a hemisphere", size, limits.max_texture_dimension_2d),
        ] {
            if needed > limit {
                return Err(Error::LimitExceeded {
                    what: format!("{needed} {what}"),
                    needed: u64::from(needed),
                    limit: u64::from(limit),
                    remedy: "gather fewer texels at once, or with fewer pixels",
                });
            }
        }
        let height = size / 2 * shape.half_heights();
        // About as high as wide.
        let columns = (f64::from(capacity) * f64::from(height) / f64::from(size))
            .sqrt()
            .ceil() as u32;
        let columns = columns.clamp(1, capacity);
        let texture = |label, format, usage| device::TextureSpec {
            label,
            size: [
                columns.saturating_mul(size),
                capacity.div_ceil(columns).saturating_mul(height),
            ],
            layers: 1,
            format,
            usage,
        };
        use wgpu::TextureUsages as T;
        let image = texture(
            "lightfall::Hemispheres",
            SURFACE_FORMAT,
            T::RENDER_ATTACHMENT | T::TEXTURE_BINDING,
        );
        let depth_format = CaptureTargets::of(CapturePurpose::Hemisphere).depth;
        let depth = texture("lightfall::Hemispheres::depth", depth_format, T::RENDER_ATTACHMENT);
        let view = |spec| Ok::<_, Error>(device::texture(device, spec)?.create_view(&Default::default()));
        let (image_view, depth_view) = (view(&image)?, view(&depth)?);
        let weights: Vec<f32> = shape
            .form_factors(size)
            .iter()
            .map(|f| (f / shape.covered()) as f32)
            .collect();
        let usage = B::STORAGE | B::COPY_DST;
        let weight_bytes = size_of_val(&weights[..]) as u64;
        let record_bytes = u64::from(capacity) * size_of::<gpu::Hemisphere>() as u64;
        let own = Self {
            shape,
            size,
            columns,
            capacity,
            texture_bytes: image.bytes() + depth.bytes(),
            image: image_view,
            depth: depth_view,
            weights: device::buffer(device, "lightfall::Hemispheres::weights", weight_bytes, usage)?,
            records: device::buffer(device, "lightfall::Hemispheres::records", record_bytes, usage)?,
            places: Vec::new(),
        };
        queue.write_buffer(&own.weights, 0, bytemuck::cast_slice(&weights));
        Ok(own)
    }

    /// Says where hemispheres stand.
    ///
    /// # Errors
    /// [`Error::CountMismatch`] for more than there is room for.
    pub fn set(&mut self, queue: &wgpu::Queue, places: &[HemispherePlace]) -> Result<(), Error> {
        if places.len() > self.capacity as usize {
            return Err(Error::CountMismatch {
                what: "hemispheres (most that there is room for)",
                expected: self.capacity as usize,
                found: places.len(),
            });
        }
        self.places = places.to_vec();
        let record = |(index, place): (u32, &HemispherePlace)| {
            let axes = axes_along(place.normal.as_dvec3());
            let [column, row] = self.corner(index);
            gpu::Hemisphere {
                eye: eye(place).to_array(),
                texel: place.texel,
                right: axes.right.to_array(),
                column,
                up: axes.up.to_array(),
                row,
                normal: axes.forward.to_array(),
                _pad: 0,
            }
        };
        let records: Vec<_> = (0..).zip(places).map(record).collect();
        queue.write_buffer(&self.records, 0, bytemuck::cast_slice(&records));
        Ok(())
    }

    /// The views that fill the tiles, [`GatherShape::views`] a hemisphere, in order.
    pub fn views(&self) -> Vec<CaptureView> {
        let (purpose, mask) = (CapturePurpose::Hemisphere, CaptureMask::InEnvMaps);
        let of_place = |place: &HemispherePlace| {
            let axes = axes_along(place.normal.as_dvec3());
            let eye = eye(place);
            let half_side = self.shape.half_side();
            let above = CaptureView::perspective(purpose, mask, eye, axes, half_side, self.size);
            let sides = SIDES.map(|side| {
                let forward = side[0] * axes.right + side[1] * axes.up;
                let side_axes = CubeFace {
                    forward,
                    right: forward.cross(axes.forward),
                    up: axes.forward,
                };
                CaptureView::upper_half(purpose, mask, eye, side_axes, self.size)
            });
            let wanted = self.shape.views() as usize;
            std::iter::once(above).chain(sides).take(wanted)
        };
        self.places.iter().flat_map(of_place).collect()
    }

    /// Where a view is drawn: left, top, width, height.
    pub(crate) fn viewport(&self, view: u32) -> [u32; 4] {
        let [left, top] = self.corner(view / self.shape.views());
        match view % self.shape.views() {
            0 => [left, top, self.size, self.size],
            side => [left, top + (side + 1) * (self.size / 2), self.size, self.size / 2],
        }
    }

    /// Upper left corner of a tile.
    fn corner(&self, index: u32) -> [u32; 2] {
        let height = self.size / 2 * self.shape.half_heights();
        [index % self.columns * self.size, index / self.columns * height]
    }

    /// Where they stand.
    pub fn places(&self) -> &[HemispherePlace] {
        &self.places
    }

    /// How they are drawn.
    pub fn shape(&self) -> GatherShape {
        self.shape
    }

    /// Width of a tile, pixels.
    pub fn size(&self) -> u32 {
        self.size
    }

    /// Points that there is room for.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// The tiles.
    pub fn image(&self) -> &wgpu::TextureView {
        &self.image
    }

    pub(crate) fn depth(&self) -> &wgpu::TextureView {
        &self.depth
    }

    /// Of each pixel of a tile its share of what is covered, `f32`, in rows.
    pub(crate) fn weights(&self) -> &wgpu::Buffer {
        &self.weights
    }

    pub(crate) fn records(&self) -> &wgpu::Buffer {
        &self.records
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.texture_bytes + self.weights.size() + self.records.size()
    }
}

/// Where the sides of a cube look, along its right and up. Twin of the sides in `shaders/pass/hemisphere_gather.wgsl`.
const SIDES: [[f32; 2]; 4] = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];

fn invalid(key: &str, value: impl ToString, expected: &str) -> Error {
    Error::InvalidSetting {
        key: key.to_owned(),
        value: value.to_string(),
        expected: expected.to_owned(),
    }
}

fn eye(place: &HemispherePlace) -> Vec3 {
    place.position + ABOVE * place.normal
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn form_factors_cover_what_the_shape_covers() {
        let sum = |shape: GatherShape, size| shape.form_factors(size).iter().sum::<f64>();
        // Larsen 2004 has 86 % at 2.
        for (half_side, share) in [(1.0, 0.554), (2.0, 0.831), (3.0, 0.917)] {
            let shape = GatherShape::Plane { half_side };
            assert!((shape.covered() - share).abs() < 5e-4, "{}", shape.covered());
            assert!((sum(shape, 16) - shape.covered()).abs() < 1e-12);
        }
        for size in [2, 8, 32] {
            assert!((sum(GatherShape::Cube, size) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn form_factors_are_those_of_the_paper_s_deltas_for_small_pixels() {
        let size = 64;
        let factors = GatherShape::Cube.form_factors(size);
        let n = f64::from(size);
        let place = |i: u32| (2.0 * f64::from(i) + 1.0) / n - 1.0;
        let area = 4.0 / (n * n);
        for (x, y) in [(0, 0), (31, 31), (5, 40)] {
            let (px, py) = (place(x), place(y));
            let top = area / (PI * (px * px + py * py + 1.0).powi(2));
            assert!((factors[(y * size + x) as usize] / top - 1.0).abs() < 2e-3);
            let y = y / 2;
            let z = 1.0 - (2.0 * f64::from(y) + 1.0) / n;
            let side = z * area / (PI * (px * px + z * z + 1.0).powi(2));
            let own = factors[(size * size + y * size + x) as usize];
            assert!((own / side - 1.0).abs() < 2e-3, "{own} {side}");
        }
    }
}
