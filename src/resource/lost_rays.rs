//! Paths whose hop a tracer could not resolve, for a surer tracer.

use super::Photons;
use crate::{Error, gpu as device};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `LostRays` in `shaders/common/lost_rays.wgsl`, with the first of its paths.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct LostRays {
        pub(crate) workgroups: [u32; 3],
        pub(crate) count: u32,
        pub(crate) paths: [u32; 1],
    }
}

/// Bytes before the first path.
const HEADER_BYTES: u64 = std::mem::offset_of!(gpu::LostRays, paths) as u64;

/// Paths that a shader lists together. Twin of `BLOCK` in `shaders/pass/image_space_tracer/list_lost.wgsl`.
pub(crate) const BLOCK: u32 = 64;

/// A list of paths on the GPU, of one hop at a time: those that a tracer lost or is not sure of, in ascending order, so that the list is the
/// same every time.
///
/// A storage buffer, also `COPY_SRC` and `COPY_DST`: the three workgroup counts of an indirect dispatch with an invocation
/// for each path in workgroups of 64, none above 65 535; how many paths there are; their numbers. All `u32`.
#[derive(Debug)]
pub struct LostRays {
    buffer: wgpu::Buffer,
    blocks: wgpu::Buffer,
}

impl LostRays {
    /// Room for all paths of `photons`: 4 bytes each, and a sixteenth of a byte to sort them by.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, photons: &Photons) -> Result<Self, Error> {
        use wgpu::BufferUsages as U;
        let count = photons.count().max(1);
        let bytes = HEADER_BYTES + 4 * u64::from(count);
        let usage = U::STORAGE | U::INDIRECT | U::COPY_SRC | U::COPY_DST;
        let block_bytes = 4 * u64::from(count.div_ceil(BLOCK));
        Ok(Self {
            buffer: device::buffer(device, "lightfall::LostRays", bytes, usage)?,
            blocks: device::buffer(device, "lightfall::LostRays::blocks", block_bytes, U::STORAGE)?,
        })
    }

    /// The list.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// Working memory of whoever fills it: a `u32` for every 64 paths.
    pub(crate) fn blocks(&self) -> &wgpu::Buffer {
        &self.blocks
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.buffer.size() + self.blocks.size()
    }
}
