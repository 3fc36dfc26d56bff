//! In the shadow maps: percentage-closer filtering, of one radius or of that of the occluders found.

use super::gather::MAP_SLOTS;
use super::{OneLight, SoftShadowInputs};
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::wgsl;

/// Bindings of group 0 of `shaders/pass/soft_shadow/filter_maps.wgsl`, in order.
pub(crate) const FILTER_SLOTS: [Slot; 8] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageTexture(wgpu::TextureFormat::R32Float),
];

const LABEL: &str = "lightfall::SoftShadow::filter";

#[derive(Debug)]
pub(super) struct Filter {
    layout: wgpu::BindGroupLayout,
    map_layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

#[derive(Debug)]
pub(super) struct FilterGroups {
    groups: BindGroupCache,
    map_groups: BindGroupCache,
}

impl FilterGroups {
    pub(super) fn new(lights: usize) -> Self {
        Self {
            groups: BindGroupCache::for_uses(lights),
            map_groups: BindGroupCache::default(),
        }
    }
}

impl Filter {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let layout = device::layout(device, LABEL, wgpu::ShaderStages::COMPUTE, &FILTER_SLOTS);
        let map_layout = device::layout(device, LABEL, wgpu::ShaderStages::COMPUTE, &MAP_SLOTS);
        let spec = ComputeSpec {
            label: LABEL,
            source: wgsl::SOFT_SHADOW_FILTER,
            entry_point: "filter_pixels",
            layouts: &[&layout, &map_layout],
            constants: &[],
        };
        Self {
            pipeline: device::compute_pipeline(device, &spec),
            layout,
            map_layout,
        }
    }

    pub(super) fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        own: &mut FilterGroups,
        inputs: &SoftShadowInputs<'_>,
        light: &OneLight<'_>,
    ) {
        let views = inputs.g_buffer.views();
        let bound = [
            light.params.into(),
            inputs.g_buffer.view_buffer().into(),
            (&views.depth).into(),
            (&views.normal).into(),
            (&views.base_color).into(),
            inputs.lights.buffer().into(),
            inputs.nearest.buffer().into(),
            light.layer.into(),
        ];
        let group = own.groups.get(device, LABEL, &self.layout, &bound);
        let maps = [inputs.shadow_maps.view().into()];
        let maps = own.map_groups.get(device, LABEL, &self.map_layout, &maps);
        let mut pass = device::compute_pass(encoder, LABEL, inputs.timestamps);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.set_bind_group(1, &maps, &[]);
        let [width, height] = inputs.g_buffer.size();
        pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
    }
}
