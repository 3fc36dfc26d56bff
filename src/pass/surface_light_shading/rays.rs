//! With shadows: rays to lights, or all around, and what they say.

use super::shared_bindings;
use super::{SurfaceLightRays, SurfaceLightShading, SurfaceLightShadingInputs, SurfaceLightShadingResources};
use crate::gpu::{self as device, ComputeSpec, Slot};
use crate::wgsl;

/// Bindings of `shaders/pass/surface_light_shading/spread_rays.wgsl`, in order.
pub(crate) const SPREAD_SLOTS: [Slot; 9] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::UintTexture,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageMut,
];

/// Bindings of `shaders/pass/surface_light_shading/sum_rays.wgsl`, in order.
pub(crate) const SUM_SLOTS: [Slot; 10] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::UintTexture,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageTexture(wgpu::TextureFormat::Rgba32Float),
];

/// Both steps.
#[derive(Debug)]
pub(super) struct Rays {
    spread_layout: wgpu::BindGroupLayout,
    sum_layout: wgpu::BindGroupLayout,
    spread: wgpu::ComputePipeline,
    sum: wgpu::ComputePipeline,
}

impl Rays {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let stage = wgpu::ShaderStages::COMPUTE;
        let spread_layout = device::layout(device, "lightfall::SurfaceLightShading::rays", stage, &SPREAD_SLOTS);
        let sum_layout = device::layout(device, "lightfall::SurfaceLightShading::sum", stage, &SUM_SLOTS);
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
            spread: pipeline(
                "lightfall::SurfaceLightShading::rays",
                wgsl::SURFACE_LIGHT_SPREAD,
                "spread_rays",
                &spread_layout,
            ),
            sum: pipeline(
                "lightfall::SurfaceLightShading::sum",
                wgsl::SURFACE_LIGHT_SUM,
                "sum_rays",
                &sum_layout,
            ),
            spread_layout,
            sum_layout,
        }
    }

    /// Columns and rows of a band.
    fn band(inputs: &SurfaceLightShadingInputs<'_>, band: &SurfaceLightRays<'_>) -> [u32; 2] {
        let [width, height] = inputs.size();
        [width, band.rows[1].min(height.saturating_sub(band.rows[0]))]
    }

    pub(super) fn record_spread(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut SurfaceLightShadingResources,
        (inputs, band): (&SurfaceLightShadingInputs<'_>, &SurfaceLightRays<'_>),
    ) {
        let [width, rows] = Self::band(inputs, band);
        let wanted = SurfaceLightShading::rays_a_pixel(inputs.settings, inputs.lights);
        let rays = wanted.min(band.rays.count() / (width * rows).max(1));
        let params = inputs.params([band.rows[0], rows], rays);
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let mut bound = shared_bindings(resources, inputs);
        bound.push(band.rays.buffer().into());
        let label = "lightfall::SurfaceLightShading::rays";
        let group = resources.spread_groups.get(device, label, &self.spread_layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.spread);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(width.div_ceil(8), rows.div_ceil(8), 1);
    }

    pub(super) fn record_sum(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut SurfaceLightShadingResources,
        (inputs, band): (&SurfaceLightShadingInputs<'_>, &SurfaceLightRays<'_>),
    ) {
        let [width, rows] = Self::band(inputs, band);
        let mut bound = shared_bindings(resources, inputs);
        bound.push(band.rays.hits().into());
        bound.push(inputs.irradiance.view().into());
        let label = "lightfall::SurfaceLightShading::sum";
        let group = resources.sum_groups.get(device, label, &self.sum_layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.sum);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(width.div_ceil(8), rows.div_ceil(8), 1);
    }
}
