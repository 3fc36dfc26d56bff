//! Density estimation: irradiance at each pixel from the photons around the surface point it sees.
//!
//! Inputs: [`Photons`], [`GBuffer`]. Output: [`Irradiance`], at every pixel of the G-buffer or at a part of them
//! ([`Subsampling`]). E(x) = Σ Φ K(|x − x_p| / h) / h², K normalised over the unit
//! disc; photons straight from a light are left out, for direct light is shaded by itself. Sources: Yao et al. 2010,
//! section 6; Yao et al., soft shadows and image-space photon mapping, section 3.3; Mara et al. 2013 (tiles).
//!
//! Cost of the tiled shape: proportional to photons × pixels a kernel covers, plus a third for pixels of touched tiles that
//! it misses. Limits: near an edge the kernel hangs over the rim and the estimate darkens; kernels are at most
//! `max_radius` pixels wide.

use super::dispatch_64;
use crate::gpu::{self as device, BindGroupCache, Bound, ComputeSpec, RenderSpec, Slot};
use crate::resource::{GBuffer, Irradiance, PHOTON_BYTES, Photons, Subsampling};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Bandwidth` in `shaders/pass/photon_splatter/splat.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Bandwidth {
        pub(crate) scale: f32,
        pub(crate) uniform_density: f32,
        pub(crate) lowest: f32,
        pub(crate) highest: f32,
    }

    /// Twin of `Params` in `shaders/pass/photon_splatter/tiled.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct TiledParams {
        pub(crate) bandwidth: Bandwidth,
        pub(crate) first_slot: u32,
        pub(crate) slot_count: u32,
        pub(crate) tile_columns: u32,
        pub(crate) tile_rows: u32,
        pub(crate) row: u32,
        pub(crate) max_radius: f32,
        pub(crate) capacity: u32,
        pub(crate) factor: u32,
    }

    /// Twin of `Params` in `shaders/pass/photon_splatter/quads.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct QuadParams {
        pub(crate) bandwidth: Bandwidth,
        pub(crate) clip_scale: [f32; 2],
        pub(crate) clip_shift: [f32; 2],
        pub(crate) first_slot: u32,
        pub(crate) max_radius: f32,
        pub(crate) factor: u32,
        pub(crate) _pad: u32,
    }

    /// Twin of `Splat` in `tiled.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Splat {
        pub(crate) position: [f32; 3],
        pub(crate) radius: f32,
        pub(crate) flux: [f32; 3],
        pub(crate) normal: u32,
    }

    /// Twin of `Tile` in `tiled.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Tile {
        pub(crate) count: u32,
        pub(crate) first: u32,
        pub(crate) filled: u32,
        pub(crate) brightest: u32,
    }
}

/// Bindings of `shaders/pass/photon_splatter/tiled.wgsl`, in order.
pub(crate) const TILED_SLOTS: [Slot; 11] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Storage,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::StorageTexture(wgpu::TextureFormat::Rgba32Float),
];

/// Bindings of `shaders/pass/photon_splatter/quads.wgsl`, in order.
pub(crate) const QUAD_SLOTS: [Slot; 6] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Storage,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
];

/// Pixels along a tile's side. Twin of `TILE` in `tiled.wgsl`.
pub(crate) const TILE: u32 = 16;

/// Tiles along a side that one photon may touch. Twin of `TILES_A_SIDE`.
pub(crate) const TILES_A_SIDE: u32 = 4;

/// Largest kernel radius, pixels, that `TILES_A_SIDE` tiles hold wherever it lies: with a pixel of slack to each side it
/// spans 48 pixels, and so at most 48 + 16.
pub(crate) const LARGEST_RADIUS: f32 = 23.0;

/// How a photon's kernel is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SplatShape {
    /// Photons are binned to screen tiles and gathered in f32: any number of photons a pixel, the same bits every frame.
    #[default]
    Tiled,
    /// Blended quads, the baseline. Where the size of the G-buffer is no multiple of a sub-sampling factor, the last row
    /// or column of samples stands up to half a block nearer than quads are drawn for, and misses a rim of them. Sums in
    /// `rgba16float` lose about a percent at a hundred photons a pixel and stagnate above a thousand; where the device has
    /// `FLOAT32_BLENDABLE`, an `rgba32float` target does not.
    Quads,
}

