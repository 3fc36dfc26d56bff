//! Indirect light at texels of surfaces, gathered again where it has changed.
//!
//! Inputs: [`SurfaceLights`], whose changes [`PhotonStream`](super::PhotonStream) has noted; then what a tracer says of the
//! [`SurfaceRays`] that the first step spreads. Output: [`IlluminationMap`]. Of each surface the indirect light that came and
//! went says whether its texels are due, the more it is for the surface's area the sooner; as many of them are gathered a frame
//! as a budget allows. E = π times the mean of L over rays as dense as the cosine, π L = Φ / A of the light nearest to where a
//! ray ends, which holds all light of its surroundings; rays may be denser where photons came from, and count for less there.
//! What is shown goes to what was gathered within a few frames. Source: Larsen 2004, section 4.6.2 and chapters 10 and 11, with
//! changes: photons are added up at texels as they come and go, where the paper searches those nearest to each; where these
//! are few, those of the texels around count as well.
//!
//! Order, for each frame: [`TexelGather::record_rays`], the tracer's `record_surface_rays`, [`TexelGather::record`]. Where
//! [`HemisphereGather`](super::HemisphereGather) gathers instead, it goes between the two, without rays. Cost: texels × rays
//! of the budget, whether as many are due or not, for rays of none are over at once; texels, more where light is taken from
//! photons around; impacts in the pool, while rays are guided.

use super::dispatch_64;
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot, Step};
use crate::resource::{IlluminationMap, PhotonPool, Photons, SurfaceLights, SurfaceRays};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/texel_gather/params.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) texel_count: u32,
        pub(crate) budget: u32,
        pub(crate) ray_count: u32,
        pub(crate) round: u32,
        pub(crate) threshold: f32,
        pub(crate) change_scale: f32,
        pub(crate) flux_of_step: f32,
        pub(crate) blend: f32,
        pub(crate) row: u32,
        pub(crate) sample_offset: u32,
        pub(crate) least_photons: u32,
        pub(crate) guided: f32,
        pub(crate) keeps_due: u32,
        pub(crate) slot_count: u32,
        pub(crate) slot_row: u32,
    }
}

/// Bindings of `shaders/pass/texel_gather/sum_radiosity.wgsl`, in order.
pub(crate) const RADIOSITY_SLOTS: [Slot; 6] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageMut,
];

/// Bindings of `shaders/pass/texel_gather/sum_changes.wgsl`, in order.
pub(crate) const CHANGE_SLOTS: [Slot; 4] = [Slot::Uniform, Slot::Storage, Slot::Storage, Slot::StorageMut];

/// Bindings of `shaders/pass/texel_gather/mark_due.wgsl`, in order.
pub(crate) const DUE_SLOTS: [Slot; 7] = [
    Slot::Uniform,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageMut,
    Slot::Storage,
    Slot::StorageMut,
];

/// Bindings of `shaders/pass/texel_gather/choose_texels.wgsl`, in order.
pub(crate) const CHOICE_SLOTS: [Slot; 8] = [
    Slot::Uniform,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageMut,
];

/// Bindings of `shaders/pass/texel_gather/count_incident.wgsl`, in order.
pub(crate) const INCIDENT_SLOTS: [Slot; 6] = [
    Slot::Uniform,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageMut,
];

/// Bindings of `shaders/pass/texel_gather/spread_rays.wgsl`, in order.
pub(crate) const SPREAD_SLOTS: [Slot; 5] = [
    Slot::Uniform,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageMut,
];

/// Bindings of `shaders/pass/texel_gather/sum_hits.wgsl`, in order.
pub(crate) const SUM_SLOTS: [Slot; 9] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageMut,
];

/// Bindings of `shaders/pass/texel_gather/blend_texels.wgsl`, in order.
pub(crate) const BLEND_SLOTS: [Slot; 3] = [Slot::Uniform, Slot::Storage, Slot::StorageMut];

/// Steps of flux in one of change. Twin of `CHANGE_SHIFT` in `shaders/pass/photon_stream/stream_impacts.wgsl`.
pub(crate) const CHANGE_SHIFT: u32 = 4;

/// Workgroups of a dispatch along an axis: one a texel.
const MOST_A_FRAME: u32 = 65_535;

