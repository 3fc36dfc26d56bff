//! Virtual surface lights: points that stand for the light that the surface around them sends on.

use crate::scene::{SurfacePlace, UnitFrame};
use crate::{Error, gpu as device, read_buffer_blocking};
use glam::{UVec3, Vec3};

/// Most cells along an axis: they are as wide as lights lie apart, or as this many cover all lights.
const MOST_CELLS: u32 = 32;

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `SurfaceLight` in `shaders/common/surface_light.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct SurfaceLight {
        pub(crate) position: [f32; 3],
        pub(crate) area: f32,
        pub(crate) normal: [f32; 3],
        pub(crate) surface: u32,
    }

    /// Twin of `Nearest` in `shaders/pass/photon_stream/place_lights.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Nearest {
        pub(crate) distance: u32,
        pub(crate) slot: u32,
    }

    /// Twin of `SurfaceLightGrid` in `shaders/common/surface_light.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct SurfaceLightGrid {
        pub(crate) origin: [f32; 3],
        pub(crate) cell: f32,
        pub(crate) cells: [u32; 3],
        pub(crate) count: u32,
        pub(crate) steps: f32,
        pub(crate) _pad: [u32; 3],
    }
}

/// Lights on surfaces, two at each place, one for either side: light 2 i on the side that its normal points to. Storage
/// buffers: 32 bytes a light (position, area, normal, number of its surface and side; unit frame), where it stands and where it
/// shines from, and its flux, red, green and blue as whole numbers of [`SurfaceLights::flux_of_step`], with the number of
/// photons that it is of. Filled by [`PhotonStream`](crate::pass::PhotonStream), shone by
/// [`SurfaceLightShading`](crate::pass::SurfaceLightShading).
#[derive(Debug)]
pub struct SurfaceLights {
    /// Where they stand.
    records: wgpu::Buffer,
    /// From where they shine.
    shining: wgpu::Buffer,
    nearest: wgpu::Buffer,
    flux: wgpu::Buffer,
    changes: wgpu::Buffer,
    /// Of each surface's side, unit frame.
    surface_areas: Vec<f32>,
    cells: wgpu::Buffer,
    grid: wgpu::Buffer,
    written: Vec<gpu::SurfaceLight>,
    /// Of `written`, or of impacts.
    count: u32,
    capacity: u32,
    steps: f32,
}

impl SurfaceLights {
    /// Bytes for so many places.
    pub fn size_in_bytes(places: u32) -> u64 {
        let lights = u64::from(lights_of(places));
        lights * (2 * size_of::<gpu::SurfaceLight>() as u64 + size_of::<gpu::Nearest>() as u64 + 16 + 8)
            + cells_bytes(places)
            + size_of::<gpu::SurfaceLightGrid>() as u64
    }

