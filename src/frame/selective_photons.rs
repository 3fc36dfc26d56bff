//! Photons that stay until something changes on their way.

use super::Settings;
use super::indirect_scene::PhotonPasses;
use super::traced_photons::{TracedPhotons, WalkInputs};
use crate::Error;
use crate::pass::{SelectiveEmitter, SelectiveEmitterInputs, SelectiveEmitterResources};
use crate::resource::{PathList, PhotonGroups, Photons};
use crate::scene::UnitFrame;

/// Which photons were traced.
pub(super) enum Retraced<'a> {
    All,
    Listed(&'a PathList),
}

/// What is told of the photons that were traced, as soon as that is recorded.
pub(super) type OnRetraced<'a> =
    &'a mut dyn FnMut(&mut wgpu::CommandEncoder, &Photons, Retraced<'_>) -> Result<(), Error>;

/// Allocated while the settings want it.
#[derive(Debug)]
pub(super) struct SelectivePhotons {
    groups: PhotonGroups,
    own: SelectiveEmitterResources,
    /// That the photons are of.
    frame: Option<UnitFrame>,
    sample_offset: u32,
}

impl SelectivePhotons {
    pub(super) fn new(device: &wgpu::Device, settings: &Settings, photons: &Photons) -> Result<Self, Error> {
        let own = &settings.selective;
        Ok(Self {
            groups: PhotonGroups::new(device, photons, own.group, own.emitter.budget)?,
            own: SelectiveEmitterResources::new(device)?,
            frame: None,
            sample_offset: 0,
        })
    }

    /// Records the photons of a frame: those whose way has changed, or all.
    pub(super) fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        (pass, passes): (&SelectiveEmitter, &PhotonPasses),
        traced: &mut TracedPhotons,
        inputs: &WalkInputs<'_>,
        on_retraced: OnRetraced<'_>,
    ) -> Result<(), Error> {
        let frame = inputs.photons.frame;
        let is_same_frame = self.frame.as_ref().is_some_and(|f| f.maps_like(frame));
        // Each accumulated frame has other photons.
        let before = std::mem::replace(&mut self.sample_offset, inputs.sample_offset);
        if !is_same_frame || before != inputs.sample_offset {
            self.own.restart();
        }
        self.frame = Some(*frame);
        let scene = inputs.photons.scene;
        let photons = traced.photons.part(traced.photons.count())?;
        let mut own_inputs = SelectiveEmitterInputs {
            queue: scene.queue,
            photons: &photons,
            groups: &mut self.groups,
            lights: inputs.photons.lights,
            settings: &inputs.photons.settings.selective.emitter,
            timestamps: scene.timestamps,
        };
        if !pass.record_probes(encoder, &mut self.own, &mut own_inputs) {
            traced.record_all(encoder, passes, inputs)?;
            return on_retraced(encoder, &photons, Retraced::All);
        }
        let probes = own_inputs.groups.probes();
        traced.record_listed(encoder, passes, inputs, probes)?;
        on_retraced(encoder, &photons, Retraced::Listed(probes))?;
        pass.record_choice(encoder, &mut self.own, &own_inputs);
        let chosen = own_inputs.groups.chosen();
        traced.record_listed(encoder, passes, inputs, chosen)?;
        on_retraced(encoder, &photons, Retraced::Listed(chosen))
    }

    pub(super) fn restart(&mut self) {
        self.own.restart();
    }

    pub(super) fn groups(&self) -> &PhotonGroups {
        &self.groups
    }

    pub(super) fn memory_use(&self) -> u64 {
        self.groups.memory_use() + self.own.memory_use()
    }
}
