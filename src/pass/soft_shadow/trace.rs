//! Rays to points all over a lamp.

use super::{OneLight, SoftShadowInputs};
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::BvhGeometry;
use crate::resource::bvh_geometry::BVH_SLOTS;
use crate::wgsl;

/// Bindings of group 0 of `shaders/pass/soft_shadow/trace_lamp.wgsl`, in order.
pub(crate) const TRACE_SLOTS: [Slot; 8] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageTexture(wgpu::TextureFormat::R32Float),
];

const LABEL: &str = "lightfall::SoftShadow::trace";

#[derive(Debug)]
pub(super) struct Trace {
    layout: wgpu::BindGroupLayout,
    geometry_layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

#[derive(Debug)]
pub(super) struct TraceGroups {
    groups: BindGroupCache,
    geometry_groups: BindGroupCache,
}

impl TraceGroups {
    pub(super) fn new(lights: usize) -> Self {
        Self {
            groups: BindGroupCache::for_uses(lights),
            geometry_groups: BindGroupCache::default(),
        }
    }
}

impl Trace {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let layout = device::layout(device, LABEL, wgpu::ShaderStages::COMPUTE, &TRACE_SLOTS);
        let geometry_layout = device::layout(device, LABEL, wgpu::ShaderStages::COMPUTE, &BVH_SLOTS);
        let spec = ComputeSpec {
            label: LABEL,
            source: wgsl::SOFT_SHADOW_TRACE,
            entry_point: "trace_pixels",
            layouts: &[&layout, &geometry_layout],
            constants: &[],
        };
        Self {
            pipeline: device::compute_pipeline(device, &spec),
            layout,
            geometry_layout,
        }
    }

    pub(super) fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        own: &mut TraceGroups,
        (inputs, bvh): (&SoftShadowInputs<'_>, &BvhGeometry),
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
            inputs.lights.polygons().into(),
            light.layer.into(),
        ];
        let group = own.groups.get(device, LABEL, &self.layout, &bound);
        let geometry = own
            .geometry_groups
            .get(device, LABEL, &self.geometry_layout, &bvh.bound());
        let mut pass = device::compute_pass(encoder, LABEL, inputs.timestamps);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.set_bind_group(1, &geometry, &[]);
        let [width, height] = inputs.g_buffer.size();
        pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
    }
}
