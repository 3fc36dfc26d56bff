//! GPU time per pass, where the device has timestamp queries.

use crate::{Error, gpu};
use std::cell::RefCell;

/// Queries a frame may write; a pass takes two.
const CAPACITY: u32 = 1024;

/// A sink for the GPU time of passes, handed to `record` by reference. Core WebGPU writes timestamps at pass boundaries
/// only, so passes beyond its capacity of 512 go untimed.
#[derive(Debug)]
pub struct Timestamps {
    query_set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    read_back: wgpu::Buffer,
    labels: RefCell<Vec<&'static str>>,
}

/// Where one pass writes its times.
pub(crate) struct Span<'a> {
    pub(crate) query_set: &'a wgpu::QuerySet,
    pub(crate) begin: u32,
    pub(crate) end: u32,
}

impl Timestamps {
    /// Features that a device needs for timing.
    pub fn required_features() -> wgpu::Features {
        wgpu::Features::TIMESTAMP_QUERY
    }

    /// A sink on this device.
    ///
    /// # Errors
    /// [`Error::MissingFeatures`] without [`Timestamps::required_features`].
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        let missing = Self::required_features() - device.features();
        if !missing.is_empty() {
            return Err(Error::MissingFeatures {
                what: "Timestamps",
                missing,
                instead: "wall-clock time around the submission",
            });
        }
        let bytes = u64::from(CAPACITY) * 8;
        use wgpu::BufferUsages as U;
        Ok(Self {
            query_set: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("lightfall::Timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count: CAPACITY,
            }),
            resolved: gpu::buffer(
                device,
                "lightfall::Timestamps::resolved",
                bytes,
                U::QUERY_RESOLVE | U::COPY_SRC,
            )?,
            read_back: gpu::buffer(
                device,
                "lightfall::Timestamps::read_back",
                bytes,
                U::MAP_READ | U::COPY_DST,
            )?,
            labels: RefCell::new(Vec::new()),
        })
    }

    /// A pair of queries for the next pass, or `None` when all are taken.
    pub(crate) fn span(&self, label: &'static str) -> Option<Span<'_>> {
        let mut labels = self.labels.borrow_mut();
        let begin = 2 * labels.len() as u32;
        (begin + 2 <= CAPACITY).then(|| {
            labels.push(label);
            Span {
                query_set: &self.query_set,
                begin,
                end: begin + 1,
            }
        })
    }

    /// Records the transfer of this frame's times; call it after the last pass, before submitting.
    pub fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        let used = 2 * self.labels.borrow().len() as u32;
        if used > 0 {
            encoder.resolve_query_set(&self.query_set, 0..used, &self.resolved, 0);
            encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.read_back, 0, u64::from(used) * 8);
        }
    }

    /// How many passes have been timed since times were last taken.
    pub fn passes(&self) -> usize {
        self.labels.borrow().len()
    }

    /// Waits for the submitted frame and returns milliseconds per pass label, in order of first use; passes that share
    /// a label are summed. Empties the sink for the next frame.
    ///
    /// # Errors
    /// [`Error::ReadBack`].
    pub fn take_blocking(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Vec<(&'static str, f64)>, Error> {
        let labels = self.labels.take();
        if labels.is_empty() {
            return Ok(Vec::new());
        }
        let ticks: Vec<u64> = crate::read_back::map_blocking(device, &self.read_back, "timestamps")?;
        let milliseconds_per_tick = f64::from(queue.get_timestamp_period()) * 1e-6;
        let mut sums: Vec<(&'static str, f64)> = Vec::new();
        for (label, pair) in labels.iter().zip(ticks.chunks_exact(2)) {
            let time = pair[1].saturating_sub(pair[0]) as f64 * milliseconds_per_tick;
            match sums.iter_mut().find(|(l, _)| l == label) {
                Some((_, sum)) => *sum += time,
                None => sums.push((label, time)),
            }
        }
        Ok(sums)
    }
}
