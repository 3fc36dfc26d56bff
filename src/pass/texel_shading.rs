//! Indirect light at pixels, from texels of the surfaces that they see.
//!
//! Inputs: [`GBuffer`], [`SurfaceLights`], whose places texels stand at, [`IlluminationMap`]. Output: [`Irradiance`]
//! (`rgba32float`) at every pixel of the G-buffer or at a part of them; alpha is 1 where a surface is seen, else 0. A plane is
//! laid through the texels around that face the same way, by moving least squares; where none is near, the nearest counts.
//! Sources: Larsen 2004, chapter 11, where textures interpolate; moving least squares (Lancaster and Salkauskas 1981).
//!
//! Cost: pixels × texels within reach. Limits: what is finer than texels lie apart is lost, contact shadows among it.

use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::{GBuffer, IlluminationMap, Irradiance, Subsampling, SurfaceLights};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/texel_shading.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) factor: u32,
        pub(crate) reach: f32,
    }
}

/// Bindings of `shaders/pass/texel_shading.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 11] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::UintTexture,
    Slot::Uniform,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageTexture(wgpu::TextureFormat::Rgba32Float),
];

/// The pass.
#[derive(Debug)]
pub struct TexelShading {
    device: wgpu::Device,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

/// Uniforms and bind groups for one view.
#[derive(Debug)]
pub struct TexelShadingResources {
    params: wgpu::Buffer,
    groups: BindGroupCache,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct TexelShadingInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// What is lit. Its view must be set.
    pub g_buffer: &'a GBuffer,
    /// At which of its pixels.
    pub subsampling: Subsampling,
    /// Where texels stand.
    pub lights: &'a SurfaceLights,
    /// Their light.
    pub map: &'a IlluminationMap,
    /// How far texels count, in times that they lie apart, above 0: 1.5 is a good value. More is smoother, and costs as the
    /// square.
    pub reach: f32,
    /// Written; `rgba32float`, of the size that [`Subsampling::size`] makes of the G-buffer's.
    pub irradiance: &'a Irradiance,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl TexelShading {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let label = "lightfall::TexelShading";
        let layout = device::layout(device, label, wgpu::ShaderStages::COMPUTE, &SLOTS);
        let spec = ComputeSpec {
            label,
            source: wgsl::TEXEL_SHADING,
            entry_point: "shade_texels",
            layouts: &[&layout],
            constants: &[],
        };
        Self {
            device: device.clone(),
            pipeline: device::compute_pipeline(device, &spec),
            layout,
        }
    }

    /// Records the irradiance.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut TexelShadingResources,
        inputs: &TexelShadingInputs<'_>,
    ) {
        let params = gpu::Params {
            factor: inputs.subsampling.factor(),
            reach: inputs.reach.clamp(0.01, 8.0),
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
            inputs.lights.grid().into(),
            inputs.lights.shining().into(),
            inputs.lights.cells().into(),
            inputs.map.shown().into(),
            inputs.irradiance.view().into(),
        ];
        let label = "lightfall::TexelShading";
        let group = resources.groups.get(&self.device, label, &self.layout, &bound);
        let [width, height] = inputs.subsampling.size(inputs.g_buffer.size());
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
    }
}

impl TexelShadingResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::TexelShading::params")?,
            groups: BindGroupCache::default(),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.params.size()
    }
}
