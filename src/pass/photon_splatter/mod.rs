//! Density estimation: irradiance at each pixel from the photons around the surface point it sees.
//!
//! Inputs: [`Photons`], [`GBuffer`]. Output: [`Irradiance`] (`rgba32float`), at every pixel of the G-buffer, at a part of them
//! ([`Subsampling`]), or anew at [`MarkedPixels`]; alpha is 1 where a surface is seen, else 0. E(x) = Σ Φ K(|x − x_p| / h) /
//! h², K normalised over the unit disc; photons straight from a light are left out, for direct light is shaded by itself.
//! Sources: Yao et al. 2010, section 6; Yao et al., soft shadows and image-space photon mapping, section 3.3; Mara et al. 2013
//! (tiles); Knaus and Zwicker 2011 ([`progressive_scale`]).
//!
//! Cost of the tiled shape: photons sorted, then pixels × photons in the bins that a kernel may reach. Limits: kernels are
//! at most `max_radius` pixels wide; what hangs over a rim is made up for where the image shows the rim.

pub(crate) mod raster;
pub(crate) mod tiled;

use crate::gpu::{self as device, BindGroupCache, Bound, ComputeSpec, Slot, Step, TextureSpec};
#[cfg(doc)]
use crate::resource::GBufferViews;
use crate::resource::{GBuffer, Irradiance, MarkedPixels, PHOTON_BYTES, Photons, Subsampling};
use crate::{Error, Timestamps, wgsl};
use raster::{Raster, RasterBuffers};
use tiled::{Tiled, TiledBuffers};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Bandwidth` in `shaders/common/bandwidth.wgsl`.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Bandwidth {
        pub(crate) scale: f32,
        pub(crate) lowest: f32,
        pub(crate) highest: f32,
        pub(crate) uniform: f32,
        pub(crate) rule: u32,
        pub(crate) min_radius: f32,
        pub(crate) max_radius: f32,
        pub(crate) factor: u32,
    }

    /// Twin of `ReceiverParams` in `find_receivers.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct ReceiverParams {
        pub(crate) factor: u32,
    }

    /// Twin of `FinishParams` in `finish.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct FinishParams {
        pub(crate) factor: u32,
        pub(crate) is_corrected: u32,
        pub(crate) sample_offset: u32,
    }
}

/// Bindings of `shaders/pass/photon_splatter/find_receivers.wgsl`, in order.
pub(crate) const RECEIVER_SLOTS: [Slot; 7] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::UintTexture,
    Slot::StorageTexture(RECEIVER_FORMAT),
];

/// Bindings of `shaders/pass/photon_splatter/finish.wgsl`, in order.
pub(crate) const FINISH_SLOTS: [Slot; 9] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::UintTexture,
    Slot::UintTexture,
    Slot::Texture,
    Slot::StorageTexture(wgpu::TextureFormat::Rgba32Float),
];

const RECEIVER_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Uint;

/// Pixels of the irradiance along the side of a bin. Twin of `BIN` in `bins.wgsl`.
pub(crate) const BIN: u32 = 1;

/// Bins beyond each rim of the image. Twin of `BORDER`.
pub(crate) const BORDER: u32 = 24;

/// Largest kernel radius, pixels, that the border holds, with a pixel of slack.
pub(crate) const LARGEST_RADIUS: f32 = 23.0;

/// How a photon's kernel is drawn. All give the same light, but for rounding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SplatShape {
    /// Photons are sorted into bins of the screen and gathered in f32, in a fixed order: the same bits every frame. Up to
    /// 3 200 000 photons, all hops but the first together.
    #[default]
    Tiled,
    /// Blended quads in the surface plane. Surfaces that stand on it within the kernel, as beyond a crease of less than 45°,
    /// are missed where the quad does not cover them on the screen. Where the size of the G-buffer is no multiple of a
    /// sub-sampling factor, the last row or column of samples stands up to half a block nearer than quads are drawn for,
    /// and misses a rim of them. Sums in `rgba16float` lose some 4 % at a hundred photons a pixel and stagnate above
    /// a thousand; where the device has `FLOAT32_BLENDABLE`, an `rgba32float` target does not.
    Quads,
    /// Blended flattened icosahedra, which cover all that the kernel may reach from any side: fifteen times the vertices and up
    /// to twice the pixels of quads. Sums are those of quads.
    Volumes,
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
    /// so that about `photons` of N photons lie under a kernel. Where photons are guided, divided by the sixth root of how much
    /// denser they are, if half of them are.
    Density {
        /// k, photons under a kernel: error is least where k grows as N to the 2/3, by which noise and blur fall alike. Of 60
        /// 000 photons 200 to 400 are best in boxes and 100 in a colonnade; twice as many take up to 1.3 times as long
        /// (`docs/tradeoff.md`).
        photons: f32,
        /// Range that p̂ is clamped to.
        clamp: [f32; 2],
    },
    /// The same with p̂ from how many photons of all hops lie around the photon on the screen, in some 10 × 10 pixels of the
    /// irradiance, by the area of its plane that they cover.
    Screen {
        /// k, photons under a kernel.
        photons: f32,
        /// Range that p̂ is clamped to.
        clamp: [f32; 2],
    },
}

