//! Sends photons where they count for the picture: more of them start, and go on from diffuse surfaces, in those directions whose
//! paths were seen in earlier frames, each with less flux, so that no light is lost or gained while paths are fresh in each frame.
//!
//! Inputs: [`Photons`] and a [`GBuffer`] of an earlier frame. Output: [`GuidingTables`], for [`PhotonEmitter`] and the tracers.
//! A direction's share is the mean, over the tiles of the view, of its part in the photons that the tile shows, so that a tile with
//! few photons counts as much as one with many: what is lit through a doorway as much as what the lamp itself stands in. Sources:
//! Peter and Pietrek 1998 (importance of photons for the picture); Vorba et al. 2014 (directions learned from earlier passes).
//!
//! Cost: twice a photon record and a depth texel for each hop and view, for those that are seen the hops before them, and 24 576
//! tables of 17 counts an update; 5.7 MB. Limits: 15 views between two updates; 16 × 16 cells of a light's emission, 4 × 4 of the directions from each of 16³
//! places; what is seen of photons in metals and glass does not count; how photons are divided among lights stays;
//! while the same paths are drawn in every frame, tables fit these, and one to two hundredths of the light are missing.
//!
//! [`PhotonEmitter`]: super::PhotonEmitter

use super::dispatch_64;
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::guiding_tables::REFLECTION_TABLES;
use crate::resource::{GBuffer, GuidingTables, Lights, MAX_LIGHTS, Photons};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `CountParams` in `shaders/pass/photon_guiding/count_params.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct CountParams {
        pub(crate) path_count: u32,
        pub(crate) slot_count: u32,
        pub(crate) light_count: u32,
        pub(crate) row: u32,
    }

    /// Twin of `UpdateParams` in `shaders/pass/photon_guiding/update_params.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct UpdateParams {
        pub(crate) kept: f32,
    }
}

/// Bindings of `shaders/pass/photon_guiding/count_visible.wgsl`, in order.
pub(crate) const COUNT_SLOTS: [Slot; 7] = [
    Slot::Uniform,
    Slot::Storage,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::Uniform,
    Slot::Texture,
    Slot::StorageMut,
];

/// Bindings of `shaders/pass/photon_guiding/update_emission.wgsl`, and of `update_reflections.wgsl`, in order.
pub(crate) const UPDATE_SLOTS: [Slot; 4] = [Slot::Uniform, Slot::StorageMut, Slot::StorageMut, Slot::StorageMut];

/// Tiles along each axis of a view; with 16 the error is the same. Twin of `TILES` in `count_visible.wgsl`.
pub(crate) const TILES: u32 = 32;

/// Part of what was counted in earlier frames that an update keeps: what a table says changes over a few frames.
const KEPT: f32 = 0.75;

/// Largest share of the photons that is guided: the others keep an eye on all that may come to be seen.
const MOST_SHARE: f32 = 0.999;

/// What guides photons, and how many of them.
#[derive(Debug, Clone, Copy)]
pub struct Guiding<'a> {
    /// Where they go.
    pub tables: &'a GuidingTables,
    /// Share of the paths that are guided, at their light and at each diffuse surface, from 0 to 0.999, or what is nearest to it; the
    /// others are spread evenly, so that nothing is overlooked for good. Flux is weighed by the density of both together (Veach 1997,
    /// balance heuristic): no photon is worth more than 1 / (1 − share) of those of a frame without guiding. The same for the emission
    /// and the walk of a frame.
    pub share: f32,
}

impl Guiding<'_> {
    /// In its range.
    pub(super) fn share(&self) -> f32 {
        if self.share > 0.0 {
            self.share.min(MOST_SHARE)
        } else {
            0.0
        }
    }
}

/// The pass.
#[derive(Debug)]
pub struct PhotonGuiding {
    device: wgpu::Device,
    count_layout: wgpu::BindGroupLayout,
    update_layout: wgpu::BindGroupLayout,
    count_tiles: wgpu::ComputePipeline,
    count_visible: wgpu::ComputePipeline,
    update_emission: wgpu::ComputePipeline,
    update_reflections: wgpu::ComputePipeline,
}

/// Uniform and bind groups of one view.
#[derive(Debug)]
pub struct PhotonGuidingResources {
    params: wgpu::Buffer,
    /// Photons that each tile of the view shows.
    tiles: wgpu::Buffer,
    groups: BindGroupCache,
}

/// Uniform and bind groups of the update.
#[derive(Debug)]
pub struct GuidingUpdateResources {
    params: wgpu::Buffer,
    groups: BindGroupCache,
}

