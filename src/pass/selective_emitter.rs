//! Traces anew only the photons whose way has changed.
//!
//! Inputs: [`Photons`], traced once as a whole, in [`PhotonGroups`]. Of each group one path is traced in each frame, another
//! one every time; where it has become another path the group has changed, and all of it is traced anew, those that have
//! changed most first, as many a frame as a budget allows. Groups of a light that moved have changed. All of it is on the GPU.
//! Source: Larsen 2004, chapter 9, with changes: groups are what Halton indices leave when divided by 2^a 3^b, and how much of
//! its flux a probe finds elsewhere says which of them come first.
//!
//! Order, for each frame: [`SelectiveEmitter::record_probes`]; emission and walk of [`PhotonGroups::probes`] (the
//! `record_listed` of [`PhotonEmitter`](super::PhotonEmitter) and of a tracer); whatever exchanges the old paths for the new
//! ones elsewhere; [`SelectiveEmitter::record_choice`]; the same of [`PhotonGroups::chosen`]. Cost: a path for each group, and
//! what has changed. A change that only some of a group's paths meet is found after as many frames as the group has paths,
//! times the interval, at the latest; where more changes than the budget allows, what waits gains on what changes again.
//! Limits: lights that take another number of photons have all photons traced anew; with [`Lights::keep_division`] that is
//! where one grows brighter or dimmer by much.

use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot, Step};
use crate::resource::photon_groups::LightsChange;
use crate::resource::{Lights, PhotonGroups, Photons};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/selective_emitter/params.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) path_count: u32,
        pub(crate) hop_count: u32,
        pub(crate) light_count: u32,
        pub(crate) group_count: u32,
        pub(crate) interval: u32,
        pub(crate) first_group: u32,
        pub(crate) round: u32,
        pub(crate) budget: u32,
        pub(crate) kept_count: u32,
        pub(crate) position_tolerance: f32,
        pub(crate) flux_tolerance: f32,
        pub(crate) moved_low: u32,
        pub(crate) moved_high: u32,
    }
}

/// Bindings of `shaders/pass/selective_emitter/list_probes.wgsl`, in order.
pub(crate) const PROBE_SLOTS: [Slot; 4] = [Slot::Uniform, Slot::Storage, Slot::StorageMut, Slot::StorageMut];

/// Bindings of `shaders/pass/selective_emitter/keep_paths.wgsl`, in order.
pub(crate) const KEEP_SLOTS: [Slot; 4] = [Slot::Uniform, Slot::Storage, Slot::Storage, Slot::StorageMut];

/// Bindings of `shaders/pass/selective_emitter/compare_paths.wgsl`, in order.
pub(crate) const COMPARE_SLOTS: [Slot; 7] = [
    Slot::Uniform,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageMut,
    Slot::StorageMut,
];

/// Bindings of `shaders/pass/selective_emitter/choose_groups.wgsl`, in order.
pub(crate) const CHOICE_SLOTS: [Slot; 5] = [
    Slot::Uniform,
    Slot::Storage,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::StorageMut,
];

/// Speed against how fast light follows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SelectiveEmitterSettings {
    /// Paths traced anew a frame beside probes, of groups that have changed; one group at least, and no more than
    /// [`PhotonGroups`] has room for.
    pub budget: u32,
    /// Each group is probed once in so many frames, from 1. Higher is cheaper, and finds small changes later.
    pub interval: u32,
    /// Lengths in the unit frame up to which a photon is taken to arrive where it did.
    pub position_tolerance: f32,
    /// Shares of its flux up to which it is taken to be as bright as it was.
    pub flux_tolerance: f32,
}

impl Default for SelectiveEmitterSettings {
    fn default() -> Self {
        Self {
            budget: 6000,
            interval: 1,
            position_tolerance: 1e-4,
            flux_tolerance: 1e-3,
        }
    }
}

/// The pass.
#[derive(Debug)]
pub struct SelectiveEmitter {
    device: wgpu::Device,
    probe: Step,
    keep: Step,
    compare: Step,
    choose: Step,
}

/// Uniforms and bind groups, and how often groups were probed.
#[derive(Debug)]
pub struct SelectiveEmitterResources {
    params: wgpu::Buffer,
    groups: [BindGroupCache; 4],
    frame: u32,
    is_new: bool,
}

