//! The photon walk through environment maps: scatter, trace, store.
//!
//! Inputs: [`EnvMaps`], [`Photons`] with hop 0. Output: [`Photons`], hops 1 to its number of bounces; or one hop, and the
//! list of the rays lost at it, for another tracer ([`SharedHop`]). Cost: photons × bounces × fetches a ray: maps ×
//! (iterations + 2) by false position, about 30 by the ordered march however many maps there are. Source: Yao et al. 2010,
//! sections 3 and 5; the march is this crate's. Limits: surfaces scatter as Lambertian ones; geometry that no map sees lets
//! rays pass or lose them; what became of every ray is in the photon records
//! ([`TraceStatistics`](super::TraceStatistics) adds them up).

use super::photon_walk::{PhotonWalk, PhotonWalkInputs, PhotonWalkResources, PreparedWalk, SharedHop};
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::{EnvMaps, LostRays, Photons};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/image_space_tracer/trace_ray.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) map_count: u32,
        pub(crate) map_size: u32,
        pub(crate) iterations: u32,
        pub(crate) epsilon: f32,
    }
}

/// Bindings of group 1: `shaders/pass/image_space_tracer/trace_ray.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 3] = [Slot::Uniform, Slot::UintArray, Slot::Storage];

/// Bindings of `shaders/pass/image_space_tracer/list_lost.wgsl`, in order.
pub(crate) const LIST_SLOTS: [Slot; 4] = [Slot::Uniform, Slot::Storage, Slot::StorageMut, Slot::StorageMut];

/// How a ray is searched for in the maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TraceMethod {
    /// The paper's: false position in every map; a stored point within a small angle of the ray (ε = 1 − cos ≤ 0.001) is
    /// a hit; nearest of all maps.
    Paper,
    /// False position; a hit meets the texel's plane from the front and within 1.5 texels of its middle; only maps that
    /// see the ray's origin are asked. As many fetches as the paper's, fewer false hits.
    Plane,
    /// Maps in order of distance, marched in equal angles, each continuing where the one before knew no further; plane
    /// test. Most rays end in the first or second map.
    #[default]
    OrderedMarch,
}

/// Speed against accuracy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageSpaceTracerSettings {
    /// How rays are searched for.
    pub method: TraceMethod,
    /// Steps of false position for each map and ray, 1 to 32; the paper uses 5. More cost a fetch each and find a few
    /// more crossings. The ordered march does not use it.
    pub iterations: u32,
    /// Scatterings before Russian roulette may end a path. Lower is faster and noisier.
    pub roulette_from: u32,
}

impl Default for ImageSpaceTracerSettings {
    fn default() -> Self {
        Self {
            method: TraceMethod::OrderedMarch,
            iterations: 8,
            roulette_from: 4,
        }
    }
}

/// ε of Yao et al. 2010, section 8.
const PAPER_EPSILON: f32 = 0.001;

/// The pass.
#[derive(Debug)]
pub struct ImageSpaceTracer {
    device: wgpu::Device,
    walk: PhotonWalk,
    layout: wgpu::BindGroupLayout,
    /// By [`TraceMethod`].
    walks: [wgpu::ComputePipeline; 3],
    list_layout: wgpu::BindGroupLayout,
    count_lost: wgpu::ComputePipeline,
    sum_blocks: wgpu::ComputePipeline,
    write_lost: wgpu::ComputePipeline,
}