/// Weight of a photon over its disc; each integrates to one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Kernel {
    /// Uniform: least noise, visible rims.
    Constant,
    /// 3/π (1 − r).
    Cone,
    /// 2/π (1 − r²): least mean squared error.
    #[default]
    Epanechnikov,
}

/// Radius of a photon's kernel. Wider is smoother and blurrier, and costs as the square.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bandwidth {
    /// The same for all, as a share of the region's radius.
    Fixed(f32),
    /// From the density that the photon's last hop implies: h = √(k A / (π N p̂)), p̂ its density over the uniform one,
    /// so that about `photons` of N photons lie under a kernel.
    Density {
        /// k, photons under a kernel.
        photons: f32,
        /// Range that p̂ is clamped to.
        clamp: [f32; 2],
    },
}

/// Fixed when pipelines are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PhotonSplatterConfig {
    /// How kernels are drawn.
    pub shape: SplatShape,
    /// Their weight.
    pub kernel: Kernel,
    /// Format of the [`Irradiance`] that quads blend into; `None`: `rgba16float`. Tiles write `rgba32float` always.
    pub blend_format: Option<wgpu::TextureFormat>,
}

impl PhotonSplatterConfig {
    /// The format of the [`Irradiance`] that this configuration writes.
    pub fn format(&self) -> wgpu::TextureFormat {
        match self.shape {
            SplatShape::Tiled => wgpu::TextureFormat::Rgba32Float,
            SplatShape::Quads => self.blend_format.unwrap_or(wgpu::TextureFormat::Rgba16Float),
        }
    }
}

/// Speed against accuracy, settable every frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhotonSplatterSettings {
    /// Kernel radius.
    pub bandwidth: Bandwidth,
    /// Widest kernel radius in pixels of the irradiance, up to 23: bounds the cost of a photon near the eye. Where
    /// irradiance is sub-sampled, kernels may thus be wider by the factor.
    pub max_radius: f32,
}

impl Default for PhotonSplatterSettings {
    /// In one frame of a Cornell box, 150 photons a kernel halve the squared error that 60 leave, for twice the darkening
    /// of edges; densities above the uniform one are clamped because that of a single hop says little of how crowded a
    /// place is (clamping at 8 instead of 1 doubles the error). See `docs/accuracy.md`.
    fn default() -> Self {
        Self {
            bandwidth: Bandwidth::Density {
                photons: 150.0,
                clamp: [0.25, 1.0],
            },
            max_radius: LARGEST_RADIUS,
        }
    }
}

/// The pass.
#[derive(Debug)]
pub struct PhotonSplatter {
    device: wgpu::Device,
    layout: wgpu::BindGroupLayout,
    pipelines: Pipelines,
    config: PhotonSplatterConfig,
}

#[derive(Debug)]
enum Pipelines {
    Tiled(Box<TiledPipelines>),
    Quads(wgpu::RenderPipeline),
}

#[derive(Debug)]
struct TiledPipelines {
    project: wgpu::ComputePipeline,
    scan: wgpu::ComputePipeline,
    bin: wgpu::ComputePipeline,
    gather: wgpu::ComputePipeline,
}

/// Working memory for one view, made for the size of its irradiance.
#[derive(Debug)]
pub struct PhotonSplatterResources {
    params: wgpu::Buffer,
    working: Option<TiledBuffers>,
    groups: BindGroupCache,
    bytes: u64,
}

#[derive(Debug)]
struct TiledBuffers {
    splats: wgpu::Buffer,
    rectangles: wgpu::Buffer,
    tiles: wgpu::Buffer,
    list: wgpu::Buffer,
    slots: u32,
    size: [u32; 2],
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct PhotonSplatterInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// Light to splat; hop 0 is left out.
    pub photons: &'a Photons,
    /// Where it may land. Its view must be set.
    pub g_buffer: &'a GBuffer,
    /// Which of its pixels are estimated.
    pub subsampling: Subsampling,
    /// Written; [`PhotonSplatterConfig::format`], of the size that [`Subsampling::size`] makes of the G-buffer's.
    pub irradiance: &'a Irradiance,
    /// Area of all surfaces, unit-frame lengths squared; sets the uniform density.
    pub area: f32,
    /// Radius of the region, unit frame.
    pub radius: f32,
    /// How to splat.
    pub settings: &'a PhotonSplatterSettings,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl PhotonSplatter {
    /// Features that a configuration needs: none, but for blending in `rgba32float`.
    pub fn required_features(config: &PhotonSplatterConfig) -> wgpu::Features {
        let blends_f32 = config.shape == SplatShape::Quads && config.format() == wgpu::TextureFormat::Rgba32Float;
        if blends_f32 {
            wgpu::Features::FLOAT32_BLENDABLE
        } else {
            wgpu::Features::empty()
        }
    }

