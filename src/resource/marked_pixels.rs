//! Pixels that an interpolation leaves in doubt.

use crate::{Error, gpu as device, read_buffer_blocking};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `MarkedPixels` in `shaders/common/marked_pixels.wgsl`, with the first of them.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct MarkedPixels {
        pub(crate) workgroups: [u32; 3],
        pub(crate) count: u32,
        pub(crate) pixels: [u32; 1],
    }
}

/// Bytes before the first pixel.
const HEADER_BYTES: u64 = std::mem::offset_of!(gpu::MarkedPixels, pixels) as u64;

/// A list on the GPU of those pixels of an [`Irradiance`](super::Irradiance) that are to be estimated anew, for what lies
/// around them does not say what they show. Which they are is the same every time; their order is not.
///
/// A storage buffer, also `INDIRECT`, `COPY_SRC` and `COPY_DST`: the three workgroup counts of an indirect dispatch with an
/// invocation for each pixel in workgroups of 64, none above 65 535; how many pixels there are; and for each its column in
/// the lower 16 bits, its row in the upper. All `u32`.
#[derive(Debug)]
pub struct MarkedPixels {
    buffer: wgpu::Buffer,
    size: [u32; 2],
}

impl MarkedPixels {
    /// Bytes for irradiance of this size: all pixels may be marked.
    pub fn size_in_bytes(size: [u32; 2]) -> u64 {
        let [width, height] = size.map(u64::from);
        HEADER_BYTES + 4 * (width * height).max(1)
    }

    /// Room for the pixels of irradiance of this size.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, size: [u32; 2]) -> Result<Self, Error> {
        use wgpu::BufferUsages as U;
        let usage = U::STORAGE | U::INDIRECT | U::COPY_SRC | U::COPY_DST;
        let bytes = Self::size_in_bytes(size);
        let buffer = device::buffer(device, "lightfall::MarkedPixels", bytes, usage)?;
        Ok(Self { buffer, size })
    }

    /// The list.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// Width and height of the irradiance they belong to.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Those that are marked, in ascending order of their numbers row · width + column. Submits and waits: for studies and
    /// tests.
    ///
    /// # Errors
    /// [`Error::ReadBack`], [`Error::LimitExceeded`].
    pub fn read_blocking(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Vec<[u32; 2]>, Error> {
        let words: Vec<u32> = read_buffer_blocking(device, queue, &self.buffer)?;
        let (header, pixels) = words.split_at(HEADER_BYTES as usize / 4);
        let marked = pixels.iter().take(header[3] as usize);
        let mut list: Vec<_> = marked.map(|pixel| [pixel & 0xffff, pixel >> 16]).collect();
        list.sort_by_key(|[column, row]| (*row, *column));
        Ok(list)
    }

    /// Forgets them.
    pub(crate) fn clear(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.buffer, 0, Some(HEADER_BYTES));
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.buffer.size()
    }
}
