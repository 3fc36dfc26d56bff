//! Fills a [`GBuffer`] with the host's draws.
//!
//! Input: [`Geometry`], a camera view. Output: [`GBuffer`]. Cost: one rasterisation of what the eye sees. A host that has
//! a G-buffer of its own skips this pass ([`GBuffer::from_views`]). One sample per pixel.

use crate::resource::{CameraView, GBuffer, Geometry};
use crate::{Timestamps, gpu};

/// The pass. It holds nothing: the draws are the host's.
#[derive(Debug, Default)]
pub struct GBufferCapture;

/// What a frame gives it.
#[derive(Clone, Copy)]
#[allow(missing_debug_implementations, reason = "holds a trait object of the host's")]
pub struct GBufferCaptureInputs<'a> {
    /// For the view's uniforms.
    pub queue: &'a wgpu::Queue,
    /// The host's draws, prepared for a list of views that holds `view.capture`.
    pub geometry: &'a dyn Geometry,
    /// From where.
    pub view: &'a CameraView,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl GBufferCapture {
    /// The pass.
    pub fn new() -> Self {
        Self
    }

    /// Records the draws into a G-buffer of the crate's own layout.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        g_buffer: &mut GBuffer,
        inputs: &GBufferCaptureInputs<'_>,
    ) {
        g_buffer.set_view(inputs.queue, inputs.view);
        let views = g_buffer.views();
        let colors = [&views.normal, &views.base_color, &views.emission, g_buffer.surfaces()];
        let label = "lightfall::GBufferCapture";
        let mut pass = gpu::render_pass(encoder, label, &colors, Some(&views.depth), inputs.timestamps);
        inputs.geometry.draw(&mut pass, &inputs.view.capture);
    }
}
