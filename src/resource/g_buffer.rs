//! What the eye sees: depth, normal, reflectance and emission per pixel.

use super::{CameraView, CapturePurpose, CaptureTargets, expect, expect_view};
use crate::{Error, gpu as device};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `View` in `shaders/common/g_buffer.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct ViewUniform {
        pub(crate) view_projection: [[f32; 4]; 4],
        pub(crate) inverse_view_projection: [[f32; 4]; 4],
        pub(crate) eye: [f32; 4],
        pub(crate) size: [u32; 2],
        pub(crate) origin: [u32; 2],
        pub(crate) normal_encoding: u32,
        pub(crate) _pad: [u32; 3],
    }
}

/// How a host stores normals, unit frame (the same directions as its world space).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum NormalEncoding {
    /// Signed components in RGB.
    #[default]
    Signed = 0,
    /// × 0.5 + 0.5 in RGB, for unsigned formats.
    HalfOffset = 1,
    /// Octahedral in RG, each in [−1, 1].
    Octahedral = 2,
    /// Octahedral in RG, each × 0.5 + 0.5, for unsigned formats.
    OctahedralHalfOffset = 3,
}

/// A host's own G-buffer textures.
#[derive(Debug, Clone)]
pub struct GBufferViews {
    /// Depth in any convention that the view's matrix inverts; a depth format or `r32float`. Where nothing is seen it
    /// holds what it was cleared to, and base colour alpha is 0.
    pub depth: wgpu::TextureView,
    /// Shading normals towards the viewer.
    pub normal: wgpu::TextureView,
    /// How they are stored.
    pub normal_encoding: NormalEncoding,
    /// Reflectance, linear RGB after any format conversion; alpha above 0 where a surface is seen.
    pub base_color: wgpu::TextureView,
    /// Emitted radiance towards the viewer, unit frame, RGB. Hosts without emission give a black texture of one texel:
    /// what lies outside it reads as black.
    pub emission: wgpu::TextureView,
    /// The number of the surface that is seen, 1 to 65 535, and 0 for none in particular: see
    /// [`Instance::surface`](crate::scene::Instance::surface). In the first channel; `None`: there are no numbers. Bits 16 to 29: how
    /// it scatters, a lobe of `shaders/common/lobe.wgsl`, 0 for diffuse; bit 30: its back is seen. Formats of 16 or 8 bits hold none.
    pub surfaces: Option<wgpu::TextureView>,
    /// The part in use (x, y, width, height), for dynamic resolution; `None`: all of it.
    pub rectangle: Option<[u32; 4]>,
}

/// What the eye sees, per pixel, and the view it was seen from. Made by
/// [`GBufferCapture`](crate::pass::GBufferCapture), or the host's own.
#[derive(Debug)]
pub struct GBuffer {
    views: GBufferViews,
    /// Of zeros, bound where the host has no numbers.
    no_surfaces: Option<wgpu::TextureView>,
    view_buffer: wgpu::Buffer,
    written: Option<CameraView>,
    size: [u32; 2],
    bytes: u64,
}

impl GBuffer {
    /// Bytes at this size.
    pub fn size_in_bytes(size: [u32; 2]) -> u64 {
        let targets = CaptureTargets::of(CapturePurpose::Camera);
        let colors: u64 = targets.colors.iter().map(|&f| device::texture_bytes(size, 1, f)).sum();
        colors + device::texture_bytes(size, 1, targets.depth) + size_of::<gpu::ViewUniform>() as u64
    }

    /// Textures of the crate's own layout: `depth32float`, octahedral normal `rg16float`, base colour `rgba16float`, emission
    /// `rgba32float`, surfaces `r32uint`.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(gpu: &wgpu::Device, size: [u32; 2]) -> Result<Self, Error> {
        let targets = CaptureTargets::of(CapturePurpose::Camera);
        use wgpu::TextureUsages as U;
        let make = |label, format| {
            let usage = U::RENDER_ATTACHMENT | U::TEXTURE_BINDING | U::COPY_SRC;
            let spec = device::TextureSpec {
                label,
                size,
                layers: 1,
                format,
                usage,
            };
            Ok(device::texture(gpu, &spec)?.create_view(&Default::default()))
        };
        let views = GBufferViews {
            depth: make("lightfall::GBuffer::depth", targets.depth)?,
            normal: make("lightfall::GBuffer::normal", targets.colors[0])?,
            normal_encoding: NormalEncoding::Octahedral,
            base_color: make("lightfall::GBuffer::base_color", targets.colors[1])?,
            emission: make("lightfall::GBuffer::emission", targets.colors[2])?,
            surfaces: Some(make("lightfall::GBuffer::surfaces", targets.colors[3])?),
            rectangle: None,
        };
        Self::with_views(gpu, views, size, Self::size_in_bytes(size))
    }

    /// Around a host's own textures.
    ///
    /// # Errors
    /// [`Error::IncompatibleView`] names the texture and what is wrong: a format that cannot be read as float, more than
    /// one sample (resolve first), unequal sizes, a rectangle outside.
    pub fn from_views(gpu: &wgpu::Device, views: GBufferViews) -> Result<Self, Error> {
        use wgpu::TextureFormat as F;
        let depth_formats = [F::Depth32Float, F::Depth24Plus, F::Depth16Unorm, F::R32Float];
        let normal_formats = [
            F::Rgba16Float,
            F::Rgba32Float,
            F::Rgba8Snorm,
            F::Rgba8Unorm,
            F::Rgb10a2Unorm,
            F::Rg16Float,
            F::Rg32Float,
        ];
        let color_formats = [
            F::Rgba16Float,
            F::Rgba32Float,
            F::Rgba8Unorm,
            F::Rgba8UnormSrgb,
            F::Bgra8UnormSrgb,
        ];
        let emission_formats = [F::Rgba16Float, F::Rgba32Float, F::Rgba8Unorm, F::Rg11b10Ufloat];
        let surface_formats = [
            F::R32Uint,
            F::R16Uint,
            F::R8Uint,
            F::Rg32Uint,
            F::Rg16Uint,
            F::Rgba16Uint,
        ];
        let usage = wgpu::TextureUsages::TEXTURE_BINDING;
        expect_view("G-buffer depth", &views.depth, &depth_formats, usage)?;
        expect_view("G-buffer normal", &views.normal, &normal_formats, usage)?;
        expect_view("G-buffer base colour", &views.base_color, &color_formats, usage)?;
        expect_view("G-buffer emission", &views.emission, &emission_formats, usage)?;
        let extent = |view: &wgpu::TextureView| [view.texture().width(), view.texture().height()];
        let full = extent(&views.depth);
        expect("G-buffer normal", "size", extent(&views.normal), &[full])?;
        expect("G-buffer base colour", "size", extent(&views.base_color), &[full])?;
        expect("G-buffer emission", "size", extent(&views.emission), &[full, [1, 1]])?;
        if let Some(surfaces) = &views.surfaces {
            expect_view("G-buffer surfaces", surfaces, &surface_formats, usage)?;
            expect("G-buffer surfaces", "size", extent(surfaces), &[full])?;
        }
        let [x, y, width, height] = views.rectangle.unwrap_or([0, 0, full[0], full[1]]);
        let fits =
            |start: u32, length: u32, limit: u32| length > 0 && start.checked_add(length).is_some_and(|e| e <= limit);
        if !fits(x, width, full[0]) || !fits(y, height, full[1]) {
            return Err(Error::IncompatibleView {
                resource: "G-buffer rectangle",
                property: "size",
                expected: format!("inside {}×{}", full[0], full[1]),
                found: format!("{width}×{height} at ({x}, {y})"),
            });
        }
        let no_surfaces = u64::from(views.surfaces.is_none()) * device::texture_bytes([1; 2], 1, F::R32Uint);
        let bytes = size_of::<gpu::ViewUniform>() as u64 + no_surfaces;
        Self::with_views(gpu, views, [width, height], bytes)
    }

    fn with_views(gpu: &wgpu::Device, views: GBufferViews, size: [u32; 2], bytes: u64) -> Result<Self, Error> {
        let no_surfaces = || {
            let spec = device::TextureSpec {
                label: "lightfall::GBuffer::no_surfaces",
                size: [1; 2],
                layers: 1,
                format: wgpu::TextureFormat::R32Uint,
                usage: wgpu::TextureUsages::TEXTURE_BINDING,
            };
            Ok(device::texture(gpu, &spec)?.create_view(&Default::default()))
        };
        Ok(Self {
            no_surfaces: views.surfaces.is_none().then(no_surfaces).transpose()?,
            views,
            view_buffer: device::uniform_buffer::<gpu::ViewUniform>(gpu, "lightfall::GBuffer::view")?,
            written: None,
            size,
            bytes,
        })
    }

    /// Says from where this G-buffer is seen. The upload lands before the whole submission: two views in one submission
    /// need two G-buffers.
    pub fn set_view(&mut self, queue: &wgpu::Queue, view: &CameraView) {
        if self.written.as_ref() == Some(view) {
            return;
        }
        let [x, y, _, _] = self.views.rectangle.unwrap_or_default();
        let uniform = gpu::ViewUniform {
            view_projection: view.capture.view_projection,
            inverse_view_projection: view.inverse_view_projection,
            eye: view.capture.eye,
            size: self.size,
            origin: [x, y],
            normal_encoding: self.views.normal_encoding as u32,
            _pad: [0; 3],
        };
        queue.write_buffer(&self.view_buffer, 0, bytemuck::bytes_of(&uniform));
        self.written = Some(*view);
    }

    /// The textures.
    pub fn views(&self) -> &GBufferViews {
        &self.views
    }

    /// What passes bind for the numbers of surfaces: the host's, or one texel of zero, outside of which reads are zero too.
    pub(crate) fn surfaces(&self) -> &wgpu::TextureView {
        let own = self.views.surfaces.as_ref().or(self.no_surfaces.as_ref());
        own.expect("made where the host has none")
    }

    /// The view's matrices, as `View` of `shaders/common/g_buffer.wgsl`.
    pub fn view_buffer(&self) -> &wgpu::Buffer {
        &self.view_buffer
    }

    /// Width and height of the part in use.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Bytes this resource allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}
