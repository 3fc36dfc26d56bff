//! Radiance to display values: exposure, a curve, gamma.
//!
//! Input: [`Radiance`]. Output: any colour target. Cost: one full-screen pass. A host with tone mapping of its own skips
//! it. Gamma 2.2 as in Yao et al. 2010, section 7; the filmic curve is a rational fit (Narkowicz 2015).

use super::full_screen::{FullScreen, FullScreenResources};
use crate::gpu::Slot;
use crate::resource::Radiance;
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/tone_map.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) exposure: f32,
        pub(crate) curve: u32,
        pub(crate) inverse_gamma: f32,
    }
}

/// Bindings of `shaders/pass/tone_map.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 2] = [Slot::Uniform, Slot::Texture];

/// How radiance above the display's range is treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ToneCurve {
    /// Cut off at 1.
    Clamp,
    /// Rolled off.
    #[default]
    Filmic,
}

/// How to map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToneMapSettings {
    /// Radiance is multiplied by this first.
    pub exposure: f32,
    /// Then this curve is applied.
    pub curve: ToneCurve,
    /// Then the power 1 / `gamma`; 1 for targets that encode sRGB themselves.
    pub gamma: f32,
}

impl Default for ToneMapSettings {
    fn default() -> Self {
        Self {
            exposure: 1.0,
            curve: ToneCurve::Filmic,
            gamma: 2.2,
        }
    }
}

/// The pass.
#[derive(Debug)]
pub struct ToneMap {
    pass: FullScreen,
}

/// Uniforms and bind groups for one view.
#[derive(Debug)]
pub struct ToneMapResources {
    inner: FullScreenResources,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct ToneMapInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// The image.
    pub radiance: &'a Radiance,
    /// Written; of the format that the pass was made for.
    pub target: &'a wgpu::TextureView,
    /// How to map.
    pub settings: &'a ToneMapSettings,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl ToneMap {
    /// The pass for targets of `format`.
    pub fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        Self {
            pass: FullScreen::new(device, "lightfall::ToneMap", (wgsl::TONE_MAP, &[]), &SLOTS, &[format]),
        }
    }

    /// Records the mapping.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut ToneMapResources,
        inputs: &ToneMapInputs<'_>,
    ) {
        let params = gpu::Params {
            exposure: inputs.settings.exposure,
            curve: inputs.settings.curve as u32,
            inverse_gamma: 1.0 / inputs.settings.gamma,
        };
        inputs
            .queue
            .write_buffer(&resources.inner.params, 0, bytemuck::bytes_of(&params));
        let bound = [inputs.radiance.view().into()];
        self.pass.record(
            encoder,
            &mut resources.inner,
            &bound,
            &[inputs.target],
            inputs.timestamps,
        );
    }
}

impl ToneMapResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        let inner = FullScreenResources::new::<gpu::Params>(device, "lightfall::ToneMap::params")?;
        Ok(Self { inner })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.inner.params.size()
    }
}
