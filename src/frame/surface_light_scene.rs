//! Surface lights that all views share: where they stand, the pool of photons that they are made of, and when it rests.

use super::indirect_scene::PhotonPasses;
use super::traced_photons::{TracedPhotons, WalkInputs};
use super::{LightPlacement, Settings};
use crate::Error;
use crate::pass::{ImpactLightInputs, PhotonStreamInputs, PhotonStreamResources};
use crate::resource::{PhotonPool, Photons, SurfaceLights};
use crate::scene::{SurfacePlace, UnitFrame};

/// Allocated while indirect light comes from surface lights.
#[derive(Debug)]
pub(super) struct SurfaceLightScene {
    lights: SurfaceLights,
    /// Unless they stand at impacts.
    pool: Option<PhotonPool>,
    own: PhotonStreamResources,
    frame: Option<UnitFrame>,
    /// Of lights and geometry, as of the last photons.
    revision: u64,
    /// Of the random sequence, as the host last gave it.
    sample_offset: u32,
    /// Paths until all are of this revision.
    left: u32,
    /// Whether a light moved, this frame.
    has_moved: bool,
}

impl SurfaceLightScene {
    pub(super) fn new(device: &wgpu::Device, settings: &Settings) -> Result<Self, Error> {
        let keeps_near = settings.keeps_near();
        let hops = settings.walked_bounces() + u32::from(!keeps_near);
        let own = &settings.surface_lights;
        let (places, pool) = match own.placement {
            LightPlacement::OnSurfaces => {
                let mut pool = PhotonPool::new(device, settings.pool_paths(), hops)?;
                if keeps_near {
                    pool.keep_near(device)?;
                }
                (own.places, Some(pool))
            }
            // Two lights a place.
            LightPlacement::AtImpacts => ((settings.traced_photons() * hops).div_ceil(2), None),
        };
        Ok(Self {
            lights: SurfaceLights::new(device, places, hops)?,
            left: pool.as_ref().map_or(0, PhotonPool::paths),
            pool,
            own: PhotonStreamResources::new(device)?,
            frame: None,
            revision: 0,
            sample_offset: 0,
            has_moved: false,
        })
    }

    /// Puts the lights where they stand this frame.
    pub(super) fn follow(
        &mut self,
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        frame: &UnitFrame,
        places: &[SurfacePlace],
    ) -> Result<(), Error> {
        let Some(pool) = &mut self.pool else {
            return Ok(());
        };
        let before = self.lights.count();
        if places.len() as u32 * 2 > self.lights.capacity() {
            self.lights = SurfaceLights::new(device, places.len() as u32, pool.hops())?;
        }
        self.has_moved = self.lights.write(queue, frame, places)?;
        // Of other lights, or of another frame, the pool knows nothing.
        if self.lights.count() != before || !self.frame.as_ref().is_some_and(|f| f.maps_like(frame)) {
            pool.restart();
            self.left = pool.paths();
        }
        self.frame = Some(*frame);
        Ok(())
    }

    /// Has all paths traced anew, as after a change.
    pub(super) fn wake(&mut self) {
        self.left = self.pool.as_ref().map_or(0, PhotonPool::paths);
    }

    /// Where in the random sequence the next photons begin; `None` while nothing has changed since all paths were traced: then
    /// the same would come again. While frames are accumulated, other photons come with each.
    fn begin(&mut self, revision: u64, sample_offset: u32) -> Option<u32> {
        let Some(pool) = &self.pool else {
            return Some(sample_offset);
        };
        if revision != self.revision {
            self.left = pool.paths();
            self.revision = revision;
        }
        let is_accumulating = sample_offset != std::mem::replace(&mut self.sample_offset, sample_offset);
        match (is_accumulating, self.left) {
            (true, _) => Some(sample_offset),
            (false, 0) => None,
            (false, _) => Some(sample_offset.wrapping_add(pool.next())),
        }
    }

    /// Records the photons of a frame, and what they change; nothing while the pool rests.
    pub(super) fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        passes: &PhotonPasses,
        traced: &mut TracedPhotons,
        mut inputs: WalkInputs<'_>,
    ) -> Result<(), Error> {
        let Some(pass) = &passes.photon_stream else {
            return Ok(());
        };
        let first = self.begin(inputs.photons.revision, inputs.sample_offset);
        inputs.sample_offset = first.unwrap_or(0);
        let is_wanted = first.is_some() && traced.photons.count() > 0;
        let is_new = is_wanted && bring_photons(encoder, passes, traced, &inputs)?;
        let (queue, timestamps) = (inputs.photons.scene.queue, inputs.photons.scene.timestamps);
        let (photons, lights) = (&traced.photons, &mut self.lights);
        let Some(pool) = &mut self.pool else {
            let mut inputs = ImpactLightInputs {
                queue,
                photons,
                lights,
                timestamps,
            };
            return pass.record_at_impacts(encoder, &mut self.own, &mut inputs);
        };
        let mut inputs = PhotonStreamInputs {
            queue,
            photons,
            pool,
            lights,
            timestamps,
        };
        if is_new {
            self.left = self.left.saturating_sub(photons.count());
            pass.record(encoder, &mut self.own, &mut inputs)?;
        } else if self.has_moved {
            pass.record_places(encoder, &mut self.own, &inputs);
        }
        Ok(())
    }

    pub(super) fn lights(&self) -> &SurfaceLights {
        &self.lights
    }

    /// Which part of their flux they hold.
    pub(super) fn share(&self) -> f32 {
        self.pool.as_ref().map_or(1.0, PhotonPool::share)
    }

    pub(super) fn pool(&self) -> Option<&PhotonPool> {
        self.pool.as_ref()
    }

    /// What lights lose near by, if it is kept.
    pub(super) fn near_photons(&self) -> Option<&Photons> {
        // Those of another unit frame lie elsewhere.
        let pool = self.pool.as_ref().filter(|pool| !pool.is_stale());
        pool.and_then(PhotonPool::near)
    }

    pub(super) fn memory_use(&self) -> u64 {
        let pool = self.pool.as_ref().map_or(0, PhotonPool::memory_use);
        self.lights.memory_use() + pool + self.own.memory_use()
    }
}

/// Whether new photons are there: from threads of the processor, if there are any, when they are ready; else traced here.
fn bring_photons(
    encoder: &mut wgpu::CommandEncoder,
    passes: &PhotonPasses,
    traced: &mut TracedPhotons,
    inputs: &WalkInputs<'_>,
) -> Result<bool, Error> {
    #[cfg(all(feature = "bvh", not(target_arch = "wasm32")))]
    if let Some(feeder) = inputs.photons.feeder {
        return Ok(feeder.upload(inputs.photons.scene.queue, &traced.photons));
    }
    traced.record(encoder, passes, inputs)?;
    Ok(true)
}
