//! Indirect light that is kept at texels of surfaces: photons that stay until their way changes, all light at texels as these
//! come and go, and the texels' irradiance, gathered again where it has changed.

use super::Settings;
use super::hemisphere_scene::{DrawInputs, HemisphereScene};
use super::indirect_scene::PhotonPasses;
use super::ray_tracers::{RayTracers, TracedScene};
use super::selective_photons::Retraced;
use super::traced_photons::{TracedPhotons, WalkInputs};
use crate::Error;
use crate::pass::{PhotonStreamInputs, PhotonStreamResources, TexelGatherInputs, TexelGatherResources};
use crate::resource::{IlluminationMap, PhotonPool, SurfaceLights, SurfaceRays};
use crate::scene::{SurfacePlace, UnitFrame};

/// Allocated while indirect light comes from illumination maps.
#[derive(Debug)]
pub(super) struct IlluminationScene {
    /// Where texels stand, and all light there.
    lights: SurfaceLights,
    /// Of all photons what each counts for.
    pool: PhotonPool,
    map: IlluminationMap,
    rays: SurfaceRays,
    stream: PhotonStreamResources,
    gather: TexelGatherResources,
    tracers: RayTracers,
    /// If the host's draws gather, instead of rays.
    hemispheres: Option<HemisphereScene>,
    frame: Option<UnitFrame>,
}

impl IlluminationScene {
    pub(super) fn new(device: &wgpu::Device, queue: &wgpu::Queue, settings: &Settings) -> Result<Self, Error> {
        let own = &settings.illumination_maps;
        let lights = SurfaceLights::new(device, own.texels, settings.bounces)?;
        let mut pool = PhotonPool::new(device, settings.traced_photons(), settings.bounces + 1)?;
        pool.note_changes();
        let a_frame = own.gather.a_frame;
        let map = IlluminationMap::new(device, &lights, a_frame)?;
        let shape = own.gather_shape();
        let hemispheres = shape.map(|shape| HemisphereScene::new(device, queue, settings, (shape, &map)));
        let rays = if shape.is_some() {
            1
        } else {
            a_frame.saturating_mul(own.gather.rays)
        };
        let mut gather = TexelGatherResources::new(device)?;
        if shape.is_none() && own.gather.guided > 0.0 {
            gather.guide_rays(device, a_frame)?;
        }
        Ok(Self {
            map,
            rays: SurfaceRays::new(device, rays)?,
            stream: PhotonStreamResources::new(device)?,
            gather,
            hemispheres: hemispheres.transpose()?,
            tracers: RayTracers::new(device)?,
            frame: None,
            lights,
            pool,
        })
    }

    /// Puts the texels where they are this frame. Returns whether all photons are to be traced, for the texels are other ones.
    pub(super) fn follow(
        &mut self,
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        (frame, settings): (&UnitFrame, &Settings),
        places: &[SurfacePlace],
    ) -> Result<bool, Error> {
        let before = self.lights.count();
        if places.len() as u32 * 2 > self.lights.capacity() {
            self.lights = SurfaceLights::new(device, places.len() as u32, settings.bounces)?;
            self.map = IlluminationMap::new(device, &self.lights, settings.illumination_maps.gather.a_frame)?;
        }
        self.lights.write(queue, frame, places)?;
        let is_other = self.lights.count() != before || !self.frame.as_ref().is_some_and(|f| f.maps_like(frame));
        if is_other {
            self.restart();
        }
        self.frame = Some(*frame);
        Ok(is_other)
    }

    /// Forgets all light: all photons are to be traced.
    pub(super) fn restart(&mut self) {
        self.pool.restart();
        self.map.restart();
        if let Some(hemispheres) = &mut self.hemispheres {
            hemispheres.restart();
        }
    }

    /// If the host's draws gather.
    pub(super) fn hemispheres_mut(&mut self) -> Option<&mut HemisphereScene> {
        self.hemispheres.as_mut()
    }