/// What is done about kernels that hang over the rim of a surface, where the estimate would darken: to one half at a
/// straight edge, to a quarter in a corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BoundaryCorrection {
    /// Nothing.
    Off,
    /// Each pixel's sum is divided by the part of a kernel of the mean radius around it that lies on its surface, as far as
    /// the G-buffer shows it: 64 points of its tangent plane are looked up.
    #[default]
    KernelArea,
}

/// Fixed when pipelines are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PhotonSplatterConfig {
    /// How kernels are drawn. Quads lose 7 % of the light of a box at edges, and volumes take 2.3 times as long as they do.
    pub shape: SplatShape,
    /// Their weight. A cone has 0.81 of a constant's error, and Epanechnikov's the same.
    pub kernel: Kernel,
    /// Format that quads and volumes are blended in, one of [`Irradiance::FORMATS`]; `None`: `rgba16float`. Tiles add up in
    /// f32 always.
    pub blend_format: Option<wgpu::TextureFormat>,
    /// Whether a photon brightens only the surface that it arrived at, where both that and the receiver's have a number
    /// ([`Instance::surface`](crate::scene::Instance::surface), [`GBufferViews::surfaces`]): for walls thinner than kernels are
    /// wide, and things that lie flat on others. Of tiles radii are then kept to eight binary digits.
    pub keeps_to_surfaces: bool,
}

impl PhotonSplatterConfig {
    /// What sums are kept in.
    fn sum_format(&self) -> wgpu::TextureFormat {
        match self.shape {
            SplatShape::Tiled => wgpu::TextureFormat::Rgba32Float,
            SplatShape::Quads | SplatShape::Volumes => self.blend_format.unwrap_or(wgpu::TextureFormat::Rgba16Float),
        }
    }
}

/// Speed against accuracy, settable every frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhotonSplatterSettings {
    /// Kernel radius.
    pub bandwidth: Bandwidth,
    /// Narrowest kernel radius in pixels of the irradiance, 0 or more, before `radius_scale`: a kernel between pixels is seen
    /// by none of them. 0, 1 and 2 differ by 3 % of the error (`docs/tradeoff.md`).
    pub min_radius: f32,
    /// Widest kernel radius in pixels of the irradiance, up to 23: bounds the cost of a photon near the eye. Where
    /// irradiance is sub-sampled, kernels may thus be wider by the factor. 6, 12, 23 have the same error where one pixel in
    /// 4 × 4 is estimated.
    pub max_radius: f32,
    /// Factor on the radius and on `min_radius`, before `max_radius`: [`progressive_scale`] of the frame where frames are
    /// accumulated, else 1.
    pub radius_scale: f32,
    /// What is done at rims. The kernel's own area: 0.93 of the time, 0.61 of the error, and 5.6 % of the light that is lost
    /// at edges otherwise.
    pub boundary: BoundaryCorrection,
}

impl Default for PhotonSplatterSettings {
    /// Of 400 000 photons in a Cornell box, 600 under a kernel leave half the squared error of 150; fewer photons want fewer.
    /// Densities above the uniform one are clamped because that of a single hop says little of how crowded a place is. See
    /// `docs/density.md`.
    fn default() -> Self {
        Self {
            bandwidth: Bandwidth::Density {
                photons: 700.0,
                clamp: [0.25, 1.0],
            },
            min_radius: 0.0,
            max_radius: LARGEST_RADIUS,
            radius_scale: 1.0,
            boundary: BoundaryCorrection::default(),
        }
    }
}

