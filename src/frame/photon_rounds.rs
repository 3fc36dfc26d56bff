//! Photons of which a part is traced anew in each frame.

use super::indirect_scene::PhotonPasses;
use super::traced_photons::{TracedPhotons, WalkInputs};
use crate::Error;
use crate::resource::{PathRounds, Photons};
use crate::scene::UnitFrame;

/// Allocated while the settings want it.
#[derive(Debug)]
pub(super) struct PhotonRounds {
    paths: PathRounds,
    /// Whose turn it is.
    round: u32,
    /// `None`: nothing was traced yet, or it is void.
    traced: Option<Traced>,
}

/// What photons were traced with that those of later frames must share. How they are divided among the lights they need not: a
/// round has about its share of each light's photons before and after.
#[derive(Debug)]
struct Traced {
    frame: UnitFrame,
    light_count: u32,
    sample_offset: u32,
}

impl PhotonRounds {
    pub(super) fn new(gpu: (&wgpu::Device, &wgpu::Queue), photons: &Photons, rounds: u32) -> Result<Self, Error> {
        Ok(Self {
            paths: PathRounds::new(gpu, photons.count(), rounds)?,
            round: 0,
            traced: None,
        })
    }

    /// Records the photons of a frame: those whose turn it is, or all.
    pub(super) fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        passes: &PhotonPasses,
        photons: &mut TracedPhotons,
        inputs: &WalkInputs<'_>,
    ) -> Result<(), Error> {
        let now = Traced {
            frame: *inputs.photons.frame,
            light_count: inputs.photons.lights.count(),
            sample_offset: inputs.sample_offset,
        };
        if self.traced.as_ref().is_some_and(|before| before.fits(&now)) {
            let list = self.paths.record(encoder, self.round);
            self.round = (self.round + 1) % self.paths.count();
            photons.record_listed(encoder, passes, inputs, list)?;
        } else {
            photons.record_all(encoder, passes, inputs)?;
        }
        self.traced = Some(now);
        Ok(())
    }

    /// Has all of them traced in the next frame.
    pub(super) fn restart(&mut self) {
        self.traced = None;
    }

    pub(super) fn memory_use(&self) -> u64 {
        self.paths.memory_use()
    }
}

impl Traced {
    fn fits(&self, now: &Self) -> bool {
        self.frame.maps_like(&now.frame)
            && self.light_count == now.light_count
            // Each accumulated frame has other photons.
            && self.sample_offset == now.sample_offset
    }
}