    /// Records what was planned of hemispheres, with the light of the last frame that was recorded.
    pub(super) fn record_draws(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        inputs: &DrawInputs<'_>,
    ) -> Result<(), Error> {
        match &mut self.hemispheres {
            Some(hemispheres) => hemispheres.record_draws(encoder, inputs, (&self.lights, &self.map)),
            None => Ok(()),
        }
    }

    /// Records the photons of a frame, and the texels that these change.
    pub(super) fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        passes: &PhotonPasses,
        traced: &mut TracedPhotons,
        inputs: &WalkInputs<'_>,
    ) -> Result<(), Error> {
        let (Some(stream), Some(gather)) = (&passes.photon_stream, &passes.texel_gather) else {
            return Ok(());
        };
        let (scene, settings) = (inputs.photons.scene, inputs.photons.settings);
        #[cfg(feature = "bvh")]
        if scene.bvh.is_none() && settings.tracer_kind.uses_triangles() {
            // A frame of photons for the selection of places alone.
            return traced.record_all(encoder, passes, inputs);
        }
        let (lights, pool, own) = (&self.lights, &mut self.pool, &mut self.stream);
        let mut is_part = false;
        traced.record_selected(encoder, passes, inputs, &mut |encoder, photons, retraced| {
            let mut stream_inputs = PhotonStreamInputs {
                queue: scene.queue,
                photons,
                pool: &mut *pool,
                lights,
                timestamps: scene.timestamps,
            };
            match retraced {
                Retraced::All => stream.record(encoder, own, &mut stream_inputs),
                Retraced::Listed(list) => {
                    is_part = true;
                    stream.record_listed(encoder, own, &stream_inputs, list)
                }
            }
        })?;
        let stream_inputs = PhotonStreamInputs {
            queue: scene.queue,
            photons: &traced.photons,
            pool: &mut self.pool,
            lights: &self.lights,
            timestamps: scene.timestamps,
        };
        // All photons bring it along.
        if is_part {
            stream.record_places(encoder, &mut self.stream, &stream_inputs);
        }
        let mut gather_inputs = TexelGatherInputs {
            queue: scene.queue,
            lights: &self.lights,
            share: self.pool.share(),
            area: inputs.photons.area,
            rays: self.hemispheres.is_none().then_some(&self.rays),
            incident: Some((&self.pool, &traced.photons)),
            map: &mut self.map,
            sample_offset: inputs.sample_offset,
            settings: &settings.illumination_maps.gather,
            timestamps: scene.timestamps,
        };
        gather.record_rays(encoder, &mut self.gather, &mut gather_inputs)?;
        if let Some(hemispheres) = &mut self.hemispheres {
            let draw_inputs = DrawInputs {
                queue: scene.queue,
                passes,
                geometry: scene.geometry,
                views: inputs.photons.hemisphere_views,
                timestamps: scene.timestamps,
            };
            hemispheres.record(encoder, &draw_inputs, (&self.lights, gather_inputs.map))?;
            gather.record(encoder, &mut self.gather, &gather_inputs);
            return Ok(());
        }
        let traced_scene = TracedScene {
            queue: scene.queue,
            passes,
            settings,
            #[cfg(feature = "bvh")]
            bvh: scene.bvh,
            maps: inputs.maps,
            timestamps: scene.timestamps,
        };
        self.tracers.record(encoder, &self.rays, &traced_scene)?;
        gather.record(encoder, &mut self.gather, &gather_inputs);
        Ok(())
    }

    pub(super) fn lights(&self) -> &SurfaceLights {
        &self.lights
    }

    pub(super) fn map(&self) -> &IlluminationMap {
        &self.map
    }

    pub(super) fn memory_use(&self) -> u64 {
        self.lights.memory_use()
            + self.pool.memory_use()
            + self.map.memory_use()
            + self.rays.memory_use()
            + self.stream.memory_use()
            + self.gather.memory_use()
            + self.tracers.memory_use()
            + self.hemispheres.as_ref().map_or(0, HemisphereScene::memory_use)
    }
}
