//! Direct irradiance, deferred over the G-buffer.
//!
//! Inputs: [`GBuffer`], [`Lights`], [`ShadowMaps`] or [`Visibility`]. Output: [`Irradiance`] (`rgba32float`). Cost: pixels
//! × lights that face them, one texel fetch each. With [`Visibility`], each light counts by its layer; without, it is
//! tested here and its shadow is hard. A receiver is lit where it lies no further than the plane of the surface that its
//! shadow-map texel holds, so flat surfaces need no bias; and where that texel saw something behind the receiver's own
//! plane, which cannot be in the way. Source: deferred shading as in Yao et al. 2010, section 7. Limits: a bulb or spot of some
//! extent gives the irradiance of a point in its middle; what lies outside the region is not shadowed from directional
//! light, and geometry further than two unit-frame lengths towards such a light does not shade.

use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::{GBuffer, Irradiance, Lights, ShadowMaps, Visibility};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/direct_light.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) light_count: u32,
        pub(crate) shadow_map_size: u32,
    }
}

/// Bindings of `shaders/pass/direct_light.wgsl`, group 0, in order.
pub(crate) const SLOTS: [Slot; 9] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::Storage,
    Slot::UintArray,
    Slot::StorageTexture(wgpu::TextureFormat::Rgba32Float),
    Slot::Storage,
];

/// Group 1, where visibility is given.
pub(crate) const VISIBILITY_SLOTS: [Slot; 1] = [Slot::TextureArray];

/// The pass.
#[derive(Debug)]
pub struct DirectLight {
    device: wgpu::Device,
    layout: wgpu::BindGroupLayout,
    visibility_layout: wgpu::BindGroupLayout,
    light: wgpu::ComputePipeline,
    light_by_visibility: wgpu::ComputePipeline,
}

/// Uniforms and bind groups for one view.
#[derive(Debug)]
pub struct DirectLightResources {
    params: wgpu::Buffer,
    groups: BindGroupCache,
    visibility_groups: BindGroupCache,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct DirectLightInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// Surfaces to light. Its view must be set.
    pub g_buffer: &'a GBuffer,
    /// Sources.
    pub lights: &'a Lights,
    /// What they see.
    pub shadow_maps: &'a ShadowMaps,
    /// How much of each light is seen, of the G-buffer's size and with a layer for each light; `None`: hard shadows.
    pub visibility: Option<&'a Visibility>,
    /// Written; `rgba32float` of the G-buffer's size.
    pub irradiance: &'a Irradiance,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl DirectLight {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let stage = wgpu::ShaderStages::COMPUTE;
        let layout = device::layout(device, "lightfall::DirectLight", stage, &SLOTS);
        let visibility_layout = device::layout(device, "lightfall::DirectLight::visibility", stage, &VISIBILITY_SLOTS);
        let pipeline = |label, entry_point, layouts: &[&wgpu::BindGroupLayout]| {
            device::compute_pipeline(
                device,
                &ComputeSpec {
                    label,
                    source: wgsl::DIRECT_LIGHT,
                    entry_point,
                    layouts,
                    constants: &[],
                },
            )
        };
        Self {
            device: device.clone(),
            light: pipeline("lightfall::DirectLight::light", "light_pixels", &[&layout]),
            light_by_visibility: pipeline(
                "lightfall::DirectLight::light_by_visibility",
                "light_pixels_by_visibility",
                &[&layout, &visibility_layout],
            ),
            layout,
            visibility_layout,
        }
    }

    /// Records the lighting.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut DirectLightResources,
        inputs: &DirectLightInputs<'_>,
    ) {
        let params = gpu::Params {
            light_count: inputs.lights.count(),
            shadow_map_size: inputs.shadow_maps.size(),
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
            inputs.lights.buffer().into(),
            inputs.shadow_maps.view().into(),
            inputs.irradiance.view().into(),
            inputs.lights.polygons().into(),
        ];
        let label = "lightfall::DirectLight";
        let group = resources.groups.get(&self.device, label, &self.layout, &bound);
        let [width, height] = inputs.g_buffer.size();
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_bind_group(0, &group, &[]);
        if let Some(visibility) = inputs.visibility {
            let bound = [visibility.view().into()];
            let (groups, layout) = (&mut resources.visibility_groups, &self.visibility_layout);
            let group = groups.get(&self.device, "lightfall::DirectLight::visibility", layout, &bound);
            pass.set_bind_group(1, &group, &[]);
            pass.set_pipeline(&self.light_by_visibility);
        } else {
            pass.set_pipeline(&self.light);
        }
        pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
    }
}

impl DirectLightResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::DirectLight::params")?,
            groups: BindGroupCache::default(),
            visibility_groups: BindGroupCache::default(),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.params.size()
    }
}
