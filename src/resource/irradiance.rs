//! Irradiance seen through each pixel, before albedo and textures.

use super::expect_view;
use crate::{Error, gpu};

/// Irradiance, W/m² in the unit frame, RGB; alpha is unused. `rgba32float`, or a coarser format where
/// a pass says so.
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
