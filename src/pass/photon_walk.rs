//! The photon walk apart from what traces its rays: uniforms, bindings and dispatch that all tracers share.

use super::dispatch_64;
use super::photon_guiding::Guiding;
use crate::Error;
use crate::gpu::{self as device, BindGroupCache, Slot};
use crate::resource::{GuidingTables, PathList, Photons};

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
        pub(crate) is_shared: u32,
        pub(crate) map: u32,
        pub(crate) guided: f32,
    }
}

/// Bindings of group 0 of `shaders/pass/photon_walk/walk_photons.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 3] = [Slot::Uniform, Slot::StorageMut, Slot::Storage];

/// Bindings of group 2 of `shaders/pass/photon_walk/walk_listed.wgsl`.
pub(crate) const LIST_SLOTS: [Slot; 1] = [Slot::Storage];

/// One hop of a walk that two tracers share. The first walks it for all paths and lists those that it lost; the second
/// walks it again for these. Then comes the next hop.
#[derive(Debug, Clone, Copy)]
pub struct SharedHop<'a> {
    /// From 1 to the number of bounces, and before them 0 where photons start on surfaces of lights. Others, and those that
    /// the tracer's resources have no room for, are left out.
    pub number: u32,
    /// The paths lost at this hop, of those that it has room for.
    pub lost: &'a PathList,
}

/// Group 0 of a tracer's pipelines.
#[derive(Debug)]
pub(super) struct PhotonWalk {
    device: wgpu::Device,
    label: &'static str,
    pub(super) layout: wgpu::BindGroupLayout,
    /// Of the list of some paths.
    pub(super) list_layout: wgpu::BindGroupLayout,
}

/// Uniforms and bind groups.
#[derive(Debug)]
pub(super) struct PhotonWalkResources {
    /// Of the whole walk, then of each shared hop from 0 on: all hops of a frame are in one submission.
    params: Vec<wgpu::Buffer>,
    /// Bound where no tables guide the walk.
    no_tables: wgpu::Buffer,
    groups: BindGroupCache,
    list_groups: BindGroupCache,
}

/// What a tracer's inputs say of the walk.
#[derive(Clone, Copy)]
pub(super) struct PhotonWalkInputs<'a> {
    pub(super) queue: &'a wgpu::Queue,
    pub(super) photons: &'a Photons,
    pub(super) shared: Option<SharedHop<'a>>,
    pub(super) sample_offset: u32,
    pub(super) roulette_from: u32,
    pub(super) guiding: Option<Guiding<'a>>,
}

/// The uniform of a walk, written, and group 0.
pub(super) struct PreparedWalk {
    pub(super) params: wgpu::Buffer,
    pub(super) group: wgpu::BindGroup,
    /// Workgroups for all paths.
    pub(super) groups: [u32; 2],
}

impl PhotonWalk {
    /// `label` is the tracer's.
    pub(super) fn new(device: &wgpu::Device, label: &'static str) -> Self {
        Self {
            device: device.clone(),
            label,
            layout: device::layout(device, label, wgpu::ShaderStages::COMPUTE, &SLOTS),
            list_layout: device::layout(device, label, wgpu::ShaderStages::COMPUTE, &LIST_SLOTS),
        }
    }

    /// What says which paths are walked, of some.
    pub(super) fn list_group(&self, resources: &mut PhotonWalkResources, list: &PathList) -> wgpu::BindGroup {
        let (groups, layout) = (&mut resources.list_groups, &self.list_layout);
        groups.get(&self.device, self.label, layout, &[list.buffer().into()])
    }

    /// Writes the uniform; `None` for a hop that there is not, or no room for.
    pub(super) fn prepare(
        &self,
        resources: &mut PhotonWalkResources,
        inputs: &PhotonWalkInputs<'_>,
    ) -> Option<PreparedWalk> {
        let bounces = inputs.photons.bounces();
        let (place, hops) = match inputs.shared {
            None => (0, [0, bounces]),
            Some(hop) if hop.number <= bounces => (hop.number as usize + 1, [hop.number; 2]),
            Some(_) => return None,
        };
        let buffer = resources.params.get(place)?;
        let (groups, row) = dispatch_64(inputs.photons.count());
        let params = gpu::WalkParams {
            photon_count: inputs.photons.count(),
            first_hop: hops[0],
            last_hop: hops[1],
            roulette_from: inputs.roulette_from,
            sample_offset: inputs.sample_offset,
            row,
            is_shared: u32::from(inputs.shared.is_some()),
            map: inputs.photons.map() as u32,
            guided: inputs.guiding.map_or(0.0, |guiding| guiding.share()),
        };
        inputs.queue.write_buffer(buffer, 0, bytemuck::bytes_of(&params));
        let tables = inputs
            .guiding
            .map_or(&resources.no_tables, |guiding| guiding.tables.reflection());
        let bound = [buffer.into(), inputs.photons.buffer().into(), tables.into()];
        Some(PreparedWalk {
            params: buffer.clone(),
            group: resources.groups.get(&self.device, self.label, &self.layout, &bound),
            groups,
        })
    }
}

impl PhotonWalkResources {
    /// For the whole walk and, if any are shared, hops 0 to `shared_hops`.
    pub(super) fn new(device: &wgpu::Device, label: &'static str, shared_hops: u32) -> Result<Self, Error> {
        let uses = if shared_hops == 0 { 1 } else { shared_hops + 2 };
        let params = (0..uses)
            .map(|_| device::uniform_buffer::<gpu::WalkParams>(device, label))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            groups: BindGroupCache::for_uses(params.len()),
            // Of what two tracers share, or of probes and of what these say to trace anew.
            list_groups: BindGroupCache::for_uses(2),
            params,
            no_tables: GuidingTables::no_reflection(device, label)?,
        })
    }

    pub(super) fn memory_use(&self) -> u64 {
        self.params.iter().map(wgpu::Buffer::size).sum::<u64>() + self.no_tables.size()
    }
}
