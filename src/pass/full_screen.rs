//! What the full-screen passes share: a pipeline over one triangle, a uniform, a cached bind group.

use crate::gpu::{self, BindGroupCache, Bound, RenderSpec, Slot};
use crate::{Error, Timestamps};

/// A full-screen pass that writes the given formats.
#[derive(Debug)]
pub(super) struct FullScreen {
    device: wgpu::Device,
    label: &'static str,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
}

/// A uniform buffer and bind groups.
#[derive(Debug)]
pub(super) struct FullScreenResources {
    pub(super) params: wgpu::Buffer,
    groups: BindGroupCache,
}

impl FullScreen {
    pub(super) fn new(
        device: &wgpu::Device,
        label: &'static str,
        (source, constants): (&'static str, &[(&str, f64)]),
        slots: &[Slot],
        formats: &[wgpu::TextureFormat],
    ) -> Self {
        let layout = gpu::layout(device, label, wgpu::ShaderStages::FRAGMENT, slots);
        let targets: Vec<_> = formats.iter().map(|&format| Some(format.into())).collect();
        let pipeline = gpu::render_pipeline(
            device,
            &RenderSpec {
                label,
                source,
                fragment: "fragment",
                layouts: &[&layout],
                constants,
                buffers: &[],
                topology: wgpu::PrimitiveTopology::TriangleList,
                cull_mode: None,
                targets: &targets,
                depth_stencil: None,
            },
        );
        Self {
            device: device.clone(),
            label,
            layout,
            pipeline,
        }
    }

    /// Records the triangle. `bound` are the slots after the uniform.
    pub(super) fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut FullScreenResources,
        bound: &[Bound],
        targets: &[&wgpu::TextureView],
        timestamps: Option<&Timestamps>,
    ) {
        let mut all = vec![Bound::from(&resources.params)];
        all.extend_from_slice(bound);
        let group = resources.groups.get(&self.device, self.label, &self.layout, &all);
        let mut pass = gpu::render_pass(encoder, self.label, targets, None, timestamps);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}

impl FullScreenResources {
    pub(super) fn new<P>(device: &wgpu::Device, label: &'static str) -> Result<Self, Error> {
        Ok(Self {
            params: gpu::uniform_buffer::<P>(device, label)?,
            groups: BindGroupCache::default(),
        })
    }
}
