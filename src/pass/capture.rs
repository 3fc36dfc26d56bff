//! What the capture passes share: one render pass for each layer, each with the host's draws.

use crate::resource::{CapturePurpose, CaptureTargets, CaptureView, Geometry};
use crate::{Error, Timestamps, gpu};

/// A square depth buffer that captures share, one view after the other.
pub(super) fn depth(device: &wgpu::Device, label: &'static str, size: u32) -> Result<(wgpu::TextureView, u64), Error> {
    let spec = gpu::TextureSpec {
        label,
        size: [size; 2],
        layers: 1,
        format: CaptureTargets::of(CapturePurpose::EnvMap).depth,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
    };
    let texture = gpu::texture(device, &spec)?;
    Ok((texture.create_view(&Default::default()), spec.bytes()))
}

/// Draws each view into its layer.
pub(super) fn record_layers<'a>(
    encoder: &mut wgpu::CommandEncoder,
    label: &'static str,
    layers: impl Iterator<Item = (&'a CaptureView, &'a wgpu::TextureView)>,
    depth: &wgpu::TextureView,
    geometry: &dyn Geometry,
    timestamps: Option<&Timestamps>,
) {
    encoder.push_debug_group(label);
    for (view, layer) in layers {
        let mut pass = gpu::render_pass(encoder, label, &[layer], Some(depth), timestamps);
        geometry.draw(&mut pass, view);
    }
    encoder.pop_debug_group();
}
