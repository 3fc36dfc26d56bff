//! Lights what environment maps show: irradiance at the surface points of their texels.
//!
//! Inputs: [`EnvMaps`], [`Photons`], [`Lights`], [`ShadowMaps`]. Output: [`EnvMapIrradiance`], direct and indirect light together.
//! Direct light is that of the lamps' centres where shadow maps agree; indirect light is estimated from the photons around, as
//! [`PhotonSplatter`](super::PhotonSplatter) does on the screen, of cells of space instead of its bins. Sources: Yao et al. 2010,
//! section 7 (lit environment maps); Larsen 2004, chapter 11 (gathering from lit surfaces).
//!
//! Cost: photons sorted, then texels × photons of the 27 cells around, which are as wide as the widest kernel that evenly
//! spread photons have. Limits: no kernel is wider than a cell; lamps count by their centres.

use super::{Bandwidth, BoundaryCorrection, Kernel, PhotonGrid, PhotonGridInputs, PhotonGridResources, SortedPhotons};
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::{EnvMapIrradiance, EnvMaps, Lights, Photons, ShadowMaps};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/env_map_lighting/light_texels.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) map_size: u32,
        pub(crate) size: u32,
        pub(crate) light_count: u32,
        pub(crate) shadow_map_size: u32,
        pub(crate) is_corrected: u32,
        pub(crate) sample_offset: u32,
    }
}

/// Bindings of `shaders/pass/env_map_lighting/light_texels.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 10] = [
    Slot::Uniform,
    Slot::UintArray,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::UintArray,
    Slot::StorageArray(wgpu::TextureFormat::Rgba32Float),
    Slot::Storage,
    Slot::Uniform,
];

/// Speed against accuracy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnvMapLightingSettings {
    /// Kernel radius; [`Bandwidth::Screen`] counts as uniform density, for there is no screen.
    pub bandwidth: Bandwidth,
    /// What is done at rims.
    pub boundary: BoundaryCorrection,
}

/// The pass.
#[derive(Debug)]
pub struct EnvMapLighting {
    device: wgpu::Device,
    grid: PhotonGrid,
    layout: wgpu::BindGroupLayout,
    light: wgpu::ComputePipeline,
}

/// Working memory for so many photons.
#[derive(Debug)]
pub struct EnvMapLightingResources {
    params: wgpu::Buffer,
    grid: PhotonGridResources,
    groups: BindGroupCache,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct EnvMapLightingInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// What is lit.
    pub env_maps: &'a EnvMaps,
    /// Indirect light; hop 0 is left out.
    pub photons: &'a Photons,
    /// Direct light.
    pub lights: &'a Lights,
    /// What lights see.
    pub shadow_maps: &'a ShadowMaps,
    /// Written, at the maps in use.
    pub irradiance: &'a EnvMapIrradiance,
    /// Area of all surfaces, unit-frame lengths squared; sets the uniform density.
    pub area: f32,
    /// Radius of the region, unit frame.
    pub radius: f32,
    /// Number of the frame's first path, as the tracers have it.
    pub sample_offset: u32,
    /// How wide kernels are.
    pub settings: &'a EnvMapLightingSettings,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl EnvMapLighting {
    /// The pass on this device. Needs no features and no more than default limits. `keeps_to_surfaces` as in
    /// [`PhotonSplatterConfig`](super::PhotonSplatterConfig).
    pub fn new(device: &wgpu::Device, kernel: Kernel, keeps_to_surfaces: bool) -> Self {
        let layout = device::layout(device, "lightfall::EnvMapLighting", wgpu::ShaderStages::COMPUTE, &SLOTS);
        let spec = ComputeSpec {
            label: "lightfall::EnvMapLighting",
            source: wgsl::ENV_MAP_LIGHTING,
            entry_point: "light_texels",
            layouts: &[&layout],
            constants: &[
                ("kernel", f64::from(kernel as u32)),
                ("splat_keeps_to_surfaces", f64::from(u8::from(keeps_to_surfaces))),
            ],
        };
        Self {
            device: device.clone(),
            grid: PhotonGrid::new(device, SortedPhotons::OnDiffuse, keeps_to_surfaces),
            light: device::compute_pipeline(device, &spec),
            layout,
        }
    }

    /// Records the lighting of the maps in use.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut EnvMapLightingResources,
        inputs: &EnvMapLightingInputs<'_>,
    ) {
        let maps = (inputs.env_maps.centers().len() as u32).min(inputs.irradiance.capacity());
        if maps == 0 {
            return;
        }
        encoder.push_debug_group("lightfall::EnvMapLighting");
        let grid_inputs = PhotonGridInputs {
            queue: inputs.queue,
            photons: inputs.photons,
            area: inputs.area,
            radius: inputs.radius,
            bandwidth: inputs.settings.bandwidth,
            timestamps: inputs.timestamps,
        };
        self.grid.record(encoder, &mut resources.grid, &grid_inputs);
        let params = gpu::Params {
            map_size: inputs.env_maps.size(),
            size: inputs.irradiance.size(),
            light_count: inputs.lights.count(),
            shadow_map_size: inputs.shadow_maps.size(),
            is_corrected: u32::from(inputs.settings.boundary == BoundaryCorrection::KernelArea),
            sample_offset: inputs.sample_offset,
        };
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let bound = [
            (&resources.params).into(),
            inputs.env_maps.view().into(),
            inputs.env_maps.centers_buffer().into(),
            resources.grid.splats().into(),
            resources.grid.first_splats().into(),
            inputs.lights.buffer().into(),
            inputs.shadow_maps.view().into(),
            inputs.irradiance.view().into(),
            inputs.lights.polygons().into(),
            resources.grid.params().into(),
        ];
        let label = "lightfall::EnvMapLighting";
        let cache = &mut resources.groups;
        let group = cache.get(&self.device, label, &self.layout, &bound);
        let side = params.size.div_ceil(8);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.light);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(side, side, 6 * maps);
        drop(pass);
        encoder.pop_debug_group();
    }
}

impl EnvMapLightingResources {
    /// Working memory for these photons.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, photons: &Photons) -> Result<Self, Error> {
        Ok(Self {
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::EnvMapLighting::params")?,
            grid: PhotonGridResources::new(device, photons, SortedPhotons::OnDiffuse)?,
            groups: BindGroupCache::default(),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.params.size() + self.grid.memory_use()
    }
}
