//! The tiled shape: photons sorted into bins of the screen, and gathered by blocks of pixels.

use super::sort::{SortBuffers, StableSort};
use super::{PhotonSplatterInputs, bin_total, gpu as shared, splatted_slots};
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::pass::dispatch_64;
use crate::{Error, wgsl};

pub(crate) mod gpu {
    use super::shared::Bandwidth;
    use bytemuck::{Pod, Zeroable};

    /// Twin of `TiledParams` in `shaders/pass/photon_splatter/tiled_splat.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct TiledParams {
        pub(crate) bandwidth: Bandwidth,
        pub(crate) first_slot: u32,
        pub(crate) slot_count: u32,
        pub(crate) row: u32,
    }

    /// Twin of `Splat`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Splat {
        pub(crate) position: [f32; 3],
        pub(crate) inverse_radius_squared: f32,
        pub(crate) strength: [f32; 3],
        pub(crate) normal: u32,
    }
}

/// Bindings of `shaders/pass/photon_splatter/tiled.wgsl`, in order.
pub(crate) const TILED_SLOTS: [Slot; 8] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Storage,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::StorageMut,
];

/// Bindings of `shaders/pass/photon_splatter/gather_tiled.wgsl`, in order.
pub(crate) const GATHER_SLOTS: [Slot; 7] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::UintTexture,
    Slot::StorageArray(wgpu::TextureFormat::Rgba32Float),
];

/// Pixels along the side of what a workgroup gathers. Twin of `TILE` in `gather_tiled.wgsl`.
pub(crate) const TILE: u32 = 16;

/// Photons that are added up in a turn of the gather's loop. Twin of `SPLATS_A_TURN`.
pub(crate) const SPLATS_A_TURN: u32 = 16;

/// Turns that an invocation may take: llvmpipe ends a shader's loops after 65 535 in all.
const MOST_TURNS: u32 = 60_000;

/// Parts that photons are gathered in, each into a layer of the sums.
pub(super) fn parts(slots: u32) -> u32 {
    slots.div_ceil(MOST_TURNS * SPLATS_A_TURN).max(1)
}

/// Its pipelines.
#[derive(Debug)]
pub(super) struct Tiled {
    layout: wgpu::BindGroupLayout,
    find_bins: wgpu::ComputePipeline,
    sort: StableSort,
    find_first: wgpu::ComputePipeline,
    prepare: wgpu::ComputePipeline,
    gather_layout: wgpu::BindGroupLayout,
    gather: wgpu::ComputePipeline,
}

/// Its working memory.
#[derive(Debug)]
pub(super) struct TiledBuffers {
    params: wgpu::Buffer,
    sort: SortBuffers,
    splats: wgpu::Buffer,
    first_splats: wgpu::Buffer,
    reach: wgpu::Buffer,
    slots: u32,
    size: [u32; 2],
    groups: BindGroupCache,
    gather_groups: BindGroupCache,
}

impl Tiled {
    pub(super) fn new(device: &wgpu::Device, kernel: &[(&str, f64)]) -> Self {
        let label = "lightfall::PhotonSplatter";
        let layout = device::layout(device, label, wgpu::ShaderStages::COMPUTE, &TILED_SLOTS);
        let gather_layout = device::layout(device, label, wgpu::ShaderStages::COMPUTE, &GATHER_SLOTS);
        let pipeline = |label, source, entry_point, layout, constants| {
            device::compute_pipeline(
                device,
                &ComputeSpec {
                    label,
                    source,
                    entry_point,
                    layouts: &[layout],
                    constants,
                },
            )
        };
        let step = |label, entry_point| pipeline(label, wgsl::PHOTON_SPLATTER_TILED, entry_point, &layout, &[]);
        Self {
            find_bins: step("lightfall::PhotonSplatter::find_bins", "find_bins"),
            sort: StableSort::new(device),
            find_first: step("lightfall::PhotonSplatter::find_first", "find_first"),
            prepare: step("lightfall::PhotonSplatter::prepare", "prepare_splats"),
            gather: pipeline(
                "lightfall::PhotonSplatter::gather",
                wgsl::PHOTON_SPLATTER_GATHER,
                "gather_tiles",
                &gather_layout,
                kernel,
            ),
            layout,
            gather_layout,
        }
    }

