//! Irradiance seen through each pixel, before albedo and textures.

use super::expect_view;
use crate::{Error, gpu};

/// At which pixels of a G-buffer irradiance is estimated: all, or one in a block of so many along each axis, from which
/// [`Upsampler`](crate::pass::Upsampler) makes the others. Wider saves time as the square and loses what is finer than a
/// block.
///
/// Sample (i, j) stands on pixel (f i + ⌊f/2⌋, f j + ⌊f/2⌋) of the part of the G-buffer in use, f the factor, or on its
/// last pixel where that lies outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Subsampling {
    /// Every pixel.
    #[default]
    Full = 1,
    /// One of 2 × 2.
    Half = 2,
    /// One of 4 × 4.
    Quarter = 4,
    /// One of 8 × 8.
    Eighth = 8,
}

impl Subsampling {
    /// Pixels for each sample along an axis.
    pub fn factor(self) -> u32 {
        self as u32
    }

    /// The next finer one; `None` for all pixels.
    pub fn finer(self) -> Option<Self> {
        match self {
            Self::Full => None,
            Self::Half => Some(Self::Full),
            Self::Quarter => Some(Self::Half),
            Self::Eighth => Some(Self::Quarter),
        }
    }

    /// Samples of an image of this size, rounded up: every block has one.
    pub fn size(self, full: [u32; 2]) -> [u32; 2] {
        full.map(|length| length.div_ceil(self.factor()))
    }

    /// The pixel of an image of this size that a sample stands on. Twin of `subsampling_pixel` in
    /// `shaders/common/subsampling.wgsl`.
    pub fn pixel(self, sample: [u32; 2], full: [u32; 2]) -> [u32; 2] {
        let factor = self.factor();
        [0, 1].map(|axis| (sample[axis] * factor + factor / 2).min(full[axis].saturating_sub(1)))
    }
}

/// Irradiance, W/m² in the unit frame, RGB. Alpha is not light: the pass that writes it says what it holds.
/// `rgba32float`, or a coarser format where a pass says so.
#[derive(Debug)]
pub struct Irradiance {
    view: wgpu::TextureView,
    bytes: u64,
}

impl Irradiance {
    /// Formats that a host may bring.
    pub const FORMATS: [wgpu::TextureFormat; 2] = [wgpu::TextureFormat::Rgba32Float, wgpu::TextureFormat::Rgba16Float];

    /// Bytes at this size and format.
    pub fn size_in_bytes(size: [u32; 2], format: wgpu::TextureFormat) -> u64 {
        gpu::texture_bytes(size, 1, format)
    }

    /// A texture of this size and format, which passes may write as storage (`rgba32float`) or render to.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`]; [`Error::IncompatibleView`] for a format not in [`Irradiance::FORMATS`].
    pub fn new(device: &wgpu::Device, size: [u32; 2], format: wgpu::TextureFormat) -> Result<Self, Error> {
        super::expect("Irradiance", "format", format, &Self::FORMATS)?;
        use wgpu::TextureUsages as U;
        let spec = gpu::TextureSpec {
            label: "lightfall::Irradiance",
            size,
            layers: 1,
            format,
            usage: U::TEXTURE_BINDING | U::STORAGE_BINDING | U::RENDER_ATTACHMENT | U::COPY_SRC,
        };
        let texture = gpu::texture(device, &spec)?;
        Ok(Self {
            view: texture.create_view(&Default::default()),
            bytes: spec.bytes(),
        })
    }

    /// Around a host's own view, to be read.
    ///
    /// # Errors
    /// [`Error::IncompatibleView`].
    pub fn from_view(view: &wgpu::TextureView) -> Result<Self, Error> {
        expect_view(
            "Irradiance view",
            view,
            &Self::FORMATS,
            wgpu::TextureUsages::TEXTURE_BINDING,
        )?;
        Ok(Self {
            view: view.clone(),
            bytes: 0,
        })
    }

    /// The texture.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// Width and height.
    pub fn size(&self) -> [u32; 2] {
        [self.view.texture().width(), self.view.texture().height()]
    }

    /// Its format.
    pub fn format(&self) -> wgpu::TextureFormat {
        self.view.texture().format()
    }

    /// Bytes this resource allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}
