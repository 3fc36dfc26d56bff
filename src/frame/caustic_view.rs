//! Caustics in one view: their photons at all pixels, under kernels of their own.

use super::indirect_view::IndirectViewInputs;
use super::{CausticMethod, Settings};
use crate::Error;
use crate::pass::{
    Bandwidth, CausticFilterInputs, CausticFilterResources, PhotonSplatterInputs, PhotonSplatterResources,
    PhotonSplatterSettings, progressive_scale,
};
use crate::resource::{Irradiance, Photons, Subsampling};

/// Range of the density of photons over that of as many spread evenly over all surfaces: caustics may be as bright as they
/// like, and where next to no photons are, kernels of the widest that a view allows.
const DENSITY_RANGE: [f32; 2] = [0.01, 1e9];

/// Allocated while caustics have photons of their own.
#[derive(Debug)]
pub(super) struct CausticView {
    estimate: Estimate,
    irradiance: Irradiance,
}

/// By [`CausticMethod`].
#[derive(Debug)]
enum Estimate {
    Splatting(Box<PhotonSplatterResources>),
    Filter(Box<CausticFilterResources>),
}

impl CausticView {
    pub(super) fn new(
        device: &wgpu::Device,
        settings: &Settings,
        photons: &Photons,
        size: [u32; 2],
    ) -> Result<Self, Error> {
        let estimate = match settings.caustic.method {
            CausticMethod::Splatting => {
                let own = PhotonSplatterResources::new(device, &settings.splatter_config, photons, size)?;
                Estimate::Splatting(Box::new(own))
            }
            CausticMethod::Filter => Estimate::Filter(Box::new(CausticFilterResources::new(device, size)?)),
        };
        Ok(Self {
            estimate,
            irradiance: Irradiance::new(device, size, wgpu::TextureFormat::Rgba32Float)?,
        })
    }

    pub(super) fn irradiance(&self) -> &Irradiance {
        &self.irradiance
    }

    /// Records the estimate.
    pub(super) fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        inputs: &IndirectViewInputs<'_>,
    ) -> Result<(), Error> {
        let Some(photons) = inputs.scene.caustic_photons() else {
            return Ok(());
        };
        match &mut self.estimate {
            Estimate::Splatting(own) => {
                splat(encoder, own, (photons, &self.irradiance), inputs);
                Ok(())
            }
            Estimate::Filter(own) => {
                let Some(pass) = &inputs.passes.0.caustic_filter else {
                    return Ok(());
                };
                let filter_inputs = CausticFilterInputs {
                    queue: inputs.view.queue,
                    photons: &[photons],
                    g_buffer: inputs.g_buffer,
                    irradiance: &self.irradiance,
                    radius: inputs.radius,
                    settings: &inputs.settings.caustic.filter,
                    timestamps: inputs.view.timestamps,
                };
                pass.record(encoder, own, &filter_inputs)
            }
        }
    }

    pub(super) fn memory_use(&self) -> u64 {
        let own = match &self.estimate {
            Estimate::Splatting(own) => own.memory_use(),
            Estimate::Filter(own) => own.memory_use(),
        };
        own + self.irradiance.memory_use()
    }
}

/// Records them under kernels.
fn splat(
    encoder: &mut wgpu::CommandEncoder,
    own: &mut PhotonSplatterResources,
    (photons, irradiance): (&Photons, &Irradiance),
    inputs: &IndirectViewInputs<'_>,
) {
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
        irradiance,
        area: inputs.area,
        radius: inputs.radius,
        sample_offset: inputs.sample_offset,
        settings: &settings,
        timestamps: inputs.view.timestamps,
    };
    inputs.passes.0.photon_splatter.record(encoder, own, &splatter_inputs);
}
