//! Sorts photons into cells of space, so that light can be estimated at any point.
//!
//! Input: [`Photons`]. Output: what the passes that estimate light at points of their own read: kernels, sorted by cell. Cost:
//! proportional to photons. No kernel is wider than a cell, and cells are as wide as the widest kernel that evenly spread
//! photons have, 64³ at most. Source: Yao et al. 2010, section 6, for kernels; Green 2008 (particles in sorted cells).
//! [`SortedPhotons`] says which photons count.

use super::photon_splatter::{self, gpu::Bandwidth as BandwidthUniform};
use super::stable_sort::{Side, SortBuffers, StableSort};
use super::{Bandwidth, dispatch_64};
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::Photons;
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use super::BandwidthUniform;
    use bytemuck::{Pod, Zeroable};

    /// Twin of `GridParams` in `shaders/common/photon_grid.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct GridParams {
        pub(crate) bandwidth: BandwidthUniform,
        pub(crate) first_slot: u32,
        pub(crate) slot_count: u32,
        pub(crate) row: u32,
        pub(crate) cells: u32,
    }
}

/// Bindings of `shaders/pass/photon_grid/sort_photons.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 6] = [
    Slot::Uniform,
    Slot::Storage,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::StorageMut,
];

/// Most cells along each axis.
const MOST_CELLS: u32 = 64;

/// Which photons are sorted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SortedPhotons {
    /// Indirect light on diffuse surfaces.
    OnDiffuse,
    /// Light on rough metal, by the direction that it comes along: indirect, or straight from a flat lamp.
    OnGlossy,
}

/// The pass.
#[derive(Debug)]
pub struct PhotonGrid {
    device: wgpu::Device,
    sorted: SortedPhotons,
    layout: wgpu::BindGroupLayout,
    find_cells: wgpu::ComputePipeline,
    sort: StableSort,
    find_first: wgpu::ComputePipeline,
    prepare: wgpu::ComputePipeline,
}

/// The sorted photons, and working memory for so many of them.
#[derive(Debug)]
pub struct PhotonGridResources {
    params: wgpu::Buffer,
    sort: SortBuffers,
    splats: wgpu::Buffer,
    first_splats: wgpu::Buffer,
    slots: u32,
    groups: BindGroupCache,
    bytes: u64,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct PhotonGridInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// To be sorted; of those on diffuse surfaces hop 0 is left out.
    pub photons: &'a Photons,
    /// Area of all surfaces, unit-frame lengths squared; sets the uniform density.
    pub area: f32,
    /// Radius of the region, unit frame.
    pub radius: f32,
    /// Kernel radius; [`Bandwidth::Screen`] counts as uniform density, for there is no screen.
    pub bandwidth: Bandwidth,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl SortedPhotons {
    /// Photons straight from a light are its direct light on diffuse surfaces.
    fn first_slot(self, photons: &Photons) -> u32 {
        match self {
            Self::OnDiffuse => photons.first_indirect(),
            Self::OnGlossy => 0,
        }
    }
}

impl PhotonGrid {
    /// The pass on this device. Needs no features and no more than default limits. `keeps_to_surfaces` as in
    /// [`PhotonSplatterConfig`](super::PhotonSplatterConfig); photons on rough metal do not.
    pub fn new(device: &wgpu::Device, sorted: SortedPhotons, keeps_to_surfaces: bool) -> Self {
        let layout = device::layout(device, "lightfall::PhotonGrid", wgpu::ShaderStages::COMPUTE, &SLOTS);
        let is_glossy = sorted == SortedPhotons::OnGlossy;
        let surfaces = (
            "splat_keeps_to_surfaces",
            f64::from(u8::from(keeps_to_surfaces && !is_glossy)),
        );
        let glossy = ("grid_is_glossy", f64::from(u8::from(is_glossy)));
        let step = |label, entry_point| {
            let spec = ComputeSpec {
                label,
                source: wgsl::PHOTON_GRID,
                entry_point,
                layouts: &[&layout],
                constants: &[surfaces, glossy],
            };
            device::compute_pipeline(device, &spec)
        };
        Self {
            device: device.clone(),
            sorted,
            find_cells: step("lightfall::PhotonGrid::find_cells", "find_cells"),
            sort: StableSort::new(device),
            find_first: step("lightfall::PhotonGrid::find_first", "find_first"),
            prepare: step("lightfall::PhotonGrid::prepare", "prepare_splats"),
            layout,
        }
    }

