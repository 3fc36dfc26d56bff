//! Some of many paths: those whose hop a tracer could not resolve, for a surer one, or those to trace anew.

use super::Photons;
use crate::{Error, gpu as device};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `PathList` in `shaders/common/path_list.wgsl`, with the first of its paths.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct PathList {
        pub(crate) workgroups: [u32; 3],
        pub(crate) count: u32,
        pub(crate) paths: [u32; 1],
    }
}

/// Bytes before the first path.
const HEADER_BYTES: u64 = std::mem::offset_of!(gpu::PathList, paths) as u64;

/// What stands before so many paths. Twin of `path_list_workgroups`.
pub(super) fn header(count: u32) -> [u32; 4] {
    let [x, y] = device::dispatch_size(count.div_ceil(64));
    [x, y, 1, count]
}

/// Paths that a shader lists together. Twin of `BLOCK` in `shaders/pass/image_space_tracer/list_lost.wgsl`.
pub(crate) const BLOCK: u32 = 64;

/// A list of paths on the GPU: those whose hop a tracer lost or is not sure of, in ascending order; or those that are traced
/// anew ([`PhotonGroups`](super::PhotonGroups)). It is the same every time.
///
/// A storage buffer, also `COPY_SRC` and `COPY_DST`: the three workgroup counts of an indirect dispatch with an invocation
/// for each path in workgroups of 64, none above 65 535; how many paths there are; their numbers. All `u32`.
#[derive(Debug)]
pub struct PathList {
    buffer: wgpu::Buffer,
    blocks: wgpu::Buffer,
    room: u32,
}

impl PathList {
    /// Room for all paths of `photons`: 4 bytes each, and a sixteenth of a byte to sort them by.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, photons: &Photons) -> Result<Self, Error> {
        Self::with_room(device, photons.count())
    }

    /// Room for so many paths.
    pub(crate) fn with_room(device: &wgpu::Device, count: u32) -> Result<Self, Error> {
        use wgpu::BufferUsages as U;
        let count = count.max(1);
        let bytes = HEADER_BYTES + 4 * u64::from(count);
        let usage = U::STORAGE | U::INDIRECT | U::COPY_SRC | U::COPY_DST;
        let block_bytes = 4 * u64::from(count.div_ceil(BLOCK));
        Ok(Self {
            buffer: device::buffer(device, "lightfall::PathList", bytes, usage)?,
            blocks: device::buffer(device, "lightfall::PathList::blocks", block_bytes, U::STORAGE)?,
            room: count,
        })
    }

    /// The list.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// Paths that there is room for.
    pub fn room(&self) -> u32 {
        self.room
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
