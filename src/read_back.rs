//! Reading results back: asynchronously on the frame path ([`ReadBackRing`]), and by waiting, for headless use, in the
//! functions that say so in their names.

use crate::{Error, gpu};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// Results that may be on their way at once: two frames in flight and one being read.
const RING: usize = 3;

/// Copies of a small buffer that come back a frame or two later, without a wait: the transfer is recorded with the frame,
/// and the host's own submitting or polling delivers it.
#[derive(Debug)]
pub(crate) struct ReadBackRing {
    slots: [RingSlot; RING],
    /// Transfers recorded so far; orders them.
    recorded: u64,
    /// Set when a result will not arrive.
    lost: Arc<AtomicBool>,
    size: u64,
}

#[derive(Debug)]
struct RingSlot {
    buffer: wgpu::Buffer,
    state: Arc<AtomicU32>,
    order: u64,
}

/// States of a slot.
const FREE: u32 = 0;
const IN_FLIGHT: u32 = 1;
const READY: u32 = 2;

/// A result under way. If it never arrives, because the commands were not submitted or the device failed, its slot is
/// freed and the loss is noted.
struct Delivery {
    /// Taken on arrival: from then on the slot is the reader's.
    slot: Option<Arc<AtomicU32>>,
    lost: Arc<AtomicBool>,
}

impl Delivery {
    fn arrive(mut self, result: Result<(), wgpu::BufferAsyncError>) {
        if result.is_ok()
            && let Some(slot) = self.slot.take()
        {
            slot.store(READY, Ordering::Release);
        }
    }
}

impl Drop for Delivery {
    fn drop(&mut self) {
        if let Some(slot) = self.slot.take() {
            self.lost.store(true, Ordering::Release);
            slot.store(FREE, Ordering::Release);
        }
    }
}

impl ReadBackRing {
    /// Bytes of a ring for results of `size` bytes.
    pub(crate) fn size_in_bytes(size: u64) -> u64 {
        RING as u64 * size
    }

    /// For results of `size` bytes.
    pub(crate) fn new(device: &wgpu::Device, label: &'static str, size: u64) -> Result<Self, Error> {
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let slot = || {
            Ok(RingSlot {
                buffer: gpu::buffer(device, label, size, usage)?,
                state: Arc::new(AtomicU32::new(FREE)),
                order: 0,
            })
        };
        Ok(Self {
            slots: [slot()?, slot()?, slot()?],
            recorded: 0,
            lost: Arc::default(),
            size,
        })
    }

    /// Records the transfer of `source`'s first bytes. While all slots are under way the result is lost.
    pub(crate) fn record(&mut self, encoder: &mut wgpu::CommandEncoder, source: &wgpu::Buffer) {
        let Some(slot) = self.slots.iter_mut().find(|s| s.state.load(Ordering::Acquire) == FREE) else {
            return;
        };
        self.recorded += 1;
        slot.order = self.recorded;
        slot.state.store(IN_FLIGHT, Ordering::Release);
        encoder.copy_buffer_to_buffer(source, 0, &slot.buffer, 0, self.size);
        let delivery = Delivery {
            slot: Some(slot.state.clone()),
            lost: self.lost.clone(),
        };
        encoder.map_buffer_on_submit(&slot.buffer, wgpu::MapMode::Read, .., move |result| {
            delivery.arrive(result)
        });
    }

    /// Whether a result has been lost since the last call.
    pub(crate) fn take_lost(&self) -> bool {
        self.lost.swap(false, Ordering::AcqRel)
    }

    /// Bytes of a result.
    pub(crate) fn size(&self) -> u64 {
        self.size
    }

    /// The latest result that has arrived; older ones are let go.
    pub(crate) fn take<T: bytemuck::AnyBitPattern>(&mut self) -> Option<T> {
        self.take_with(|bytes| bytemuck::try_pod_read_unaligned(&bytes[..size_of::<T>()]).ok())
    }

    /// The same, as words.
    pub(crate) fn take_words(&mut self) -> Option<Vec<u32>> {
        self.take_with(|bytes| Some(bytemuck::pod_collect_to_vec(bytes)))
    }

    fn take_with<T>(&mut self, read: impl Fn(&[u8]) -> Option<T>) -> Option<T> {
        let mut latest = None;
        let mut newest = 0;
        for slot in &self.slots {
            if slot.state.load(Ordering::Acquire) != READY {
                continue;
            }
            if slot.order > newest
                && let Ok(mapped) = slot.buffer.slice(..).get_mapped_range()
            {
                latest = read(&mapped);
                newest = slot.order;
            }
            slot.buffer.unmap();
            slot.state.store(FREE, Ordering::Release);
        }
        latest
    }
}

