//! Plain mean of frames, in f32: with a jittered camera and fresh photons every frame, noise falls and edges smooth.
//!
//! Input: [`Radiance`] of a frame. Output: the mean so far, in which each of n frames weighs 1/n; it begins anew when what it
//! shows changes ([`AccumulatorResources::follow`]); and how noisy that still is
//! ([`AccumulatorResources::relative_variance_blocking`]). Cost: one full-screen pass and four textures. Limits: blur of the
//! density estimate falls only as far as its kernels narrow with the frames ([`progressive_scale`](super::progressive_scale)).

use super::full_screen::{FullScreen, FullScreenResources};
use crate::gpu::{self as device, Slot};
use crate::resource::{BLACK_GUARD, Radiance};
use crate::{Error, Timestamps, read_rgba32float_blocking, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/accumulator.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) history_weight: f32,
        pub(crate) mean_weight: f32,
    }
}

/// Bindings of `shaders/pass/accumulator.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 3] = [Slot::Uniform, Slot::Texture, Slot::Texture];

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
    /// The sum as it was when the number of its frames was last a power of two below the present one.
    part: wgpu::TextureView,
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
            history_weight: if resources.frames == 0 { 0.0 } else { 1.0 },
            mean_weight: 1.0 / (resources.frames + 1) as f32,
        };
        if resources.frames.is_power_of_two() {
            let (sum, part) = (history.texture(), resources.part.texture());
            encoder.copy_texture_to_texture(sum.as_image_copy(), part.as_image_copy(), sum.size());
        }
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
            usage: U::RENDER_ATTACHMENT | U::TEXTURE_BINDING | U::COPY_SRC | U::COPY_DST,
        };
        let view = || Ok::<_, Error>(device::texture(device, &spec)?.create_view(&Default::default()));
        let inner = FullScreenResources::new::<gpu::Params>(device, "lightfall::Accumulator::params")?;
        let mean = Radiance::new(device, size)?;
        Ok(Self {
            bytes: 3 * spec.bytes() + mean.memory_use() + inner.params.size(),
            inner,
            sums: [view()?, view()?],
            part: view()?,
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

    /// The noise left in the mean, told by how far the mean of the first frames, some power of two and at least half of them,
    /// is from that of the others: relMSE as in `reference::metrics` of all pixels, as far as it is variance; infinite with
    /// fewer than two frames. Where the camera is jittered, what that changes at edges counts; blur, which all frames share,
    /// does not. Submits and waits.
    ///
    /// # Errors
    /// [`Error::ReadBack`], [`Error::LimitExceeded`].
    pub fn relative_variance_blocking(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<f64, Error> {
        if self.frames < 2 {
            return Ok(f64::INFINITY);
        }
        let all = self.sums[(self.frames as usize - 1) % 2].texture();
        let [all, part] = [all, self.part.texture()].map(|sum| read_rgba32float_blocking(device, queue, sum));
        let (all, part) = (all?, part?);
        // The largest power of two below.
        let first = f64::from(1 << (self.frames - 1).ilog2());
        let frames = f64::from(self.frames);
        let pairs = || {
            let channels = |(all, part): (&[f32; 4], &[f32; 4])| [0, 1, 2].map(|c| [all[c], part[c]].map(f64::from));
            all.iter().zip(&part).flat_map(channels)
        };
        let count = pairs().count().max(1) as f64;
        let guard = BLACK_GUARD * pairs().map(|[all, _]| all / frames).sum::<f64>() / count;
        let relative = |[all, part]: [f64; 2]| {
            let (mean, apart) = (all / frames, part / first - (all - part) / (frames - first));
            let scale = mean * mean + guard * guard;
            // Of the means of two parts, each with the variance of a frame over its frames.
            let variance = apart * apart * first * (frames - first) / (frames * frames);
            if scale > 0.0 { variance / scale } else { 0.0 }
        };
        Ok(pairs().map(relative).sum::<f64>() / count)
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}
