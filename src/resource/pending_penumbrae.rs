//! What hard shadow tests found, for a pass that gathers penumbrae from it later.

use super::Visibility;
use crate::{Error, gpu as device};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// How the penumbra of a light is found. Twin of `Params` in `shaders/pass/soft_shadow/params.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct PenumbraParams {
        pub(crate) light: u32,
        pub(crate) shadow_map_size: u32,
        pub(crate) layer_count: u32,
        pub(crate) search: u32,
        pub(crate) search_taps: u32,
        pub(crate) blur_taps: u32,
        pub(crate) disc_taps: u32,
        pub(crate) rays: u32,
        pub(crate) sample_offset: u32,
        pub(crate) gathered: u32,
        pub(crate) max_radius: f32,
        pub(crate) range_scale: f32,
    }
}

/// Pixels along a side of a tile.
pub(crate) const TILE: u32 = 8;

/// Tiles of an image, by columns and rows.
pub(crate) fn tile_counts(size: [u32; 2]) -> [u32; 2] {
    size.map(|side| side.div_ceil(TILE))
}

/// Shadows of each light as far as they are found without looking at a pixel's neighbours: in a layer of a 2D array of
/// `r32float` what [`Visibility`] holds, or, of a light whose penumbra is to be gathered in image space, how far before the
/// receiver its occluder stands, unit frame; −1 where none does, −2 where no surface is seen or it faces away. Beside them,
/// which tiles of 8 × 8 pixels may hold a penumbra, and how it is to be looked for. Filled by
/// [`SoftShadow`](crate::pass::SoftShadow), for [`FusedComposite`](crate::pass::FusedComposite).
#[derive(Debug)]
pub struct PendingPenumbrae {
    layers: Visibility,
    params: wgpu::Buffer,
    flags: wgpu::Buffer,
}

impl PendingPenumbrae {
    /// Bytes for this many lights at this size.
    pub fn size_in_bytes(size: [u32; 2], lights: u32) -> u64 {
        Visibility::size_in_bytes(size, lights) + params_bytes(lights) + flags_bytes(size, lights)
    }

    /// Layers for this many lights, of the G-buffer's size.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, size: [u32; 2], lights: u32) -> Result<Self, Error> {
        use wgpu::BufferUsages as B;
        let (params, flags) = (params_bytes(lights), flags_bytes(size, lights));
        let params_label = "lightfall::PendingPenumbrae::params";
        Ok(Self {
            layers: Visibility::new(device, size, lights)?,
            params: device::buffer(device, params_label, params, B::STORAGE | B::COPY_DST)?,
            flags: device::buffer(device, "lightfall::PendingPenumbrae::flags", flags, B::STORAGE)?,
        })
    }

    /// What was found, one layer a light.
    pub(crate) fn layers(&self) -> &Visibility {
        &self.layers
    }

    /// How to look for each penumbra.
    pub(crate) fn params(&self) -> &wgpu::Buffer {
        &self.params
    }

    /// A bit a light, in a word a tile for each 32 lights.
    pub(crate) fn flags(&self) -> &wgpu::Buffer {
        &self.flags
    }

    /// Lights that it has layers for.
    pub fn lights(&self) -> u32 {
        self.layers.lights()
    }

    /// Width and height.
    pub fn size(&self) -> [u32; 2] {
        self.layers.size()
    }

    /// Bytes this resource allocated.
    pub fn memory_use(&self) -> u64 {
        self.layers.memory_use() + self.params.size() + self.flags.size()
    }
}

fn params_bytes(lights: u32) -> u64 {
    u64::from(lights.max(1)) * size_of::<gpu::PenumbraParams>() as u64
}

fn flags_bytes(size: [u32; 2], lights: u32) -> u64 {
    let [columns, rows] = tile_counts(size).map(u64::from);
    4 * (columns * rows * u64::from(lights.div_ceil(32))).max(1)
}
