//! The tiled shape: photons sorted into bins of the screen, and gathered by pixels.

use super::{MarkedSplatInputs, PhotonSplatterInputs, bin_total, gpu as shared, is_corrected, splatted_slots};
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::pass::dispatch_64;
use crate::pass::stable_sort::{Side, SortBuffers, StableSort};
use crate::resource::Subsampling;
use crate::{Error, wgsl};

pub(crate) mod gpu {
    use super::shared::Bandwidth;
    use bytemuck::{Pod, Zeroable};

    /// Twin of `TiledParams` in `shaders/pass/photon_splatter/tiled_params.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct TiledParams {
        pub(crate) bandwidth: Bandwidth,
        pub(crate) first_slot: u32,
        pub(crate) slot_count: u32,
        pub(crate) row: u32,
    }

    /// Twin of `MarkedParams` in `gather_marked.wgsl`.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct MarkedParams {
        pub(crate) bandwidth: Bandwidth,
        pub(crate) factor: u32,
        pub(crate) is_corrected: u32,
        pub(crate) sample_offset: u32,
    }

    /// Twin of `Splat` in `shaders/common/splat_record.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Splat {
        pub(crate) position: [f32; 3],
        pub(crate) inverse_radius_squared: u32,
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
    Slot::StorageTexture(wgpu::TextureFormat::Rgba32Float),
];

/// Bindings of `shaders/pass/photon_splatter/gather_marked.wgsl`, in order.
pub(crate) const MARKED_SLOTS: [Slot; 11] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::UintTexture,
    Slot::Storage,
    Slot::StorageTexture(wgpu::TextureFormat::Rgba32Float),
];

/// Pixels along the side of what a workgroup gathers. Twin of `TILE` in `gather_tiled.wgsl`.
pub(crate) const TILE: u32 = 16;

/// Most photons that are gathered, all hops but the first together: 64 in each of 50 000 turns. llvmpipe ends a shader's
/// loops after 65 535 turns in all, some of which go to finding bins.
const MOST_SPLATS: u32 = 64 * 50_000;

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
    marked_layout: wgpu::BindGroupLayout,
    gather_marked: wgpu::ComputePipeline,
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
    /// By the logarithm of the sub-sampling.
    marked: [MarkedBuffers; 4],
    /// What photons were sorted for; `None` before they were.
    sorted_for: Option<gpu::MarkedParams>,
}

/// Of one sub-sampling: several may be recorded before any of them runs.
#[derive(Debug)]
struct MarkedBuffers {
    params: wgpu::Buffer,
    groups: BindGroupCache,
}

