//! Lists of rays, followed by whichever tracer the settings choose.

use super::Settings;
use super::indirect_scene::PhotonPasses;
#[cfg(feature = "bvh")]
use crate::pass::{BvhTracerResources, BvhTracerSurfaceRayInputs};
use crate::pass::{ImageSpaceTracerRayInputs, ImageSpaceTracerResources};
#[cfg(feature = "bvh")]
use crate::resource::BvhGeometry;
use crate::resource::{DepthHierarchy, EnvMaps, SurfaceRays};
use crate::{Error, Timestamps};

/// What rays meet, and what follows them.
#[derive(Clone, Copy)]
pub(super) struct TracedScene<'a> {
    pub(super) queue: &'a wgpu::Queue,
    pub(super) passes: &'a PhotonPasses,
    pub(super) settings: &'a Settings,
    #[cfg(feature = "bvh")]
    pub(super) bvh: Option<&'a BvhGeometry>,
    pub(super) maps: Option<(&'a EnvMaps, Option<&'a DepthHierarchy>)>,
    pub(super) timestamps: Option<&'a Timestamps>,
}

/// What the tracers of one list keep.
#[derive(Debug)]
pub(super) struct RayTracers {
    image_space: ImageSpaceTracerResources,
    #[cfg(feature = "bvh")]
    bvh: BvhTracerResources,
}

impl RayTracers {
    pub(super) fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            image_space: ImageSpaceTracerResources::new(device)?,
            #[cfg(feature = "bvh")]
            bvh: BvhTracerResources::new(device)?,
        })
    }

    /// Records what `rays` meet: triangles if the settings trace any, else what environment maps show.
    pub(super) fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        rays: &SurfaceRays,
        scene: &TracedScene<'_>,
    ) -> Result<(), Error> {
        let (queue, timestamps) = (scene.queue, scene.timestamps);
        #[cfg(feature = "bvh")]
        if let (Some(tracer), Some(geometry)) = (&scene.passes.bvh_tracer, scene.bvh) {
            let ray_inputs = BvhTracerSurfaceRayInputs {
                queue,
                geometry,
                rays,
                timestamps,
            };
            tracer.record_surface_rays(encoder, &mut self.bvh, &ray_inputs);
            return Ok(());
        }
        let (Some(tracer), Some((env_maps, hierarchy))) = (&scene.passes.image_space_tracer, scene.maps) else {
            return Ok(());
        };
        let ray_inputs = ImageSpaceTracerRayInputs {
            queue,
            env_maps,
            hierarchy,
            rays,
            settings: &scene.settings.tracer,
            timestamps,
        };
        tracer.record_rays(encoder, &mut self.image_space, &ray_inputs)
    }

    pub(super) fn memory_use(&self) -> u64 {
        let bytes = self.image_space.memory_use();
        #[cfg(feature = "bvh")]
        let bytes = bytes + self.bvh.memory_use();
        bytes
    }
}