/// Waits until `buffer` (MAP_READ) can be mapped and copies its contents out.
pub(crate) fn map_blocking<T: bytemuck::Pod>(
    device: &wgpu::Device,
    buffer: &wgpu::Buffer,
    what: &'static str,
) -> Result<Vec<T>, Error> {
    let error = |reason: String| Error::ReadBack { what, reason };
    gpu::count_wait();
    let (sender, receiver) = std::sync::mpsc::channel();
    buffer.slice(..).map_async(wgpu::MapMode::Read, move |result| {
        // The receiver lives until this function returns.
        let _ = sender.send(result);
    });
    device
        .poll(wgpu::PollType::wait_indefinitely())
        .map_err(|e| error(e.to_string()))?;
    receiver
        .recv()
        .map_err(|e| error(e.to_string()))?
        .map_err(|e| error(e.to_string()))?;
    let mapped = buffer.slice(..).get_mapped_range().map_err(|e| error(e.to_string()))?;
    let values = bytemuck::pod_collect_to_vec(&mapped);
    drop(mapped);
    buffer.unmap();
    Ok(values)
}

/// Copies a buffer (usage `COPY_SRC`) to the CPU: submits, waits.
///
/// # Errors
/// [`Error::ReadBack`] if the device is lost, [`Error::LimitExceeded`] if the staging buffer cannot be made.
pub fn read_buffer_blocking<T: bytemuck::Pod>(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    buffer: &wgpu::Buffer,
) -> Result<Vec<T>, Error> {
    let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
    let staging = gpu::buffer(device, "lightfall::read_back", buffer.size(), usage)?;
    let mut encoder = device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
    queue.submit([encoder.finish()]);
    map_blocking(device, &staging, "a buffer")
}

/// Copies an `rgba32float` texture (usage `COPY_SRC`) to the CPU, row-major from the top: submits, waits.
///
/// # Errors
/// [`Error::IncompatibleView`] for another format, else as [`read_buffer_blocking`].
pub fn read_rgba32float_blocking(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
) -> Result<Vec<[f32; 4]>, Error> {
    read_texels_blocking(device, queue, texture, wgpu::TextureFormat::Rgba32Float)
}

/// Copies one layer after the other of a texture whose texel is `T`.
pub(crate) fn read_texels_blocking<T: bytemuck::Pod>(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
    format: wgpu::TextureFormat,
) -> Result<Vec<T>, Error> {
    if texture.format() != format {
        return Err(Error::IncompatibleView {
            resource: "read-back texture",
            property: "format",
            expected: format!("{format:?}"),
            found: format!("{:?}", texture.format()),
        });
    }
    let (width, height, layers) = (texture.width(), texture.height(), texture.depth_or_array_layers());
    let row = width * size_of::<T>() as u32;
    let padded_row = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
    let size = u64::from(padded_row) * u64::from(height) * u64::from(layers);
    let staging = gpu::buffer(device, "lightfall::read_back", size, usage)?;
    let mut encoder = device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &staging,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(padded_row),
                rows_per_image: Some(height),
            },
        },
        texture.size(),
    );
    queue.submit([encoder.finish()]);
    let bytes: Vec<u8> = map_blocking(device, &staging, "a texture")?;
    Ok(bytes
        .chunks_exact(padded_row as usize)
        .flat_map(|r| bytemuck::pod_collect_to_vec::<u8, T>(&r[..row as usize]))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn delivery() -> (Delivery, Arc<AtomicU32>, Arc<AtomicBool>) {
        let (slot, lost) = (Arc::new(AtomicU32::new(IN_FLIGHT)), Arc::<AtomicBool>::default());
        let delivery = Delivery {
            slot: Some(slot.clone()),
            lost: lost.clone(),
        };
        (delivery, slot, lost)
    }

    #[test]
    fn a_result_that_arrives_is_ready_and_one_that_cannot_is_noted() {
        let (arriving, slot, lost) = delivery();
        arriving.arrive(Ok(()));
        assert_eq!(
            (slot.load(Ordering::Acquire), lost.load(Ordering::Acquire)),
            (READY, false)
        );
        let (failing, slot, lost) = delivery();
        failing.arrive(Err(wgpu::BufferAsyncError));
        assert_eq!(
            (slot.load(Ordering::Acquire), lost.load(Ordering::Acquire)),
            (FREE, true)
        );
        let (dropped, slot, lost) = delivery();
        drop(dropped);
        assert_eq!(
            (slot.load(Ordering::Acquire), lost.load(Ordering::Acquire)),
            (FREE, true)
        );
    }
}
