//! How near to each lamp anything stands, coarsely, so that the search for occluders need not look further than it must.
//!
//! Inputs: [`Lights`], [`ShadowMaps`]. Output: [`NearestOccluders`]. Cost: every texel of the shadow maps of lights with an
//! extent once, for all views; nothing where no light has one. Source: this crate's; Yao et al., soft shadows and
//! image-space photon mapping, section 3.4, search everywhere as far (Eq. 2). Limits: of occluders nearer to the lamp than
//! five of its radii, those in the way from beyond a tile's neighbours are overlooked.

use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::nearest_occluders::TILES;
use crate::resource::{Lights, NearestOccluders, ShadowMaps};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/nearest_occluder.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) light_count: u32,
        pub(crate) shadow_map_size: u32,
        pub(crate) layer_count: u32,
    }
}

/// Bindings of `shaders/pass/nearest_occluder.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 4] = [Slot::Uniform, Slot::Storage, Slot::UintArray, Slot::StorageMut];

/// The pass.
#[derive(Debug)]
pub struct NearestOccluder {
    device: wgpu::Device,
    layout: wgpu::BindGroupLayout,
    reduce: wgpu::ComputePipeline,
    spread: wgpu::ComputePipeline,
}

/// Uniforms and bind groups.
#[derive(Debug)]
pub struct NearestOccluderResources {
    params: wgpu::Buffer,
    groups: BindGroupCache,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct NearestOccluderInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// Sources.
    pub lights: &'a Lights,
    /// What they see.
    pub shadow_maps: &'a ShadowMaps,
    /// Written; made for the layers of `shadow_maps`.
    pub nearest: &'a NearestOccluders,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl NearestOccluder {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let stage = wgpu::ShaderStages::COMPUTE;
        let layout = device::layout(device, "lightfall::NearestOccluder", stage, &SLOTS);
        let pipeline = |label, entry_point| {
            device::compute_pipeline(
                device,
                &ComputeSpec {
                    label,
                    source: wgsl::NEAREST_OCCLUDER,
                    entry_point,
                    layouts: &[&layout],
                    constants: &[],
                },
            )
        };
        Self {
            device: device.clone(),
            reduce: pipeline("lightfall::NearestOccluder::reduce", "reduce_tiles"),
            spread: pipeline("lightfall::NearestOccluder::spread", "spread_tiles"),
            layout,
        }
    }

    /// Records the reduction, after the shadow maps have been captured.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut NearestOccluderResources,
        inputs: &NearestOccluderInputs<'_>,
    ) {
        let layers = inputs.nearest.layers();
        let params = gpu::Params {
            light_count: inputs.lights.count(),
            shadow_map_size: inputs.shadow_maps.size(),
            layer_count: layers,
        };
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let bound = [
            (&resources.params).into(),
            inputs.lights.buffer().into(),
            inputs.shadow_maps.view().into(),
            inputs.nearest.buffer().into(),
        ];
        let label = "lightfall::NearestOccluder";
        let group = resources.groups.get(&self.device, label, &self.layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_bind_group(0, &group, &[]);
        pass.set_pipeline(&self.reduce);
        pass.dispatch_workgroups(TILES * TILES, layers, 1);
        pass.set_pipeline(&self.spread);
        pass.dispatch_workgroups(layers, 1, 1);
    }
}

impl NearestOccluderResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::NearestOccluder::params")?,
            groups: BindGroupCache::default(),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.params.size()
    }
}
