//! A photon map on its way from the lights to the last surface, by whichever tracers the settings choose.

use super::indirect_scene::{PhotonInputs, PhotonPasses};
use super::photon_rounds::PhotonRounds;
use super::selective_photons::{OnRetraced, Retraced, SelectivePhotons};
use super::{Settings, TracerKind};
use crate::Error;
#[cfg(feature = "bvh")]
use crate::pass::{BvhTracerInputs, BvhTracerResources};
use crate::pass::{
    FirstHits, ImageSpaceTracerInputs, ImageSpaceTracerResources, PhotonEmitterInputs, PhotonEmitterResources,
    PhotonSpread, SharedHop,
};
use crate::resource::{DepthHierarchy, EnvMaps, PathList, PhotonGroups, PhotonMap, Photons};

/// Fetches after which a ray is left to triangles unless settings name another number: groups of rays take 14 to 18 % fewer
/// in furnished scenes, for up to 0.5 % more rays against triangles.
const HYBRID_FETCHES: u32 = 400;

/// One photon map and what its walk needs of its own.
#[derive(Debug)]
pub(super) struct TracedPhotons {
    pub(super) photons: Photons,
    kind: TracerKind,
    emitter: PhotonEmitterResources,
    image_space: ImageSpaceTracerResources,
    #[cfg(feature = "bvh")]
    bvh: BvhTracerResources,
    /// While one tracer traces what the other loses.
    lost: Option<PathList>,
    /// While photons stay until their way changes.
    selective: Option<Box<SelectivePhotons>>,
    /// While a part of them is traced a frame.
    rounds: Option<PhotonRounds>,
}

/// Which part of the walk is recorded.
#[derive(Clone, Copy)]
enum Part<'a> {
    All,
    /// Of all paths, while two tracers share it.
    Hop(u32),
    /// All hops of these.
    Listed(&'a PathList),
}

/// What a walk needs beside what all share.
#[derive(Clone, Copy)]
pub(super) struct WalkInputs<'a> {
    pub(super) photons: &'a PhotonInputs<'a>,
    pub(super) spread: PhotonSpread<'a>,
    pub(super) first_hits: FirstHits,
    /// While photons are traced in image space.
    pub(super) maps: Option<(&'a EnvMaps, Option<&'a DepthHierarchy>)>,
    /// First index into the random sequence.
    pub(super) sample_offset: u32,
}

impl TracedPhotons {
    /// `kind`: what traces them, of those that the settings have.
    pub(super) fn new(
        device: &wgpu::Device,
        (count, bounces): (u32, u32),
        (map, kind): (PhotonMap, TracerKind),
    ) -> Result<Self, Error> {
        let is_shared = kind == TracerKind::Hybrid;
        let shared_hops = if is_shared { bounces } else { 0 };
        let mut photons = Photons::new(device, count, bounces)?;
        photons.set_map(map);
        Ok(Self {
            emitter: PhotonEmitterResources::new(device)?,
            image_space: ImageSpaceTracerResources::for_shared_hops(device, shared_hops)?,
            #[cfg(feature = "bvh")]
            bvh: BvhTracerResources::for_shared_hops(device, shared_hops)?,
            lost: is_shared.then(|| PathList::new(device, &photons)).transpose()?,
            kind,
            selective: None,
            rounds: None,
            photons,
        })
    }

    /// Has photons stay until their way changes.
    pub(super) fn select(&mut self, device: &wgpu::Device, settings: &Settings) -> Result<(), Error> {
        self.selective = Some(Box::new(SelectivePhotons::new(device, settings, &self.photons)?));
        Ok(())
    }

    /// Has a part of them traced anew in each of so many frames. Not for a hybrid.
    pub(super) fn trace_in_rounds(&mut self, gpu: (&wgpu::Device, &wgpu::Queue), rounds: u32) -> Result<(), Error> {
        self.rounds = Some(PhotonRounds::new(gpu, &self.photons, rounds)?);
        Ok(())
    }

    /// Has all of them traced in the next frame.
    pub(super) fn retrace(&mut self) {
        if let Some(selective) = &mut self.selective {
            selective.restart();
        }
        if let Some(rounds) = &mut self.rounds {
            rounds.restart();
        }
    }

    /// In groups, if they stay.
    pub(super) fn groups(&self) -> Option<&PhotonGroups> {
        self.selective.as_ref().map(|s| s.groups())
    }

    /// Traces so many from now on, of those that there is room for.
    pub(super) fn set_count(&mut self, count: u32) -> Result<(), Error> {
        if count != self.photons.count() {
            self.photons = self.photons.part(count)?;
        }
        Ok(())
    }

    /// Forgets lights and shadow maps that are no more.
    pub(super) fn renew_emitter(&mut self, device: &wgpu::Device) -> Result<(), Error> {
        self.emitter = PhotonEmitterResources::new(device)?;
        if let Some(rounds) = &mut self.rounds {
            rounds.restart();
        }
        Ok(())
    }