/// What a view gives it.
#[derive(Debug, Clone, Copy)]
pub struct PhotonGuidingInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// Paths of this frame.
    pub photons: &'a Photons,
    /// What they started from.
    pub lights: &'a Lights,
    /// Where they are seen.
    pub g_buffer: &'a GBuffer,
    /// What they were guided by; what is counted is added.
    pub tables: &'a GuidingTables,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

/// What an update needs.
#[derive(Debug, Clone, Copy)]
pub struct GuidingUpdateInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// The tables are written, the counts cleared.
    pub tables: &'a GuidingTables,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl PhotonGuiding {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let layout = |label, slots: &[Slot]| device::layout(device, label, wgpu::ShaderStages::COMPUTE, slots);
        let count_layout = layout("lightfall::PhotonGuiding::count", &COUNT_SLOTS);
        let update_layout = layout("lightfall::PhotonGuiding::update", &UPDATE_SLOTS);
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
        let count = |label, entry_point| pipeline(label, wgsl::PHOTON_GUIDING_COUNT, entry_point, &count_layout);
        Self {
            device: device.clone(),
            count_tiles: count("lightfall::PhotonGuiding::count_tiles", "count_tiles"),
            count_visible: count("lightfall::PhotonGuiding::count_visible", "count_visible"),
            update_emission: pipeline(
                "lightfall::PhotonGuiding::update_emission",
                wgsl::PHOTON_GUIDING_EMISSION,
                "update_emission",
                &update_layout,
            ),
            update_reflections: pipeline(
                "lightfall::PhotonGuiding::update_reflections",
                wgsl::PHOTON_GUIDING_REFLECTIONS,
                "update_reflections",
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
        resources: &mut PhotonGuidingResources,
        inputs: &PhotonGuidingInputs<'_>,
    ) {
        let (groups, row) = dispatch_64(inputs.photons.slots());
        let params = gpu::CountParams {
            path_count: inputs.photons.count(),
            slot_count: inputs.photons.slots(),
            light_count: inputs.lights.count(),
            row,
        };
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let [emission_counts, _] = inputs.tables.emission_counts();
        let [reflection_counts, _] = inputs.tables.reflection_counts();
        let bound = [
            (&resources.params).into(),
            inputs.photons.buffer().into(),
            emission_counts.into(),
            reflection_counts.into(),
            inputs.g_buffer.view_buffer().into(),
            (&inputs.g_buffer.views().depth).into(),
            (&resources.tiles).into(),
        ];
        let label = "lightfall::PhotonGuiding::count";
        let group = resources.groups.get(&self.device, label, &self.count_layout, &bound);
        encoder.clear_buffer(&resources.tiles, 0, None);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_bind_group(0, &group, &[]);
        for pipeline in [&self.count_tiles, &self.count_visible] {
            pass.set_pipeline(pipeline);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
        }
    }

    /// Records the update of the tables by what views have counted since the last one, before the emission.
    pub fn record_update(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut GuidingUpdateResources,
        inputs: &GuidingUpdateInputs<'_>,
    ) {
        let params = gpu::UpdateParams { kept: KEPT };
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let label = "lightfall::PhotonGuiding::update";
        let tables = inputs.tables;
        let groups = [
            (tables.emission_counts(), tables.emission()),
            (tables.reflection_counts(), tables.reflection()),
        ]
        .map(|([counts, history], table)| {
            let bound = [(&resources.params).into(), counts.into(), history.into(), table.into()];
            resources.groups.get(&self.device, label, &self.update_layout, &bound)
        });
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.update_emission);
        pass.set_bind_group(0, &groups[0], &[]);
        pass.dispatch_workgroups(MAX_LIGHTS as u32, 1, 1);
        pass.set_pipeline(&self.update_reflections);
        pass.set_bind_group(0, &groups[1], &[]);
        pass.dispatch_workgroups((REFLECTION_TABLES as u32).div_ceil(64), 1, 1);
    }
}

impl PhotonGuidingResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        use wgpu::BufferUsages as U;
        let bytes = 4 * u64::from(TILES * TILES);
        let usage = U::STORAGE | U::COPY_DST;
        Ok(Self {
            params: device::uniform_buffer::<gpu::CountParams>(device, "lightfall::PhotonGuiding::count")?,
            tiles: device::buffer(device, "lightfall::PhotonGuiding::tiles", bytes, usage)?,
            groups: BindGroupCache::default(),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.params.size() + self.tiles.size()
    }
}

impl GuidingUpdateResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            params: device::uniform_buffer::<gpu::UpdateParams>(device, "lightfall::PhotonGuiding::update")?,
            groups: BindGroupCache::for_uses(2),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.params.size()
    }
}