    /// Records the sort.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut PhotonGridResources,
        inputs: &PhotonGridInputs<'_>,
    ) {
        let first_slot = self.sorted.first_slot(inputs.photons);
        let slots = (inputs.photons.slots() - first_slot).min(resources.slots);
        let (groups, row) = dispatch_64(slots);
        let (bandwidth, widest) =
            photon_splatter::free_bandwidth(inputs.bandwidth, inputs.photons.count(), (inputs.area, inputs.radius));
        let params = gpu::GridParams {
            bandwidth,
            first_slot,
            slot_count: slots,
            row,
            cells: cells(widest),
        };
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let label = "lightfall::PhotonGrid";
        let mut group = |side: &Side| {
            let bound = [
                (&resources.params).into(),
                inputs.photons.buffer().into(),
                (&side.keys).into(),
                (&side.values).into(),
                (&resources.splats).into(),
                (&resources.first_splats).into(),
            ];
            let cache = &mut resources.groups;
            cache.get(&self.device, label, &self.layout, &bound)
        };
        let [unsorted, sorted] = [group(resources.sort.unsorted()), group(resources.sort.sorted())];
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        if slots > 0 {
            pass.set_bind_group(0, &unsorted, &[]);
            pass.set_pipeline(&self.find_cells);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
            self.sort
                .record(&self.device, inputs.queue, &mut pass, &mut resources.sort, slots);
        }
        pass.set_bind_group(0, &sorted, &[]);
        let ([x, y], _) = dispatch_64(params.cells.pow(3) + 1);
        pass.set_pipeline(&self.find_first);
        pass.dispatch_workgroups(x, y, 1);
        if slots > 0 {
            pass.set_pipeline(&self.prepare);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
        }
    }
}

impl PhotonGridResources {
    /// Bytes for so many slots of photon buffers, those of hop 0 counted where they are sorted.
    pub fn size_in_bytes(slots: u32) -> u64 {
        let params = size_of::<gpu::GridParams>() as u64;
        let splats = u64::from(slots.max(1)) * photon_splatter::SPLAT_BYTES;
        SortBuffers::size_in_bytes(slots, MOST_CELLS.pow(3)) + splats + 4 * u64::from(MOST_CELLS.pow(3) + 1) + params
    }

    /// Working memory for these photons.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, photons: &Photons, sorted: SortedPhotons) -> Result<Self, Error> {
        let slots = photons.slots() - sorted.first_slot(photons);
        photon_splatter::check_splats(device, slots)?;
        let storage = |label, bytes| device::buffer(device, label, bytes, wgpu::BufferUsages::STORAGE);
        Ok(Self {
            params: device::uniform_buffer::<gpu::GridParams>(device, "lightfall::PhotonGrid::params")?,
            sort: SortBuffers::new(device, slots, MOST_CELLS.pow(3))?,
            splats: storage(
                "lightfall::PhotonGrid::splats",
                u64::from(slots.max(1)) * photon_splatter::SPLAT_BYTES,
            )?,
            first_splats: storage(
                "lightfall::PhotonGrid::first_splats",
                4 * u64::from(MOST_CELLS.pow(3) + 1),
            )?,
            slots,
            groups: BindGroupCache::for_uses(2),
            bytes: Self::size_in_bytes(slots),
        })
    }

    /// `GridParams` of the last record.
    pub(super) fn params(&self) -> &wgpu::Buffer {
        &self.params
    }

    /// Kernels in the order of their cells.
    pub(super) fn splats(&self) -> &wgpu::Buffer {
        &self.splats
    }

    /// Of each cell the first of its kernels, and where those of the last end.
    pub(super) fn first_splats(&self) -> &wgpu::Buffer {
        &self.first_splats
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}

/// Cells along each axis of the cube [−1, 1]³, so that none is narrower than the widest kernel.
fn cells(widest: f32) -> u32 {
    // The largest of NaN and 1 is 1.
    (2.0 / widest).floor().max(1.0).min(MOST_CELLS as f32) as u32
}

#[cfg(test)]
mod tests {
    use super::cells;

    #[test]
    fn cells_are_as_wide_as_the_widest_kernel() {
        assert_eq!(
            [0.0, 1e-6, 0.03125, 0.0999, 0.5, 1.5, 100.0, f32::INFINITY, f32::NAN].map(cells),
            [64, 64, 64, 20, 4, 1, 1, 1, 1]
        );
    }
}
