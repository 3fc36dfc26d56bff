//! How much of each light is seen through each pixel.

use super::expect_view;
use crate::{Error, gpu};

/// Format of a layer.
pub(crate) const VISIBILITY_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;

/// Share of each light that is seen: 1 all of its extent, 0 none of it. A 2D array of `r32float`, one layer a light in the
/// order of the lights, environments left out, and a spare last layer: wgpu's GL backend takes an array of one layer for a plain texture
/// and one of 6 k layers for a cube map. Where no surface is seen, or it faces away from the light, it is 0. Filled by
/// [`SoftShadow`](crate::pass::SoftShadow), or by a host that finds out by other means.
#[derive(Debug)]
pub struct Visibility {
    view: wgpu::TextureView,
    layer_views: Vec<wgpu::TextureView>,
    lights: u32,
    bytes: u64,
}

impl Visibility {
    /// Bytes for this many lights at this size.
    pub fn size_in_bytes(size: [u32; 2], lights: u32) -> u64 {
        gpu::texture_bytes(size, lights.saturating_add(1), VISIBILITY_FORMAT)
    }

    /// Layers for this many lights, of the G-buffer's size.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, size: [u32; 2], lights: u32) -> Result<Self, Error> {
        use wgpu::TextureUsages as U;
        let spec = gpu::TextureSpec {
            label: "lightfall::Visibility",
            size,
            layers: lights.saturating_add(1),
            format: VISIBILITY_FORMAT,
            usage: U::TEXTURE_BINDING | U::STORAGE_BINDING | U::COPY_SRC,
        };
        let texture = gpu::texture(device, &spec)?;
        Ok(Self::with_texture(&texture, spec.bytes()))
    }

    /// Around a host's own array of the lights' layers and a spare one, of the G-buffer's size. `view` must cover all
    /// layers as a 2D array. With storage-binding usage [`SoftShadow`](crate::pass::SoftShadow) may fill it.
    ///
    /// # Errors
    /// [`Error::IncompatibleView`] unless it is single-sampled `r32float` with texture-binding usage and two layers or
    /// more.
    pub fn from_view(view: &wgpu::TextureView) -> Result<Self, Error> {
        let resource = "Visibility view";
        expect_view(
            resource,
            view,
            &[VISIBILITY_FORMAT],
            wgpu::TextureUsages::TEXTURE_BINDING,
        )?;
        let layers = view.texture().depth_or_array_layers();
        if layers < 2 {
            return Err(Error::IncompatibleView {
                resource,
                property: "layer count",
                expected: "at least 2 (one a light and a spare)".into(),
                found: layers.to_string(),
            });
        }
        Ok(Self::with_texture(view.texture(), 0))
    }

    fn with_texture(texture: &wgpu::Texture, bytes: u64) -> Self {
        let lights = texture.depth_or_array_layers() - 1;
        let can_write = texture.usage().contains(wgpu::TextureUsages::STORAGE_BINDING);
        let layers = if can_write { lights } else { 0 };
        Self {
            view: gpu::array_view(texture),
            layer_views: (0..layers).map(|layer| gpu::layer_view(texture, layer)).collect(),
            lights,
            bytes,
        }
    }

    /// All layers as a 2D array.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// The layer of one light, to write to. Empty for arrays that cannot be written as storage.
    pub fn layer_view(&self, light: u32) -> Option<&wgpu::TextureView> {
        self.layer_views.get(light as usize)
    }

    /// Lights that it has layers for.
    pub fn lights(&self) -> u32 {
        self.lights
    }

    /// Width and height.
    pub fn size(&self) -> [u32; 2] {
        [self.view.texture().width(), self.view.texture().height()]
    }

    /// Bytes this resource allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}
