//! Photons to surface lights: each path replaces the oldest of a pool, whose light is taken back; or a light at each impact.
//!
//! Inputs: new [`Photons`], [`SurfaceLights`]. Outputs: their flux, and the [`PhotonPool`]. Source: photon streaming with
//! virtual surface lights, section 0.5 and Algorithm 2, with changes: an impact counts the flux that its surface sends *on*;
//! the pool holds whole paths, each of the flux that one of as many emitted at once has, so that its energy is the lights';
//! fluxes are whole numbers, so that sums never drift, rounded by chance that belongs to the place in the pool. A light shines
//! from where that of its impacts arrived that is nearest to its place: places may be hidden, and what no light reaches should
//! not shine (`docs/surface_lights.md`). [`PhotonStream::record_at_impacts`] is instant radiosity (Keller 1997), the paper's
//! baseline. For what lights that are discs lose near by one photon of a path is kept ([`PhotonPool::keep_near`]): splatted, it
//! brings that back.
//!
//! Cost: impacts of the new paths; of each, the cells of the grid around it up to the nearest light; two looks at each impact
//! of the pool. Limits: diffuse surfaces alone send light on here; what glossy ones reflect is photons' matter.

use super::dispatch_64;
use super::photon_walk::LIST_SLOTS;
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::{PathList, PhotonPool, Photons, SurfaceLights};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/photon_stream/params.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) path_count: u32,
        pub(crate) hop_count: u32,
        pub(crate) first_path: u32,
        pub(crate) pool_count: u32,
        pub(crate) row: u32,
        pub(crate) share: f32,
        pub(crate) keeps_changes: u32,
    }

    /// Twin of `Params` in `shaders/pass/photon_stream/place_lights.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct PlaceParams {
        pub(crate) slot_count: u32,
        pub(crate) light_count: u32,
        pub(crate) row: u32,
    }
}

/// Bindings of `shaders/pass/photon_stream/stream_impacts.wgsl`, in order.
pub(crate) const STREAM_SLOTS: [Slot; 8] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::StorageMut,
];

/// Bindings of `shaders/pass/photon_stream/place_lights.wgsl`, in order.
pub(crate) const PLACE_SLOTS: [Slot; 5] = [
    Slot::Uniform,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageMut,
    Slot::StorageMut,
];

/// Bindings of `shaders/pass/photon_stream/keep_near.wgsl`, in order.
pub(crate) const NEAR_SLOTS: [Slot; 5] = [
    Slot::Uniform,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageMut,
];

/// Bindings of `shaders/pass/photon_stream/lights_at_impacts.wgsl`, in order.
pub(crate) const IMPACT_SLOTS: [Slot; 5] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Storage,
    Slot::StorageMut,
    Slot::StorageMut,
];

/// The pass.
#[derive(Debug)]
pub struct PhotonStream {
    device: wgpu::Device,
    stream_layout: wgpu::BindGroupLayout,
    impact_layout: wgpu::BindGroupLayout,
    stream: wgpu::ComputePipeline,
    /// Of the list of some paths.
    list_layout: wgpu::BindGroupLayout,
    stream_listed: wgpu::ComputePipeline,
    near_layout: wgpu::BindGroupLayout,
    keep_near: wgpu::ComputePipeline,
    place_layout: wgpu::BindGroupLayout,
    /// Of each light the nearest impact: how far, which, and so where.
    places: [wgpu::ComputePipeline; 3],
    at_impacts: wgpu::ComputePipeline,
}

/// Uniforms and bind groups.
#[derive(Debug)]
pub struct PhotonStreamResources {
    params: wgpu::Buffer,
    place_params: wgpu::Buffer,
    place_groups: BindGroupCache,
    stream_groups: BindGroupCache,
    list_groups: BindGroupCache,
    near_groups: BindGroupCache,
    impact_groups: BindGroupCache,
}

/// What a frame gives it.
#[derive(Debug)]
pub struct PhotonStreamInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// The new paths, traced: no more than the pool holds, of as many hops. Emitted from [`PhotonPool::next`] of the random
    /// sequence on, and as if there were no others.
    pub photons: &'a Photons,
    /// The others.
    pub pool: &'a mut PhotonPool,
    /// Where they stand this frame is written.
    pub lights: &'a SurfaceLights,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

