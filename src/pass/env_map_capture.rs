//! Fills [`EnvMaps`] with the host's draws: six faces around each centre.
//!
//! Input: [`Geometry`], centres (in the maps). Output: [`EnvMaps`]. Cost: k maps are 6 k draws of the scene, each of a
//! sixth of it once the host culls. Source: Yao et al. 2010, section 3.

use super::capture;
use crate::resource::{CaptureView, EnvMaps, Geometry};
use crate::{Error, Timestamps};

/// The pass. It holds nothing: the draws are the host's.
#[derive(Debug, Default)]
pub struct EnvMapCapture;

/// The depth buffer that all faces share.
#[derive(Debug)]
pub struct EnvMapCaptureResources {
    depth: wgpu::TextureView,
    bytes: u64,
}

/// What a frame gives it.
#[derive(Clone, Copy)]
#[allow(missing_debug_implementations, reason = "holds a trait object of the host's")]
pub struct EnvMapCaptureInputs<'a> {
    /// The maps to fill.
    pub env_maps: &'a EnvMaps,
    /// The host's draws, prepared for a list of views that holds `views`.
    pub geometry: &'a dyn Geometry,
    /// [`EnvMaps::views`], or some of them, with their indices in the frame's list set.
    pub views: &'a [CaptureView],
    /// The layer of each of these views. `None`: the first view is of layer 0, and so on.
    pub layers: Option<&'a [u32]>,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl EnvMapCapture {
    /// The pass.
    pub fn new() -> Self {
        Self
    }

    /// Records one render pass for each view.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut EnvMapCaptureResources,
        inputs: &EnvMapCaptureInputs<'_>,
    ) {
        let all: Vec<u32> = (0..inputs.views.len() as u32).collect();
        let layers = inputs.layers.unwrap_or(&all);
        let faces = layers.iter().map_while(|&layer| inputs.env_maps.face_view(layer));
        capture::record_layers(
            encoder,
            "lightfall::EnvMapCapture",
            inputs.views.iter().zip(faces),
            &resources.depth,
            inputs.geometry,
            inputs.timestamps,
        );
    }
}

impl EnvMapCaptureResources {
    /// For maps of `size`² texels a face.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, size: u32) -> Result<Self, Error> {
        let (depth, bytes) = capture::depth(device, "lightfall::EnvMapCapture::depth", size)?;
        Ok(Self { depth, bytes })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}
