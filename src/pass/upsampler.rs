//! Up-sampling: irradiance at every pixel, or at more of them, from an estimate at a part of them.
//!
//! Inputs: [`GBuffer`], coarse [`Irradiance`] of some [`Subsampling`]. Outputs: [`Irradiance`] (`rgba32float`) of all pixels
//! or of a finer [`Subsampling`], and on demand [`MarkedPixels`]: where the samples around a pixel leave in doubt what it
//! shows, for [`PhotonSplatter::record_marked`](super::PhotonSplatter::record_marked). Sources: Yao et al., soft shadows and
//! image-space photon mapping, section 3.5 (joint bilateral interpolation between the four samples around a pixel); Yao et
//! al. 2010, section 6 (level by level, with pixels estimated anew).
//!
//! A pixel is marked where those of the four samples that fit differ by more than `disagreement` of their mean, where they
//! weigh less than a quarter of what four do, and where none fits.
//!
//! A sample weighs as in bilinear interpolation, times how well its normal agrees, times how near it lies to the
//! receiver's tangent plane, by geometric or shading normal; of another surface than the pixel's, by their numbers, it does not
//! count at all. That plane stands for the paper's difference of depth, which
//! a slanted floor has by itself.
//! Distance from it is measured in distances on the screen between receiver and sample, brought to the receiver's depth,
//! so that scale and angle of view play no part. Weights are over clip-space w: what is linear on a plane is reproduced
//! exactly, in any view. Where none of the four fits, the sixteen around are tried; where none of those does, the
//! best-fitting one is taken as it is, and alpha says so.
//!
//! Alpha of the output: 1 where samples fit, 0 where none did or where no surface is seen. There RGB is 0 as well, and
//! where all sixteen samples miss every surface.
//!
//! Cost: pixels, whatever the factor; some thirty texel fetches each. Limits: detail finer than a block is lost where
//! nothing is estimated anew, contact shadows among it; things that no sample sees then take the colour of the best-fitting
//! surface beside them; beyond the outermost samples the outermost counts alone.

use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::{GBuffer, Irradiance, MarkedPixels, Subsampling};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Interpolation` in `shaders/common/interpolate.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Interpolation {
        pub(crate) factor: u32,
        pub(crate) target_factor: u32,
        pub(crate) normal_agreement: f32,
        pub(crate) plane_distance: f32,
        pub(crate) disagreement: f32,
        pub(crate) is_marking: u32,
    }
}

/// Bindings of `shaders/pass/upsampler.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 9] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::UintTexture,
    Slot::Texture,
    Slot::StorageTexture(wgpu::TextureFormat::Rgba32Float),
    Slot::StorageMut,
];

/// Which samples a pixel takes, and which pixels are marked. The fields cost no time here; what is marked costs time where it
/// is estimated anew.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UpsamplerSettings {
    /// Cosine between the shading normals of pixel and sample at and below which the sample is left out, below 1; its
    /// weight rises linearly to 1 where they agree. Higher keeps the sides of an edge apart at flatter edges; lower finds
    /// samples on surfaces that are strongly curved. 0.25, 0.5, 0.75 differ by a hundredth of the error in a hall of pillars
    /// (`docs/tradeoff.md`).
    pub normal_agreement: f32,
    /// How far off the pixel's tangent plane a sample is left out, above 0, as a share of the distance between both as
    /// seen on the screen; its weight falls linearly to there. Lower keeps thinner steps apart; higher finds samples on
    /// surfaces that are curved away from the eye. From 0.05 to 0.4 the error there is the same.
    pub plane_distance: f32,
    /// Difference of the samples around a pixel, as a share of their mean, above which the pixel is marked where marks are
    /// wanted; 0 or more. Lower estimates more pixels anew: 0.4, 0.2, 0.1 take 1.6 and 2.0 times the time for 0.89 and 1.01 of
    /// the error.
    pub disagreement: f32,
}

impl Default for UpsamplerSettings {
    /// 45° lets neighbouring facets share light and keeps the walls of a corner apart, as in density estimation. In a
    /// Cornell box, cosines from 0.3 to 0.9 and distances from 0.25 to 1 come out the same: see `docs/accuracy.md`.
    fn default() -> Self {
        Self {
            normal_agreement: 0.7,
            plane_distance: 0.5,
            disagreement: 0.25,
        }
    }
}