    /// Records the emission and the walk: of all photons, of those whose turn it is, or of those whose way has changed.
    pub(super) fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        passes: &PhotonPasses,
        inputs: &WalkInputs<'_>,
    ) -> Result<(), Error> {
        if let Some(mut rounds) = self.rounds.take() {
            let recorded = rounds.record(encoder, passes, self, inputs);
            self.rounds = Some(rounds);
            return recorded;
        }
        self.record_selected(encoder, passes, inputs, &mut |_, _, _| Ok(()))
    }

    /// The same, and tells which.
    pub(super) fn record_selected(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        passes: &PhotonPasses,
        inputs: &WalkInputs<'_>,
        on_retraced: OnRetraced<'_>,
    ) -> Result<(), Error> {
        let (Some(pass), Some(mut selective)) = (&passes.selective_emitter, self.selective.take()) else {
            self.record_all(encoder, passes, inputs)?;
            return on_retraced(encoder, &self.photons, Retraced::All);
        };
        let recorded = selective.record(encoder, (pass, passes), self, inputs, on_retraced);
        self.selective = Some(selective);
        recorded
    }

    /// Records the emission and the walk of some photons.
    pub(super) fn record_listed(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        passes: &PhotonPasses,
        inputs: &WalkInputs<'_>,
        list: &PathList,
    ) -> Result<(), Error> {
        let emitter_inputs = emitter_inputs(&self.photons, inputs);
        passes
            .photon_emitter
            .record_listed(encoder, &mut self.emitter, &emitter_inputs, list);
        self.record_walk(encoder, passes, inputs, Part::Listed(list))
    }

    /// Records the emission and the walk of all photons.
    pub(super) fn record_all(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        passes: &PhotonPasses,
        inputs: &WalkInputs<'_>,
    ) -> Result<(), Error> {
        let emitter_inputs = emitter_inputs(&self.photons, inputs);
        passes
            .photon_emitter
            .record(encoder, &mut self.emitter, &emitter_inputs);
        if self.lost.is_none() {
            return self.record_walk(encoder, passes, inputs, Part::All);
        }
        let starts_at_lights = inputs.first_hits == FirstHits::Traced || inputs.photons.lights.have_area();
        let mut hops = u32::from(!starts_at_lights)..=self.photons.bounces();
        hops.try_for_each(|hop| self.record_walk(encoder, passes, inputs, Part::Hop(hop)))
    }

    /// Of each tracer that there is, a part of the walk.
    fn record_walk(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        passes: &PhotonPasses,
        inputs: &WalkInputs<'_>,
        part: Part<'_>,
    ) -> Result<(), Error> {
        let (scene, settings) = (inputs.photons.scene, inputs.photons.settings);
        let lost = self.lost.as_ref();
        let shared = match (part, lost) {
            (Part::Hop(number), Some(lost)) => Some(SharedHop { number, lost }),
            _ => None,
        };
        if let (Some(tracer), Some((env_maps, hierarchy))) = (&passes.image_space_tracer, inputs.maps)
            && self.kind.uses_env_maps()
        {
            let mut tracer_settings = settings.tracer;
            if shared.is_some() && tracer_settings.most_fetches == 0 {
                tracer_settings.most_fetches = HYBRID_FETCHES;
            }
            let tracer_inputs = ImageSpaceTracerInputs {
                queue: scene.queue,
                env_maps,
                hierarchy,
                photons: &self.photons,
                shared,
                guiding: inputs.spread.guiding(),
                sample_offset: inputs.sample_offset,
                settings: &tracer_settings,
                timestamps: scene.timestamps,
            };
            match part {
                Part::Listed(list) => tracer.record_listed(encoder, &mut self.image_space, &tracer_inputs, list)?,
                Part::All | Part::Hop(_) => tracer.record(encoder, &mut self.image_space, &tracer_inputs)?,
            }
        }
        #[cfg(feature = "bvh")]
        if let (Some(tracer), Some(geometry)) = (&passes.bvh_tracer, scene.bvh)
            && self.kind.uses_triangles()
        {
            let tracer_inputs = BvhTracerInputs {
                queue: scene.queue,
                geometry,
                photons: &self.photons,
                shared,
                guiding: inputs.spread.guiding(),
                sample_offset: inputs.sample_offset,
                roulette_from: settings.tracer.roulette_from,
                timestamps: scene.timestamps,
            };
            match part {
                Part::Listed(list) => tracer.record_listed(encoder, &mut self.bvh, &tracer_inputs, list),
                Part::All | Part::Hop(_) => tracer.record(encoder, &mut self.bvh, &tracer_inputs),
            }
        }
        Ok(())
    }

    /// Bytes of the photons, of the lists of those that were lost, of all else.
    pub(super) fn memory_use(&self) -> [u64; 3] {
        let uniforms = self.emitter.memory_use() + self.image_space.memory_use();
        #[cfg(feature = "bvh")]
        let uniforms = uniforms + self.bvh.memory_use();
        let lost = self.lost.as_ref().map_or(0, PathList::memory_use);
        let selective = self.selective.as_ref().map_or(0, |s| s.memory_use());
        let rounds = self.rounds.as_ref().map_or(0, PhotonRounds::memory_use);
        let photons = self.photons.memory_use() + selective + rounds;
        [photons, lost, uniforms]
    }
}

fn emitter_inputs<'a>(photons: &'a Photons, inputs: &WalkInputs<'a>) -> PhotonEmitterInputs<'a> {
    PhotonEmitterInputs {
        queue: inputs.photons.scene.queue,
        lights: inputs.photons.lights,
        shadow_maps: inputs.photons.shadow_maps,
        photons,
        spread: inputs.spread,
        first_hits: inputs.first_hits,
        sample_offset: inputs.sample_offset,
        timestamps: inputs.photons.scene.timestamps,
    }
}