/// What a frame gives it.
#[derive(Debug)]
pub struct SelectiveEmitterInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// What was traced so far.
    pub photons: &'a Photons,
    /// Their groups.
    pub groups: &'a mut PhotonGroups,
    /// Where they begin, written for this frame.
    pub lights: &'a Lights,
    /// How.
    pub settings: &'a SelectiveEmitterSettings,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl SelectiveEmitter {
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
            probe: step(
                "lightfall::SelectiveEmitter::probe",
                wgsl::SELECTIVE_EMITTER_PROBE,
                "list_probes",
                &PROBE_SLOTS,
            ),
            keep: step(
                "lightfall::SelectiveEmitter::keep",
                wgsl::SELECTIVE_EMITTER_KEEP,
                "keep_paths",
                &KEEP_SLOTS,
            ),
            compare: step(
                "lightfall::SelectiveEmitter::compare",
                wgsl::SELECTIVE_EMITTER_COMPARE,
                "compare_paths",
                &COMPARE_SLOTS,
            ),
            choose: step(
                "lightfall::SelectiveEmitter::choose",
                wgsl::SELECTIVE_EMITTER_CHOOSE,
                "choose_groups",
                &CHOICE_SLOTS,
            ),
            device: device.clone(),
        }
    }

    /// Records which paths are probed this frame, and what they were. Returns whether they are of use: if not, because the
    /// lights divide their photons otherwise than before or none are traced yet, nothing was recorded, and all photons are to
    /// be traced as a whole instead.
    pub fn record_probes(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut SelectiveEmitterResources,
        inputs: &mut SelectiveEmitterInputs<'_>,
    ) -> bool {
        let change = inputs.groups.write(inputs.queue, inputs.lights);
        let is_new = std::mem::take(&mut resources.is_new);
        let LightsChange::Moved(moved) = change else {
            encoder.clear_buffer(inputs.groups.changed(), 0, None);
            encoder.clear_buffer(inputs.groups.counts(), 0, None);
            return false;
        };
        let fits = inputs.photons.count() == inputs.groups.paths();
        if is_new || inputs.groups.count() == 0 || !fits {
            resources.is_new = !fits;
            encoder.clear_buffer(inputs.groups.changed(), 0, None);
            encoder.clear_buffer(inputs.groups.counts(), 0, None);
            return false;
        }
        let groups = &*inputs.groups;
        let interval = inputs.settings.interval.clamp(1, groups.count());
        let room = groups.chosen().room();
        let params = gpu::Params {
            path_count: inputs.photons.count(),
            hop_count: inputs.photons.bounces() + 1,
            light_count: groups.light_count(),
            group_count: groups.count(),
            interval,
            first_group: resources.frame % interval,
            round: resources.frame / interval,
            // A group of the largest size always fits behind it.
            budget: inputs.settings.budget.min(room.saturating_sub(groups.largest())),
            kept_count: groups.kept_count(),
            position_tolerance: inputs.settings.position_tolerance,
            flux_tolerance: inputs.settings.flux_tolerance,
            moved_low: moved as u32,
            moved_high: (moved >> 32) as u32,
        };
        resources.frame = resources.frame.wrapping_add(1);
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        encoder.clear_buffer(groups.counts(), 0, None);
        let bound = [
            (&resources.params).into(),
            groups.grouped().into(),
            groups.changed().into(),
            groups.probes().buffer().into(),
        ];
        let label = "lightfall::SelectiveEmitter";
        let group = resources.groups[0].get(&self.device, label, &self.probe.layout, &bound);
        let (workgroups, _) = super::dispatch_64(groups.count());
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.probe.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(workgroups[0], workgroups[1], 1);
        drop(pass);
        self.record_kept(encoder, resources, inputs);
        true
    }

    /// Records, after probes were traced anew, which groups have changed and which of them are traced anew.
    pub fn record_choice(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut SelectiveEmitterResources,
        inputs: &SelectiveEmitterInputs<'_>,
    ) {
        let groups = &*inputs.groups;
        let label = "lightfall::SelectiveEmitter::choice";
        let compared = [
            (&resources.params).into(),
            groups.grouped().into(),
            inputs.photons.buffer().into(),
            groups.probes().buffer().into(),
            groups.kept().into(),
            groups.changed().into(),
            groups.counts().into(),
        ];
        let chosen = [
            (&resources.params).into(),
            groups.grouped().into(),
            groups.changed().into(),
            groups.chosen().buffer().into(),
            groups.counts().into(),
        ];
        let compare = resources.groups[1].get(&self.device, label, &self.compare.layout, &compared);
        let choose = resources.groups[2].get(&self.device, label, &self.choose.layout, &chosen);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.compare.pipeline);
        pass.set_bind_group(0, &compare, &[]);
        pass.dispatch_workgroups_indirect(groups.probes().buffer(), 0);
        pass.set_pipeline(&self.choose.pipeline);
        pass.set_bind_group(0, &choose, &[]);
        pass.dispatch_workgroups(1, 1, 1);
    }

    fn record_kept(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut SelectiveEmitterResources,
        inputs: &SelectiveEmitterInputs<'_>,
    ) {
        let list = inputs.groups.probes();
        let bound = [
            (&resources.params).into(),
            inputs.photons.buffer().into(),
            list.buffer().into(),
            inputs.groups.kept().into(),
        ];
        let label = "lightfall::SelectiveEmitter::keep";
        let group = resources.groups[3].get(&self.device, label, &self.keep.layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.keep.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups_indirect(list.buffer(), 0);
    }
}

impl SelectiveEmitterResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::SelectiveEmitter::params")?,
            groups: Default::default(),
            frame: 0,
            is_new: true,
        })
    }

    /// Has all photons traced as a whole in the next frame: where the unit frame is another one.
    pub fn restart(&mut self) {
        self.is_new = true;
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.params.size()
    }
}
