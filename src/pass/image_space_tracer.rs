//! The photon walk through environment maps: scatter, trace, store.
//!
//! Inputs: [`EnvMaps`], [`Photons`] with hop 0. Output: [`Photons`], hops 1 to its number of bounces. Cost: photons ×
//! bounces × fetches a ray: maps × (iterations + 2) by false position, about 30 by the ordered march however many maps
//! there are. Source: Yao et al. 2010, sections 3 and 5; the march is this crate's. Limits: surfaces scatter
//! as Lambertian ones; geometry that no map sees lets rays pass or lose them; what became of every ray is in the photon
//! records ([`TraceStatistics`](super::TraceStatistics) adds them up).

use super::dispatch_64;
use super::photon_walk::{PhotonWalk, PhotonWalkInputs, PhotonWalkResources};
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::{EnvMaps, Photons};
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
}

/// Uniforms and bind groups.
#[derive(Debug)]
pub struct ImageSpaceTracerResources {
    walk: PhotonWalkResources,
    params: wgpu::Buffer,
    groups: BindGroupCache,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct ImageSpaceTracerInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// What photons meet.
    pub env_maps: &'a EnvMaps,
    /// Hop 0 is read, the others are written.
    pub photons: &'a Photons,
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
        let walk = PhotonWalk::new(device, "lightfall::ImageSpaceTracer::walk");
        let layout = device::layout(
            device,
            "lightfall::ImageSpaceTracer",
            wgpu::ShaderStages::COMPUTE,
            &SLOTS,
        );
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
        Self {
            device: device.clone(),
            walk,
            layout,
            walks,
        }
    }

    /// Records the walk.
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
            sample_offset: inputs.sample_offset,
            roulette_from: settings.roulette_from,
        };
        let walk = self.walk.group(&mut resources.walk, &walk);
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
        pass.set_bind_group(0, &walk, &[]);
        pass.set_bind_group(1, &maps, &[]);
        let (groups, _) = dispatch_64(inputs.photons.count());
        pass.dispatch_workgroups(groups[0], groups[1], 1);
    }
}

impl ImageSpaceTracerResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            walk: PhotonWalkResources::new(device, "lightfall::ImageSpaceTracer::walk")?,
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::ImageSpaceTracer::params")?,
            groups: BindGroupCache::default(),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.walk.memory_use() + self.params.size()
    }
}
