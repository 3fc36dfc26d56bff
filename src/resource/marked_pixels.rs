//! Pixels that an interpolation leaves in doubt.

use crate::{Error, gpu, read_buffer_blocking};

/// Pixels along the side of a block whose marks lie together. Twin of `marked_blocks` in `shaders/common/marked_pixels.wgsl`.
const BLOCK: u32 = 8;

/// One bit for each pixel of an [`Irradiance`](super::Irradiance): those that are to be estimated anew, for what lies around
/// them does not say what they show.
///
/// A storage buffer, also `COPY_SRC`: two `u32` for each block of 8 × 8 pixels, row by row; within a block, bits count along
/// rows, from the lowest. Those beyond the image are 0.
#[derive(Debug)]
pub struct MarkedPixels {
    buffer: wgpu::Buffer,
    size: [u32; 2],
}

impl MarkedPixels {
    /// Bytes for irradiance of this size.
    pub fn size_in_bytes(size: [u32; 2]) -> u64 {
        let [columns, rows] = size.map(|length| u64::from(length.div_ceil(BLOCK)));
        (8 * columns * rows).max(8)
    }

    /// Marks for irradiance of this size.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, size: [u32; 2]) -> Result<Self, Error> {
        use wgpu::BufferUsages as U;
        let bytes = Self::size_in_bytes(size);
        let buffer = gpu::buffer(device, "lightfall::MarkedPixels", bytes, U::STORAGE | U::COPY_SRC)?;
        Ok(Self { buffer, size })
    }

    /// The marks.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// Width and height of the irradiance they belong to.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// How many pixels are marked. Submits and waits: for studies and tests.
    ///
    /// # Errors
    /// [`Error::ReadBack`], [`Error::LimitExceeded`].
    pub fn count_blocking(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<u64, Error> {
        let words: Vec<u32> = read_buffer_blocking(device, queue, &self.buffer)?;
        Ok(words.iter().map(|word| u64::from(word.count_ones())).sum())
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.buffer.size()
    }
}