    /// The pass on this device; default limits suffice.
    ///
    /// # Errors
    /// [`Error::MissingFeatures`] without [`PhotonSplatter::required_features`]; [`Error::IncompatibleView`] for a blend
    /// format that is not one of [`Irradiance::FORMATS`].
    pub fn new(device: &wgpu::Device, config: &PhotonSplatterConfig) -> Result<Self, Error> {
        let missing = Self::required_features(config) - device.features();
        if !missing.is_empty() {
            return Err(Error::MissingFeatures {
                what: "PhotonSplatter quads into rgba32float",
                missing,
                instead: "rgba16float, or the tiled shape",
            });
        }
        if !Irradiance::FORMATS.contains(&config.format()) {
            return Err(Error::IncompatibleView {
                resource: "PhotonSplatterConfig::blend_format",
                property: "format",
                expected: format!("{:?}", Irradiance::FORMATS),
                found: format!("{:?}", config.format()),
            });
        }
        let constants = [("kernel", f64::from(config.kernel as u32))];
        let (layout, pipelines) = match config.shape {
            SplatShape::Tiled => tiled_pipelines(device, &constants),
            SplatShape::Quads => quad_pipeline(device, &constants, config.format()),
        };
        Ok(Self {
            device: device.clone(),
            layout,
            pipelines,
            config: *config,
        })
    }

    /// What it was made with.
    pub fn config(&self) -> &PhotonSplatterConfig {
        &self.config
    }

    /// Records the estimate.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut PhotonSplatterResources,
        inputs: &PhotonSplatterInputs<'_>,
    ) {
        match &self.pipelines {
            Pipelines::Tiled(pipelines) => self.record_tiled(pipelines, encoder, resources, inputs),
            Pipelines::Quads(pipeline) => self.record_quads(pipeline, encoder, resources, inputs),
        }
    }

    fn record_tiled(
        &self,
        pipelines: &TiledPipelines,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut PhotonSplatterResources,
        inputs: &PhotonSplatterInputs<'_>,
    ) {
        let Some(working) = &resources.working else {
            return;
        };
        let slots = splatted_slots(inputs.photons).min(working.slots);
        let size = inputs.subsampling.size(inputs.g_buffer.size());
        let factor = inputs.subsampling.factor();
        let tiles = tiles_of([size[0].min(working.size[0]), size[1].min(working.size[1])]);
        let (groups, row) = dispatch_64(slots);
        let params = gpu::TiledParams {
            first_slot: inputs.photons.count(),
            slot_count: slots,
            tile_columns: tiles[0],
            tile_rows: tiles[1],
            row,
            max_radius: inputs.settings.max_radius.clamp(0.0, LARGEST_RADIUS) * factor as f32,
            capacity: (working.list.size() / 4) as u32,
            factor,
            bandwidth: bandwidth(inputs),
        };
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let views = inputs.g_buffer.views();
        let bound: [Bound; 11] = [
            (&resources.params).into(),
            inputs.g_buffer.view_buffer().into(),
            inputs.photons.buffer().into(),
            (&working.splats).into(),
            (&working.rectangles).into(),
            (&working.tiles).into(),
            (&working.list).into(),
            (&views.depth).into(),
            (&views.normal).into(),
            (&views.base_color).into(),
            inputs.irradiance.view().into(),
        ];
        let label = "lightfall::PhotonSplatter";
        let group = resources.groups.get(&self.device, label, &self.layout, &bound);
        encoder.push_debug_group(label);
        encoder.clear_buffer(&working.tiles, 0, None);
        let steps = [
            (&pipelines.project, groups),
            (&pipelines.scan, [1, 1]),
            (&pipelines.bin, groups),
            (&pipelines.gather, tiles),
        ];
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_bind_group(0, &group, &[]);
        for (pipeline, [x, y]) in steps {
            pass.set_pipeline(pipeline);
            pass.dispatch_workgroups(x, y, 1);
        }
        drop(pass);
        encoder.pop_debug_group();
    }

    fn record_quads(
        &self,
        pipeline: &wgpu::RenderPipeline,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut PhotonSplatterResources,
        inputs: &PhotonSplatterInputs<'_>,
    ) {
        let slots = splatted_slots(inputs.photons);
        let factor = inputs.subsampling.factor();
        let [x, y] = clip_maps(inputs.subsampling, inputs.g_buffer.size());
        let params = gpu::QuadParams {
            bandwidth: bandwidth(inputs),
            clip_scale: [x[0], y[0]],
            // Clip space has +y up, pixels have it down.
            clip_shift: [x[1], -y[1]],
            first_slot: inputs.photons.count(),
            max_radius: inputs.settings.max_radius * factor as f32,
            factor,
            _pad: 0,
        };
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let views = inputs.g_buffer.views();
        let bound: [Bound; 6] = [
            (&resources.params).into(),
            inputs.g_buffer.view_buffer().into(),
            inputs.photons.buffer().into(),
            (&views.depth).into(),
            (&views.normal).into(),
            (&views.base_color).into(),
        ];
        let label = "lightfall::PhotonSplatter";
        let group = resources.groups.get(&self.device, label, &self.layout, &bound);
        let target = [inputs.irradiance.view()];
        let mut pass = device::render_pass(encoder, label, &target, None, inputs.timestamps);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..4, 0..slots);
    }
}