/// Factor on the radius in a frame of an accumulation, counted from 0: h² falls from the i-th frame to the next, counted from
/// 1, by (i + α) / (i + 1), α in (0, 1] (Knaus and Zwicker 2011). The variance of the mean then falls as n^−α and its squared
/// bias as n^−2(1 − α): equally fast, and fastest, at α = 2/3. At 1 radii stay.
pub fn progressive_scale(frame: u32, alpha: f32) -> f32 {
    // Up to here the product is multiplied out, from there on it falls as n^(α − 1), to a relative error of 1 / n.
    const EXACT: u32 = 4096;
    let alpha = f64::from(alpha);
    let step = |i: u32| (f64::from(i) + alpha) / (f64::from(i) + 1.0);
    let product: f64 = (1..=frame.min(EXACT)).map(step).product();
    let beyond = (f64::from(frame.max(EXACT)) / f64::from(EXACT)).powf(alpha - 1.0);
    (product * beyond).sqrt() as f32
}

/// The pass.
#[derive(Debug)]
pub struct PhotonSplatter {
    device: wgpu::Device,
    config: PhotonSplatterConfig,
    receivers: Step,
    shape: Shape,
    finish: Step,
}

#[derive(Debug)]
enum Shape {
    Tiled(Box<Tiled>),
    Raster(Raster),
}

/// Working memory for one view, made for the size of its irradiance.
#[derive(Debug)]
pub struct PhotonSplatterResources {
    receiver_params: wgpu::Buffer,
    finish_params: wgpu::Buffer,
    receivers: wgpu::TextureView,
    sums: wgpu::TextureView,
    shape: ShapeBuffers,
    groups: [BindGroupCache; 2],
    bytes: u64,
}

