//! Rays against the triangles themselves: the photon walk, and lists of rays.
//!
//! Inputs: [`BvhGeometry`], and [`Photons`] with hop 0, [`Rays`] or [`SurfaceRays`]. Output: [`Photons`], hops 1 to its number
//! of bounces, and hop 0 of those that start on lamps, or of one hop those that another tracer lost ([`SharedHop`]), or hits of
//! [`Rays`] or [`SurfaceRays`]. Cost: a ray visits some ten to thirty nodes of 80 bytes and a few triangles of 48
//! (`docs/tracing.md`). Sources: Ylitie et al. 2017 (compressed wide trees), Woop et al. 2013 (watertight triangles); Yao's
//! general tracer, section 3.2. Limits: geometry that a host deforms on the GPU alone is not in the trees. No ray is lost: it
//! meets a triangle or has escaped.

use super::dispatch_64;
use super::photon_guiding::Guiding;
use super::photon_walk::{PhotonWalk, PhotonWalkInputs, PhotonWalkResources, SharedHop};
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::bvh_geometry::BVH_SLOTS;
use crate::resource::{BvhGeometry, PathList, Photons, Rays, SurfaceRays};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/bvh_tracer/trace_rays.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) ray_count: u32,
        pub(crate) row: u32,
    }
}

/// Bindings of group 0 of `shaders/pass/bvh_tracer/trace_rays.wgsl` and `trace_surface_rays.wgsl`, in order.
pub(crate) const RAY_SLOTS: [Slot; 3] = [Slot::Uniform, Slot::Storage, Slot::StorageMut];

/// What is asked of a ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RayQuery {
    /// What it hits first.
    #[default]
    Closest,
    /// Whether it hits anything; the hit reported is the first one found. Cheaper: for shadows.
    Any,
}

/// The pass.
#[derive(Debug)]
pub struct BvhTracer {
    device: wgpu::Device,
    photon_walk: PhotonWalk,
    ray_layout: wgpu::BindGroupLayout,
    geometry_layout: wgpu::BindGroupLayout,
    walk: wgpu::ComputePipeline,
    walk_listed: wgpu::ComputePipeline,
    /// By [`RayQuery`].
    traces: [wgpu::ComputePipeline; 2],
    trace_surface_rays: wgpu::ComputePipeline,
}

/// Uniforms and bind groups.
#[derive(Debug)]
pub struct BvhTracerResources {
    walk: PhotonWalkResources,
    rays: ListResources,
    surface_rays: ListResources,
    geometry_groups: BindGroupCache,
}

/// Of one kind of list.
#[derive(Debug)]
struct ListResources {
    params: wgpu::Buffer,
    groups: BindGroupCache,
}

/// A list of either kind, and what traces it.
struct ListOfRays<'a> {
    label: &'static str,
    pipeline: &'a wgpu::ComputePipeline,
    count: u32,
    /// Rays, and what they hit.
    buffers: [&'a wgpu::Buffer; 2],
    timestamps: Option<&'a Timestamps>,
}

/// What a frame gives it for the photon walk.
#[derive(Debug, Clone, Copy)]
pub struct BvhTracerInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// What photons meet, of the instances that environment maps see; prepared for this frame.
    pub geometry: &'a BvhGeometry,
    /// Hop 0 is read, and written where it starts on a lamp; the others are written; of a shared hop, the one before it and the
    /// listed slots of its own.
    pub photons: &'a Photons,
    /// `None`: the whole walk. A hop: this one, of the paths that the other tracer has listed.
    pub shared: Option<SharedHop<'a>>,
    /// What guided their emission, if anything did ([`PhotonSpread::Guided`]).
    ///
    /// [`PhotonSpread::Guided`]: super::PhotonSpread::Guided
    pub guiding: Option<Guiding<'a>>,
    /// As for the emitter.
    pub sample_offset: u32,
    /// Scatterings before Russian roulette may end a path. Lower is faster and noisier.
    pub roulette_from: u32,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