/// What a frame gives it for lights at impacts.
#[derive(Debug)]
pub struct ImpactLightInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// Traced; of as many slots as there is room for lights, or fewer.
    pub photons: &'a Photons,
    /// Written.
    pub lights: &'a mut SurfaceLights,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl PhotonStream {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let stage = wgpu::ShaderStages::COMPUTE;
        let stream_layout = device::layout(device, "lightfall::PhotonStream", stage, &STREAM_SLOTS);
        let impact_layout = device::layout(device, "lightfall::PhotonStream::impacts", stage, &IMPACT_SLOTS);
        let list_layout = device::layout(device, "lightfall::PhotonStream::list", stage, &LIST_SLOTS);
        let near_layout = device::layout(device, "lightfall::PhotonStream::near", stage, &NEAR_SLOTS);
        let place_layout = device::layout(device, "lightfall::PhotonStream::places", stage, &PLACE_SLOTS);
        let pipeline = |label, source, entry_point, layouts: &[&wgpu::BindGroupLayout]| {
            let spec = ComputeSpec {
                label,
                source,
                entry_point,
                layouts,
                constants: &[],
            };
            device::compute_pipeline(device, &spec)
        };
        let places = ["find_distances", "find_slots", "place_lights"].map(|entry_point| {
            let source = wgsl::PHOTON_STREAM_PLACES;
            pipeline("lightfall::PhotonStream::places", source, entry_point, &[&place_layout])
        });
        Self {
            device: device.clone(),
            stream: pipeline(
                "lightfall::PhotonStream",
                wgsl::PHOTON_STREAM,
                "stream_impacts",
                &[&stream_layout],
            ),
            stream_listed: pipeline(
                "lightfall::PhotonStream::listed",
                wgsl::PHOTON_STREAM,
                "stream_listed",
                &[&stream_layout, &list_layout],
            ),
            keep_near: pipeline(
                "lightfall::PhotonStream::near",
                wgsl::PHOTON_STREAM_NEAR,
                "keep_near",
                &[&near_layout],
            ),
            places,
            at_impacts: pipeline(
                "lightfall::PhotonStream::impacts",
                wgsl::PHOTON_STREAM_AT_IMPACTS,
                "lights_at_impacts",
                &[&impact_layout],
            ),
            stream_layout,
            list_layout,
            near_layout,
            place_layout,
            impact_layout,
        }
    }

    /// Records the exchange of the oldest paths for the new ones.
    ///
    /// # Errors
    /// [`Error::CountMismatch`] for more paths than the pool holds, or of another number of hops; nothing is recorded then.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut PhotonStreamResources,
        inputs: &mut PhotonStreamInputs<'_>,
    ) -> Result<(), Error> {
        let (paths, hops) = checked_paths(inputs, inputs.photons.count() > inputs.pool.paths())?;
        let (first_path, is_stale) = inputs.pool.advance(paths);
        if is_stale {
            encoder.clear_buffer(inputs.pool.buffer(), 0, None);
            if let Some(near) = inputs.pool.near() {
                encoder.clear_buffer(near.buffer(), 0, None);
            }
            inputs.lights.clear_flux(encoder);
        }
        if paths == 0 || inputs.lights.count() == 0 {
            return Ok(());
        }
        let (groups, row) = dispatch_64(paths * inputs.pool.hops());
        let group = self.stream_group(resources, inputs, [hops, first_path, row]);
        let label = "lightfall::PhotonStream";
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.stream);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(groups[0], groups[1], 1);
        drop(pass);
        self.record_near(encoder, resources, inputs, groups);
        self.record_places(encoder, resources, inputs);
        Ok(())
    }

    /// Records that some of the paths have become other ones, where the pool holds all photons that there are: nothing else of
    /// it changes, nor do photons near by, if it keeps them. Follow it with [`PhotonStream::record_places`].
    ///
    /// # Errors
    /// [`Error::CountMismatch`] for another number of paths than the pool holds, or of hops; nothing is recorded then.
    pub fn record_listed(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut PhotonStreamResources,
        inputs: &PhotonStreamInputs<'_>,
        list: &PathList,
    ) -> Result<(), Error> {
        let (_, hops) = checked_paths(inputs, inputs.photons.count() != inputs.pool.paths())?;
        if inputs.lights.count() == 0 {
            return Ok(());
        }
        let group = self.stream_group(resources, inputs, [hops, 0, 0]);
        let label = "lightfall::PhotonStream";
        let bound = [list.buffer().into()];
        let listed = resources
            .list_groups
            .get(&self.device, label, &self.list_layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.stream_listed);
        pass.set_bind_group(0, &group, &[]);
        pass.set_bind_group(1, &listed, &[]);
        pass.dispatch_workgroups_indirect(list.buffer(), 0);
        Ok(())
    }

    /// Uniform and bindings of an exchange.
    fn stream_group(
        &self,
        resources: &mut PhotonStreamResources,
        inputs: &PhotonStreamInputs<'_>,
        [hops, first_path, row]: [u32; 3],
    ) -> wgpu::BindGroup {
        let params = gpu::Params {
            path_count: inputs.photons.count(),
            hop_count: hops,
            first_path,
            pool_count: inputs.pool.paths(),
            row,
            share: (f64::from(inputs.photons.count()) / f64::from(inputs.pool.paths())) as f32,
            keeps_changes: u32::from(inputs.pool.notes_changes()),
        };
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let bound = [
            (&resources.params).into(),
            inputs.lights.grid().into(),
            inputs.photons.buffer().into(),
            inputs.lights.records().into(),
            inputs.lights.cells().into(),
            inputs.pool.buffer().into(),
            inputs.lights.flux().into(),
            inputs.lights.changes().into(),
        ];
        let label = "lightfall::PhotonStream";
        resources
            .stream_groups
            .get(&self.device, label, &self.stream_layout, &bound)
    }

    /// Records what is kept of new paths near by, behind their exchange and with its uniform.
    fn record_near(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut PhotonStreamResources,
        inputs: &PhotonStreamInputs<'_>,
        groups: [u32; 2],
    ) {
        let Some(near) = inputs.pool.near() else {
            return;
        };
        let bound = [
            (&resources.params).into(),
            inputs.photons.buffer().into(),
            inputs.lights.records().into(),
            inputs.pool.buffer().into(),
            near.buffer().into(),
        ];
        let label = "lightfall::PhotonStream::near";
        let group = resources
            .near_groups
            .get(&self.device, label, &self.near_layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.keep_near);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(groups[0], groups[1], 1);
    }

    /// Records from where lights shine, as `record` does at its end: for frames in which lights moved and no photons are
    /// streamed.
    pub fn record_places(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut PhotonStreamResources,
        inputs: &PhotonStreamInputs<'_>,
    ) {
        let slots = inputs.pool.paths() * inputs.pool.hops();
        let (groups, row) = dispatch_64(slots);
        let params = gpu::PlaceParams {
            slot_count: slots,
            light_count: inputs.lights.count(),
            row,
        };
        inputs
            .queue
            .write_buffer(&resources.place_params, 0, bytemuck::bytes_of(&params));
        encoder.clear_buffer(inputs.lights.nearest(), 0, None);
        let bound = [
            (&resources.place_params).into(),
            inputs.pool.buffer().into(),
            inputs.lights.records().into(),
            inputs.lights.nearest().into(),
            inputs.lights.shining().into(),
        ];
        let label = "lightfall::PhotonStream::places";
        let group = resources
            .place_groups
            .get(&self.device, label, &self.place_layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_bind_group(0, &group, &[]);
        let [distances, slots, places] = &self.places;
        for pipeline in [distances, slots] {
            pass.set_pipeline(pipeline);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
        }
        pass.set_pipeline(places);
        pass.dispatch_workgroups(inputs.lights.count().div_ceil(64), 1, 1);
    }

    /// Records a light at each impact.
    ///
    /// # Errors
    /// [`Error::CountMismatch`] for more slots than there is room for lights.
    pub fn record_at_impacts(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut PhotonStreamResources,
        inputs: &mut ImpactLightInputs<'_>,
    ) -> Result<(), Error> {
        let photons = inputs.photons;
        if photons.slots() > inputs.lights.capacity() {
            return Err(Error::CountMismatch {
                what: "photons for lights at impacts (most lights that there is room for)",
                expected: inputs.lights.capacity() as usize,
                found: photons.slots() as usize,
            });
        }
        inputs.lights.stand_at_impacts(inputs.queue, photons.slots());
        let (groups, row) = dispatch_64(photons.slots());
        let params = gpu::Params {
            path_count: photons.count(),
            hop_count: photons.bounces() + 1,
            first_path: 0,
            pool_count: photons.count(),
            row,
            share: 1.0,
            keeps_changes: 0,
        };
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let bound = [
            (&resources.params).into(),
            inputs.lights.grid().into(),
            photons.buffer().into(),
            inputs.lights.shining().into(),
            inputs.lights.flux().into(),
        ];
        let label = "lightfall::PhotonStream::impacts";
        let group = resources
            .impact_groups
            .get(&self.device, label, &self.impact_layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.at_impacts);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(groups[0], groups[1], 1);
        Ok(())
    }
}