/// Uniforms and bind groups.
#[derive(Debug)]
pub struct ImageSpaceTracerResources {
    walk: PhotonWalkResources,
    params: wgpu::Buffer,
    groups: BindGroupCache,
    list_groups: BindGroupCache,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct ImageSpaceTracerInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// What photons meet.
    pub env_maps: &'a EnvMaps,
    /// Hop 0 is read, the others are written; of a shared hop, the one before it and itself.
    pub photons: &'a Photons,
    /// `None`: the whole walk. A hop: this one, whose lost rays are listed.
    pub shared: Option<SharedHop<'a>>,
    /// As for the emitter.
    pub sample_offset: u32,
    /// How to trace.
    pub settings: &'a ImageSpaceTracerSettings,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl ImageSpaceTracer {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let stages = wgpu::ShaderStages::COMPUTE;
        let walk = PhotonWalk::new(device, "lightfall::ImageSpaceTracer::walk");
        let layout = device::layout(device, "lightfall::ImageSpaceTracer", stages, &SLOTS);
        let by_method = |method: TraceMethod| {
            device::compute_pipeline(
                device,
                &ComputeSpec {
                    label: "lightfall::ImageSpaceTracer::walk",
                    source: wgsl::IMAGE_SPACE_TRACER,
                    entry_point: "walk_photons",
                    layouts: &[&walk.layout, &layout],
                    constants: &[("method", f64::from(method as u32))],
                },
            )
        };
        let walks = [TraceMethod::Paper, TraceMethod::Plane, TraceMethod::OrderedMarch].map(by_method);
        let list_layout = device::layout(device, "lightfall::ImageSpaceTracer::list", stages, &LIST_SLOTS);
        let step = |label, entry_point| {
            device::compute_pipeline(
                device,
                &ComputeSpec {
                    label,
                    source: wgsl::IMAGE_SPACE_TRACER_LIST,
                    entry_point,
                    layouts: &[&list_layout],
                    constants: &[],
                },
            )
        };
        Self {
            device: device.clone(),
            walks,
            count_lost: step("lightfall::ImageSpaceTracer::count_lost", "count_lost"),
            sum_blocks: step("lightfall::ImageSpaceTracer::sum_blocks", "sum_blocks"),
            write_lost: step("lightfall::ImageSpaceTracer::write_lost", "write_lost"),
            walk,
            layout,
            list_layout,
        }
    }

    /// Records the walk, or a shared hop and the list of its lost rays.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut ImageSpaceTracerResources,
        inputs: &ImageSpaceTracerInputs<'_>,
    ) {
        let settings = inputs.settings;
        let walk = PhotonWalkInputs {
            queue: inputs.queue,
            photons: inputs.photons,
            shared: inputs.shared,
            sample_offset: inputs.sample_offset,
            roulette_from: settings.roulette_from,
        };
        let Some(walk) = self.walk.prepare(&mut resources.walk, &walk) else {
            return;
        };
        let params = gpu::Params {
            map_count: inputs.env_maps.centers().len() as u32,
            map_size: inputs.env_maps.size(),
            iterations: settings.iterations.clamp(1, 32),
            epsilon: PAPER_EPSILON,
        };
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let bound = [
            (&resources.params).into(),
            inputs.env_maps.view().into(),
            inputs.env_maps.centers_buffer().into(),
        ];
        let label = "lightfall::ImageSpaceTracer";
        let maps = resources.groups.get(&self.device, label, &self.layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.walks[settings.method as usize]);
        pass.set_bind_group(0, &walk.group, &[]);
        pass.set_bind_group(1, &maps, &[]);
        pass.dispatch_workgroups(walk.groups[0], walk.groups[1], 1);
        drop(pass);
        if let Some(hop) = inputs.shared {
            self.record_list(encoder, resources, inputs, (&walk, hop.lost));
        }
    }

    fn record_list(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut ImageSpaceTracerResources,
        inputs: &ImageSpaceTracerInputs<'_>,
        (walk, lost): (&PreparedWalk, &LostRays),
    ) {
        let bound = [
            (&walk.params).into(),
            inputs.photons.buffer().into(),
            lost.buffer().into(),
            lost.blocks().into(),
        ];
        let label = "lightfall::ImageSpaceTracer::list";
        let (groups, layout) = (&mut resources.list_groups, &self.list_layout);
        let group = groups.get(&self.device, label, layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_bind_group(0, &group, &[]);
        let steps = [
            (&self.count_lost, walk.groups),
            (&self.sum_blocks, [1, 1]),
            (&self.write_lost, walk.groups),
        ];
        for (pipeline, [x, y]) in steps {
            pass.set_pipeline(pipeline);
            pass.dispatch_workgroups(x, y, 1);
        }
    }
}

impl ImageSpaceTracerResources {
    /// For the whole walk.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Self::for_shared_hops(device, 0)
    }

    /// For the whole walk, and for up to `bounces` hops that are shared with another tracer.
    ///
    /// # Errors
    /// As [`ImageSpaceTracerResources::new`].
    pub fn for_shared_hops(device: &wgpu::Device, bounces: u32) -> Result<Self, Error> {
        Ok(Self {
            walk: PhotonWalkResources::new(device, "lightfall::ImageSpaceTracer::walk", bounces)?,
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::ImageSpaceTracer::params")?,
            groups: BindGroupCache::default(),
            list_groups: BindGroupCache::for_uses(bounces as usize),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.walk.memory_use() + self.params.size()
    }
}
