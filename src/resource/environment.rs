//! Light from infinitely far away, for rays that meet no surface.

use crate::Error;
use crate::gpu::{self as device, TextureSpec};
use crate::scene::{EnvironmentImage, Light, LightKind, UnitFrame};
use glam::Vec3;

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Environment` in `shaders/common/environment.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Environment {
        pub(crate) radiance: [f32; 3],
        pub(crate) rotation: f32,
        pub(crate) size: [u32; 2],
        pub(crate) _pad: [u32; 2],
    }
}

/// An [`EnvironmentImage`] as an `rgba32float` texture (factors of the radiance by direction; a single texel without an image), 16
/// bytes a texel, and a uniform: the radiance of an environment light, unit frame, and how it is turned.
#[derive(Debug)]
pub struct Environment {
    image: wgpu::TextureView,
    image_bytes: u64,
    buffer: wgpu::Buffer,
    written: gpu::Environment,
}

impl Environment {
    /// Without an image.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn black(device: &wgpu::Device) -> Result<Self, Error> {
        Self::of_size(device, [1, 1])
    }

    /// Uploads an image; black until a light is written.
    ///
    /// # Errors
    /// As [`EnvironmentImage::validate`]; [`Error::LimitExceeded`] for one that is larger than a texture may be.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, image: &EnvironmentImage) -> Result<Self, Error> {
        image.validate(0)?;
        let own = Self::of_size(device, [image.width, image.height])?;
        let texels: Vec<_> = image
            .rgb
            .iter()
            .map(|&rgb| Vec3::from(rgb).extend(1.0).to_array())
            .collect();
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(16 * image.width),
            rows_per_image: None,
        };
        let texture = own.image.texture();
        queue.write_texture(
            texture.as_image_copy(),
            bytemuck::cast_slice(&texels),
            layout,
            texture.size(),
        );
        Ok(own)
    }

    fn of_size(device: &wgpu::Device, size: [u32; 2]) -> Result<Self, Error> {
        let spec = TextureSpec {
            label: "lightfall::Environment",
            size,
            layers: 1,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        };
        let texture = device::texture(device, &spec)?;
        Ok(Self {
            // Both begin as zeros.
            image: texture.create_view(&Default::default()),
            image_bytes: spec.bytes(),
            buffer: device::uniform_buffer::<gpu::Environment>(device, "lightfall::Environment")?,
            written: bytemuck::Zeroable::zeroed(),
        })
    }

    /// Uploads the strength and the turn of an environment light, and whether the image counts; any other, or none, makes it
    /// black.
    pub fn write(&mut self, queue: &wgpu::Queue, frame: &UnitFrame, light: Option<&Light>) {
        let record = match light.map(|l| (l.kind, frame.radiance(l.strength()))) {
            Some((LightKind::Environment { image, rotation }, radiance)) => gpu::Environment {
                radiance: radiance.to_array(),
                rotation: rotation as f32,
                size: image.map_or([0; 2], |_| {
                    let texture = self.image.texture();
                    [texture.width(), texture.height()]
                }),
                _pad: [0; 2],
            },
            _ => bytemuck::Zeroable::zeroed(),
        };
        if record != self.written {
            queue.write_buffer(&self.buffer, 0, bytemuck::bytes_of(&record));
            self.written = record;
        }
    }

    /// The image: `rgba32float`.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.image
    }

    /// The uniform: `Environment` of `shaders/common/environment.wgsl`.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// Bytes this resource allocated.
    pub fn memory_use(&self) -> u64 {
        self.image_bytes + self.buffer.size()
    }
}
