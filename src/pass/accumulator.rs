//! Plain mean of frames, in f32: with a jittered camera and fresh photons every frame, noise falls and edges smooth.
//!
//! Input: [`Radiance`] of a frame. Output: the mean so far, in which each of n frames weighs 1/n; it begins anew when what it
//! shows changes ([`AccumulatorResources::follow`]); and how noisy that still is
//! ([`AccumulatorResources::relative_variance_blocking`]). Cost: one full-screen pass and three textures. Limits: blur of the
//! density estimate falls only as far as its kernels narrow with the frames ([`progressive_scale`](super::progressive_scale)).

use super::full_screen::{FullScreen, FullScreenResources};
use crate::gpu::{self as device, Slot};
use crate::resource::Radiance;
use crate::{Error, Timestamps, read_rgba32float_blocking, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/accumulator.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) frames: f32,
        pub(crate) mean_weight: f32,
    }
}

/// Bindings of `shaders/pass/accumulator.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 3] = [Slot::Uniform, Slot::Texture, Slot::Texture];

/// Part of the mean radiance that stands in for the radiance of black pixels, as in [`metrics`](crate::reference::metrics).
const BLACK_GUARD: f64 = 0.01;

/// The pass.
#[derive(Debug)]
pub struct Accumulator {
    pass: FullScreen,
}

/// Sums so far of one view.
#[derive(Debug)]
pub struct AccumulatorResources {
    inner: FullScreenResources,
    sums: [wgpu::TextureView; 2],
    mean: Radiance,
    frames: u32,
    /// What they show.
    subject: Option<u64>,
    bytes: u64,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct AccumulatorInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// The frame to add.
    pub radiance: &'a Radiance,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl Accumulator {
    const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let formats = [Self::FORMAT; 2];
        Self {
            pass: FullScreen::new(
                device,
                "lightfall::Accumulator",
                (wgsl::ACCUMULATOR, &[]),
                &SLOTS,
                &formats,
            ),
        }
    }

    /// Records the addition of one frame. One call a submission: its uniforms land before the whole submission.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut AccumulatorResources,
        inputs: &AccumulatorInputs<'_>,
    ) {
        let (target, history) = match resources.frames % 2 {
            0 => (&resources.sums[0], &resources.sums[1]),
            _ => (&resources.sums[1], &resources.sums[0]),
        };
        let params = gpu::Params {
            frames: resources.frames as f32,
            mean_weight: 1.0 / (resources.frames + 1) as f32,
        };
        resources.frames += 1;
        inputs
            .queue
            .write_buffer(&resources.inner.params, 0, bytemuck::bytes_of(&params));
        let bound = [inputs.radiance.view().into(), history.into()];
        let targets = [target, resources.mean.view()];
        self.pass
            .record(encoder, &mut resources.inner, &bound, &targets, inputs.timestamps);
    }
}

impl AccumulatorResources {
    /// Sums for images of `size`.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, size: [u32; 2]) -> Result<Self, Error> {
        use wgpu::TextureUsages as U;
        let spec = device::TextureSpec {
            label: "lightfall::Accumulator::sum",
            size,
            layers: 1,
            format: Accumulator::FORMAT,
            usage: U::RENDER_ATTACHMENT | U::TEXTURE_BINDING | U::COPY_SRC,
        };
        let view = || Ok::<_, Error>(device::texture(device, &spec)?.create_view(&Default::default()));
        let inner = FullScreenResources::new::<gpu::Params>(device, "lightfall::Accumulator::params")?;
        let mean = Radiance::new(device, size)?;
        Ok(Self {
            bytes: 2 * spec.bytes() + mean.memory_use() + inner.params.size(),
            inner,
            sums: [view()?, view()?],
            mean,
            frames: 0,
            subject: None,
        })
    }

    /// Says what the next frame shows, by a number that is another one whenever that has changed:
    /// [`GiRenderer::subject`](crate::frame::GiRenderer::subject), or a host's own. On another number than the last one all
    /// frames are forgotten. Returns how many are in the mean.
    pub fn follow(&mut self, subject: u64) -> u32 {
        if self.subject.replace(subject).is_some_and(|last| last != subject) {
            self.restart();
        }
        self.frames
    }

    /// Forgets all frames.
    pub fn restart(&mut self) {
        self.frames = 0;
    }

    /// Frames in the mean.
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// The mean of all frames since the last restart.
    pub fn mean(&self) -> &Radiance {
        &self.mean
    }

    /// The noise left in the mean, told by how far frames spread: relMSE ([`metrics`](crate::reference::metrics)) that is
    /// variance, of the sum of the channels; infinite with fewer than two frames. Photons of one sequence are spread more evenly
    /// over many frames than by chance, so that the mean is nearer to the truth than this says; blur, which all frames share, is
    /// no part of it. Submits and waits.
    ///
    /// # Errors
    /// [`Error::ReadBack`], [`Error::LimitExceeded`].
    pub fn relative_variance_blocking(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<f64, Error> {
        if self.frames < 2 {
            return Ok(f64::INFINITY);
        }
        let last = self.sums[(self.frames as usize - 1) % 2].texture();
        let texels = read_rgba32float_blocking(device, queue, last)?;
        let frames = f64::from(self.frames);
        let light = |texel: &[f32; 4]| texel[..3].iter().map(|&v| f64::from(v)).sum::<f64>() / frames;
        let count = texels.len().max(1) as f64;
        let guard = BLACK_GUARD * texels.iter().map(light).sum::<f64>() / count;
        let of_pixel = |texel: &[f32; 4]| {
            let (squared, variance) = (light(texel).powi(2), f64::from(texel[3]) / (frames * (frames - 1.0)));
            if squared > 0.0 { variance * squared / (squared + guard * guard) } else { 0.0 }
        };
        Ok(texels.iter().map(of_pixel).sum::<f64>() / count)
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}
