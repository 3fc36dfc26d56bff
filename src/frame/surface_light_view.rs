//! What a view has of surface lights: their irradiance, with the rays of its shadows, and that of photons near by.

use super::Settings;
use super::indirect_view::{IndirectViewInputs, MOST_RAYS};
use super::ray_tracers::RayTracers;
use super::surface_light_scene::SurfaceLightScene;
use crate::Error;
use crate::pass::{
    Bandwidth, IndirectShadows, LightForm, PhotonSplatterInputs, PhotonSplatterResources, PhotonSplatterSettings,
    SurfaceLightRays, SurfaceLightShading, SurfaceLightShadingInputs, SurfaceLightShadingResources, progressive_scale,
};
use crate::resource::{Irradiance, Photons, SurfaceRays};

/// Range of the density of photons near by over that of as many spread evenly over all surfaces.
const DENSITY_RANGE: [f32; 2] = [0.25, 1.0];

/// Allocated while indirect light comes from surface lights.
#[derive(Debug)]
pub(super) struct SurfaceLightView {
    own: SurfaceLightShadingResources,
    /// If they throw shadows.
    shadows: Option<Shadows>,
    /// If photons are kept that came a short way.
    near: Option<NearPhotons>,
}

/// What lights lose near by.
#[derive(Debug)]
struct NearPhotons {
    splatter: PhotonSplatterResources,
    irradiance: Irradiance,
    /// Whether there were any in the last frame.
    are_there: bool,
}

#[derive(Debug)]
struct Shadows {
    /// Of one band after the other.
    rays: SurfaceRays,
    rays_a_pixel: u32,
    band_rows: u32,
    /// Of each band.
    own: Vec<SurfaceLightShadingResources>,
    tracers: RayTracers,
}

impl SurfaceLightView {
    pub(super) fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            own: SurfaceLightShadingResources::new(device)?,
            shadows: None,
            near: None,
        })
    }

    /// The format of irradiance that the settings make.
    pub(super) fn format(device: &wgpu::Device, settings: &Settings) -> wgpu::TextureFormat {
        let shading = &settings.surface_lights.shading;
        let is_drawn = shading.form == LightForm::Drawn && shading.shadows == IndirectShadows::Off;
        match is_drawn && !device.features().contains(wgpu::Features::FLOAT32_BLENDABLE) {
            true => wgpu::TextureFormat::Rgba16Float,
            false => wgpu::TextureFormat::Rgba32Float,
        }
    }

    /// Makes or drops what shadows need, room for the rays of a band of `size` pixels' rows; makes what photons near by need.
    pub(super) fn follow(
        &mut self,
        device: &wgpu::Device,
        settings: &Settings,
        scene: &SurfaceLightScene,
        size: [u32; 2],
    ) -> Result<(), Error> {
        if let (None, Some(photons)) = (&self.near, scene.near_photons()) {
            self.near = Some(NearPhotons {
                splatter: PhotonSplatterResources::new(device, &settings.splatter_config, photons, size)?,
                irradiance: Irradiance::new(device, size, wgpu::TextureFormat::Rgba32Float)?,
                are_there: false,
            });
        }
        let rays = SurfaceLightShading::rays_a_pixel(&settings.surface_lights.shading, scene.lights());
        if rays == 0 {
            self.shadows = None;
        } else if self.shadows.as_ref().is_none_or(|s| s.rays_a_pixel != rays) {
            self.shadows = Some(Shadows::new(device, size, rays)?);
        }
        Ok(())
    }

    /// Records the irradiance.
    pub(super) fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        estimated: &Irradiance,
        inputs: &IndirectViewInputs<'_>,
    ) -> Result<(), Error> {
        let (Some(pass), Some(scene)) = (&inputs.passes.0.surface_light_shading, inputs.scene.surface_lights()) else {
            return Ok(());
        };
        let shading_inputs = SurfaceLightShadingInputs {
            queue: inputs.view.queue,
            g_buffer: inputs.g_buffer,
            subsampling: inputs.settings.subsampling,
            lights: scene.lights(),
            share: scene.share(),
            area: inputs.area,
            radius: inputs.radius,
            irradiance: estimated,
            sample_offset: inputs.sample_offset,
            settings: &inputs.settings.surface_lights.shading,
            timestamps: inputs.view.timestamps,
        };
        if let Some(near) = &mut self.near {
            near.are_there = scene.near_photons().is_some();
            if let Some(photons) = scene.near_photons() {
                near.record(encoder, photons, inputs);
            }
        }
        let Some(shadows) = &mut self.shadows else {
            return pass.record(encoder, &mut self.own, &shading_inputs);
        };
        for (index, own) in (0..).zip(&mut shadows.own) {
            let band = SurfaceLightRays {
                rays: &shadows.rays,
                rows: [index * shadows.band_rows, shadows.band_rows],
            };
            pass.record_rays(encoder, own, &shading_inputs, &band);
            shadows.tracers.record(encoder, &shadows.rays, &inputs.traced_scene())?;
            pass.record_shadowed(encoder, own, &shading_inputs, &band)?;
        }
        Ok(())
    }

    /// What is to be added to the irradiance that was recorded.
    pub(super) fn near(&self) -> Option<&Irradiance> {
        self.near.as_ref().filter(|n| n.are_there).map(|n| &n.irradiance)
    }

    pub(super) fn memory_use(&self) -> u64 {
        let near = self.near.as_ref();
        let near = near.map_or(0, |n| n.splatter.memory_use() + n.irradiance.memory_use());
        let shadows = self.shadows.as_ref().map_or(0, |s| {
            let own: u64 = s.own.iter().map(SurfaceLightShadingResources::memory_use).sum();
            s.rays.memory_use() + own + s.tracers.memory_use()
        });
        self.own.memory_use() + shadows + near
    }
}

