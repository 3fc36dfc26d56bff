//! Radiance towards the eye: the finished image before tone mapping.

use crate::{Error, gpu};

/// Part of the mean radiance that stands in for the radiance of black pixels in relative errors.
pub(crate) const BLACK_GUARD: f64 = 0.01;

/// Outgoing radiance, W/m²/sr in world units (times the host's pre-exposure), linear RGB; alpha is 1 where a surface is
/// seen. Any colour format that can be rendered to; `rgba32float` holds every scene unscaled.
#[derive(Debug)]
pub struct Radiance {
    view: wgpu::TextureView,
    bytes: u64,
}

impl Radiance {
    /// Bytes of an `rgba32float` texture of this size.
    pub fn size_in_bytes(size: [u32; 2]) -> u64 {
        gpu::texture_bytes(size, 1, wgpu::TextureFormat::Rgba32Float)
    }

    /// An `rgba32float` texture.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, size: [u32; 2]) -> Result<Self, Error> {
        use wgpu::TextureUsages as U;
        let spec = gpu::TextureSpec {
            label: "lightfall::Radiance",
            size,
            layers: 1,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: U::RENDER_ATTACHMENT | U::TEXTURE_BINDING | U::COPY_SRC,
        };
        let texture = gpu::texture(device, &spec)?;
        Ok(Self {
            view: texture.create_view(&Default::default()),
            bytes: spec.bytes(),
        })
    }

    /// Around a host's own view, to be rendered to.
    ///
    /// # Errors
    /// [`Error::IncompatibleView`] without render-attachment usage, or for a multisampled view.
    pub fn from_view(view: &wgpu::TextureView) -> Result<Self, Error> {
        let texture = view.texture();
        super::expect("Radiance view", "sample count", texture.sample_count(), &[1])?;
        super::expect_usage("Radiance view", texture, wgpu::TextureUsages::RENDER_ATTACHMENT)?;
        Ok(Self {
            view: view.clone(),
            bytes: 0,
        })
    }

    /// The texture.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// Bytes this resource allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}
