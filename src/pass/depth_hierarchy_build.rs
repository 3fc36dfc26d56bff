//! Between which depths the surfaces in ever coarser parts of environment maps lie, so that rays can step over empty space.
//!
//! Input: [`EnvMaps`]. Output: [`DepthHierarchy`]. Cost: nine fetches a texel, then four a cell of each coarser level; maps
//! that were not captured anew need none. Source: this crate's; minimum-maximum mipmaps of depth are well known, of inverse
//! depth with each texel as a piece of plane they are exact for flat surfaces.

use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::{DepthHierarchy, EnvMaps, RANGE_FORMAT};
use crate::{Error, Timestamps, wgsl};

/// Bindings of both shaders in `shaders/pass/depth_hierarchy_build/`, in order.
pub(crate) const SLOTS: [Slot; 3] = [Slot::UintArray, Slot::StorageArray(RANGE_FORMAT), Slot::Storage];

/// Invocations along a side of a workgroup.
const GROUP: u32 = 8;

/// The pass.
#[derive(Debug)]
pub struct DepthHierarchyBuild {
    device: wgpu::Device,
    layout: wgpu::BindGroupLayout,
    measure: wgpu::ComputePipeline,
    join: wgpu::ComputePipeline,
}

/// Which maps, and bind groups.
#[derive(Debug)]
pub struct DepthHierarchyBuildResources {
    maps: wgpu::Buffer,
    groups: BindGroupCache,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct DepthHierarchyBuildInputs<'a> {
    /// For the list of maps.
    pub queue: &'a wgpu::Queue,
    /// Captured.
    pub env_maps: &'a EnvMaps,
    /// Written; made for these maps.
    pub hierarchy: &'a DepthHierarchy,
    /// Maps that were captured since, those that are not in use left out; `None`: all that are in use.
    pub maps: Option<&'a [u32]>,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl DepthHierarchyBuild {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let label = "lightfall::DepthHierarchyBuild";
        let layout = device::layout(device, label, wgpu::ShaderStages::COMPUTE, &SLOTS);
        let pipeline = |label, source, entry_point| {
            device::compute_pipeline(
                device,
                &ComputeSpec {
                    label,
                    source,
                    entry_point,
                    layouts: &[&layout],
                    constants: &[],
                },
            )
        };
        Self {
            device: device.clone(),
            measure: pipeline(
                "lightfall::DepthHierarchyBuild::measure_texels",
                wgsl::DEPTH_HIERARCHY_BUILD_MEASURE,
                "measure_texels",
            ),
            join: pipeline(
                "lightfall::DepthHierarchyBuild::join_cells",
                wgsl::DEPTH_HIERARCHY_BUILD_JOIN,
                "join_cells",
            ),
            layout,
        }
    }

    /// Records all levels. Of a map of which one face was captured all six are measured: texels at the border of a face look
    /// at the next.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut DepthHierarchyBuildResources,
        inputs: &DepthHierarchyBuildInputs<'_>,
    ) {
        let room = resources.maps.size() / size_of::<u32>() as u64;
        let in_use = (inputs.env_maps.centers().len() as u64).min(room) as u32;
        let maps: Vec<u32> = (0..in_use)
            .filter(|map| inputs.maps.is_none_or(|maps| maps.contains(map)))
            .collect();
        if maps.is_empty() {
            return;
        }
        inputs
            .queue
            .write_buffer(&resources.maps, 0, bytemuck::cast_slice(&maps));
        let label = "lightfall::DepthHierarchyBuild";
        let levels = inputs.hierarchy.levels();
        let sources = std::iter::once(inputs.env_maps.view()).chain(levels);
        let groups: Vec<_> = sources
            .zip(levels)
            .map(|(source, target)| {
                let bound = [source.into(), target.into(), (&resources.maps).into()];
                resources.groups.get(&self.device, label, &self.layout, &bound)
            })
            .collect();
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        for (level, group) in (0..).zip(&groups) {
            let side = (inputs.env_maps.size().next_power_of_two() >> level).div_ceil(GROUP);
            pass.set_pipeline(if level == 0 { &self.measure } else { &self.join });
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(side, side, 6 * maps.len() as u32);
        }
    }
}

impl DepthHierarchyBuildResources {
    /// For these maps.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device, env_maps: &EnvMaps) -> Result<Self, Error> {
        /// Levels of the largest maps that there can be.
        const LEVELS: usize = 16;
        use wgpu::BufferUsages as U;
        let bytes = u64::from(env_maps.capacity()) * size_of::<u32>() as u64;
        let label = "lightfall::DepthHierarchyBuild::maps";
        Ok(Self {
            maps: device::buffer(device, label, bytes, U::STORAGE | U::COPY_DST)?,
            groups: BindGroupCache::for_uses(LEVELS),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.maps.size()
    }
}
