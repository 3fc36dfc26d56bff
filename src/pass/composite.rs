//! Puts light together: L = L_e + ρ/π · (E_direct + E_indirect + E_caustic), or of specular surfaces what is seen in them,
//! scaled back to world units.
//!
//! Inputs: [`GBuffer`], two or three [`Irradiance`]s, what [`SpecularPaths`](super::SpecularPaths) gives, and the [`Environment`].
//! Output: [`Radiance`]. Cost: one full-screen pass. Source: Larsen 2004,
//! chapter 13; the 1/π that is missing from Yao et al., soft shadows and image-space photon mapping, Eq. 1. Limits: a
//! surface is either Lambertian or specular.

use super::full_screen::{FullScreen, FullScreenResources};
use crate::gpu::Slot;
use crate::resource::{Environment, GBuffer, Irradiance, Radiance};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Parts` in `shaders/common/surface_radiance.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Parts {
        pub(crate) output_scale: f32,
        pub(crate) direct_weight: f32,
        pub(crate) indirect_weight: f32,
        pub(crate) caustic_weight: f32,
        pub(crate) emission_weight: f32,
        pub(crate) diffuse_weight: f32,
        pub(crate) has_specular: u32,
    }
}

/// Bindings of `shaders/pass/composite.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 11] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::UintTexture,
    Slot::Texture,
    Slot::Uniform,
    Slot::Texture,
];

/// Which parts of the light to show, and how bright.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CompositeSettings {
    /// [`UnitFrame::output_scale`](crate::scene::UnitFrame::output_scale): world radiance, times pre-exposure, that one
    /// unit of the unit frame stands for.
    pub output_scale: f32,
    /// Factor of direct light; 0 leaves it out.
    pub direct: f32,
    /// Factor of indirect light.
    pub indirect: f32,
    /// Factor of caustics, where these are apart from other indirect light.
    pub caustic: f32,
    /// Factor of emission, and of the environment where no surface is seen.
    pub emission: f32,
    /// Factor of what diffuse surfaces reflect; 0 leaves what is seen in metal and glass.
    pub diffuse: f32,
}

impl Default for CompositeSettings {
    fn default() -> Self {
        Self {
            output_scale: 1.0,
            direct: 1.0,
            indirect: 1.0,
            caustic: 1.0,
            emission: 1.0,
            diffuse: 1.0,
        }
    }
}

impl CompositeSettings {
    /// With or without caustics and specular surfaces apart from other light.
    pub(super) fn parts(&self, has_caustic: bool, has_specular: bool) -> gpu::Parts {
        gpu::Parts {
            output_scale: self.output_scale,
            direct_weight: self.direct,
            indirect_weight: self.indirect,
            caustic_weight: if has_caustic { self.caustic } else { 0.0 },
            emission_weight: self.emission,
            diffuse_weight: self.diffuse,
            has_specular: has_specular.into(),
        }
    }
}

/// The pass.
#[derive(Debug)]
pub struct Composite {
    pass: FullScreen,
}

/// Uniforms and bind groups for one view.
#[derive(Debug)]
pub struct CompositeResources {
    inner: FullScreenResources,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct CompositeInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// Surfaces. Its view must be set.
    pub g_buffer: &'a GBuffer,
    /// Light straight from sources.
    pub direct: &'a Irradiance,
    /// Light by way of other surfaces.
    pub indirect: &'a Irradiance,
    /// Light by way of specular surfaces alone; `None` where `indirect` holds it.
    pub caustic: Option<&'a Irradiance>,
    /// Radiance of specular surfaces, unit frame; `None`: they are taken for diffuse ones.
    pub specular: Option<&'a Irradiance>,
    /// What is seen where no surface is.
    pub environment: &'a Environment,
    /// Written; of the format that the pass was made for.
    pub radiance: &'a Radiance,
    /// What to show.
    pub settings: &'a CompositeSettings,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl Composite {
    /// The pass for targets of `format`: `rgba32float` unscaled, or a narrower one with a pre-exposure.
    pub fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        Self {
            pass: FullScreen::new(
                device,
                "lightfall::Composite",
                (wgsl::COMPOSITE, &[]),
                &SLOTS,
                &[format],
            ),
        }
    }

    /// Records the sum.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut CompositeResources,
        inputs: &CompositeInputs<'_>,
    ) {
        let parts = inputs
            .settings
            .parts(inputs.caustic.is_some(), inputs.specular.is_some());
        inputs
            .queue
            .write_buffer(&resources.inner.params, 0, bytemuck::bytes_of(&parts));
        let views = inputs.g_buffer.views();
        let bound = [
            inputs.g_buffer.view_buffer().into(),
            (&views.base_color).into(),
            (&views.emission).into(),
            inputs.direct.view().into(),
            inputs.indirect.view().into(),
            inputs.caustic.unwrap_or(inputs.indirect).view().into(),
            inputs.g_buffer.surfaces().into(),
            inputs.specular.unwrap_or(inputs.direct).view().into(),
            inputs.environment.buffer().into(),
            inputs.environment.view().into(),
        ];
        let targets = [inputs.radiance.view()];
        self.pass
            .record(encoder, &mut resources.inner, &bound, &targets, inputs.timestamps);
    }
}

impl CompositeResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        let inner = FullScreenResources::new::<gpu::Parts>(device, "lightfall::Composite::params")?;
        Ok(Self { inner })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.inner.params.size()
    }
}