    /// Room for so many places. `hops`: how many times the photons that they are made of arrive at a surface at most,
    /// [`Photons::bounces`](super::Photons::bounces) + 1.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, places: u32, hops: u32) -> Result<Self, Error> {
        use wgpu::BufferUsages as B;
        let lights = u64::from(lights_of(places)).max(2);
        let records = lights * size_of::<gpu::SurfaceLight>() as u64;
        let storage = |label, bytes| device::buffer(device, label, bytes, B::STORAGE | B::COPY_DST | B::COPY_SRC);
        Ok(Self {
            records: storage("lightfall::SurfaceLights::records", records)?,
            shining: storage("lightfall::SurfaceLights::shining", records)?,
            nearest: storage(
                "lightfall::SurfaceLights::nearest",
                lights * size_of::<gpu::Nearest>() as u64,
            )?,
            flux: storage("lightfall::SurfaceLights::flux", 16 * lights)?,
            changes: storage("lightfall::SurfaceLights::changes", 8 * lights)?,
            surface_areas: Vec::new(),
            cells: storage("lightfall::SurfaceLights::cells", cells_bytes(places))?,
            grid: device::uniform_buffer::<gpu::SurfaceLightGrid>(device, "lightfall::SurfaceLights::grid")?,
            written: Vec::new(),
            count: 0,
            capacity: lights_of(places),
            steps: steps(hops),
        })
    }

    /// Says where they stand this frame. Their flux stays: of as many places as before, those of the same index are the
    /// same lights. Nothing is uploaded where nothing moved.
    ///
    /// # Errors
    /// [`Error::CountMismatch`] for more places than there is room for; [`Error::InvalidScene`] for one that is not finite.
    ///
    /// Returns whether any moved: then they shine from their places until [`PhotonStream`](crate::pass::PhotonStream) is
    /// recorded.
    pub fn write(&mut self, queue: &wgpu::Queue, frame: &UnitFrame, places: &[SurfacePlace]) -> Result<bool, Error> {
        if lights_of(places.len() as u32) > self.capacity {
            return Err(Error::CountMismatch {
                what: "places of surface lights (most that there is room for)",
                expected: (self.capacity / 2) as usize,
                found: places.len(),
            });
        }
        let is_bad = |p: &SurfacePlace| {
            let is_unit = (p.normal.length_squared() - 1.0).abs() < 1e-3;
            let has_areas = p.areas.iter().all(|area| *area >= 0.0 && area.is_finite());
            !(p.position.is_finite() && is_unit && has_areas)
        };
        if let Some(index) = places.iter().position(is_bad) {
            let problem = "has a position or an area that is not finite, or a normal that is not of length one";
            return Err(Error::scene("surface light", format!("#{index}"), "place", problem));
        }
        let mut numbers = std::collections::BTreeMap::new();
        let sides = |p: &SurfacePlace| {
            let next = 2 * numbers.len() as u32;
            let surface = *numbers.entry(p.surface).or_insert(next);
            [(1.0, 0), (-1.0, 1)].map(|(side, back)| gpu::SurfaceLight {
                position: frame.point(p.position).to_array(),
                area: frame.area(p.areas[back as usize]),
                normal: (side * p.normal).as_vec3().to_array(),
                surface: surface + back,
            })
        };
        let records: Vec<_> = places.iter().flat_map(sides).collect();
        if records == self.written {
            return Ok(false);
        }
        let (grid, cells) = cells_of(&records, self.steps);
        for buffer in [&self.records, &self.shining] {
            queue.write_buffer(buffer, 0, bytemuck::cast_slice(&records));
        }
        queue.write_buffer(&self.cells, 0, bytemuck::cast_slice(&cells));
        queue.write_buffer(&self.grid, 0, bytemuck::bytes_of(&grid));
        self.count = records.len() as u32;
        self.surface_areas = vec![0.0; 2 * numbers.len()];
        records
            .iter()
            .for_each(|r| self.surface_areas[r.surface as usize] += r.area);
        self.written = records;
        Ok(true)
    }

    /// Says that so many lights stand where photons arrive, and not at places of their own.
    pub(crate) fn stand_at_impacts(&mut self, queue: &wgpu::Queue, count: u32) {
        let grid = gpu::SurfaceLightGrid {
            steps: self.steps,
            ..bytemuck::Zeroable::zeroed()
        };
        queue.write_buffer(&self.grid, 0, bytemuck::bytes_of(&grid));
        self.count = count.min(self.capacity);
        self.written.clear();
    }

    /// Takes all flux from them.
    pub(crate) fn clear_flux(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.flux, 0, None);
        encoder.clear_buffer(&self.changes, 0, None);
    }

    /// Where the lights stand, 32 bytes each.
    pub fn records(&self) -> &wgpu::Buffer {
        &self.records
    }

    /// The same, but with the position that they shine from: that of their impact that is nearest to their place, or the place
    /// until there is one.
    pub fn shining(&self) -> &wgpu::Buffer {
        &self.shining
    }

    /// How far from its place each of the lights shines, unit frame: waits for the GPU.
    pub(crate) fn read_shifts_blocking(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Vec<Vec3>, Error> {
        let shining: Vec<gpu::SurfaceLight> = read_buffer_blocking(device, queue, &self.shining)?;
        let shift =
            |(from, to): (&gpu::SurfaceLight, &gpu::SurfaceLight)| Vec3::from(to.position) - Vec3::from(from.position);
        Ok(self.written.iter().zip(&shining).map(shift).collect())
    }

    pub(crate) fn nearest(&self) -> &wgpu::Buffer {
        &self.nearest
    }

    /// Of the lights, 16 bytes each: red, green, blue, photons.
    pub fn flux(&self) -> &wgpu::Buffer {
        &self.flux
    }

    /// Of the lights, two `u32` each: the flux that came and went where a pool notes that
    /// ([`PhotonPool::note_changes`](super::PhotonPool::note_changes)), sums over channels in 16 steps, and of that the part
    /// that had been scattered before it arrived; until whoever uses it sets it to 0.
    pub fn changes(&self) -> &wgpu::Buffer {
        &self.changes
    }

    /// Area of each side of each surface that lights stand on, unit frame, by the number in a light's record.
    pub(crate) fn surface_areas(&self) -> &[f32] {
        &self.surface_areas
    }

    pub(crate) fn cells(&self) -> &wgpu::Buffer {
        &self.cells
    }

    pub(crate) fn grid(&self) -> &wgpu::Buffer {
        &self.grid
    }

    /// Unit-frame flux of a step: a power of two. Sums hold what a unit frame's lights send out, twice over, at every hop.
    pub fn flux_of_step(&self) -> f32 {
        1.0 / self.steps
    }

    /// Lights, two a place.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Lights that there is room for.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Bytes this resource allocated.
    pub fn memory_use(&self) -> u64 {
        self.records.size()
            + self.shining.size()
            + self.nearest.size()
            + self.flux.size()
            + self.changes.size()
            + self.cells.size()
            + self.grid.size()
    }
}

