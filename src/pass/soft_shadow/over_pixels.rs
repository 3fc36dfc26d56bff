//! Ways that see to each pixel by itself in one dispatch: filtering of the shadow maps, and rays to points all over a lamp.

use super::{OneLight, SoftShadowInputs};
use crate::gpu::{self as device, BindGroupCache, Bound, ComputeSpec, Slot};

/// Bindings of group 0 of `shaders/pass/soft_shadow/filter_maps.wgsl` and `trace_lamp.wgsl`, in order.
pub(crate) const PIXEL_SLOTS: [Slot; 8] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageTexture(wgpu::TextureFormat::R32Float),
];

/// One way.
#[derive(Debug)]
pub(super) struct OverPixels {
    label: &'static str,
    layout: wgpu::BindGroupLayout,
    occluder_layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

/// Bind groups, for one view.
#[derive(Debug)]
pub(super) struct OverPixelsGroups {
    groups: BindGroupCache,
    occluder_groups: BindGroupCache,
}

impl OverPixelsGroups {
    pub(super) fn new(lights: usize) -> Self {
        Self {
            groups: BindGroupCache::for_uses(lights),
            occluder_groups: BindGroupCache::default(),
        }
    }
}

impl OverPixels {
    /// `occluders` are the bindings of group 1: what stands in the way.
    pub(super) fn new(
        device: &wgpu::Device,
        label: &'static str,
        (source, entry_point): (&'static str, &'static str),
        occluders: &[Slot],
    ) -> Self {
        let layout = device::layout(device, label, wgpu::ShaderStages::COMPUTE, &PIXEL_SLOTS);
        let occluder_layout = device::layout(device, label, wgpu::ShaderStages::COMPUTE, occluders);
        let spec = ComputeSpec {
            label,
            source,
            entry_point,
            layouts: &[&layout, &occluder_layout],
            constants: &[],
        };
        Self {
            label,
            pipeline: device::compute_pipeline(device, &spec),
            layout,
            occluder_layout,
        }
    }

    /// `of_lights` is what it reads about lights beside their records.
    pub(super) fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        own: &mut OverPixelsGroups,
        (inputs, light): (&SoftShadowInputs<'_>, &OneLight<'_>),
        (of_lights, occluders): (&wgpu::Buffer, &[Bound]),
    ) {
        let views = inputs.g_buffer.views();
        let bound = [
            light.params.into(),
            inputs.g_buffer.view_buffer().into(),
            (&views.depth).into(),
            (&views.normal).into(),
            (&views.base_color).into(),
            inputs.lights.buffer().into(),
            of_lights.into(),
            light.layer.into(),
        ];
        let group = own.groups.get(device, self.label, &self.layout, &bound);
        let (groups, layout) = (&mut own.occluder_groups, &self.occluder_layout);
        let occluders = groups.get(device, self.label, layout, occluders);
        let mut pass = device::compute_pass(encoder, self.label, inputs.timestamps);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.set_bind_group(1, &occluders, &[]);
        let [width, height] = inputs.g_buffer.size();
        pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
    }
}