/// Paths, and hops whose light goes on.
fn checked_paths(inputs: &PhotonStreamInputs<'_>, is_other_number: bool) -> Result<(u32, u32), Error> {
    let (photons, pool) = (inputs.photons, &*inputs.pool);
    let paths = photons.count();
    // What arrives last is of use near by, or for what it changes, alone.
    let ends = pool.near().is_some() || pool.notes_changes();
    let hops = photons.bounces() + u32::from(!ends);
    let kept = hops + u32::from(pool.notes_changes());
    for (what, expected, found, is_bad) in [
        (
            "photons to stream (what the pool holds)",
            pool.paths(),
            paths,
            is_other_number,
        ),
        (
            "hops of photons to stream (as many as the pool has; one more where it keeps those near by)",
            pool.hops(),
            kept,
            kept != pool.hops(),
        ),
    ] {
        if is_bad {
            let (expected, found) = (expected as usize, found as usize);
            return Err(Error::CountMismatch { what, expected, found });
        }
    }
    Ok((paths, hops))
}

impl PhotonStreamResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::PhotonStream::params")?,
            place_params: device::uniform_buffer::<gpu::PlaceParams>(device, "lightfall::PhotonStream::place_params")?,
            place_groups: BindGroupCache::default(),
            stream_groups: BindGroupCache::default(),
            // Of probes, and of what these say to trace anew.
            list_groups: BindGroupCache::for_uses(2),
            near_groups: BindGroupCache::default(),
            impact_groups: BindGroupCache::default(),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.params.size() + self.place_params.size()
    }
}
