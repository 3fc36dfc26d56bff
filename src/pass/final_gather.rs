//! Indirect light from what rays bring back from lit surfaces, instead of from the photons around: no kernel lies over an edge.
//!
//! Inputs: [`GBuffer`]; then what a tracer says of the [`SurfaceRays`] that the first step spreads, [`EnvMaps`] and their
//! [`EnvMapIrradiance`]. Output: [`Irradiance`] (`rgba32float`) at every pixel of the G-buffer or at a part of them; alpha is 1
//! where a surface is seen, else 0. E = π times the mean of L over rays as dense as the cosine, L = ρ / π times the irradiance
//! of the map that shows a ray's end in most detail. Sources: Larsen 2004, section 4.6 and chapter 11; Yao et al. 2010, section 7.
//!
//! Order, for each band of rows: [`FinalGather::record_rays`], the tracer's `record_rays`, [`FinalGather::record`]. Cost: pixels × rays, each traced and
//! looked up in every map. Limits: the error is noise of few rays, the same every frame while `sample_offset` is; rays that
//! the tracer loses, or whose end no map shows, bring nothing.

use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::{EnvMapIrradiance, EnvMaps, GBuffer, Irradiance, Subsampling, SurfaceRays};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/final_gather/params.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) factor: u32,
        pub(crate) ray_count: u32,
        pub(crate) first_row: u32,
        pub(crate) row_count: u32,
        pub(crate) sample_offset: u32,
        pub(crate) map_count: u32,
        pub(crate) map_size: u32,
    }
}

/// Bindings of `shaders/pass/final_gather/spread_rays.wgsl`, in order.
pub(crate) const SPREAD_SLOTS: [Slot; 7] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::UintTexture,
    Slot::StorageMut,
];

/// Bindings of `shaders/pass/final_gather/sum_hits.wgsl`, in order.
pub(crate) const SUM_SLOTS: [Slot; 9] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Storage,
    Slot::Storage,
    Slot::UintArray,
    Slot::Storage,
    Slot::TextureArray,
    Slot::StorageTexture(wgpu::TextureFormat::Rgba32Float),
];

/// The pass.
#[derive(Debug)]
pub struct FinalGather {
    device: wgpu::Device,
    spread_layout: wgpu::BindGroupLayout,
    sum_layout: wgpu::BindGroupLayout,
    spread: wgpu::ComputePipeline,
    sum: wgpu::ComputePipeline,
}

/// Uniforms and bind groups of one band of one view.
#[derive(Debug)]
pub struct FinalGatherResources {
    params: wgpu::Buffer,
    spread_groups: BindGroupCache,
    sum_groups: BindGroupCache,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct FinalGatherInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// Where light is gathered. Its view must be set.
    pub g_buffer: &'a GBuffer,
    /// At which of its pixels.
    pub subsampling: Subsampling,
    /// Which rows of the irradiance, as first row and number: a band of it, where the rays of all do not fit one list. Each band
    /// of a submission needs resources of its own.
    pub rows: [u32; 2],
    /// Rays of a pixel; as many as there is room for, if that is less.
    pub rays_a_pixel: u32,
    /// Room for the rays of the band's pixels. The first step writes them, a tracer says what they meet, the second step reads
    /// both. What is left over is not written: it is to hold rays that a tracer may follow, as of a band before.
    pub rays: &'a SurfaceRays,
    /// What shows the surfaces where rays end.
    pub env_maps: &'a EnvMaps,
    /// The light on these.
    pub light: &'a EnvMapIrradiance,
    /// Written by the second step; `rgba32float`, of the size that [`Subsampling::size`] makes of the G-buffer's.
    pub irradiance: &'a Irradiance,
    /// Turns the rays: another in each frame that is accumulated, constant in real time.
    pub sample_offset: u32,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl FinalGatherInputs<'_> {
    /// Columns and rows of the band.
    fn band(&self) -> [u32; 2] {
        let [width, height] = self.subsampling.size(self.g_buffer.size());
        [width, self.rows[1].min(height.saturating_sub(self.rows[0]))]
    }

    fn params(&self) -> gpu::Params {
        let [width, row_count] = self.band();
        gpu::Params {
            factor: self.subsampling.factor(),
            ray_count: self.rays_a_pixel.min(self.rays.count() / (width * row_count).max(1)),
            first_row: self.rows[0],
            row_count,
            sample_offset: self.sample_offset,
            map_count: (self.env_maps.centers().len() as u32).min(self.light.capacity()),
            map_size: self.env_maps.size(),
        }
    }
}

impl FinalGather {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let layout = |label, slots: &[Slot]| device::layout(device, label, wgpu::ShaderStages::COMPUTE, slots);
        let spread_layout = layout("lightfall::FinalGather::spread", &SPREAD_SLOTS);
        let sum_layout = layout("lightfall::FinalGather::sum", &SUM_SLOTS);
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
            spread: pipeline(
                "lightfall::FinalGather::spread",
                wgsl::FINAL_GATHER_SPREAD,
                "spread_rays",
                &spread_layout,
            ),
            sum: pipeline(
                "lightfall::FinalGather::sum",
                wgsl::FINAL_GATHER_SUM,
                "sum_hits",
                &sum_layout,
            ),
            spread_layout,
            sum_layout,
        }
    }

    /// Records the rays, to be traced before [`FinalGather::record`].
    pub fn record_rays(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut FinalGatherResources,
        inputs: &FinalGatherInputs<'_>,
    ) {
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&inputs.params()));
        let views = inputs.g_buffer.views();
        let bound = [
            (&resources.params).into(),
            inputs.g_buffer.view_buffer().into(),
            (&views.depth).into(),
            (&views.normal).into(),
            (&views.base_color).into(),
            inputs.g_buffer.surfaces().into(),
            inputs.rays.buffer().into(),
        ];
        let label = "lightfall::FinalGather::rays";
        let cache = &mut resources.spread_groups;
        let group = cache.get(&self.device, label, &self.spread_layout, &bound);
        let [width, height] = inputs.band();
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.spread);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
    }

    /// Records the sum of what they bring back, with the inputs of `record_rays`.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut FinalGatherResources,
        inputs: &FinalGatherInputs<'_>,
    ) {
        let bound = [
            (&resources.params).into(),
            inputs.g_buffer.view_buffer().into(),
            (&inputs.g_buffer.views().base_color).into(),
            inputs.rays.buffer().into(),
            inputs.rays.hits().into(),
            inputs.env_maps.view().into(),
            inputs.env_maps.centers_buffer().into(),
            inputs.light.view().into(),
            inputs.irradiance.view().into(),
        ];
        let label = "lightfall::FinalGather";
        let cache = &mut resources.sum_groups;
        let group = cache.get(&self.device, label, &self.sum_layout, &bound);
        let [width, height] = inputs.band();
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.sum);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(width, height, 1);
    }
}

impl FinalGatherResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::FinalGather::params")?,
            spread_groups: BindGroupCache::default(),
            sum_groups: BindGroupCache::default(),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.params.size()
    }
}