/// Of a texel's hemisphere, where photons come from: `INCIDENT_STRIDE` in `shaders/pass/texel_gather/incident_cell.wgsl`, 4
/// bytes each.
const INCIDENT_BYTES: u64 = 4 * 65;

/// Rays that go wherever light may come from, at least: what no photon showed has a weight of its inverse.
const MOST_GUIDED: f32 = 0.95;

/// Places of the last two steps' bind groups.
const SUM_GROUP: usize = 6;
const BLEND_GROUP: usize = 7;

/// Speed against accuracy, settable every frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TexelGatherSettings {
    /// Texels gathered a frame, from 1, and no more than the map has room for.
    pub a_frame: u32,
    /// Rays of a texel, from 1. Noise, which is the same as long as nothing changes, falls faster than as the root: 64, 256,
    /// 1024 have 0.93 and 0.98 of the error before (`docs/tradeoff.md`).
    pub rays: u32,
    /// Change of indirect light from which on a surface is gathered again, per area, over that of all light spread over all
    /// surfaces, 0 or more. Changes below it add up.
    pub threshold: f32,
    /// Share of the way that shown light goes to what was gathered, each frame, above 0, at most 1: at once.
    pub blend: f32,
    /// Photons that all light at a texel is taken from, if as many lie around it on its surface: of texels with fewer, more of
    /// the surface is taken. 0: none but its own. More are smoother and blurrier: 30 and 100 have 1.02 and 1.09 of the error of
    /// 0 in a hall of pillars.
    pub least_photons: u32,
    /// Share of the rays that go where photons came from which had been scattered before, 0 to 0.95, where there are many of
    /// these, half of it where there are 128; the others are spread as the cosine.
    pub guided: f32,
}

impl Default for TexelGatherSettings {
    fn default() -> Self {
        Self {
            a_frame: 200,
            rays: 256,
            threshold: 0.001,
            blend: 0.3,
            least_photons: 0,
            guided: 0.5,
        }
    }
}

/// The pass.
#[derive(Debug)]
pub struct TexelGather {
    device: wgpu::Device,
    sum_radiosity: Step,
    sum_changes: Step,
    mark_due: Step,
    choose: Step,
    count_incident: Step,
    spread: Step,
    sum_hits: Step,
    blend: Step,
}

/// Uniforms and bind groups.
#[derive(Debug)]
pub struct TexelGatherResources {
    params: wgpu::Buffer,
    groups: [BindGroupCache; 8],
    /// While rays are guided: of each chosen texel where its photons came from.
    incident: wgpu::Buffer,
    frame: u32,
}

