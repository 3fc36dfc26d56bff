//! How near to each lamp anything stands, coarsely: what bounds the search for occluders.

use crate::{Error, gpu};

/// Tiles along a side of a shadow-map layer. Finer bounds the search more tightly, and sees less far around: a tile and
/// its neighbours must hold what the lamp's extent lets stand in a receiver's way. Eight are 11° of a cube's face each,
/// which is right for occluders further from the lamp than five of its radii. Twin of `TILES`.
pub(crate) const TILES: u32 = 8;

/// Of each 8 × 8 tile of each layer of [`ShadowMaps`](super::ShadowMaps), the least distance that it holds, unit frame: a
/// storage buffer of `f32`, 64 a layer in rows from the top left, first each tile's own and then, 64 a layer again, the
/// least of a tile and those around it (over the edges of cube faces as well). `f32::MAX` where there is nothing; layers
/// of lights without extent are left alone. Filled by [`NearestOccluder`](crate::pass::NearestOccluder).
#[derive(Debug)]
pub struct NearestOccluders {
    buffer: wgpu::Buffer,
    layers: u32,
}

impl NearestOccluders {
    /// Bytes for this many layers.
    pub fn size_in_bytes(layers: u32) -> u64 {
        u64::from(layers.max(1)) * u64::from(2 * TILES * TILES) * 4
    }

    /// For shadow maps of this many layers.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device, layers: u32) -> Result<Self, Error> {
        let bytes = Self::size_in_bytes(layers);
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        Ok(Self {
            buffer: gpu::buffer(device, "lightfall::NearestOccluders", bytes, usage)?,
            layers,
        })
    }

    /// The distances.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// Layers it was made for.
    pub fn layers(&self) -> u32 {
        self.layers
    }

    /// Bytes this resource allocated.
    pub fn memory_use(&self) -> u64 {
        self.buffer.size()
    }
}
