//! Rays against the triangles themselves: lists of rays, closest hit or any hit.
//!
//! Inputs: [`BvhGeometry`], [`Rays`]. Output: hits of [`Rays`]. Cost: a ray visits some ten to thirty nodes of 80 bytes and
//! a few triangles of 48 (`docs/tracing.md`). Sources: Ylitie et al. 2017 (compressed wide trees), Woop et al. 2013
//! (watertight triangles); Yao's general tracer, section 3.2. Limits: geometry that a host deforms on the GPU alone is not
//! in the trees.

use super::dispatch_64;
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::bvh_geometry::BVH_SLOTS;
use crate::resource::{BvhGeometry, Rays};
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

/// Bindings of group 0 of `shaders/pass/bvh_tracer/trace_rays.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 3] = [Slot::Uniform, Slot::Storage, Slot::StorageMut];

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
    layout: wgpu::BindGroupLayout,
    geometry_layout: wgpu::BindGroupLayout,
    /// By [`RayQuery`].
    traces: [wgpu::ComputePipeline; 2],
}

/// Uniforms and bind groups.
#[derive(Debug)]
pub struct BvhTracerResources {
    params: wgpu::Buffer,
    groups: BindGroupCache,
    geometry_groups: BindGroupCache,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct BvhTracerInputs<'a> {
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

impl BvhTracer {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let stages = wgpu::ShaderStages::COMPUTE;
        let layout = device::layout(device, "lightfall::BvhTracer", stages, &SLOTS);
        let geometry_layout = device::layout(device, "lightfall::BvhTracer::geometry", stages, &BVH_SLOTS);
        let trace = |entry_point| {
            device::compute_pipeline(
                device,
                &ComputeSpec {
                    label: "lightfall::BvhTracer::trace",
                    source: wgsl::BVH_TRACER,
                    entry_point,
                    layouts: &[&layout, &geometry_layout],
                    constants: &[],
                },
            )
        };
        let traces = ["trace_closest", "trace_any"].map(trace);
        Self {
            device: device.clone(),
            layout,
            geometry_layout,
            traces,
        }
    }

    /// Records the tracing of a list of rays.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut BvhTracerResources,
        inputs: &BvhTracerInputs<'_>,
    ) {
        let (groups, row) = dispatch_64(inputs.rays.count());
        let params = gpu::Params {
            ray_count: inputs.rays.count(),
            row,
        };
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let label = "lightfall::BvhTracer";
        let bound = [
            (&resources.params).into(),
            inputs.rays.buffer().into(),
            inputs.rays.hits().into(),
        ];
        let group = resources.groups.get(&self.device, label, &self.layout, &bound);
        let bound = inputs.geometry.bound();
        let geometry = resources
            .geometry_groups
            .get(&self.device, label, &self.geometry_layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.traces[inputs.query as usize]);
        pass.set_bind_group(0, &group, &[]);
        pass.set_bind_group(1, &geometry, &[]);
        pass.dispatch_workgroups(groups[0], groups[1], 1);
    }
}

impl BvhTracerResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::BvhTracer::params")?,
            groups: BindGroupCache::default(),
            geometry_groups: BindGroupCache::default(),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.params.size()
    }
}
