//! The energy audit: emitted = absorbed + stored and continuing + escaped + lost, hop by hop.
//!
//! Input: [`Photons`]. Output: five sums a hop, read back by the host. Cost: one read of the photon buffer; meant for
//! measuring, not for every frame. At metal and glass "absorbed" is what their colour takes: glass that reflects takes none, and
//! rough metal a little more.

use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::Photons;
use crate::{Error, Timestamps, read_back, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/trace_statistics.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) photon_count: u32,
    }

    /// Twin of `Sums`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Sums {
        pub(crate) stored: [f32; 4],
        pub(crate) tentative: [f32; 4],
        pub(crate) absorbed: [f32; 4],
        pub(crate) escaped: [f32; 4],
        pub(crate) lost: [f32; 4],
    }
}

/// Bindings of `shaders/pass/trace_statistics.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 3] = [Slot::Uniform, Slot::Storage, Slot::StorageMut];

/// What became of the flux of one hop; unit frame, RGB.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HopStatistics {
    /// Records that arrived at a surface.
    pub stored_count: u64,
    /// Flux that set out: stored + escaped + lost.
    pub emitted: [f32; 3],
    /// Flux that arrived at a surface.
    pub stored: [f32; 3],
    /// Part of `stored` of which the tracer is not sure ([`Photon::TENTATIVE`](crate::resource::Photon::TENTATIVE)).
    pub tentative: [f32; 3],
    /// Part of `stored` that the surface keeps.
    pub absorbed: [f32; 3],
    /// Flux that left the scene.
    pub escaped: [f32; 3],
    /// Flux whose end the tracer could not find.
    pub lost: [f32; 3],
}

/// The pass.
#[derive(Debug)]
pub struct TraceStatistics {
    device: wgpu::Device,
    layout: wgpu::BindGroupLayout,
    sum: wgpu::ComputePipeline,
}

/// Sums of one photon buffer.
#[derive(Debug)]
pub struct TraceStatisticsResources {
    params: wgpu::Buffer,
    hops: wgpu::Buffer,
    groups: BindGroupCache,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct TraceStatisticsInputs<'a> {
    /// For the uniforms.
    pub queue: &'a wgpu::Queue,
    /// What to add up; of the number of bounces that the resources were made for.
    pub photons: &'a Photons,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl TraceStatistics {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let layout = device::layout(
            device,
            "lightfall::TraceStatistics",
            wgpu::ShaderStages::COMPUTE,
            &SLOTS,
        );
        let sum = device::compute_pipeline(
            device,
            &ComputeSpec {
                label: "lightfall::TraceStatistics::sum",
                source: wgsl::TRACE_STATISTICS,
                entry_point: "sum_hops",
                layouts: &[&layout],
                constants: &[],
            },
        );
        Self {
            device: device.clone(),
            layout,
            sum,
        }
    }

    /// Records the sums.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut TraceStatisticsResources,
        inputs: &TraceStatisticsInputs<'_>,
    ) {
        let params = gpu::Params {
            photon_count: inputs.photons.count(),
        };
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let bound = [
            (&resources.params).into(),
            inputs.photons.buffer().into(),
            (&resources.hops).into(),
        ];
        let label = "lightfall::TraceStatistics";
        let group = resources.groups.get(&self.device, label, &self.layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.sum);
        pass.set_bind_group(0, &group, &[]);
        let room = (resources.hops.size() / size_of::<gpu::Sums>() as u64) as u32;
        pass.dispatch_workgroups(room.min(inputs.photons.bounces() + 1), 1, 1);
    }
}

impl TraceStatisticsResources {
    /// Room for the hops of `photons`.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device, photons: &Photons) -> Result<Self, Error> {
        let size = (u64::from(photons.bounces()) + 1) * size_of::<gpu::Sums>() as u64;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        Ok(Self {
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::TraceStatistics::params")?,
            hops: device::buffer(device, "lightfall::TraceStatistics::hops", size, usage)?,
            groups: BindGroupCache::default(),
        })
    }

    /// Waits for the submitted sums. Blocks; for headless use.
    ///
    /// # Errors
    /// [`Error::ReadBack`].
    pub fn read_blocking(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Vec<HopStatistics>, Error> {
        let sums: Vec<gpu::Sums> = read_back::read_buffer_blocking(device, queue, &self.hops)?;
        Ok(sums.iter().map(hop).collect())
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.params.size() + self.hops.size()
    }
}

fn hop(sums: &gpu::Sums) -> HopStatistics {
    let rgb = |v: [f32; 4]| [v[0], v[1], v[2]];
    HopStatistics {
        stored_count: sums.stored[3] as u64,
        emitted: [0, 1, 2].map(|c| sums.stored[c] + sums.escaped[c] + sums.lost[c]),
        stored: rgb(sums.stored),
        tentative: rgb(sums.tentative),
        absorbed: rgb(sums.absorbed),
        escaped: rgb(sums.escaped),
        lost: rgb(sums.lost),
    }
}
