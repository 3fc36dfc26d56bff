//! What one view sees in mirrors and through glass.

use super::indirect_view::{IndirectViewInputs, MOST_RAYS};
use super::ray_tracers::RayTracers;
use crate::Error;
use crate::pass::{GlossyLightInputs, GlossyLightResources, PathShape, SpecularPathsInputs, SpecularPathsResources};
use crate::resource::{Environment, Irradiance, ShadowMaps, SurfaceRays};

/// Allocated while anything specular may be in view.
#[derive(Debug)]
pub(super) struct SpecularView {
    /// Of one band after the other.
    rays: SurfaceRays,
    band_rows: u32,
    /// Of each band.
    own: Vec<SpecularPathsResources>,
    tracers: RayTracers,
    glossy: GlossyLightResources,
    radiance: Irradiance,
}

impl SpecularView {
    pub(super) fn new(device: &wgpu::Device, shape: PathShape, size: [u32; 2]) -> Result<Self, Error> {
        let band_rows = (MOST_RAYS / u64::from(size[0])).clamp(1, u64::from(size[1])) as u32;
        let pixels = size[0] * band_rows;
        let own = (0..size[1].div_ceil(band_rows)).map(|_| SpecularPathsResources::new(device, pixels, shape));
        Ok(Self {
            rays: SurfaceRays::new(device, pixels)?,
            band_rows,
            own: own.collect::<Result<_, _>>()?,
            tracers: RayTracers::new(device)?,
            glossy: GlossyLightResources::new(device)?,
            radiance: Irradiance::new(device, size, wgpu::TextureFormat::Rgba32Float)?,
        })
    }

    /// At pixels whose surface is specular.
    pub(super) fn radiance(&self) -> &Irradiance {
        &self.radiance
    }

    /// Records the paths of all pixels.
    pub(super) fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        inputs: &IndirectViewInputs<'_>,
        shadow_maps: &ShadowMaps,
        environment: &Environment,
    ) -> Result<(), Error> {
        let Some(photons) = inputs.scene.photon_grid() else {
            return Ok(());
        };
        let pass = &inputs.passes.0.specular_paths;
        let glossy = inputs.passes.0.glossy_light.as_ref().zip(inputs.scene.glossy_grid());
        let weights = [inputs.view.composite.direct, inputs.view.composite.indirect];
        let mut path_inputs = SpecularPathsInputs {
            queue: inputs.view.queue,
            g_buffer: inputs.g_buffer,
            rows: [0, self.band_rows],
            rays: &self.rays,
            photons,
            lights: inputs.lights,
            shadow_maps,
            environment,
            radiance: &self.radiance,
            weights,
            skips_glossy: glossy.is_some(),
            sample_offset: inputs.sample_offset,
            timestamps: inputs.view.timestamps,
        };
        for own in &mut self.own {
            let shape = own.shape();
            for round in 0..shape.rounds {
                pass.record_rays(encoder, own, &path_inputs, round);
                for step in 0..shape.steps {
                    self.tracers.record(encoder, &self.rays, &inputs.traced_scene())?;
                    pass.record(encoder, own, &path_inputs, [round, step]);
                }
            }
            path_inputs.rows[0] += self.band_rows;
        }
        if let Some((pass, photons)) = glossy {
            let glossy_inputs = GlossyLightInputs {
                queue: inputs.view.queue,
                g_buffer: inputs.g_buffer,
                photons,
                lights: inputs.lights,
                shadow_maps,
                radiance: &self.radiance,
                weights,
                timestamps: inputs.view.timestamps,
            };
            pass.record(encoder, &mut self.glossy, &glossy_inputs);
        }
        Ok(())
    }

    pub(super) fn memory_use(&self) -> u64 {
        let own: u64 = self.own.iter().map(SpecularPathsResources::memory_use).sum();
        self.rays.memory_use() + own + self.tracers.memory_use() + self.glossy.memory_use() + self.radiance.memory_use()
    }
}