impl NearPhotons {
    fn record(&mut self, encoder: &mut wgpu::CommandEncoder, photons: &Photons, inputs: &IndirectViewInputs<'_>) {
        let settings = PhotonSplatterSettings {
            // The bins of the screen hold few of them, and would say nothing of how dense all photons are.
            bandwidth: Bandwidth::Density {
                photons: inputs.settings.surface_lights.near_kernel,
                clamp: DENSITY_RANGE,
            },
            radius_scale: progressive_scale(inputs.view.accumulated, inputs.settings.radius_alpha),
            ..inputs.settings.splatter
        };
        let splatter_inputs = PhotonSplatterInputs {
            queue: inputs.view.queue,
            photons,
            g_buffer: inputs.g_buffer,
            subsampling: inputs.settings.subsampling,
            irradiance: &self.irradiance,
            area: inputs.area,
            radius: inputs.radius,
            sample_offset: inputs.sample_offset,
            settings: &settings,
            timestamps: inputs.view.timestamps,
        };
        inputs
            .passes
            .0
            .photon_splatter
            .record(encoder, &mut self.splatter, &splatter_inputs);
    }
}

impl Shadows {
    fn new(device: &wgpu::Device, size: [u32; 2], rays_a_pixel: u32) -> Result<Self, Error> {
        let rays_a_row = u64::from(size[0]) * u64::from(rays_a_pixel);
        let band_rows = (MOST_RAYS / rays_a_row.max(1)).clamp(1, u64::from(size[1])) as u32;
        let rays = u32::try_from(rays_a_row * u64::from(band_rows)).unwrap_or(u32::MAX);
        let own = (0..size[1].div_ceil(band_rows)).map(|_| SurfaceLightShadingResources::new(device));
        Ok(Self {
            rays: SurfaceRays::new(device, rays)?,
            rays_a_pixel,
            band_rows,
            own: own.collect::<Result<_, _>>()?,
            tracers: RayTracers::new(device)?,
        })
    }
}
