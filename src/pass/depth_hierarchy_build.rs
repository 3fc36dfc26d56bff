//! Between which depths the surfaces in ever coarser parts of environment maps lie, so that rays can step over empty space.
//!
//! Input: [`EnvMaps`]. Output: [`DepthHierarchy`]. Cost: nine fetches a texel, then four a cell of each coarser level; maps
//! that were not captured anew need none. Source: this crate's; minimum-maximum mipmaps of depth are well known, of inverse
//! depth with each texel as a piece of plane they are exact for flat surfaces.

use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::{DepthHierarchy, EnvMaps, RANGE_FORMAT};
use crate::{Timestamps, wgsl};

/// Bindings of both shaders in `shaders/pass/depth_hierarchy_build/`, in order.
pub(crate) const SLOTS: [Slot; 2] = [Slot::UintArray, Slot::StorageArray(RANGE_FORMAT)];

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

/// Bind groups.
#[derive(Debug)]
pub struct DepthHierarchyBuildResources {
    groups: BindGroupCache,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct DepthHierarchyBuildInputs<'a> {
    /// Captured.
    pub env_maps: &'a EnvMaps,
    /// Written; made for these maps.
    pub hierarchy: &'a DepthHierarchy,
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

    /// Records all levels, of the maps in use.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut DepthHierarchyBuildResources,
        inputs: &DepthHierarchyBuildInputs<'_>,
    ) {
        let layers = 6 * inputs.env_maps.centers().len() as u32;
        if layers == 0 {
            return;
        }
        let label = "lightfall::DepthHierarchyBuild";
        let levels = inputs.hierarchy.levels();
        let sources = std::iter::once(inputs.env_maps.view()).chain(levels);
        let groups: Vec<_> = sources
            .zip(levels)
            .map(|(source, target)| {
                let bound = [source.into(), target.into()];
                resources.groups.get(&self.device, label, &self.layout, &bound)
            })
            .collect();
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        for (level, group) in (0..).zip(&groups) {
            let side = (inputs.env_maps.size().next_power_of_two() >> level).div_ceil(GROUP);
            pass.set_pipeline(if level == 0 { &self.measure } else { &self.join });
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(side, side, layers);
        }
    }
}

impl DepthHierarchyBuildResources {
    /// For one set of maps.
    pub fn new() -> Self {
        Self::default()
    }
}

impl Default for DepthHierarchyBuildResources {
    fn default() -> Self {
        /// Levels of the largest maps that there can be.
        const LEVELS: usize = 16;
        Self {
            groups: BindGroupCache::for_uses(LEVELS),
        }
    }
}
