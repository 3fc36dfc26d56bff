//! Between which depths the surfaces in ever coarser parts of environment maps lie.

use super::EnvMaps;
use crate::{Error, gpu};

/// Format of one cell: see `shaders/common/depth_range.wgsl`.
pub(crate) const RANGE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;

/// For every face of a set of [`EnvMaps`], the least and greatest inverse depth in squares of 1, 2, 4, ... texels: what a
/// ray needs to step over empty space. `r32uint`, layers as in the maps, mip l holds squares of 2^l texels; a side that is
/// no power of two is rounded up to one, and the cells beyond it say that nothing is there. Depth is the distance along the
/// face's axis, unit frame. Two numbers of 13 bits a cell, and on the finest mip five bits that say where a texel's
/// neighbours show the same surface (`docs/conventions.md`).
#[derive(Debug)]
pub struct DepthHierarchy {
    view: wgpu::TextureView,
    levels: Vec<wgpu::TextureView>,
    bytes: u64,
}

impl DepthHierarchy {
    fn spec(capacity: u32, size: u32) -> (gpu::TextureSpec, u32) {
        let side = size.next_power_of_two();
        let spec = gpu::TextureSpec {
            label: "lightfall::DepthHierarchy",
            size: [side; 2],
            layers: EnvMaps::layers(capacity),
            format: RANGE_FORMAT,
            usage: wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::STORAGE_BINDING
                | wgpu::TextureUsages::COPY_SRC,
        };
        (spec, side.ilog2() + 1)
    }

    /// Bytes for `capacity` maps of `size`² texels a face: a third of the maps' own where the side is a power of two.
    pub fn size_in_bytes(capacity: u32, size: u32) -> u64 {
        let (spec, levels) = Self::spec(capacity, size);
        gpu::mip_bytes(&spec, levels)
    }

    /// Room for the hierarchies of these maps.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] where a side rounded up to a power of two is more than the device grants.
    pub fn new(device: &wgpu::Device, env_maps: &EnvMaps) -> Result<Self, Error> {
        let (spec, levels) = Self::spec(env_maps.capacity(), env_maps.size());
        let texture = gpu::texture_with_mips(device, &spec, levels)?;
        Ok(Self {
            view: gpu::array_view(&texture),
            levels: (0..levels).map(|level| gpu::level_view(&texture, level)).collect(),
            bytes: gpu::mip_bytes(&spec, levels),
        })
    }

    /// All levels of all layers.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// Each level of all layers, the finest first.
    pub fn levels(&self) -> &[wgpu::TextureView] {
        &self.levels
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}
