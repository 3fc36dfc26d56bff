//! Where photons start: for each light, which share of them starts in which part of what it emits.

use super::MAX_LIGHTS;
use crate::{Error, gpu as device};

/// Cells along each axis of a light's emission. Twin of `EMISSION_CELLS`.
pub(crate) const CELLS: usize = 16;

pub(crate) mod gpu {
    use super::CELLS;
    use bytemuck::{Pod, Zeroable};

    /// Twin of `EmissionTable` in `shaders/common/emission_cells.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct EmissionTable {
        pub(crate) columns: [f32; CELLS],
        pub(crate) rows: [f32; CELLS * CELLS],
    }
}

/// For each of [`MAX_LIGHTS`] lights a table of 16 × 16 cells of the two random numbers that an emission is made of, with the
/// share of the light's photons that starts in each; and counts of what came of those. At first all cells are alike.
#[derive(Debug)]
pub struct EmissionCells {
    tables: wgpu::Buffer,
    counts: wgpu::Buffer,
    history: wgpu::Buffer,
}

impl EmissionCells {
    /// Tables of evenly spread photons.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Self, Error> {
        use wgpu::BufferUsages as U;
        let end = |i: usize| (i % CELLS + 1) as f32 / CELLS as f32;
        let even = gpu::EmissionTable {
            columns: std::array::from_fn(end),
            rows: std::array::from_fn(end),
        };
        let buffer = |label, bytes: usize, usage| device::buffer(device, label, bytes as u64, U::STORAGE | usage);
        let cells = 8 * MAX_LIGHTS * CELLS * CELLS;
        let tables = buffer(
            "lightfall::EmissionCells::tables",
            MAX_LIGHTS * size_of::<gpu::EmissionTable>(),
            U::COPY_DST | U::COPY_SRC,
        )?;
        queue.write_buffer(&tables, 0, bytemuck::cast_slice(&[even; MAX_LIGHTS]));
        Ok(Self {
            tables,
            counts: buffer("lightfall::EmissionCells::counts", cells, U::empty())?,
            history: buffer("lightfall::EmissionCells::history", cells, U::empty())?,
        })
    }

    /// For each light, `f32`: for each of 16 columns the sum of the shares up to its end; then, column by column, for each of
    /// its 16 cells the sum up to its end as a part of the column's share. The first of the two numbers says the column.
    pub fn tables(&self) -> &wgpu::Buffer {
        &self.tables
    }

    /// For each cell, two `u32`: paths that started in it and hops of theirs that were seen, since the last update.
    pub(crate) fn counts(&self) -> &wgpu::Buffer {
        &self.counts
    }

    /// The same over all frames, older ones counting less, `f32`.
    pub(crate) fn history(&self) -> &wgpu::Buffer {
        &self.history
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.tables.size() + self.counts.size() + self.history.size()
    }
}