impl Tiled {
    /// `kernel`: constants of what weighs photons; `surfaces`: of what prepares them.
    pub(super) fn new(device: &wgpu::Device, kernel: &[(&str, f64)], surfaces: &[(&str, f64)]) -> Self {
        let label = "lightfall::PhotonSplatter";
        let layout = device::layout(device, label, wgpu::ShaderStages::COMPUTE, &TILED_SLOTS);
        let gather_layout = device::layout(device, label, wgpu::ShaderStages::COMPUTE, &GATHER_SLOTS);
        let marked_layout = device::layout(device, label, wgpu::ShaderStages::COMPUTE, &MARKED_SLOTS);
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
        let step = |label, entry_point| pipeline(label, wgsl::PHOTON_SPLATTER_TILED, entry_point, &layout, surfaces);
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
            gather_marked: pipeline(
                "lightfall::PhotonSplatter::gather_marked",
                wgsl::PHOTON_SPLATTER_MARKED,
                "gather_marked",
                &marked_layout,
                kernel,
            ),
            layout,
            gather_layout,
            marked_layout,
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
        buffers.sorted_for = None;
        if [0, 1].into_iter().any(|axis| size[axis] > buffers.size[axis]) {
            // Made for a smaller image.
            return;
        }
        let (groups, row) = dispatch_64(slots);
        let params = gpu::TiledParams {
            bandwidth: *bandwidth,
            first_slot: inputs.photons.first_indirect(),
            slot_count: slots,
            row,
        };
        inputs
            .queue
            .write_buffer(&buffers.params, 0, bytemuck::bytes_of(&params));
        buffers.sorted_for = Some(gpu::MarkedParams {
            bandwidth: *bandwidth,
            factor: bandwidth.factor,
            is_corrected: is_corrected(inputs.settings),
            sample_offset: inputs.sample_offset,
        });
        encoder.clear_buffer(&buffers.reach, 0, None);
        let view = inputs.g_buffer.view_buffer();
        let label = "lightfall::PhotonSplatter";
        let group = |groups: &mut BindGroupCache, side: &Side| {
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
            let ([x, y], _) = dispatch_64(bin_total(size) + 1);
            for (pipeline, [x, y]) in [(&self.find_first, [x, y]), (&self.prepare, groups)] {
                pass.set_pipeline(pipeline);
                pass.dispatch_workgroups(x, y, 1);
            }
        }
        let label = "lightfall::PhotonSplatter::gather";
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.gather);
        pass.set_bind_group(0, &gathering, &[]);
        pass.dispatch_workgroups(size[0].div_ceil(TILE), size[1].div_ceil(TILE), 1);
    }

    pub(super) fn record_marked(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        buffers: &mut TiledBuffers,
        inputs: &MarkedSplatInputs<'_>,
    ) {
        let Some(sorted_for) = buffers.sorted_for else {
            return;
        };
        let params = gpu::MarkedParams {
            factor: inputs.subsampling.factor(),
            ..sorted_for
        };
        let own = &mut buffers.marked[level(inputs.subsampling)];
        inputs.queue.write_buffer(&own.params, 0, bytemuck::bytes_of(&params));
        let views = inputs.g_buffer.views();
        let bound = [
            (&own.params).into(),
            inputs.g_buffer.view_buffer().into(),
            (&buffers.splats).into(),
            (&buffers.first_splats).into(),
            (&buffers.reach).into(),
            (&views.depth).into(),
            (&views.normal).into(),
            (&views.base_color).into(),
            inputs.g_buffer.surfaces().into(),
            inputs.marked.buffer().into(),
            inputs.irradiance.view().into(),
        ];
        let label = "lightfall::PhotonSplatter::gather_marked";
        let group = own.groups.get(device, label, &self.marked_layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.gather_marked);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups_indirect(inputs.marked.buffer(), 0);
    }
}

impl TiledBuffers {
    /// Bytes for so many slots and irradiance of this size.
    pub(super) fn size_in_bytes(slots: u32, size: [u32; 2]) -> u64 {
        let [splats, bins] = sizes(slots, size);
        let params = size_of::<gpu::TiledParams>() + 4 * size_of::<gpu::MarkedParams>();
        SortBuffers::size_in_bytes(slots, bin_total(size)) + splats + 2 * bins + params as u64
    }

    pub(super) fn check(device: &wgpu::Device, slots: u32) -> Result<(), Error> {
        if slots > MOST_SPLATS {
            return Err(Error::LimitExceeded {
                what: "photons to be added up, without the first hop".into(),
                needed: u64::from(slots),
                limit: u64::from(MOST_SPLATS),
                remedy: "emit fewer a frame and accumulate more frames, or let them bounce less often",
            });
        }
        let [splats, _] = sizes(slots, [1, 1]);
        let usage = wgpu::BufferUsages::STORAGE;
        device::check_buffer(device, "lightfall::PhotonSplatter::splats", splats, usage)
    }

    pub(super) fn new(device: &wgpu::Device, slots: u32, size: [u32; 2]) -> Result<Self, Error> {
        use wgpu::BufferUsages as U;
        Self::check(device, slots)?;
        let [splats, bins] = sizes(slots, size);
        let buffer = |label, bytes| device::buffer(device, label, bytes, U::STORAGE | U::COPY_DST);
        let marked = || -> Result<_, Error> {
            let label = "lightfall::PhotonSplatter::marked_params";
            Ok(MarkedBuffers {
                params: device::uniform_buffer::<gpu::MarkedParams>(device, label)?,
                groups: BindGroupCache::default(),
            })
        };
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
            marked: [marked()?, marked()?, marked()?, marked()?],
            sorted_for: None,
        })
    }
}

/// Which of `TiledBuffers::marked` a sub-sampling has.
fn level(subsampling: Subsampling) -> usize {
    subsampling.factor().ilog2() as usize
}

/// Bytes of the splats, and of one number for each bin and one more.
fn sizes(slots: u32, size: [u32; 2]) -> [u64; 2] {
    [
        u64::from(slots.max(1)) * size_of::<gpu::Splat>() as u64,
        4 * (u64::from(bin_total(size)) + 1),
    ]
}