impl PhotonSplatterResources {
    /// Bytes of working memory for photon buffers of `slots` slots and irradiance of `size`.
    pub fn size_in_bytes(config: &PhotonSplatterConfig, slots: u32, size: [u32; 2]) -> u64 {
        match config.shape {
            SplatShape::Tiled => working_sizes(slots, size).iter().sum::<u64>() + size_of::<gpu::TiledParams>() as u64,
            SplatShape::Quads => size_of::<gpu::QuadParams>() as u64,
        }
    }

    /// Whether working memory for this many paths and bounces fits the device, without making it.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn check(device: &wgpu::Device, config: &PhotonSplatterConfig, count: u32, bounces: u32) -> Result<(), Error> {
        if config.shape == SplatShape::Quads {
            return Ok(());
        }
        let slots = count.saturating_mul(bounces);
        let largest = working_sizes(slots, [1, 1]).into_iter().max().unwrap_or(0);
        let usage = wgpu::BufferUsages::STORAGE;
        device::check_buffer(device, "lightfall::PhotonSplatter::list", largest, usage)
    }

    /// Working memory for this many photons and irradiance of this size: the G-buffer's, or what [`Subsampling::size`]
    /// makes of it.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(
        device: &wgpu::Device,
        config: &PhotonSplatterConfig,
        photons: &Photons,
        size: [u32; 2],
    ) -> Result<Self, Error> {
        let params_label = "lightfall::PhotonSplatter::params";
        let (params, working) = match config.shape {
            SplatShape::Tiled => (
                device::uniform_buffer::<gpu::TiledParams>(device, params_label)?,
                Some(TiledBuffers::new(device, splatted_slots(photons), size)?),
            ),
            SplatShape::Quads => (device::uniform_buffer::<gpu::QuadParams>(device, params_label)?, None),
        };
        let working_bytes = working
            .as_ref()
            .map_or(0, |w| working_sizes(w.slots, w.size).iter().sum());
        Ok(Self {
            bytes: params.size() + working_bytes,
            params,
            working,
            groups: BindGroupCache::default(),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}

impl TiledBuffers {
    fn new(device: &wgpu::Device, slots: u32, size: [u32; 2]) -> Result<Self, Error> {
        let [splats, rectangles, tiles, list] = working_sizes(slots, size);
        let buffer = |label, bytes| {
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
            device::buffer(device, label, bytes, usage)
        };
        Ok(Self {
            splats: buffer("lightfall::PhotonSplatter::splats", splats)?,
            rectangles: buffer("lightfall::PhotonSplatter::rectangles", rectangles)?,
            tiles: buffer("lightfall::PhotonSplatter::tiles", tiles)?,
            list: buffer("lightfall::PhotonSplatter::list", list)?,
            slots,
            size,
        })
    }
}

/// Bytes of splats, rectangles, tiles and list.
fn working_sizes(slots: u32, size: [u32; 2]) -> [u64; 4] {
    let slots = u64::from(slots.max(1));
    let [columns, rows] = tiles_of(size);
    [
        slots * size_of::<gpu::Splat>() as u64,
        slots * 8,
        u64::from(columns) * u64::from(rows) * size_of::<gpu::Tile>() as u64,
        slots * u64::from(TILES_A_SIDE * TILES_A_SIDE) * 4,
    ]
}

fn tiles_of(size: [u32; 2]) -> [u32; 2] {
    size.map(|s| s.div_ceil(TILE))
}

/// All slots but hop 0.
fn splatted_slots(photons: &Photons) -> u32 {
    let slots = photons.slots() - photons.count();
    debug_assert!(photons.buffer().size() >= u64::from(photons.slots()) * PHOTON_BYTES);
    slots
}

/// Scale and shift, by axis, that take the clip space of an image to that of its samples: pixel i of them is pixel
/// f i + ⌊f/2⌋ of the image, so that a point x pixels from its left lies (x − s) / f from theirs, s = ⌊f/2⌋ + 1/2 − f/2.
fn clip_maps(subsampling: Subsampling, full: [u32; 2]) -> [[f32; 2]; 2] {
    let factor = subsampling.factor();
    let shift = f64::from(factor / 2) + 0.5 - 0.5 * f64::from(factor);
    let samples = subsampling.size(full);
    [0, 1].map(|axis| {
        let (full, span) = (f64::from(full[axis]), f64::from(factor * samples[axis]));
        [(full / span) as f32, ((full - 2.0 * shift) / span - 1.0) as f32]
    })
}

fn bandwidth(inputs: &PhotonSplatterInputs<'_>) -> gpu::Bandwidth {
    match inputs.settings.bandwidth {
        Bandwidth::Fixed(share) => gpu::Bandwidth {
            scale: share * inputs.radius,
            uniform_density: 1.0,
            lowest: 0.0,
            highest: 0.0,
        },
        Bandwidth::Density { photons, clamp } => {
            let emitted = inputs.photons.count().max(1) as f32;
            gpu::Bandwidth {
                scale: (photons * inputs.area / (std::f32::consts::PI * emitted)).sqrt(),
                uniform_density: 1.0 / inputs.area,
                lowest: clamp[0],
                highest: clamp[1],
            }
        }
    }
}

fn tiled_pipelines(device: &wgpu::Device, constants: &[(&str, f64)]) -> (wgpu::BindGroupLayout, Pipelines) {
    let layout = device::layout(
        device,
        "lightfall::PhotonSplatter",
        wgpu::ShaderStages::COMPUTE,
        &TILED_SLOTS,
    );
    let pipeline = |label, entry_point| {
        device::compute_pipeline(
            device,
            &ComputeSpec {
                label,
                source: wgsl::PHOTON_SPLATTER_TILED,
                entry_point,
                layouts: &[&layout],
                constants,
            },
        )
    };
    let pipelines = Box::new(TiledPipelines {
        project: pipeline("lightfall::PhotonSplatter::project", "project_photons"),
        scan: pipeline("lightfall::PhotonSplatter::scan", "scan_tiles"),
        bin: pipeline("lightfall::PhotonSplatter::bin", "bin_splats"),
        gather: pipeline("lightfall::PhotonSplatter::gather", "gather_tiles"),
    });
    (layout, Pipelines::Tiled(pipelines))
}

fn quad_pipeline(
    device: &wgpu::Device,
    constants: &[(&str, f64)],
    format: wgpu::TextureFormat,
) -> (wgpu::BindGroupLayout, Pipelines) {
    let stages = wgpu::ShaderStages::VERTEX_FRAGMENT;
    let layout = device::layout(device, "lightfall::PhotonSplatter", stages, &QUAD_SLOTS);
    let add = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    let pipeline = device::render_pipeline(
        device,
        &RenderSpec {
            label: "lightfall::PhotonSplatter::quads",
            source: wgsl::PHOTON_SPLATTER_QUADS,
            fragment: "fragment",
            layouts: &[&layout],
            constants,
            buffers: &[],
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            targets: &[Some(wgpu::ColorTargetState {
                format,
                blend: Some(wgpu::BlendState { color: add, alpha: add }),
                write_mask: wgpu::ColorWrites::ALL,
            })],
            depth_stencil: None,
        },
    );
    (layout, Pipelines::Quads(pipeline))
}
