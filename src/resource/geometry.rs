//! How the host's draws reach the passes: image-space techniques work for whatever can be rasterised.

use super::{CapturePurpose, CaptureView};
use crate::Error;
use crate::scene::UnitFrame;

/// What [`Geometry::prepare`] may use.
#[derive(Debug)]
pub struct PrepareContext<'a> {
    /// The device.
    pub device: &'a wgpu::Device,
    /// For uploads of this frame.
    pub queue: &'a wgpu::Queue,
    /// The frame that all positions handed to the passes are in.
    pub frame: &'a UnitFrame,
}

/// Everything that blocks or reflects light, drawn by the host.
pub trait Geometry {
    /// Called once per frame before any pass, with every view of the frame: cull, upload, skin.
    ///
    /// # Errors
    /// Whatever keeps the geometry from being drawn; the frame is then not recorded.
    fn prepare(&mut self, _context: &PrepareContext<'_>, _views: &[CaptureView]) -> Result<(), Error> {
        Ok(())
    }

    /// Records draws of everything that `view` wants into `pass`, whose targets are
    /// [`CaptureTargets::of`] the view's purpose; viewport and scissor are set.
    fn draw(&self, pass: &mut wgpu::RenderPass<'_>, view: &CaptureView);
}

/// The attachments of a view's render pass, for which the host builds its pipelines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CaptureTargets {
    /// Colour formats in attachment order.
    pub colors: &'static [wgpu::TextureFormat],
    /// Depth format.
    pub depth: wgpu::TextureFormat,
    /// Depth test that passes nearer fragments: reverse-Z.
    pub depth_compare: wgpu::CompareFunction,
}

impl CaptureTargets {
    /// Targets of views of this purpose.
    ///
    /// Lights, candidates, environment maps and hemispheres: one `rgba32uint`, written with `surface_texel_pack` of
    /// [`wgsl::CAPTURE`](crate::wgsl::CAPTURE). The camera: octahedral normal (`vec2f`, what `octahedral_encode` makes of it),
    /// base colour (`vec4f`, alpha 1), emission (`vec4f`) and the number of the surface (`u32`), as
    /// [`GBufferViews`](super::GBufferViews) describes them.
    pub fn of(purpose: CapturePurpose) -> Self {
        use wgpu::TextureFormat as F;
        Self {
            colors: match purpose {
                CapturePurpose::Camera => &[F::Rg16Float, F::Rgba16Float, F::Rgba32Float, F::R32Uint],
                _ => &[F::Rgba32Uint],
            },
            depth: F::Depth32Float,
            depth_compare: wgpu::CompareFunction::Greater,
        }
    }

    /// Depth state for a pipeline that draws to these targets.
    pub fn depth_stencil(&self) -> wgpu::DepthStencilState {
        wgpu::DepthStencilState {
            format: self.depth,
            depth_write_enabled: Some(true),
            depth_compare: Some(self.depth_compare),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }
    }
}
