//! Radiance of rough metal from the photons around what a pixel shows, each by the BRDF: no ray is traced.
//!
//! Inputs: [`GBuffer`] with lobes among its surfaces; photons on rough metal, sorted ([`PhotonGrid`](super::PhotonGrid) of
//! [`SortedPhotons::OnGlossy`](super::SortedPhotons)); [`Lights`] and [`ShadowMaps`]. Output: radiance, as an [`Irradiance`]
//! (`rgba32float`, unit frame): of pixels whose surface is a rough metal or a Phong lobe; others stay as they are. Sources: Jensen 1996,
//! the radiance estimate; Yao et al. 2010, section 6, which evaluates it at full resolution.
//!
//! Order: after [`SpecularPaths`](super::SpecularPaths), which leaves those pixels out where it is told to. Cost: pixels × photons
//! around them. Limits: reflections are as sharp as the lobe or the kernel, whichever is wider, and as noisy as few photons under
//! both; an environment is seen as its suns, with hard shadows as all lights that are no flat lamps; no boundary correction, and
//! kernels do not narrow as frames are accumulated.

use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::pass::{Kernel, PhotonGridResources};
use crate::resource::{GBuffer, Irradiance, Lights, ShadowMaps};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/glossy_light.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) light_count: u32,
        pub(crate) shadow_map_size: u32,
        pub(crate) direct_weight: f32,
        pub(crate) indirect_weight: f32,
    }
}

/// Bindings of `shaders/pass/glossy_light.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 13] = [
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
    Slot::Storage,
    Slot::UintArray,
    Slot::StorageTexture(wgpu::TextureFormat::Rgba32Float),
];

/// The pass.
#[derive(Debug)]
pub struct GlossyLight {
    device: wgpu::Device,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

/// Uniforms and bind groups of one view.
#[derive(Debug)]
pub struct GlossyLightResources {
    params: wgpu::Buffer,
    groups: BindGroupCache,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct GlossyLightInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// What is seen. Its view must be set.
    pub g_buffer: &'a GBuffer,
    /// Photons on rough metal, sorted.
    pub photons: &'a PhotonGridResources,
    /// Light of single directions; of flat lamps photons bring it.
    pub lights: &'a Lights,
    /// What lights see.
    pub shadow_maps: &'a ShadowMaps,
    /// Written at pixels of rough metal; `rgba32float` of the G-buffer's size.
    pub radiance: &'a Irradiance,
    /// Factors of light straight from a source, and of all other light.
    pub weights: [f32; 2],
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl GlossyLight {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device, kernel: Kernel) -> Self {
        let label = "lightfall::GlossyLight";
        let layout = device::layout(device, label, wgpu::ShaderStages::COMPUTE, &SLOTS);
        let spec = ComputeSpec {
            label,
            source: wgsl::GLOSSY_LIGHT,
            entry_point: "light_pixels",
            layouts: &[&layout],
            constants: &[("kernel", f64::from(kernel as u32))],
        };
        Self {
            device: device.clone(),
            pipeline: device::compute_pipeline(device, &spec),
            layout,
        }
    }

    /// Records the estimate.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut GlossyLightResources,
        inputs: &GlossyLightInputs<'_>,
    ) {
        let params = gpu::Params {
            light_count: inputs.lights.count(),
            shadow_map_size: inputs.shadow_maps.size(),
            direct_weight: inputs.weights[0],
            indirect_weight: inputs.weights[1],
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
            inputs.photons.params().into(),
            inputs.photons.splats().into(),
            inputs.photons.first_splats().into(),
            inputs.lights.buffer().into(),
            inputs.lights.polygons().into(),
            inputs.shadow_maps.view().into(),
            inputs.radiance.view().into(),
        ];
        let label = "lightfall::GlossyLight";
        let group = resources.groups.get(&self.device, label, &self.layout, &bound);
        let [width, height] = inputs.g_buffer.size();
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
    }
}

impl GlossyLightResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::GlossyLight::params")?,
            groups: BindGroupCache::default(),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.params.size()
    }
}
