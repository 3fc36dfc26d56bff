//! Light on what environment maps show.

use super::EnvMaps;
use crate::{Error, gpu};

/// Irradiance, unit frame, at the surface points that texels of [`EnvMaps`] show: an `rgba32float` 2D array of 6 k + 1 layers
/// as theirs, of fewer texels. A texel stands for the point that the maps' texel under its middle shows; alpha is 1 where
/// there is one, else all four are 0.
#[derive(Debug)]
pub struct EnvMapIrradiance {
    view: wgpu::TextureView,
    size: u32,
    capacity: u32,
    bytes: u64,
}

impl EnvMapIrradiance {
    const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

    /// Bytes for `capacity` maps of `size`² texels a face.
    pub fn size_in_bytes(capacity: u32, size: u32) -> u64 {
        gpu::texture_bytes([size; 2], EnvMaps::layers(capacity), Self::FORMAT)
    }

    /// Of these maps, `size`² texels a face.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, env_maps: &EnvMaps, size: u32) -> Result<Self, Error> {
        use wgpu::TextureUsages as U;
        let spec = gpu::TextureSpec {
            label: "lightfall::EnvMapIrradiance",
            size: [size; 2],
            layers: EnvMaps::layers(env_maps.capacity()),
            format: Self::FORMAT,
            usage: U::TEXTURE_BINDING | U::STORAGE_BINDING | U::COPY_SRC,
        };
        Ok(Self {
            view: gpu::array_view(&gpu::texture(device, &spec)?),
            size,
            capacity: env_maps.capacity(),
            bytes: spec.bytes(),
        })
    }

    /// All layers as a 2D array.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// Texels along a face's side.
    pub fn size(&self) -> u32 {
        self.size
    }

    /// Most maps that it has room for.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Bytes this resource allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}