#[derive(Debug)]
enum ShapeBuffers {
    Tiled(Box<TiledBuffers>),
    Raster(RasterBuffers),
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
    /// Written; `rgba32float`, of the size that [`Subsampling::size`] makes of the G-buffer's.
    pub irradiance: &'a Irradiance,
    /// Area of all surfaces, unit-frame lengths squared; sets the uniform density.
    pub area: f32,
    /// Radius of the region, unit frame.
    pub radius: f32,
    /// Number of the frame's first path, as the tracers have it: another in each frame that is accumulated.
    pub sample_offset: u32,
    /// How to splat.
    pub settings: &'a PhotonSplatterSettings,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

/// What the estimate at marked pixels needs.
#[derive(Debug, Clone, Copy)]
pub struct MarkedSplatInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// The G-buffer of the last `record`.
    pub g_buffer: &'a GBuffer,
    /// Which of its pixels may be marked; any, whatever the last `record` had.
    pub subsampling: Subsampling,
    /// Written where a pixel is marked, alpha 1; `rgba32float`, of the size that [`Subsampling::size`] makes of the
    /// G-buffer's.
    pub irradiance: &'a Irradiance,
    /// The marked ones of its pixels, of the same size; of another size, nothing is estimated.
    pub marked: &'a MarkedPixels,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl PhotonSplatter {
    /// Features that a configuration needs: none, but for blending in `rgba32float`.
    pub fn required_features(config: &PhotonSplatterConfig) -> wgpu::Features {
        let blends_f32 = config.shape != SplatShape::Tiled && config.sum_format() == wgpu::TextureFormat::Rgba32Float;
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
                what: "PhotonSplatter shapes blended in rgba32float",
                missing,
                instead: "rgba16float, or the tiled shape",
            });
        }
        if !Irradiance::FORMATS.contains(&config.sum_format()) {
            return Err(Error::IncompatibleView {
                resource: "PhotonSplatterConfig::blend_format",
                property: "format",
                expected: format!("{:?}", Irradiance::FORMATS),
                found: format!("{:?}", config.sum_format()),
            });
        }
        let surfaces = ("splat_keeps_to_surfaces", f64::from(u8::from(config.keeps_to_surfaces)));
        let kernel = [("kernel", f64::from(config.kernel as u32)), surfaces];
        let step = |label, source, entry_point, constants, slots: &[Slot]| {
            let spec = ComputeSpec {
                label,
                source,
                entry_point,
                layouts: &[],
                constants,
            };
            Step::new(device, slots, &spec)
        };
        Ok(Self {
            device: device.clone(),
            config: *config,
            receivers: step(
                "lightfall::PhotonSplatter::receivers",
                wgsl::PHOTON_SPLATTER_RECEIVERS,
                "find_receivers",
                &[],
                &RECEIVER_SLOTS,
            ),
            shape: match config.shape {
                SplatShape::Tiled => Shape::Tiled(Box::new(Tiled::new(device, &kernel, &[surfaces]))),
                SplatShape::Quads | SplatShape::Volumes => Shape::Raster(Raster::new(device, config, &kernel)),
            },
            finish: step(
                "lightfall::PhotonSplatter::finish",
                wgsl::PHOTON_SPLATTER_FINISH,
                "finish_pixels",
                &kernel,
                &FINISH_SLOTS,
            ),
        })
    }

    /// What it was made with.
    pub fn config(&self) -> &PhotonSplatterConfig {
        &self.config
    }

    /// Records the estimate: none with resources of another shape, for fewer photons or for smaller irradiance.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut PhotonSplatterResources,
        inputs: &PhotonSplatterInputs<'_>,
    ) {
        encoder.push_debug_group("lightfall::PhotonSplatter");
        self.find_receivers(encoder, resources, inputs);
        let bandwidth = bandwidth(inputs);
        match (&self.shape, &mut resources.shape) {
            (Shape::Tiled(tiled), ShapeBuffers::Tiled(buffers)) => {
                let targets = (&resources.receivers, &resources.sums);
                tiled.record(&self.device, encoder, buffers, inputs, &bandwidth, targets);
            }
            (Shape::Raster(raster), ShapeBuffers::Raster(buffers)) => {
                let targets = (&resources.receivers, &resources.sums);
                raster.record(&self.device, encoder, buffers, inputs, &bandwidth, targets);
            }
            // Resources of another shape: nothing is estimated.
            _ => {}
        }
        self.finish(encoder, resources, inputs);
        encoder.pop_debug_group();
    }

    /// Records the estimate at marked pixels, of the photons and with the settings of the last `record`, whose kernels are the
    /// same at any sub-sampling: what an interpolation between its pixels leaves in doubt. Tiled shape only; the others
    /// estimate nothing. At most one call for each sub-sampling in a submission.
    pub fn record_marked(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut PhotonSplatterResources,
        inputs: &MarkedSplatInputs<'_>,
    ) {
        encoder.push_debug_group("lightfall::PhotonSplatter::marked");
        let size = inputs.subsampling.size(inputs.g_buffer.size());
        if let (Shape::Tiled(tiled), ShapeBuffers::Tiled(buffers)) = (&self.shape, &mut resources.shape)
            && inputs.marked.size() == size
        {
            tiled.record_marked(&self.device, encoder, buffers, inputs);
        }
        encoder.pop_debug_group();
    }

    fn find_receivers(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut PhotonSplatterResources,
        inputs: &PhotonSplatterInputs<'_>,
    ) {
        let params = gpu::ReceiverParams {
            factor: inputs.subsampling.factor(),
        };
        inputs
            .queue
            .write_buffer(&resources.receiver_params, 0, bytemuck::bytes_of(&params));
        let views = inputs.g_buffer.views();
        let bound: [Bound; 7] = [
            (&resources.receiver_params).into(),
            inputs.g_buffer.view_buffer().into(),
            (&views.depth).into(),
            (&views.normal).into(),
            (&views.base_color).into(),
            inputs.g_buffer.surfaces().into(),
            (&resources.receivers).into(),
        ];
        let label = "lightfall::PhotonSplatter::receivers";
        let group = resources.groups[0].get(&self.device, label, &self.receivers.layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        dispatch_pixels(&mut pass, &self.receivers.pipeline, &group, inputs);
    }

    fn finish(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut PhotonSplatterResources,
        inputs: &PhotonSplatterInputs<'_>,
    ) {
        let params = gpu::FinishParams {
            factor: inputs.subsampling.factor(),
            is_corrected: is_corrected(inputs.settings),
            sample_offset: inputs.sample_offset,
        };
        inputs
            .queue
            .write_buffer(&resources.finish_params, 0, bytemuck::bytes_of(&params));
        let views = inputs.g_buffer.views();
        let bound: [Bound; 9] = [
            (&resources.finish_params).into(),
            inputs.g_buffer.view_buffer().into(),
            (&views.depth).into(),
            (&views.normal).into(),
            (&views.base_color).into(),
            inputs.g_buffer.surfaces().into(),
            (&resources.receivers).into(),
            (&resources.sums).into(),
            inputs.irradiance.view().into(),
        ];
        let label = "lightfall::PhotonSplatter::finish";
        let group = resources.groups[1].get(&self.device, label, &self.finish.layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        dispatch_pixels(&mut pass, &self.finish.pipeline, &group, inputs);
    }
}

/// One invocation for each pixel of the irradiance, in workgroups of 8 × 8.
fn dispatch_pixels(
    pass: &mut wgpu::ComputePass<'_>,
    pipeline: &wgpu::ComputePipeline,
    group: &wgpu::BindGroup,
    inputs: &PhotonSplatterInputs<'_>,
) {
    let [width, height] = inputs.subsampling.size(inputs.g_buffer.size());
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, group, &[]);
    pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
}

