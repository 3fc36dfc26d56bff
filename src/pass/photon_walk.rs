//! The photon walk apart from what traces its rays: uniform, bindings and dispatch that all tracers share.

use super::dispatch_64;
use crate::Error;
use crate::gpu::{self as device, BindGroupCache, Slot};
use crate::resource::Photons;

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `WalkParams` in `shaders/pass/photon_walk/params.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct WalkParams {
        pub(crate) photon_count: u32,
        pub(crate) first_hop: u32,
        pub(crate) last_hop: u32,
        pub(crate) roulette_from: u32,
        pub(crate) sample_offset: u32,
        pub(crate) row: u32,
    }
}

/// Bindings of group 0 of `shaders/pass/photon_walk/walk_photons.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 2] = [Slot::Uniform, Slot::StorageMut];

/// Group 0 of a tracer's pipelines.
#[derive(Debug)]
pub(super) struct PhotonWalk {
    device: wgpu::Device,
    label: &'static str,
    pub(super) layout: wgpu::BindGroupLayout,
}

/// Uniform and bind groups.
#[derive(Debug)]
pub(super) struct PhotonWalkResources {
    params: wgpu::Buffer,
    groups: BindGroupCache,
}

/// What a tracer's inputs say of the walk.
#[derive(Clone, Copy)]
pub(super) struct PhotonWalkInputs<'a> {
    pub(super) queue: &'a wgpu::Queue,
    pub(super) photons: &'a Photons,
    pub(super) sample_offset: u32,
    pub(super) roulette_from: u32,
}

impl PhotonWalk {
    /// `label` is the tracer's.
    pub(super) fn new(device: &wgpu::Device, label: &'static str) -> Self {
        Self {
            device: device.clone(),
            label,
            layout: device::layout(device, label, wgpu::ShaderStages::COMPUTE, &SLOTS),
        }
    }

    /// Writes the uniform and returns the bind group.
    pub(super) fn group(&self, resources: &mut PhotonWalkResources, inputs: &PhotonWalkInputs<'_>) -> wgpu::BindGroup {
        let (_, row) = dispatch_64(inputs.photons.count());
        let params = gpu::WalkParams {
            photon_count: inputs.photons.count(),
            first_hop: 1,
            last_hop: inputs.photons.bounces(),
            roulette_from: inputs.roulette_from,
            sample_offset: inputs.sample_offset,
            row,
        };
        let bytes = bytemuck::bytes_of(&params);
        inputs.queue.write_buffer(&resources.params, 0, bytes);
        let bound = [(&resources.params).into(), inputs.photons.buffer().into()];
        resources.groups.get(&self.device, self.label, &self.layout, &bound)
    }
}

impl PhotonWalkResources {
    pub(super) fn new(device: &wgpu::Device, label: &'static str) -> Result<Self, Error> {
        Ok(Self {
            params: device::uniform_buffer::<gpu::WalkParams>(device, label)?,
            groups: BindGroupCache::default(),
        })
    }

    pub(super) fn memory_use(&self) -> u64 {
        self.params.size()
    }
}
