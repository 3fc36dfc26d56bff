//! Sends photons where they count for the picture: more of them start in those parts of a light's emission whose paths were
//! seen in earlier frames, each with less flux, so that no light is lost or gained.
//!
//! Inputs: [`Photons`] and a [`GBuffer`] of an earlier frame. Output: [`EmissionCells`], for [`PhotonEmitter`]. Cells get
//! photons in proportion to the root of the share of their paths that was seen. Cost: a photon record and a depth texel for
//! each hop and view, and a workgroup a light. Limits: 16 × 16 cells a light; how photons are divided among lights stays.
//!
//! [`PhotonEmitter`]: super::PhotonEmitter

use super::dispatch_64;
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::{EmissionCells, GBuffer, Lights, Photons};
use crate::resource::emission_cells::TABLES;
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/emission_importance/params.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) path_count: u32,
        pub(crate) slot_count: u32,
        pub(crate) light_count: u32,
        pub(crate) row: u32,
        pub(crate) share: f32,
        pub(crate) kept: f32,
    }
}

/// Bindings of `shaders/pass/emission_importance/count_visible.wgsl`, in order.
pub(crate) const COUNT_SLOTS: [Slot; 6] = [
    Slot::Uniform,
    Slot::Storage,
    Slot::StorageMut,
    Slot::Uniform,
    Slot::Texture,
    Slot::StorageMut,
];

/// Bindings of `shaders/pass/emission_importance/update_tables.wgsl`, in order.
pub(crate) const UPDATE_SLOTS: [Slot; 5] = [
    Slot::Uniform,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::StorageMut,
];

/// Tiles along each axis of a view. Twin of `TILES` in `count_visible.wgsl`.
pub(crate) const TILES: u64 = 32;

/// Part of what was counted in earlier frames that an update keeps: what a table says changes over a few frames.
const KEPT: f32 = 0.75;

/// Largest share of the photons that is led: the others keep an eye on all that may come to be seen.
const MOST_SHARE: f32 = 0.999;

/// The pass.
#[derive(Debug)]
pub struct EmissionImportance {
    device: wgpu::Device,
    count_layout: wgpu::BindGroupLayout,
    update_layout: wgpu::BindGroupLayout,
    count_tiles: wgpu::ComputePipeline,
    count: wgpu::ComputePipeline,
    update: wgpu::ComputePipeline,
    update_reflections: wgpu::ComputePipeline,
}

/// Uniforms and bind groups, of a view or of the update.
#[derive(Debug)]
pub struct EmissionImportanceResources {
    count: Step,
    tiles: wgpu::Buffer,
    update: Step,
}

/// Of one step: both may be recorded before either runs.
#[derive(Debug)]
struct Step {
    params: wgpu::Buffer,
    groups: BindGroupCache,
}

/// What a view gives it.
#[derive(Debug, Clone, Copy)]
pub struct EmissionImportanceInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// Paths of this frame.
    pub photons: &'a Photons,
    /// What they started from.
    pub lights: &'a Lights,
    /// Where they are seen.
    pub g_buffer: &'a GBuffer,
    /// What is counted is added.
    pub cells: &'a EmissionCells,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

