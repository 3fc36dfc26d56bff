//! All that follows the hard shadow tests in one pass over the G-buffer: penumbrae are gathered, indirect light is
//! interpolated, direct light is summed, and all of it put together as [`Composite`](super::Composite) does.
//!
//! Inputs: [`GBuffer`], [`Lights`], [`ShadowMaps`], [`PendingPenumbrae`] of [`SoftShadow`](super::SoftShadow) with
//! [`NearestOccluders`], indirect [`Irradiance`] of some [`Subsampling`], what [`SpecularPaths`](super::SpecularPaths) gives,
//! and the [`Environment`]. Output: [`Radiance`]. It stands for the steps of `SoftShadow` after its test,
//! [`Upsampler`](super::Upsampler), [`DirectLight`](super::DirectLight) and `Composite`, and gives what they give with
//! [`ShadowMethod::Disc`](super::ShadowMethod) and samples interpolated at once, to rounding. Between them no visibility, no
//! radius and no irradiance of all pixels is written and read again: `docs/shadows.md` has bytes and times of both.
//!
//! Cost: one full-screen pass; a pixel that may lie in a penumbra takes 4 `search_taps` + `disc_taps` taps of two fetches a
//! light. Source: Yao et al., soft shadows and image-space photon mapping, section 3.4 (soft shadow, up-sampling and sum in one
//! pass), with the changes that the passes it stands for have. Limits: theirs; pixels that up-sampling leaves in doubt are not
//! estimated anew, and there is no irradiance for a host to look at or to filter.

use super::full_screen::{FullScreen, FullScreenResources};
use super::{CompositeSettings, UpsamplerSettings, composite, upsampler};
use crate::gpu::{self as device, Slot};
use crate::resource::{
    Environment, GBuffer, Irradiance, Lights, NearestOccluders, PendingPenumbrae, Radiance, ShadowMaps, Subsampling,
};
use crate::{Error, Timestamps, wgsl};
use std::sync::OnceLock;

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Counts` in `shaders/pass/fused_composite.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Counts {
        pub(crate) lights: u32,
        pub(crate) layers: u32,
        pub(crate) shadow_map_size: u32,
    }
}

/// Bindings of `shaders/pass/fused_composite.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 21] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::UintTexture,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::Uniform,
    Slot::Texture,
    Slot::Storage,
    Slot::Storage,
    Slot::UintArray,
    Slot::TextureArray,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
];

/// The pass. Each of its pipelines is made when it is first recorded.
#[derive(Debug)]
pub struct FusedComposite {
    device: wgpu::Device,
    format: wgpu::TextureFormat,
    /// Without penumbrae, and with.
    passes: [OnceLock<FullScreen>; 2],
}

/// Uniforms and bind groups for one view.
#[derive(Debug)]
pub struct FusedCompositeResources {
    inner: FullScreenResources,
    interpolation: wgpu::Buffer,
    counts: wgpu::Buffer,
    /// Bound where no light has a penumbra.
    hard: (PendingPenumbrae, NearestOccluders),
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct FusedCompositeInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// Surfaces. Its view must be set.
    pub g_buffer: &'a GBuffer,
    /// Sources.
    pub lights: &'a Lights,
    /// What they see.
    pub shadow_maps: &'a ShadowMaps,
    /// What is known of each light's shadow, of the G-buffer's size, and how near to the lights anything stands; `None`, and of
    /// lights beyond its layers: hard shadows.
    pub penumbrae: Option<(&'a PendingPenumbrae, &'a NearestOccluders)>,
    /// Light by way of other surfaces, of the size that `subsampling` makes of the G-buffer's.
    pub indirect: &'a Irradiance,
    /// Where its samples stand.
    pub subsampling: Subsampling,
    /// Which samples a pixel takes.
    pub upsampler: &'a UpsamplerSettings,
    /// Light by way of specular surfaces alone, at all pixels; `None` where `indirect` holds it.
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

impl FusedComposite {
    /// The pass for targets of `format`: `rgba32float` unscaled, or a narrower one with a pre-exposure.
    pub fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        Self {
            device: device.clone(),
            format,
            passes: Default::default(),
        }
    }

    fn pass(&self, has_penumbrae: bool) -> &FullScreen {
        let constants = [("HAS_PENUMBRAE", f64::from(u8::from(has_penumbrae)))];
        let shader = (wgsl::FUSED_COMPOSITE, &constants[..]);
        let label = "lightfall::FusedComposite";
        let new = || FullScreen::new(&self.device, label, shader, &SLOTS, &[self.format]);
        self.passes[usize::from(has_penumbrae)].get_or_init(new)
    }

    /// Records the pass.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut FusedCompositeResources,
        inputs: &FusedCompositeInputs<'_>,
    ) {
        resources.write(inputs);
        let (none, none_near) = &resources.hard;
        let (pending, nearest) = inputs.penumbrae.unwrap_or((none, none_near));
        let views = inputs.g_buffer.views();
        let bound = [
            (&resources.interpolation).into(),
            (&resources.counts).into(),
            inputs.g_buffer.view_buffer().into(),
            (&views.depth).into(),
            (&views.normal).into(),
            (&views.base_color).into(),
            (&views.emission).into(),
            inputs.g_buffer.surfaces().into(),
            inputs.indirect.view().into(),
            inputs.caustic.unwrap_or(inputs.indirect).view().into(),
            inputs.specular.unwrap_or(inputs.indirect).view().into(),
            inputs.environment.buffer().into(),
            inputs.environment.view().into(),
            inputs.lights.buffer().into(),
            inputs.lights.polygons().into(),
            inputs.shadow_maps.view().into(),
            pending.layers().view().into(),
            pending.params().into(),
            nearest.buffer().into(),
            pending.flags().into(),
        ];
        let targets = [inputs.radiance.view()];
        self.pass(inputs.penumbrae.is_some()).record(
            encoder,
            &mut resources.inner,
            &bound,
            &targets,
            inputs.timestamps,
        );
    }
}

impl FusedCompositeResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        let interpolation = "lightfall::FusedComposite::interpolation";
        Ok(Self {
            inner: FullScreenResources::new::<composite::gpu::Parts>(device, "lightfall::FusedComposite::parts")?,
            interpolation: device::uniform_buffer::<upsampler::gpu::Interpolation>(device, interpolation)?,
            counts: device::uniform_buffer::<gpu::Counts>(device, "lightfall::FusedComposite::counts")?,
            hard: (
                PendingPenumbrae::new(device, [1, 1], 1)?,
                NearestOccluders::new(device, 1)?,
            ),
        })
    }

    fn write(&self, inputs: &FusedCompositeInputs<'_>) {
        let parts = inputs
            .settings
            .parts(inputs.caustic.is_some(), inputs.specular.is_some());
        let interpolation = inputs.upsampler.interpolation(inputs.subsampling, Subsampling::Full);
        let counts = gpu::Counts {
            lights: inputs.lights.count(),
            layers: inputs.penumbrae.map_or(0, |p| p.0.lights()),
            shadow_map_size: inputs.shadow_maps.size(),
        };
        let written = [
            (&self.inner.params, bytemuck::bytes_of(&parts)),
            (&self.interpolation, bytemuck::bytes_of(&interpolation)),
            (&self.counts, bytemuck::bytes_of(&counts)),
        ];
        for (buffer, bytes) in written {
            inputs.queue.write_buffer(buffer, 0, bytes);
        }
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        let uniforms = self.inner.params.size() + self.interpolation.size() + self.counts.size();
        uniforms + self.hard.0.memory_use() + self.hard.1.memory_use()
    }
}
