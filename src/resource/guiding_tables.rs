//! Where photons start and where they go on to: which share of them goes which way.

use super::MAX_LIGHTS;
use crate::{Error, gpu as device};

/// Cells along each axis of a light's emission. Twin of `EMISSION_CELLS`.
pub(crate) const CELLS: usize = 16;

/// Cells along each axis of the directions from a diffuse surface. Twin of `REFLECTION_CELLS`.
pub(crate) const REFLECTIONS: usize = 4;

/// Places along each axis of the unit frame's cube. Twin of `REFLECTION_PLACES`.
pub(crate) const PLACES: usize = 16;

/// Tables of reflections: one for each place and each of the six directions that a normal may be nearest to.
pub(crate) const REFLECTION_TABLES: usize = 6 * PLACES * PLACES * PLACES;

/// Numbers counted for each cell of an emission, and for each table of reflections. Twins of `EMISSION_COUNTS`,
/// `REFLECTION_COUNTS`.
pub(crate) const EMISSION_COUNTS: usize = 2;
pub(crate) const REFLECTION_COUNTS: usize = 1 + REFLECTIONS * REFLECTIONS;

pub(crate) mod gpu {
    use super::{CELLS, REFLECTIONS};
    use bytemuck::{Pod, Zeroable};

    /// Twin of `EmissionTable` in `shaders/common/emission_tables.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct EmissionTable {
        pub(crate) columns: [f32; CELLS],
        pub(crate) rows: [f32; CELLS * CELLS],
    }

    /// Twin of `ReflectionTable` in `shaders/common/reflection_tables.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct ReflectionTable {
        pub(crate) columns: [f32; REFLECTIONS],
        pub(crate) rows: [f32; REFLECTIONS * REFLECTIONS],
    }
}

/// For each of [`MAX_LIGHTS`] lights, and for each place and side of diffuse surfaces, the share of photons that leaves each way;
/// and counts of what came of those. At first all ways are alike.
///
/// Ways are cells of the square of the two random numbers that a direction is made of. A place is one of 16 × 16 × 16 cubes that
/// the unit frame's region is divided into, a side one of the six directions of the axes that a normal is nearest to.
#[derive(Debug)]
pub struct GuidingTables {
    emission: wgpu::Buffer,
    reflection: wgpu::Buffer,
    /// Since the last update; over all frames, older ones counting less.
    emission_counts: [wgpu::Buffer; 2],
    reflection_counts: [wgpu::Buffer; 2],
}

impl GuidingTables {
    /// Tables of evenly spread photons.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Self, Error> {
        use wgpu::BufferUsages as U;
        let buffer = |label, bytes: usize, usage| device::buffer(device, label, bytes as u64, U::STORAGE | usage);
        let even_emission = gpu::EmissionTable {
            columns: std::array::from_fn(end_of_cell::<CELLS>),
            rows: std::array::from_fn(end_of_cell::<CELLS>),
        };
        let even_reflection = gpu::ReflectionTable {
            columns: std::array::from_fn(end_of_cell::<REFLECTIONS>),
            rows: std::array::from_fn(end_of_cell::<REFLECTIONS>),
        };
        let emission = vec![even_emission; MAX_LIGHTS];
        let reflection = vec![even_reflection; REFLECTION_TABLES];
        let counts = [
            4 * EMISSION_COUNTS * MAX_LIGHTS * CELLS * CELLS,
            4 * REFLECTION_COUNTS * REFLECTION_TABLES,
        ];
        let usage = U::COPY_DST | U::COPY_SRC;
        let none = U::empty();
        let tables = Self {
            emission: buffer("lightfall::GuidingTables::emission", size_of_val(&*emission), usage)?,
            reflection: buffer("lightfall::GuidingTables::reflection", size_of_val(&*reflection), usage)?,
            emission_counts: [
                buffer("lightfall::GuidingTables::emission_counts", counts[0], none)?,
                buffer("lightfall::GuidingTables::emission_history", counts[0], none)?,
            ],
            reflection_counts: [
                buffer("lightfall::GuidingTables::reflection_counts", counts[1], none)?,
                buffer("lightfall::GuidingTables::reflection_history", counts[1], none)?,
            ],
        };
        queue.write_buffer(&tables.emission, 0, bytemuck::cast_slice(&emission));
        queue.write_buffer(&tables.reflection, 0, bytemuck::cast_slice(&reflection));
        Ok(tables)
    }

    /// For each light, `f32`: for each of 16 columns the sum of the shares up to its end; then, column by column, for each of
    /// its 16 cells the sum up to its end as a part of the column's share. The first of the two numbers says the column.
    pub fn emission(&self) -> &wgpu::Buffer {
        &self.emission
    }

    /// For each place, x first, then y, and in each for normals nearest to +x, −x, +y, −y, +z, −z: the same for 4 × 4 cells of the two
    /// numbers that the direction from a diffuse surface is made of.
    pub fn reflection(&self) -> &wgpu::Buffer {
        &self.reflection
    }

    /// What is bound in the place of those where there are none.
    pub(crate) fn no_reflection(device: &wgpu::Device, label: &'static str) -> Result<wgpu::Buffer, Error> {
        let bytes = size_of::<gpu::ReflectionTable>() as u64;
        device::buffer(device, label, bytes, wgpu::BufferUsages::STORAGE)
    }

    /// For each cell of each light, since the last update, `u32`: weight of the hops of its paths that were seen, and how many these
    /// were; and the same over all frames, `f32`.
    pub(crate) fn emission_counts(&self) -> [&wgpu::Buffer; 2] {
        self.emission_counts.each_ref()
    }

    /// For each table of reflections: how many hops of paths that went on there were seen, and for each of its cells the weight of
    /// those of paths that went that way. In two buffers, as those of emission.
    pub(crate) fn reflection_counts(&self) -> [&wgpu::Buffer; 2] {
        self.reflection_counts.each_ref()
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        let counts = self.emission_counts.iter().chain(&self.reflection_counts);
        self.emission.size() + self.reflection.size() + counts.map(wgpu::Buffer::size).sum::<u64>()
    }
}

/// Where the cell of an even table ends, in its column of N.
fn end_of_cell<const N: usize>(cell: usize) -> f32 {
    (cell % N + 1) as f32 / N as f32
}