impl UpsamplerSettings {
    /// Without marks.
    pub(super) fn interpolation(&self, samples: Subsampling, target: Subsampling) -> gpu::Interpolation {
        gpu::Interpolation {
            factor: samples.factor(),
            target_factor: target.factor(),
            normal_agreement: self.normal_agreement,
            plane_distance: self.plane_distance,
            disagreement: self.disagreement,
            is_marking: 0,
        }
    }
}

/// The pass.
#[derive(Debug)]
pub struct Upsampler {
    device: wgpu::Device,
    layout: wgpu::BindGroupLayout,
    upsample: wgpu::ComputePipeline,
    count_marks: wgpu::ComputePipeline,
}

/// Uniforms and bind groups for one view.
#[derive(Debug)]
pub struct UpsamplerResources {
    params: wgpu::Buffer,
    /// Bound where no marks are wanted.
    no_marks: wgpu::Buffer,
    groups: BindGroupCache,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct UpsamplerInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// Surfaces to light. Its view must be set.
    pub g_buffer: &'a GBuffer,
    /// The estimate, in any format of [`Irradiance::FORMATS`], of the size that [`Subsampling::size`] makes of the
    /// G-buffer's. Of another size, what both have is used.
    pub coarse: &'a Irradiance,
    /// Where its samples stand.
    pub subsampling: Subsampling,
    /// Which pixels are interpolated: [`Subsampling::Full`] for all, or a finer one than that of the samples.
    pub target: Subsampling,
    /// Written; `rgba32float`, of the size that `target` makes of the G-buffer's.
    pub irradiance: &'a Irradiance,
    /// Written, if it is of that size: pixels that are to be estimated anew.
    pub marked: Option<&'a MarkedPixels>,
    /// Which samples to take.
    pub settings: &'a UpsamplerSettings,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl Upsampler {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let layout = device::layout(device, "lightfall::Upsampler", wgpu::ShaderStages::COMPUTE, &SLOTS);
        let pipeline = |label, entry_point| {
            let spec = ComputeSpec {
                label,
                source: wgsl::UPSAMPLER,
                entry_point,
                layouts: &[&layout],
                constants: &[],
            };
            device::compute_pipeline(device, &spec)
        };
        Self {
            device: device.clone(),
            upsample: pipeline("lightfall::Upsampler::upsample", "upsample_pixels"),
            count_marks: pipeline("lightfall::Upsampler::count_marks", "count_marks"),
            layout,
        }
    }

    /// Records the interpolation.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut UpsamplerResources,
        inputs: &UpsamplerInputs<'_>,
    ) {
        let size = inputs.target.size(inputs.g_buffer.size());
        let marked = inputs.marked.filter(|m| m.size() == size);
        let params = gpu::Interpolation {
            is_marking: u32::from(marked.is_some()),
            ..inputs.settings.interpolation(inputs.subsampling, inputs.target)
        };
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        if let Some(marked) = marked {
            marked.clear(encoder);
        }
        let views = inputs.g_buffer.views();
        let bound = [
            (&resources.params).into(),
            inputs.g_buffer.view_buffer().into(),
            (&views.depth).into(),
            (&views.normal).into(),
            (&views.base_color).into(),
            inputs.g_buffer.surfaces().into(),
            inputs.coarse.view().into(),
            inputs.irradiance.view().into(),
            marked.map_or(&resources.no_marks, MarkedPixels::buffer).into(),
        ];
        let label = "lightfall::Upsampler";
        let group = resources.groups.get(&self.device, label, &self.layout, &bound);
        let [width, height] = size;
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.upsample);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
        if marked.is_some() {
            pass.set_pipeline(&self.count_marks);
            pass.dispatch_workgroups(1, 1, 1);
        }
    }
}

impl UpsamplerResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            params: device::uniform_buffer::<gpu::Interpolation>(device, "lightfall::Upsampler::params")?,
            no_marks: device::buffer(
                device,
                "lightfall::Upsampler::no_marks",
                MarkedPixels::size_in_bytes([1, 1]),
                wgpu::BufferUsages::STORAGE,
            )?,
            groups: BindGroupCache::default(),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.params.size() + self.no_marks.size()
    }
}
