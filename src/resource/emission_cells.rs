//! Where photons start: for each light, which share of them starts in which part of what it emits.

use super::MAX_LIGHTS;
use crate::{Error, gpu as device};

/// Cells along each axis of a light's emission. Twin of `EMISSION_CELLS`.
pub(crate) const CELLS: usize = 16;

/// Cells along each axis of what paths of one of those go on to from their first hit. Twin of `REFLECTION_CELLS`.
pub(crate) const REFLECTIONS: usize = 4;

/// Of all lights.
pub(crate) const TABLES: usize = 6 * PLACES * PLACES * PLACES;
const PLACES: usize = 16;

pub(crate) mod gpu {
    use super::{CELLS, REFLECTIONS};
    use bytemuck::{Pod, Zeroable};

    /// Twin of `EmissionTable` in `shaders/common/emission_cells.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct EmissionTable {
        pub(crate) columns: [f32; CELLS],
        pub(crate) rows: [f32; CELLS * CELLS],
    }

    /// Twin of `ReflectionTable` in `shaders/common/reflection_cells.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct ReflectionTable {
        pub(crate) columns: [f32; REFLECTIONS],
        pub(crate) rows: [f32; REFLECTIONS * REFLECTIONS],
    }
}

/// For each of [`MAX_LIGHTS`] lights a table of 16 × 16 cells of the two random numbers that an emission is made of, with the
/// share of the light's photons that starts in each; and counts of what came of those. At first all cells are alike.
#[derive(Debug)]
pub struct EmissionCells {
    tables: wgpu::Buffer,
    reflection_tables: wgpu::Buffer,
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
        fn end<const N: usize>(i: usize) -> f32 {
            (i % N + 1) as f32 / N as f32
        }
        let even = gpu::EmissionTable {
            columns: std::array::from_fn(end::<CELLS>),
            rows: std::array::from_fn(end::<CELLS>),
        };
        let even_reflections = gpu::ReflectionTable {
            columns: std::array::from_fn(end::<REFLECTIONS>),
            rows: std::array::from_fn(end::<REFLECTIONS>),
        };
        let buffer = |label, bytes: usize, usage| device::buffer(device, label, bytes as u64, U::STORAGE | usage);
        let cells = 8 * MAX_LIGHTS * CELLS * CELLS + 4 * TABLES * (1 + REFLECTIONS * REFLECTIONS);
        let tables = buffer(
            "lightfall::EmissionCells::tables",
            MAX_LIGHTS * size_of::<gpu::EmissionTable>(),
            U::COPY_DST | U::COPY_SRC,
        )?;
        queue.write_buffer(&tables, 0, bytemuck::cast_slice(&[even; MAX_LIGHTS]));
        let reflection_tables = buffer(
            "lightfall::EmissionCells::reflection_tables",
            TABLES * size_of::<gpu::ReflectionTable>(),
            U::COPY_DST | U::COPY_SRC,
        )?;
        queue.write_buffer(&reflection_tables, 0, bytemuck::cast_slice(&vec![even_reflections; TABLES]));
        Ok(Self {
            tables,
            reflection_tables,
            counts: buffer("lightfall::EmissionCells::counts", cells, U::empty())?,
            history: buffer("lightfall::EmissionCells::history", cells, U::empty())?,
        })
    }

    /// For each light, `f32`: for each of 16 columns the sum of the shares up to its end; then, column by column, for each of
    /// its 16 cells the sum up to its end as a part of the column's share. The first of the two numbers says the column.
    pub fn tables(&self) -> &wgpu::Buffer {
        &self.tables
    }

    /// For each cell of each light, `f32`: the same for 4 × 4 cells of the two random numbers that a path's direction from its
    /// first hit is made of, if that is diffuse.
    pub fn reflection_tables(&self) -> &wgpu::Buffer {
        &self.reflection_tables
    }

    /// What is bound in the place of those where there are none.
    pub(crate) fn no_reflection_tables(device: &wgpu::Device, label: &'static str) -> Result<wgpu::Buffer, Error> {
        let bytes = size_of::<gpu::ReflectionTable>() as u64;
        device::buffer(device, label, bytes, wgpu::BufferUsages::STORAGE)
    }

    /// For each cell, `u32`, since the last update: weight of the hops of its paths that were seen, how many those were, and the
    /// weight of those that came by each of its reflections.
    pub(crate) fn counts(&self) -> &wgpu::Buffer {
        &self.counts
    }

    /// The same over all frames, older ones counting less, `f32`.
    pub(crate) fn history(&self) -> &wgpu::Buffer {
        &self.history
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.tables.size() + self.reflection_tables.size() + self.counts.size() + self.history.size()
    }
}
