//! Evens out the noise of irradiance along surfaces and not across their edges.
//!
//! Input: [`Irradiance`] of some [`Subsampling`], [`GBuffer`]. Output: [`Irradiance`] (`rgba32float`) of the same size; alpha
//! is that of the input. Each pixel becomes the mean of those around, which weigh 1 − d² / (r + 1)² at d pixels from it, times
//! how well their normals agree and how near they lie to its tangent plane, as in [`Upsampler`](super::Upsampler); those of
//! another surface, by their numbers, do not count. What is smooth already may be added at the same time. Source: joint
//! bilateral filtering (Petschnigg et al. 2004), with the distance from the plane in the place of depth.
//!
//! Cost: pixels × (2 r + 1)², some five texel fetches each. Limits: what is finer than the radius is blurred, contact shadows
//! among it.

use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::{GBuffer, Irradiance, Subsampling};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/irradiance_filter.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) factor: u32,
        pub(crate) radius: u32,
        pub(crate) normal_agreement: f32,
        pub(crate) plane_distance: f32,
        pub(crate) plus_factor: f32,
    }
}

/// Bindings of `shaders/pass/irradiance_filter.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 9] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::UintTexture,
    Slot::Texture,
    Slot::Texture,
    Slot::StorageTexture(wgpu::TextureFormat::Rgba32Float),
];

/// Widest radius, pixels of the irradiance.
pub(crate) const MOST_RADIUS: u32 = 16;

/// How far, and what fits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IrradianceFilterSettings {
    /// Pixels of the irradiance to each side, up to 16; 0: it is copied. Wider is smoother and blurrier, and costs as the
    /// square.
    pub radius: u32,
    /// As [`UpsamplerSettings::normal_agreement`](super::UpsamplerSettings::normal_agreement).
    pub normal_agreement: f32,
    /// As [`UpsamplerSettings::plane_distance`](super::UpsamplerSettings::plane_distance).
    pub plane_distance: f32,
}

/// The pass.
#[derive(Debug)]
pub struct IrradianceFilter {
    device: wgpu::Device,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

/// Uniforms and bind groups for one view.
#[derive(Debug)]
pub struct IrradianceFilterResources {
    params: wgpu::Buffer,
    groups: BindGroupCache,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct IrradianceFilterInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// The surfaces. Its view must be set.
    pub g_buffer: &'a GBuffer,
    /// At which of its pixels irradiance was estimated.
    pub subsampling: Subsampling,
    /// Of the size that [`Subsampling::size`] makes of the G-buffer's.
    pub estimate: &'a Irradiance,
    /// What is added to the result as it is, times a factor: of the same size.
    pub plus: Option<(&'a Irradiance, f32)>,
    /// Written; another texture of the same size, `rgba32float`.
    pub irradiance: &'a Irradiance,
    /// How far.
    pub settings: &'a IrradianceFilterSettings,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl IrradianceFilter {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let label = "lightfall::IrradianceFilter";
        let layout = device::layout(device, label, wgpu::ShaderStages::COMPUTE, &SLOTS);
        let spec = ComputeSpec {
            label,
            source: wgsl::IRRADIANCE_FILTER,
            entry_point: "filter_pixels",
            layouts: &[&layout],
            constants: &[],
        };
        Self {
            device: device.clone(),
            pipeline: device::compute_pipeline(device, &spec),
            layout,
        }
    }

    /// Records the filter.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut IrradianceFilterResources,
        inputs: &IrradianceFilterInputs<'_>,
    ) {
        let params = gpu::Params {
            factor: inputs.subsampling.factor(),
            radius: inputs.settings.radius.min(MOST_RADIUS),
            // At 1 no normal would agree with itself. The smaller of NaN and it is it.
            normal_agreement: inputs.settings.normal_agreement.min(0.9999),
            plane_distance: inputs.settings.plane_distance,
            plus_factor: inputs.plus.map_or(0.0, |plus| plus.1),
        };
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let views = inputs.g_buffer.views();
        let bound = [
            (&resources.params).into(),
            inputs.g_buffer.view_buffer().into(),
            (&views.depth).into(),
            (&views.normal).into(),
            (&views.base_color).into(),
            inputs.g_buffer.surfaces().into(),
            inputs.estimate.view().into(),
            // Not read, if there is nothing to add.
            inputs.plus.map_or(inputs.estimate, |plus| plus.0).view().into(),
            inputs.irradiance.view().into(),
        ];
        let label = "lightfall::IrradianceFilter";
        let group = resources.groups.get(&self.device, label, &self.layout, &bound);
        let [width, height] = inputs.subsampling.size(inputs.g_buffer.size());
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
    }
}

impl IrradianceFilterResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::IrradianceFilter::params")?,
            groups: BindGroupCache::default(),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.params.size()
    }
}