fn lights_of(places: u32) -> u32 {
    places.saturating_mul(2)
}

fn cells_bytes(places: u32) -> u64 {
    4 * (u64::from(MOST_CELLS).pow(3) + 1 + u64::from(lights_of(places)))
}

/// Steps of flux in one of the unit frame, so that 32 bits hold all of it, twice over, at every hop: a power of two.
fn steps(hops: u32) -> f32 {
    0x8000_0000u32 as f32 / (2.0 * hops.max(1).next_power_of_two() as f32)
}

/// Lights by cells: of each cell where its lights begin, one more, and the lights.
fn cells_of(records: &[gpu::SurfaceLight], steps: f32) -> (gpu::SurfaceLightGrid, Vec<u32>) {
    let positions = || records.iter().map(|r| Vec3::from(r.position));
    let low = positions().reduce(Vec3::min).unwrap_or(Vec3::ZERO);
    let high = positions().reduce(Vec3::max).unwrap_or(Vec3::ZERO);
    let area: f32 = records.iter().map(|r| r.area).sum();
    let apart = (area / records.len().max(1) as f32).sqrt();
    let widest = (high - low).max_element() / (MOST_CELLS - 1) as f32;
    let cell = apart.max(widest).max(1e-6);
    let cells = ((high - low) / cell).floor().as_uvec3() + UVec3::ONE;
    let cells = cells.min(UVec3::splat(MOST_CELLS));
    let index = |p: Vec3| {
        let at = ((p - low) / cell).floor().as_uvec3().min(cells - UVec3::ONE);
        ((at.z * cells.y + at.y) * cells.x + at.x) as usize
    };
    let total = cells.element_product() as usize;
    let mut starts = vec![0u32; total + 1];
    positions().for_each(|p| starts[index(p) + 1] += 1);
    for i in 0..total {
        starts[i + 1] += starts[i];
    }
    let mut next = starts.clone();
    let mut entries = vec![0u32; records.len()];
    for (light, p) in (0..).zip(positions()) {
        let slot = &mut next[index(p)];
        entries[*slot as usize] = light;
        *slot += 1;
    }
    starts.extend(entries);
    let grid = gpu::SurfaceLightGrid {
        origin: low.to_array(),
        cell,
        cells: cells.to_array(),
        count: records.len() as u32,
        steps,
        _pad: [0; 3],
    };
    (grid, starts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_light_is_in_the_cell_that_it_stands_in() {
        let record = |i: u32| gpu::SurfaceLight {
            position: [(i as f32 * 0.37).sin(), (i as f32 * 0.11).cos(), i as f32 * 0.01 - 0.5],
            area: 0.02,
            normal: [0.0, 1.0, 0.0],
            surface: 0,
        };
        let records: Vec<_> = (0..200).map(record).collect();
        let (grid, cells) = cells_of(&records, 1.0);
        let total = grid.cells.iter().product::<u32>() as usize;
        assert_eq!(cells.len(), total + 1 + 200);
        assert!(grid.cells.iter().all(|&c| (1..=MOST_CELLS).contains(&c)));
        let mut seen = 0;
        for cell in 0..total {
            let [x, y, z] = [0, 1, 2].map(|axis| {
                let below: u32 = grid.cells[..axis].iter().product();
                (cell as u32 / below % grid.cells[axis]) as f32
            });
            for entry in cells[cell]..cells[cell + 1] {
                let p = Vec3::from(records[cells[total + 1 + entry as usize] as usize].position);
                let at = (p - Vec3::from(grid.origin)) / grid.cell - Vec3::new(x, y, z);
                assert!(at.min_element() > -1e-3 && at.max_element() < 1.001, "{at}");
                seen += 1;
            }
        }
        assert_eq!(seen, 200);
        // None at all.
        let (grid, cells) = cells_of(&[], 1.0);
        assert_eq!((grid.cells, cells), ([1; 3], vec![0, 0]));
    }

    #[test]
    fn sums_hold_all_of_a_frame_s_flux_at_every_hop() {
        for hops in [1, 3, 4, 65] {
            let most = 2.0 * f64::from(hops) * f64::from(steps(hops));
            assert!(most <= 2f64.powi(32) && most >= 2f64.powi(29), "{hops}");
        }
    }
}
