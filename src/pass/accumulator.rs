//! Plain mean of frames, in f32: with a jittered camera and fresh photons every frame, noise falls and edges smooth.
//!
//! Input: [`Radiance`] of a frame. Output: the mean so far, in which each of n frames weighs 1/n; it begins anew when what it
//! shows changes ([`AccumulatorResources::follow`]). Cost: one full-screen pass and three textures. Limits: blur of the
//! density estimate falls only as far as its kernels narrow with the frames ([`progressive_scale`](super::progressive_scale)).

use super::full_screen::{FullScreen, FullScreenResources};
use crate::gpu::{self as device, Slot};
use crate::resource::Radiance;
use crate::{Error, Timestamps, wgsl};

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
            usage: U::RENDER_ATTACHMENT | U::TEXTURE_BINDING,
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

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}
