//! Caustics in one view: their photons at all pixels, under kernels of their own.

use super::Settings;
use super::indirect_view::IndirectViewInputs;
use crate::Error;
use crate::pass::{
    Bandwidth, PhotonSplatterInputs, PhotonSplatterResources, PhotonSplatterSettings, progressive_scale,
};
use crate::resource::{Irradiance, Photons, Subsampling};

/// Range of the density of photons over that of as many spread evenly over all surfaces: caustics may be as bright as they
/// like, and where next to no photons are, kernels of the widest that a view allows.
const DENSITY_RANGE: [f32; 2] = [0.01, 1e9];

/// Allocated while caustics have photons of their own.
#[derive(Debug)]
pub(super) struct CausticView {
    splatter: PhotonSplatterResources,
    irradiance: Irradiance,
}

impl CausticView {
    pub(super) fn new(
        device: &wgpu::Device,
        settings: &Settings,
        photons: &Photons,
        size: [u32; 2],
    ) -> Result<Self, Error> {
        Ok(Self {
            splatter: PhotonSplatterResources::new(device, &settings.splatter_config, photons, size)?,
            irradiance: Irradiance::new(device, size, wgpu::TextureFormat::Rgba32Float)?,
        })
    }

    pub(super) fn irradiance(&self) -> &Irradiance {
        &self.irradiance
    }

    /// Records the estimate.
    pub(super) fn record(&mut self, encoder: &mut wgpu::CommandEncoder, inputs: &IndirectViewInputs<'_>) {
        let Some(photons) = inputs.scene.caustic_photons() else {
            return;
        };
        let caustic = &inputs.settings.caustic;
        let settings = PhotonSplatterSettings {
            bandwidth: Bandwidth::Screen {
                photons: caustic.kernel_photons,
                clamp: DENSITY_RANGE,
            },
            min_radius: caustic.min_radius,
            radius_scale: progressive_scale(inputs.view.accumulated, inputs.settings.radius_alpha),
            ..inputs.settings.splatter
        };
        let splatter_inputs = PhotonSplatterInputs {
            queue: inputs.view.queue,
            photons,
            g_buffer: inputs.g_buffer,
            subsampling: Subsampling::Full,
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

    pub(super) fn memory_use(&self) -> u64 {
        self.splatter.memory_use() + self.irradiance.memory_use()
    }
}