/// What an update needs.
#[derive(Debug, Clone, Copy)]
pub struct EmissionUpdateInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// Lights of the frame.
    pub lights: &'a Lights,
    /// The tables are written, the counts cleared.
    pub cells: &'a EmissionCells,
    /// Share of the photons that start where paths were seen, from 0 to 0.999, or what is nearest to it; the others are
    /// spread evenly, so that nothing is overlooked for good.
    pub share: f32,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl EmissionImportance {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let layout = |label, slots: &[Slot]| device::layout(device, label, wgpu::ShaderStages::COMPUTE, slots);
        let count_layout = layout("lightfall::EmissionImportance::count", &COUNT_SLOTS);
        let update_layout = layout("lightfall::EmissionImportance::update", &UPDATE_SLOTS);
        let pipeline = |label, source, entry_point, layout| {
            let spec = ComputeSpec {
                label,
                source,
                entry_point,
                layouts: &[layout],
                constants: &[],
            };
            device::compute_pipeline(device, &spec)
        };
        Self {
            device: device.clone(),
            count_tiles: pipeline(
                "lightfall::EmissionImportance::count_tiles",
                wgsl::EMISSION_IMPORTANCE_COUNT,
                "count_tiles",
                &count_layout,
            ),
            count: pipeline(
                "lightfall::EmissionImportance::count",
                wgsl::EMISSION_IMPORTANCE_COUNT,
                "count_visible",
                &count_layout,
            ),
            update_reflections: pipeline(
                "lightfall::EmissionImportance::update_reflections",
                wgsl::EMISSION_IMPORTANCE_UPDATE,
                "update_reflections",
                &update_layout,
            ),
            update: pipeline(
                "lightfall::EmissionImportance::update",
                wgsl::EMISSION_IMPORTANCE_UPDATE,
                "update_tables",
                &update_layout,
            ),
            count_layout,
            update_layout,
        }
    }

    /// Records the count of what a view sees of the paths, after the walk and the view's depth. Each view has resources of
    /// its own.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut EmissionImportanceResources,
        inputs: &EmissionImportanceInputs<'_>,
    ) {
        let (groups, row) = dispatch_64(inputs.photons.slots());
        let params = gpu::Params {
            path_count: inputs.photons.count(),
            slot_count: inputs.photons.slots(),
            light_count: inputs.lights.count(),
            row,
            share: 0.0,
            kept: 0.0,
        };
        inputs
            .queue
            .write_buffer(&resources.count.params, 0, bytemuck::bytes_of(&params));
        let bound = [
            (&resources.count.params).into(),
            inputs.photons.buffer().into(),
            inputs.cells.counts().into(),
            inputs.g_buffer.view_buffer().into(),
            (&inputs.g_buffer.views().depth).into(),
            (&resources.tiles).into(),
        ];
        let label = "lightfall::EmissionImportance::count";
        let group = resources
            .count
            .groups
            .get(&self.device, label, &self.count_layout, &bound);
        encoder.clear_buffer(&resources.tiles, 0, None);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_bind_group(0, &group, &[]);
        for pipeline in [&self.count_tiles, &self.count] {
            pass.set_pipeline(pipeline);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
        }
    }

    /// Records the update of the tables by what views have counted since the last one, before the emission.
    pub fn record_update(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut EmissionImportanceResources,
        inputs: &EmissionUpdateInputs<'_>,
    ) {
        let params = gpu::Params {
            path_count: 0,
            slot_count: 0,
            light_count: inputs.lights.count(),
            row: 0,
            share: if inputs.share > 0.0 {
                inputs.share.min(MOST_SHARE)
            } else {
                0.0
            },
            kept: KEPT,
        };
        inputs
            .queue
            .write_buffer(&resources.update.params, 0, bytemuck::bytes_of(&params));
        let bound = [
            (&resources.update.params).into(),
            inputs.cells.counts().into(),
            inputs.cells.history().into(),
            inputs.cells.tables().into(),
            inputs.cells.reflection_tables().into(),
        ];
        let label = "lightfall::EmissionImportance::update";
        let group = resources
            .update
            .groups
            .get(&self.device, label, &self.update_layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.update);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(inputs.lights.count(), 1, 1);
        pass.set_pipeline(&self.update_reflections);
        pass.dispatch_workgroups((TABLES as u32).div_ceil(64), 1, 1);
    }
}

impl EmissionImportanceResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        let step = || -> Result<_, Error> {
            Ok(Step {
                params: device::uniform_buffer::<gpu::Params>(device, "lightfall::EmissionImportance::params")?,
                groups: BindGroupCache::default(),
            })
        };
        Ok(Self {
            count: step()?,
            tiles: device::buffer(
                device,
                "lightfall::EmissionImportance::tiles",
                4 * TILES * TILES,
                wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            )?,
            update: step()?,
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.count.params.size() + self.tiles.size() + self.update.params.size()
    }
}