/// What a frame gives it.
#[derive(Debug)]
pub struct TexelGatherInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// Where texels stand, and what all light around them is.
    pub lights: &'a SurfaceLights,
    /// [`PhotonPool::share`](crate::resource::PhotonPool::share): which part of their flux they hold.
    pub share: f32,
    /// Of all surfaces, unit frame.
    pub area: f32,
    /// Room for the rays of as many texels as are gathered a frame; where there is less, fewer are. The first step writes them,
    /// a tracer says what they meet, the second step reads that. `None`: texels are chosen, and stay due until
    /// [`HemisphereGather`](super::HemisphereGather) gathers them.
    pub rays: Option<&'a SurfaceRays>,
    /// What guides rays, if any are: the pool that `lights` are made of, and the photons that fill it, as many paths as it has.
    pub incident: Option<(&'a PhotonPool, &'a Photons)>,
    /// Written.
    pub map: &'a mut IlluminationMap,
    /// Turns the rays: another in each frame that is accumulated, constant in real time.
    pub sample_offset: u32,
    /// How.
    pub settings: &'a TexelGatherSettings,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl TexelGather {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let step = |label, source, entry_point, slots: &[Slot]| {
            let spec = ComputeSpec {
                label,
                source,
                entry_point,
                layouts: &[],
                constants: &[],
            };
            Step::new(device, slots, &spec)
        };
        Self {
            sum_radiosity: step(
                "lightfall::TexelGather::radiosity",
                wgsl::TEXEL_GATHER_RADIOSITY,
                "sum_radiosity",
                &RADIOSITY_SLOTS,
            ),
            sum_changes: step(
                "lightfall::TexelGather::changes",
                wgsl::TEXEL_GATHER_CHANGES,
                "sum_changes",
                &CHANGE_SLOTS,
            ),
            mark_due: step(
                "lightfall::TexelGather::due",
                wgsl::TEXEL_GATHER_DUE,
                "mark_due",
                &DUE_SLOTS,
            ),
            choose: step(
                "lightfall::TexelGather::choice",
                wgsl::TEXEL_GATHER_CHOICE,
                "choose_texels",
                &CHOICE_SLOTS,
            ),
            count_incident: step(
                "lightfall::TexelGather::incident",
                wgsl::TEXEL_GATHER_INCIDENT,
                "count_incident",
                &INCIDENT_SLOTS,
            ),
            spread: step(
                "lightfall::TexelGather::rays",
                wgsl::TEXEL_GATHER_SPREAD,
                "spread_rays",
                &SPREAD_SLOTS,
            ),
            sum_hits: step(
                "lightfall::TexelGather::sum",
                wgsl::TEXEL_GATHER_SUM,
                "sum_hits",
                &SUM_SLOTS,
            ),
            blend: step(
                "lightfall::TexelGather::blend",
                wgsl::TEXEL_GATHER_BLEND,
                "blend_texels",
                &BLEND_SLOTS,
            ),
            device: device.clone(),
        }
    }

    /// Records which texels are gathered, and their rays, to be traced before [`TexelGather::record`].
    ///
    /// # Errors
    /// [`Error::CountMismatch`] for more lights than the map has texels; nothing is recorded then.
    pub fn record_rays(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut TexelGatherResources,
        inputs: &mut TexelGatherInputs<'_>,
    ) -> Result<(), Error> {
        let lights = inputs.lights;
        if lights.count() > inputs.map.capacity() {
            return Err(Error::CountMismatch {
                what: "surface lights to gather at (most texels that there is room for)",
                expected: inputs.map.capacity() as usize,
                found: lights.count() as usize,
            });
        }
        inputs.map.write_areas(inputs.queue, lights);
        if inputs.map.take_stale() {
            let map = &*inputs.map;
            for buffer in [map.gathered(), map.shown(), map.due()] {
                encoder.clear_buffer(buffer, 0, None);
            }
        }
        let map = &*inputs.map;
        let settings = inputs.settings;
        let rays = inputs.rays.map_or(0, |r| settings.rays.clamp(1, r.count().max(1)));
        let room = inputs.rays.map_or(u32::MAX, |r| r.count() / rays.max(1));
        let room = room.min(map.chosen().room());
        let budget = settings.a_frame.min(MOST_A_FRAME).min(room).max(1);
        let (workgroups, row) = dispatch_64(budget * rays);
        let is_guided =
            rays > 0 && settings.guided > 0.0 && resources.incident.size() >= INCIDENT_BYTES * u64::from(budget);
        let guides = inputs.incident.filter(|_| is_guided);
        let (slot_groups, slot_row) = dispatch_64(guides.map_or(0, |(pool, _)| pool.paths() * pool.hops()));
        let change = lights.flux_of_step() * (1u32 << CHANGE_SHIFT) as f32 / inputs.share;
        let params = gpu::Params {
            texel_count: lights.count(),
            budget,
            ray_count: rays,
            round: resources.frame,
            threshold: settings.threshold,
            // All lights give no more than the unit frame's flux, 1.
            change_scale: change * inputs.area,
            flux_of_step: lights.flux_of_step() / inputs.share,
            blend: settings.blend,
            row,
            sample_offset: inputs.sample_offset,
            least_photons: settings.least_photons,
            guided: guides.map_or(0.0, |_| settings.guided.min(MOST_GUIDED)),
            keeps_due: u32::from(inputs.rays.is_none()),
            slot_count: guides.map_or(0, |(pool, _)| pool.paths() * pool.hops()),
            slot_row,
        };
        resources.frame = resources.frame.wrapping_add(1);
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        encoder.clear_buffer(map.surface_changes(), 0, None);
        let own = || (&resources.params).into();
        let radiosity = [
            own(),
            lights.grid().into(),
            lights.records().into(),
            lights.cells().into(),
            lights.flux().into(),
            map.radiosity().into(),
        ];
        let changes = [
            own(),
            lights.records().into(),
            lights.changes().into(),
            map.surface_changes().into(),
        ];
        let due = [
            own(),
            lights.records().into(),
            map.surface_changes().into(),
            map.surface_areas().into(),
            lights.changes().into(),
            map.gathered().into(),
            map.due().into(),
        ];
        let choice = [
            own(),
            map.due().into(),
            map.chosen().buffer().into(),
            map.counts().into(),
            map.places().into(),
            lights.records().into(),
            lights.shining().into(),
            map.shifts().into(),
        ];
        let incident = guides.map(|(pool, photons)| {
            [
                own(),
                lights.records().into(),
                pool.buffer().into(),
                photons.buffer().into(),
                map.places().into(),
                (&resources.incident).into(),
            ]
        });
        let spread = inputs.rays.map(|rays| {
            [
                own(),
                lights.shining().into(),
                map.chosen().buffer().into(),
                (&resources.incident).into(),
                rays.buffer().into(),
            ]
        });
        let texels = [lights.count().div_ceil(64), 1];
        let mut steps = vec![
            (&self.sum_radiosity, &radiosity[..], texels),
            (&self.sum_changes, &changes[..], texels),
            (&self.mark_due, &due[..], texels),
            (&self.choose, &choice[..], [1, 1]),
        ];
        if let Some(incident) = &incident {
            encoder.clear_buffer(map.places(), 0, None);
            encoder.clear_buffer(&resources.incident, 0, None);
            steps.push((&self.count_incident, &incident[..], slot_groups));
        }
        if let Some(spread) = &spread {
            steps.push((&self.spread, &spread[..], workgroups));
        }
        let label = "lightfall::TexelGather";
        let groups: Vec<_> = steps
            .iter()
            .zip(&mut resources.groups)
            .map(|((step, bound, _), cache)| cache.get(&self.device, label, &step.layout, bound))
            .collect();
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        for ((step, _, [x, y]), group) in steps.iter().zip(&groups) {
            pass.set_pipeline(&step.pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(*x, *y, 1);
        }
        Ok(())
    }

    /// Records what the rays bring back, and what is shown, with the inputs of `record_rays`.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut TexelGatherResources,
        inputs: &TexelGatherInputs<'_>,
    ) {
        let (lights, map) = (inputs.lights, &*inputs.map);
        let label = "lightfall::TexelGather::sum";
        let sum = inputs.rays.map(|rays| {
            let sum = [
                (&resources.params).into(),
                lights.grid().into(),
                lights.records().into(),
                lights.cells().into(),
                map.radiosity().into(),
                map.chosen().buffer().into(),
                rays.buffer().into(),
                rays.hits().into(),
                map.gathered().into(),
            ];
            resources.groups[SUM_GROUP].get(&self.device, label, &self.sum_hits.layout, &sum)
        });
        let blend = [(&resources.params).into(), map.gathered().into(), map.shown().into()];
        let blend = resources.groups[BLEND_GROUP].get(&self.device, label, &self.blend.layout, &blend);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        if let Some(sum) = &sum {
            pass.set_pipeline(&self.sum_hits.pipeline);
            pass.set_bind_group(0, sum, &[]);
            pass.dispatch_workgroups_indirect(map.chosen().buffer(), 0);
        }
        pass.set_pipeline(&self.blend.pipeline);
        pass.set_bind_group(0, &blend, &[]);
        pass.dispatch_workgroups(lights.count().div_ceil(64), 1, 1);
    }
}

impl TexelGatherResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::TexelGather::params")?,
            groups: Default::default(),
            incident: incident_buffer(device, 0)?,
            frame: 0,
        })
    }

    /// Makes room for what guides the rays of up to `a_frame` texels at once, 260 bytes each; without it none are guided.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn guide_rays(&mut self, device: &wgpu::Device, a_frame: u32) -> Result<(), Error> {
        self.incident = incident_buffer(device, a_frame)?;
        Ok(())
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.params.size() + self.incident.size()
    }
}

fn incident_buffer(device: &wgpu::Device, texels: u32) -> Result<wgpu::Buffer, Error> {
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
    let bytes = INCIDENT_BYTES * u64::from(texels);
    device::buffer(device, "lightfall::TexelGather::incident", bytes, usage)
}
