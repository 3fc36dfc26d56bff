//! Fills [`ShadowMaps`] with the host's draws, as each light sees them.
//!
//! Input: [`Geometry`], the lights' views. Output: [`ShadowMaps`]. Cost: one rasterisation of the scene for each layer.

use super::capture;
use crate::resource::{CaptureView, Geometry, ShadowMaps};
use crate::{Error, Timestamps};

/// The pass. It holds nothing: the draws are the host's.
#[derive(Debug, Default)]
pub struct ShadowMapCapture;

/// The depth buffer that all layers share.
#[derive(Debug)]
pub struct ShadowMapCaptureResources {
    depth: wgpu::TextureView,
    bytes: u64,
}

/// What a frame gives it.
#[derive(Clone, Copy)]
#[allow(missing_debug_implementations, reason = "holds a trait object of the host's")]
pub struct ShadowMapCaptureInputs<'a> {
    /// The maps to fill.
    pub shadow_maps: &'a ShadowMaps,
    /// The host's draws, prepared for a list of views that holds `views`.
    pub geometry: &'a dyn Geometry,
    /// [`ShadowMaps::views`], with their indices in the frame's list set.
    pub views: &'a [CaptureView],
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl ShadowMapCapture {
    /// The pass.
    pub fn new() -> Self {
        Self
    }

    /// Records one render pass for each layer.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut ShadowMapCaptureResources,
        inputs: &ShadowMapCaptureInputs<'_>,
    ) {
        let layers = (0..).map_while(|layer| inputs.shadow_maps.layer_view(layer));
        capture::record_layers(
            encoder,
            "lightfall::ShadowMapCapture",
            inputs.views.iter().zip(layers),
            &resources.depth,
            inputs.geometry,
            inputs.timestamps,
        );
    }
}

impl ShadowMapCaptureResources {
    /// For maps of `size`² texels a layer.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, size: u32) -> Result<Self, Error> {
        let (depth, bytes) = capture::depth(device, "lightfall::ShadowMapCapture::depth", size)?;
        Ok(Self { depth, bytes })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}
