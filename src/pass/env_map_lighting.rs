//! Lights what environment maps show: irradiance at the surface points of their texels.
//!
//! Inputs: [`EnvMaps`], [`Photons`], [`Lights`], [`ShadowMaps`]. Output: [`EnvMapIrradiance`], direct and indirect light together.
//! Direct light is that of the lamps' centres where shadow maps agree; indirect light is estimated from the photons around, as
//! [`PhotonSplatter`](super::PhotonSplatter) does on the screen, of cells of space instead of its bins. Sources: Yao et al. 2010,
//! section 7 (lit environment maps); Larsen 2004, chapter 11 (gathering from lit surfaces).
//!
//! Cost: photons sorted, then texels × photons of the 27 cells around, which are as wide as the widest kernel that evenly
//! spread photons have. Limits: no kernel is wider than a cell; lamps count by their centres.

use super::photon_splatter::{self, gpu::Bandwidth as BandwidthUniform};
use super::stable_sort::{Side, SortBuffers, StableSort};
use super::{Bandwidth, BoundaryCorrection, Kernel, dispatch_64};
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::{EnvMapIrradiance, EnvMaps, Lights, Photons, ShadowMaps};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use super::BandwidthUniform;
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/env_map_lighting/params.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) bandwidth: BandwidthUniform,
        pub(crate) first_slot: u32,
        pub(crate) slot_count: u32,
        pub(crate) row: u32,
        pub(crate) cells: u32,
        pub(crate) map_size: u32,
        pub(crate) size: u32,
        pub(crate) light_count: u32,
        pub(crate) shadow_map_size: u32,
        pub(crate) is_corrected: u32,
        pub(crate) sample_offset: u32,
    }
}

/// Bindings of `shaders/pass/env_map_lighting/sort_photons.wgsl`, in order.
pub(crate) const SORT_SLOTS: [Slot; 6] = [
    Slot::Uniform,
    Slot::Storage,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::StorageMut,
];

/// Bindings of `shaders/pass/env_map_lighting/light_texels.wgsl`, in order.
pub(crate) const LIGHT_SLOTS: [Slot; 9] = [
    Slot::Uniform,
    Slot::UintArray,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::UintArray,
    Slot::StorageArray(wgpu::TextureFormat::Rgba32Float),
    Slot::Storage,
];

/// Most cells along each axis.
const MOST_CELLS: u32 = 64;

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
    sort_layout: wgpu::BindGroupLayout,
    light_layout: wgpu::BindGroupLayout,
    find_cells: wgpu::ComputePipeline,
    sort: StableSort,
    find_first: wgpu::ComputePipeline,
    prepare: wgpu::ComputePipeline,
    light: wgpu::ComputePipeline,
}

/// Working memory for so many photons.
#[derive(Debug)]
pub struct EnvMapLightingResources {
    params: wgpu::Buffer,
    sort: SortBuffers,
    splats: wgpu::Buffer,
    first_splats: wgpu::Buffer,
    slots: u32,
    sort_groups: BindGroupCache,
    light_groups: BindGroupCache,
    bytes: u64,
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
        let layout = |label, slots: &[Slot]| device::layout(device, label, wgpu::ShaderStages::COMPUTE, slots);
        let sort_layout = layout("lightfall::EnvMapLighting::sort", &SORT_SLOTS);
        let light_layout = layout("lightfall::EnvMapLighting::light", &LIGHT_SLOTS);
        let surfaces = ("splat_keeps_to_surfaces", f64::from(u8::from(keeps_to_surfaces)));
        let pipeline = |label, source, entry_point, layout, constants: &[(&str, f64)]| {
            let spec = ComputeSpec {
                label,
                source,
                entry_point,
                layouts: &[layout],
                constants,
            };
            device::compute_pipeline(device, &spec)
        };
        let step = |label, entry_point| {
            let source = wgsl::ENV_MAP_LIGHTING_SORT;
            pipeline(label, source, entry_point, &sort_layout, &[surfaces])
        };
        Self {
            device: device.clone(),
            find_cells: step("lightfall::EnvMapLighting::find_cells", "find_cells"),
            sort: StableSort::new(device),
            find_first: step("lightfall::EnvMapLighting::find_first", "find_first"),
            prepare: step("lightfall::EnvMapLighting::prepare", "prepare_splats"),
            light: pipeline(
                "lightfall::EnvMapLighting::light",
                wgsl::ENV_MAP_LIGHTING,
                "light_texels",
                &light_layout,
                &[("kernel", f64::from(kernel as u32)), surfaces],
            ),
            sort_layout,
            light_layout,
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
        let slots = photon_splatter::splatted_slots(inputs.photons).min(resources.slots);
        let (groups, row) = dispatch_64(slots);
        let (bandwidth, widest) = photon_splatter::free_bandwidth(
            inputs.settings.bandwidth,
            inputs.photons.count(),
            (inputs.area, inputs.radius),
        );
        let params = gpu::Params {
            bandwidth,
            first_slot: inputs.photons.count(),
            slot_count: slots,
            row,
            cells: cells(widest),
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
        self.record_sort(encoder, resources, inputs, (slots, groups, params.cells));
        let bound = [
            (&resources.params).into(),
            inputs.env_maps.view().into(),
            inputs.env_maps.centers_buffer().into(),
            (&resources.splats).into(),
            (&resources.first_splats).into(),
            inputs.lights.buffer().into(),
            inputs.shadow_maps.view().into(),
            inputs.irradiance.view().into(),
            inputs.lights.polygons().into(),
        ];
        let label = "lightfall::EnvMapLighting";
        let cache = &mut resources.light_groups;
        let group = cache.get(&self.device, label, &self.light_layout, &bound);
        let side = params.size.div_ceil(8);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.light);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(side, side, 6 * maps);
        drop(pass);
        encoder.pop_debug_group();
    }