impl PhotonSplatterResources {
    /// Bytes of working memory for photon buffers of `slots` slots, hop 0 not counted, and irradiance of `size`.
    pub fn size_in_bytes(config: &PhotonSplatterConfig, slots: u32, size: [u32; 2]) -> u64 {
        let params = size_of::<gpu::ReceiverParams>() + size_of::<gpu::FinishParams>();
        let textures =
            device::texture_bytes(size, 1, RECEIVER_FORMAT) + device::texture_bytes(size, 1, config.sum_format());
        let shape = match config.shape {
            SplatShape::Tiled => TiledBuffers::size_in_bytes(slots, size),
            SplatShape::Quads | SplatShape::Volumes => RasterBuffers::size_in_bytes(size),
        };
        params as u64 + textures + shape
    }

    /// Whether working memory for this many paths and bounces fits the device, without making it.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn check(device: &wgpu::Device, config: &PhotonSplatterConfig, count: u32, bounces: u32) -> Result<(), Error> {
        if config.shape != SplatShape::Tiled {
            return Ok(());
        }
        TiledBuffers::check(device, count.saturating_mul(bounces))
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
        use wgpu::TextureUsages as U;
        let texture = |label, format, usage| {
            let spec = TextureSpec {
                label,
                size,
                layers: 1,
                format,
                usage: usage | U::TEXTURE_BINDING,
            };
            device::texture(device, &spec)
        };
        let slots = splatted_slots(photons);
        let (shape, sum_usage) = match config.shape {
            SplatShape::Tiled => {
                let buffers = TiledBuffers::new(device, slots, size)?;
                (ShapeBuffers::Tiled(Box::new(buffers)), U::STORAGE_BINDING)
            }
            SplatShape::Quads | SplatShape::Volumes => {
                let buffers = RasterBuffers::new(device, size)?;
                (ShapeBuffers::Raster(buffers), U::RENDER_ATTACHMENT)
            }
        };
        let receivers = texture(
            "lightfall::PhotonSplatter::receivers",
            RECEIVER_FORMAT,
            U::STORAGE_BINDING,
        )?;
        let sums = texture("lightfall::PhotonSplatter::sums", config.sum_format(), sum_usage)?;
        Ok(Self {
            receiver_params: device::uniform_buffer::<gpu::ReceiverParams>(
                device,
                "lightfall::PhotonSplatter::receiver_params",
            )?,
            finish_params: device::uniform_buffer::<gpu::FinishParams>(
                device,
                "lightfall::PhotonSplatter::finish_params",
            )?,
            receivers: receivers.create_view(&Default::default()),
            sums: sums.create_view(&Default::default()),
            shape,
            groups: Default::default(),
            bytes: Self::size_in_bytes(config, slots, size),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}

fn is_corrected(settings: &PhotonSplatterSettings) -> u32 {
    u32::from(settings.boundary == BoundaryCorrection::KernelArea)
}

/// Bytes of a photon as it is added up.
pub(super) const SPLAT_BYTES: u64 = size_of::<tiled::gpu::Splat>() as u64;

/// Whether so many can be added up.
pub(super) fn check_splats(device: &wgpu::Device, slots: u32) -> Result<(), Error> {
    TiledBuffers::check(device, slots)
}

/// All slots but those of light straight from its source.
pub(super) fn splatted_slots(photons: &Photons) -> u32 {
    let slots = photons.slots() - photons.first_indirect();
    debug_assert!(photons.buffer().size() >= u64::from(photons.slots()) * PHOTON_BYTES);
    slots
}

/// Bins along both axes of irradiance of this size. Twin of `bin_grid` in `bins.wgsl`.
fn bin_grid(size: [u32; 2]) -> [u32; 2] {
    size.map(|length| length.div_ceil(BIN) + 2 * BORDER)
}

fn bin_total(size: [u32; 2]) -> u32 {
    bin_grid(size).iter().product()
}

fn bandwidth(inputs: &PhotonSplatterInputs<'_>) -> gpu::Bandwidth {
    let (settings, factor) = (inputs.settings, inputs.subsampling.factor());
    let (free, _) = free_bandwidth(settings.bandwidth, inputs.photons.count(), (inputs.area, inputs.radius));
    gpu::Bandwidth {
        scale: free.scale * settings.radius_scale,
        min_radius: (settings.min_radius * settings.radius_scale).max(0.0) * factor as f32,
        max_radius: settings.max_radius.clamp(0.0, LARGEST_RADIUS) * factor as f32,
        factor,
        ..free
    }
}

/// Radii of `count` photons on surfaces of some area in a region of some radius, without regard to a view; and the widest.
pub(super) fn free_bandwidth(bandwidth: Bandwidth, count: u32, (area, radius): (f32, f32)) -> (gpu::Bandwidth, f32) {
    let emitted = count.max(1) as f32;
    // Twins of `BANDWIDTH_…`.
    let (rule, clamp) = match bandwidth {
        Bandwidth::Fixed(_) => (0, [1.0; 2]),
        Bandwidth::Density { clamp, .. } => (1, clamp),
        Bandwidth::Screen { clamp, .. } => (2, clamp),
    };
    let scale = match bandwidth {
        Bandwidth::Fixed(share) => share * radius,
        Bandwidth::Density { photons, .. } | Bandwidth::Screen { photons, .. } => {
            (photons * area / (std::f32::consts::PI * emitted)).sqrt()
        }
    };
    let uniform = gpu::Bandwidth {
        scale,
        lowest: clamp[0],
        highest: clamp[1],
        uniform: if rule == 2 { emitted / area } else { 1.0 / area },
        rule,
        min_radius: 0.0,
        max_radius: f32::MAX,
        factor: 1,
    };
    (uniform, scale / clamp[0].sqrt())
}

#[cfg(test)]
mod tests {
    use super::{Bandwidth, free_bandwidth, progressive_scale};
    use crate::scene::{SceneBounds, UnitFrame};
    use glam::DVec3;

    #[test]
    fn radii_grow_with_the_scene_where_its_unit_is_doubled() {
        // A cube of side `scale`: kernels over the scene, and its unit. Units are powers of two.
        let kernels = |scale: f64| {
            let bounds = SceneBounds::new(DVec3::ZERO, DVec3::splat(scale)).unwrap();
            let frame = UnitFrame::new(&bounds, 1.0).unwrap();
            let region = (frame.area(6.0 * scale * scale), frame.radius());
            let clamp = [0.25, 4.0];
            let rules = [
                Bandwidth::Fixed(0.1),
                Bandwidth::Density { photons: 50.0, clamp },
                Bandwidth::Screen { photons: 50.0, clamp },
            ];
            let radii = rules.map(|rule| {
                let (bandwidth, widest) = free_bandwidth(rule, 10_000, region);
                // What a density that is three photons on a unit of the scene's own area leaves of the radius.
                let density = 3.0 / frame.area(scale * scale) / bandwidth.uniform;
                [bandwidth.scale, widest, bandwidth.scale / density.sqrt()]
                    .map(|radius| f64::from(radius) * frame.length_scale() / scale)
            });
            (radii, frame.length_scale())
        };
        let units = (0..100).map(|i| (1.01f64.powi(i), 1.01f64.powi(i + 1)));
        let [(below, unit), (above, next)] = units
            .map(|(a, b)| [kernels(a), kernels(b)])
            .find(|[(_, a), (_, b)]| a != b)
            .expect("a unit between 1 and e");
        assert_eq!(next, 2.0 * unit);
        for (a, b) in below.as_flattened().iter().zip(above.as_flattened()) {
            assert!((a / b - 1.0).abs() < 1e-6, "{a} and {b}");
        }
    }

    #[test]
    fn radii_of_accumulated_frames_shrink_as_they_should() {
        let area = |frame, alpha| progressive_scale(frame, alpha).powi(2);
        for alpha in [0.3f32, 2.0 / 3.0, 1.0] {
            assert_eq!(area(0, alpha), 1.0);
            let third = (1.0 + alpha) / 2.0 * (2.0 + alpha) / 3.0 * (3.0 + alpha) / 4.0;
            assert!((area(3, alpha) - third).abs() < 1e-6);
            // Γ(n + 1 + α) / (Γ(1 + α) Γ(n + 2)): from one frame to one of eight times its number as 8^(α − 1).
            for frame in [1000, 4096, 40_000] {
                let ratio = area(8 * frame, alpha) / area(frame, alpha);
                assert!(
                    (ratio / 8f32.powf(alpha - 1.0) - 1.0).abs() < 2e-3,
                    "{alpha}, {frame}: {ratio}"
                );
            }
        }
        assert!(progressive_scale(u32::MAX, 0.5) > 0.0);
    }
}
