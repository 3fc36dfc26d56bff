//! Environment maps: what is around a few chosen points, as distance, normal and reflectance.

use super::{CaptureMask, CapturePurpose, CaptureView, expect, expect_view};
use crate::{Error, gpu};
use glam::Vec3;

/// Format of one texel: see `shaders/common/surface_texel.wgsl`.
pub(crate) const SURFACE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Uint;

/// `k` cube maps as layers of one `rgba32uint` 2D array: face f of map m is layer 6 m + f, faces ordered and oriented as
/// [`cube_face::CUBE_FACES`](super::cube_face::CUBE_FACES). One layer is spare, because wgpu's GL backend takes an
/// array of 6 k layers for a cube map. Texel: distance from the centre (f32 bits, unit frame; 0: nothing there),
/// octahedral geometric normal, reflectance 11-11-10, class and flags. Distances are from a centre in the centres
/// buffer, `array<vec4f>`, unit frame; w is 1 for a map in use and 0 for one that is switched off.
#[derive(Debug)]
pub struct EnvMaps {
    view: wgpu::TextureView,
    face_views: Vec<wgpu::TextureView>,
    centers_buffer: wgpu::Buffer,
    centers: Vec<Vec3>,
    capacity: u32,
    size: u32,
    bytes: u64,
}

impl EnvMaps {
    /// Six faces a map and a spare layer.
    pub(super) fn layers(capacity: u32) -> u32 {
        capacity.saturating_mul(6).saturating_add(1)
    }

    const USAGE: wgpu::TextureUsages = wgpu::TextureUsages::RENDER_ATTACHMENT
        .union(wgpu::TextureUsages::TEXTURE_BINDING)
        .union(wgpu::TextureUsages::COPY_SRC);

    /// Bytes of `capacity` maps of `size`² texels a face, centres included.
    pub fn size_in_bytes(capacity: u32, size: u32) -> u64 {
        gpu::texture_bytes([size; 2], Self::layers(capacity), SURFACE_FORMAT) + 16 * u64::from(capacity.max(1))
    }

    /// Room for `capacity` maps of `size`² texels a face.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if 6 × `capacity` + 1 layers, or `size`, are more than the device grants.
    pub fn new(device: &wgpu::Device, capacity: u32, size: u32) -> Result<Self, Error> {
        let spec = gpu::TextureSpec {
            label: "lightfall::EnvMaps",
            size: [size; 2],
            layers: Self::layers(capacity),
            format: SURFACE_FORMAT,
            usage: Self::USAGE,
        };
        let texture = gpu::texture(device, &spec)?;
        Self::with_texture(device, &texture, capacity, spec.bytes())
    }

    /// Around a host's array of at least 6 k + 1 layers, filled by the host in the format above. `view` must cover all
    /// layers as a 2D array.
    ///
    /// # Errors
    /// [`Error::IncompatibleView`] unless it is square, single-sampled `rgba32uint` with texture-binding usage.
    pub fn from_view(device: &wgpu::Device, view: &wgpu::TextureView) -> Result<Self, Error> {
        let resource = "EnvMaps view";
        expect_view(resource, view, &[SURFACE_FORMAT], wgpu::TextureUsages::TEXTURE_BINDING)?;
        let texture = view.texture();
        expect(resource, "size", texture.height(), &[texture.width()])?;
        let layers = texture.depth_or_array_layers();
        if layers < 7 {
            return Err(Error::IncompatibleView {
                resource,
                property: "layer count",
                expected: "at least 7 (six faces and a spare)".into(),
                found: layers.to_string(),
            });
        }
        Self::with_texture(device, texture, (layers - 1) / 6, 0)
    }

    fn with_texture(
        device: &wgpu::Device,
        texture: &wgpu::Texture,
        capacity: u32,
        texture_bytes: u64,
    ) -> Result<Self, Error> {
        use wgpu::BufferUsages as U;
        let usage = U::STORAGE | U::COPY_DST | U::COPY_SRC;
        let bytes = 16 * u64::from(capacity.max(1));
        let can_render = texture.usage().contains(wgpu::TextureUsages::RENDER_ATTACHMENT);
        let faces = if can_render { 6 * capacity } else { 0 };
        Ok(Self {
            view: gpu::array_view(texture),
            face_views: (0..faces).map(|layer| gpu::layer_view(texture, layer)).collect(),
            centers_buffer: gpu::buffer(device, "lightfall::EnvMaps::centers", bytes, usage)?,
            centers: Vec::new(),
            capacity,
            size: texture.width(),
            bytes: texture_bytes + bytes,
        })
    }

    /// Says where the maps are taken from, unit frame; uploads the centres.
    ///
    /// # Errors
    /// [`Error::CountMismatch`] if there are more than [`EnvMaps::capacity`].
    pub fn set_centers(&mut self, queue: &wgpu::Queue, centers: &[Vec3]) -> Result<(), Error> {
        if centers.len() > self.capacity as usize {
            return Err(Error::CountMismatch {
                what: "environment-map centres for the maps allocated",
                expected: self.capacity as usize,
                found: centers.len(),
            });
        }
        if self.centers != centers {
            let padded: Vec<[f32; 4]> = centers.iter().map(|c| c.extend(1.0).to_array()).collect();
            queue.write_buffer(&self.centers_buffer, 0, bytemuck::cast_slice(&padded));
            self.centers = centers.to_vec();
        }
        Ok(())
    }

    /// Makes the next `set_centers` write, and so switch on, even the centres that it has.
    pub(crate) fn forget_centers(&mut self) {
        self.centers.clear();
    }

    /// The views that fill these maps, six a centre, in layer order.
    pub fn views(&self, purpose: CapturePurpose) -> impl Iterator<Item = CaptureView> + '_ {
        self.centers.iter().flat_map(move |&center| {
            (0..6).map(move |face| CaptureView::cube_face(purpose, CaptureMask::InEnvMaps, center, face, self.size))
        })
    }

    /// All layers as a 2D array.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// One face of one map, to render to. Empty for arrays that cannot be rendered to.
    pub fn face_view(&self, layer: u32) -> Option<&wgpu::TextureView> {
        self.face_views.get(layer as usize)
    }

    /// Centres, `array<vec4f>`, unit frame; w: 1 in use, 0 switched off.
    pub fn centers_buffer(&self) -> &wgpu::Buffer {
        &self.centers_buffer
    }

    /// Centres in use, unit frame.
    pub fn centers(&self) -> &[Vec3] {
        &self.centers
    }

    /// Most maps it can hold.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Texels along a face's side.
    pub fn size(&self) -> u32 {
        self.size
    }

    /// Bytes this resource allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}