    fn record_sort(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut EnvMapLightingResources,
        inputs: &EnvMapLightingInputs<'_>,
        (slots, groups, cells): (u32, [u32; 2], u32),
    ) {
        let label = "lightfall::EnvMapLighting::sort";
        let mut group = |side: &Side| {
            let bound = [
                (&resources.params).into(),
                inputs.photons.buffer().into(),
                (&side.keys).into(),
                (&side.values).into(),
                (&resources.splats).into(),
                (&resources.first_splats).into(),
            ];
            let cache = &mut resources.sort_groups;
            cache.get(&self.device, label, &self.sort_layout, &bound)
        };
        let [unsorted, sorted] = [group(resources.sort.unsorted()), group(resources.sort.sorted())];
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        if slots > 0 {
            pass.set_bind_group(0, &unsorted, &[]);
            pass.set_pipeline(&self.find_cells);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
            self.sort
                .record(&self.device, inputs.queue, &mut pass, &mut resources.sort, slots);
        }
        pass.set_bind_group(0, &sorted, &[]);
        let ([x, y], _) = dispatch_64(cells.pow(3) + 1);
        pass.set_pipeline(&self.find_first);
        pass.dispatch_workgroups(x, y, 1);
        if slots > 0 {
            pass.set_pipeline(&self.prepare);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
        }
    }
}

impl EnvMapLightingResources {
    /// Bytes for photon buffers of `slots` slots, hop 0 not counted.
    pub fn size_in_bytes(slots: u32) -> u64 {
        let params = size_of::<gpu::Params>() as u64;
        let splats = u64::from(slots.max(1)) * photon_splatter::SPLAT_BYTES;
        SortBuffers::size_in_bytes(slots, MOST_CELLS.pow(3)) + splats + 4 * u64::from(MOST_CELLS.pow(3) + 1) + params
    }

    /// Working memory for these photons.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, photons: &Photons) -> Result<Self, Error> {
        let slots = photon_splatter::splatted_slots(photons);
        photon_splatter::check_splats(device, slots)?;
        let storage = |label, bytes| device::buffer(device, label, bytes, wgpu::BufferUsages::STORAGE);
        Ok(Self {
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::EnvMapLighting::params")?,
            sort: SortBuffers::new(device, slots, MOST_CELLS.pow(3))?,
            splats: storage(
                "lightfall::EnvMapLighting::splats",
                u64::from(slots.max(1)) * photon_splatter::SPLAT_BYTES,
            )?,
            first_splats: storage(
                "lightfall::EnvMapLighting::first_splats",
                4 * u64::from(MOST_CELLS.pow(3) + 1),
            )?,
            slots,
            sort_groups: BindGroupCache::for_uses(2),
            light_groups: BindGroupCache::default(),
            bytes: Self::size_in_bytes(slots),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}

/// Cells along each axis of the cube [−1, 1]³, so that none is narrower than the widest kernel.
fn cells(widest: f32) -> u32 {
    // The largest of NaN and 1 is 1.
    (2.0 / widest).floor().max(1.0).min(MOST_CELLS as f32) as u32
}

#[cfg(test)]
mod tests {
    use super::cells;

    #[test]
    fn cells_are_as_wide_as_the_widest_kernel() {
        assert_eq!(
            [0.0, 1e-6, 0.03125, 0.0999, 0.5, 1.5, 100.0, f32::INFINITY, f32::NAN].map(cells),
            [64, 64, 64, 20, 4, 1, 1, 1, 1]
        );
    }
}