/// What a frame gives it for a list of rays.
#[derive(Debug, Clone, Copy)]
pub struct BvhTracerRayInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// What rays meet; prepared for this frame.
    pub geometry: &'a BvhGeometry,
    /// Rays are read, hits are written.
    pub rays: &'a Rays,
    /// What is asked of them.
    pub query: RayQuery,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

/// What a frame gives it for a list of rays that leave surfaces.
#[derive(Debug, Clone, Copy)]
pub struct BvhTracerSurfaceRayInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// What rays meet, of the instances that environment maps see; prepared for this frame.
    pub geometry: &'a BvhGeometry,
    /// Rays are read, what becomes of them is written: none is lost or tentative.
    pub rays: &'a SurfaceRays,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl BvhTracer {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let stages = wgpu::ShaderStages::COMPUTE;
        let photon_walk = PhotonWalk::new(device, "lightfall::BvhTracer::walk");
        let ray_layout = device::layout(device, "lightfall::BvhTracer::rays", stages, &RAY_SLOTS);
        let geometry_layout = device::layout(device, "lightfall::BvhTracer::geometry", stages, &BVH_SLOTS);
        let pipeline = |label, source, entry_point, layouts: &[&wgpu::BindGroupLayout]| {
            device::compute_pipeline(
                device,
                &ComputeSpec {
                    label,
                    source,
                    entry_point,
                    layouts,
                    constants: &[],
                },
            )
        };
        let trace = |entry_point| {
            let layouts = [&ray_layout, &geometry_layout];
            pipeline(
                "lightfall::BvhTracer::trace",
                wgsl::BVH_TRACER_RAYS,
                entry_point,
                &layouts,
            )
        };
        Self {
            device: device.clone(),
            walk: pipeline(
                "lightfall::BvhTracer::walk",
                wgsl::BVH_TRACER,
                "walk_photons",
                &[&photon_walk.layout, &geometry_layout],
            ),
            walk_listed: pipeline(
                "lightfall::BvhTracer::walk_listed",
                wgsl::BVH_TRACER,
                "walk_listed",
                &[&photon_walk.layout, &geometry_layout, &photon_walk.list_layout],
            ),
            traces: ["trace_closest", "trace_any"].map(trace),
            trace_surface_rays: pipeline(
                "lightfall::BvhTracer::trace_surface_rays",
                wgsl::BVH_TRACER_SURFACE_RAYS,
                "trace_surface_rays",
                &[&ray_layout, &geometry_layout],
            ),
            photon_walk,
            ray_layout,
            geometry_layout,
        }
    }

    /// Records the photon walk, or the listed part of a shared hop.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut BvhTracerResources,
        inputs: &BvhTracerInputs<'_>,
    ) {
        self.record_walk(encoder, resources, inputs, inputs.shared.map(|hop| hop.lost));
    }

    /// Records the walk of some paths alone, over what is there.
    pub fn record_listed(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut BvhTracerResources,
        inputs: &BvhTracerInputs<'_>,
        list: &PathList,
    ) {
        self.record_walk(
            encoder,
            resources,
            &BvhTracerInputs {
                shared: None,
                ..*inputs
            },
            Some(list),
        );
    }

    fn record_walk(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut BvhTracerResources,
        inputs: &BvhTracerInputs<'_>,
        list: Option<&PathList>,
    ) {
        let walk = PhotonWalkInputs {
            queue: inputs.queue,
            photons: inputs.photons,
            shared: inputs.shared,
            sample_offset: inputs.sample_offset,
            roulette_from: inputs.roulette_from,
            guiding: inputs.guiding,
        };
        let Some(walk) = self.photon_walk.prepare(&mut resources.walk, &walk) else {
            return;
        };
        let label = "lightfall::BvhTracer";
        let geometry = self.geometry_group(resources, inputs.geometry);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_bind_group(0, &walk.group, &[]);
        pass.set_bind_group(1, &geometry, &[]);
        match list {
            None => {
                pass.set_pipeline(&self.walk);
                pass.dispatch_workgroups(walk.groups[0], walk.groups[1], 1);
            }
            Some(list) => {
                pass.set_pipeline(&self.walk_listed);
                pass.set_bind_group(2, &self.photon_walk.list_group(&mut resources.walk, list), &[]);
                pass.dispatch_workgroups_indirect(list.buffer(), 0);
            }
        }
    }

    /// Records the tracing of a list of rays.
    pub fn record_rays(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut BvhTracerResources,
        inputs: &BvhTracerRayInputs<'_>,
    ) {
        let list = ListOfRays {
            label: "lightfall::BvhTracer::rays",
            pipeline: &self.traces[inputs.query as usize],
            count: inputs.rays.count(),
            buffers: [inputs.rays.buffer(), inputs.rays.hits()],
            timestamps: inputs.timestamps,
        };
        let geometry = self.geometry_group(resources, inputs.geometry);
        self.record_list(encoder, &mut resources.rays, &geometry, (inputs.queue, &list));
    }

    /// Records the tracing of a list of rays that leave surfaces, as [`ImageSpaceTracer`](super::ImageSpaceTracer) does.
    pub fn record_surface_rays(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut BvhTracerResources,
        inputs: &BvhTracerSurfaceRayInputs<'_>,
    ) {
        let list = ListOfRays {
            label: "lightfall::BvhTracer::surface_rays",
            pipeline: &self.trace_surface_rays,
            count: inputs.rays.count(),
            buffers: [inputs.rays.buffer(), inputs.rays.hits()],
            timestamps: inputs.timestamps,
        };
        let geometry = self.geometry_group(resources, inputs.geometry);
        self.record_list(encoder, &mut resources.surface_rays, &geometry, (inputs.queue, &list));
    }

    fn record_list(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        own: &mut ListResources,
        geometry: &wgpu::BindGroup,
        (queue, list): (&wgpu::Queue, &ListOfRays<'_>),
    ) {
        let (groups, row) = dispatch_64(list.count);
        let params = gpu::Params {
            ray_count: list.count,
            row,
        };
        queue.write_buffer(&own.params, 0, bytemuck::bytes_of(&params));
        let [rays, hits] = list.buffers;
        let bound = [(&own.params).into(), rays.into(), hits.into()];
        let rays = own.groups.get(&self.device, list.label, &self.ray_layout, &bound);
        let mut pass = device::compute_pass(encoder, list.label, list.timestamps);
        pass.set_pipeline(list.pipeline);
        pass.set_bind_group(0, &rays, &[]);
        pass.set_bind_group(1, geometry, &[]);
        pass.dispatch_workgroups(groups[0], groups[1], 1);
    }

    fn geometry_group(&self, resources: &mut BvhTracerResources, geometry: &BvhGeometry) -> wgpu::BindGroup {
        let label = "lightfall::BvhTracer::geometry";
        let (groups, layout) = (&mut resources.geometry_groups, &self.geometry_layout);
        groups.get(&self.device, label, layout, &geometry.bound())
    }
}

impl BvhTracerResources {
    /// For the whole walk and for lists of rays.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Self::for_shared_hops(device, 0)
    }

    /// The same, and for up to `bounces` hops that are shared with another tracer.
    ///
    /// # Errors
    /// As [`BvhTracerResources::new`].
    pub fn for_shared_hops(device: &wgpu::Device, bounces: u32) -> Result<Self, Error> {
        Ok(Self {
            walk: PhotonWalkResources::new(device, "lightfall::BvhTracer::walk", bounces)?,
            rays: ListResources::new(device)?,
            surface_rays: ListResources::new(device)?,
            geometry_groups: BindGroupCache::default(),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.walk.memory_use() + self.rays.params.size() + self.surface_rays.params.size()
    }
}

impl ListResources {
    fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::BvhTracer::params")?,
            groups: BindGroupCache::default(),
        })
    }
}