    pub(super) fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        buffers: &mut TiledBuffers,
        inputs: &PhotonSplatterInputs<'_>,
        bandwidth: &shared::Bandwidth,
        (receivers, sums): (&wgpu::TextureView, &wgpu::TextureView),
    ) {
        let slots = splatted_slots(inputs.photons).min(buffers.slots);
        let size = inputs.subsampling.size(inputs.g_buffer.size());
        if [0, 1].into_iter().any(|axis| size[axis] > buffers.size[axis]) {
            // Made for a smaller image.
            return;
        }
        let (groups, row) = dispatch_64(slots);
        let params = gpu::TiledParams {
            bandwidth: *bandwidth,
            first_slot: inputs.photons.count(),
            slot_count: slots,
            row,
        };
        inputs
            .queue
            .write_buffer(&buffers.params, 0, bytemuck::bytes_of(&params));
        encoder.clear_buffer(&buffers.reach, 0, None);
        let view = inputs.g_buffer.view_buffer();
        let label = "lightfall::PhotonSplatter";
        let group = |groups: &mut BindGroupCache, side: &super::sort::Side| {
            let bound = [
                (&buffers.params).into(),
                view.into(),
                inputs.photons.buffer().into(),
                (&side.keys).into(),
                (&side.values).into(),
                (&buffers.splats).into(),
                (&buffers.first_splats).into(),
                (&buffers.reach).into(),
            ];
            groups.get(device, label, &self.layout, &bound)
        };
        let unsorted = group(&mut buffers.groups, buffers.sort.unsorted());
        let sorted = group(&mut buffers.groups, buffers.sort.sorted());
        let bound = [
            (&buffers.params).into(),
            view.into(),
            (&buffers.splats).into(),
            (&buffers.first_splats).into(),
            (&buffers.reach).into(),
            receivers.into(),
            sums.into(),
        ];
        let gathering = buffers.gather_groups.get(device, label, &self.gather_layout, &bound);
        if slots > 0 {
            let label = "lightfall::PhotonSplatter::sort";
            let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
            pass.set_bind_group(0, &unsorted, &[]);
            pass.set_pipeline(&self.find_bins);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
            self.sort
                .record(device, inputs.queue, &mut pass, &mut buffers.sort, slots);
            pass.set_bind_group(0, &sorted, &[]);
            for pipeline in [&self.find_first, &self.prepare] {
                pass.set_pipeline(pipeline);
                pass.dispatch_workgroups(groups[0], groups[1], 1);
            }
        }
        let label = "lightfall::PhotonSplatter::gather";
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.gather);
        pass.set_bind_group(0, &gathering, &[]);
        pass.dispatch_workgroups(size[0].div_ceil(TILE), size[1].div_ceil(TILE), parts(buffers.slots));
    }
}

impl TiledBuffers {
    /// Bytes for so many slots and irradiance of this size.
    pub(super) fn size_in_bytes(slots: u32, size: [u32; 2]) -> u64 {
        let [splats, bins] = sizes(slots, size);
        SortBuffers::size_in_bytes(slots, bin_total(size)) + splats + 2 * bins + size_of::<gpu::TiledParams>() as u64
    }

    pub(super) fn check(device: &wgpu::Device, slots: u32) -> Result<(), Error> {
        let [splats, _] = sizes(slots, [1, 1]);
        let usage = wgpu::BufferUsages::STORAGE;
        device::check_buffer(device, "lightfall::PhotonSplatter::splats", splats, usage)
    }

    pub(super) fn new(device: &wgpu::Device, slots: u32, size: [u32; 2]) -> Result<Self, Error> {
        use wgpu::BufferUsages as U;
        let [splats, bins] = sizes(slots, size);
        let buffer = |label, bytes| device::buffer(device, label, bytes, U::STORAGE | U::COPY_DST);
        Ok(Self {
            params: device::uniform_buffer::<gpu::TiledParams>(device, "lightfall::PhotonSplatter::params")?,
            sort: SortBuffers::new(device, slots, bin_total(size))?,
            splats: buffer("lightfall::PhotonSplatter::splats", splats)?,
            first_splats: buffer("lightfall::PhotonSplatter::first_splats", bins)?,
            reach: buffer("lightfall::PhotonSplatter::reach", bins)?,
            slots,
            size,
            groups: BindGroupCache::for_uses(2),
            gather_groups: BindGroupCache::default(),
        })
    }
}

/// Bytes of the splats, and of one number for each bin and one more.
fn sizes(slots: u32, size: [u32; 2]) -> [u64; 2] {
    [
        u64::from(slots.max(1)) * size_of::<gpu::Splat>() as u64,
        4 * (u64::from(bin_total(size)) + 1),
    ]
}
