//! Surface lights to pixels: the irradiance that they give to what the eye sees, with or without shadows.
//!
//! Inputs: [`GBuffer`], [`SurfaceLights`], and for shadows what a tracer says of [`SurfaceRays`]. Output: [`Irradiance`], at
//! all pixels or at some. E = Σ Φ cosθ cosθ′ / (π r² + A): of a light as the disc of the surface that it stands for
//! ([`LightShape::Disc`]), exact on the disc's axis, or without A as a point ([`LightShape::Point`]), the paper's formula,
//! whose spike is as high as a light is near. Without shadows in three forms ([`LightForm`]) that give the same; with shadows
//! ([`IndirectShadows`]) by rays: [`SurfaceLightShading::record_rays`], a tracer, then
//! [`SurfaceLightShading::record_shadowed`].
//!
//! A light counts within a ball: its irradiance is above a threshold e within r₀ √cosθ′ of it, r₀ = √(Φ/(π e)); the ball around
//! that region has radius 0.6204 r₀ and stands 0.4387 r₀ along the normal. (The paper's is 2.6 times as wide, around the
//! light.) Source: photon streaming with virtual surface lights, sections 0.4.1, 0.6 and 0.7.3. Cost: pixels × lights that
//! reach their tile; with shadows, pixels × rays. Limits: lights are diffuse, and so are receivers.

pub(crate) mod rays;

use crate::gpu::{self as device, BindGroupCache, ComputeSpec, RenderSpec, Slot};
use crate::resource::{GBuffer, Irradiance, Subsampling, SurfaceLights, SurfaceRays};
use crate::{Error, Timestamps, wgsl};
use rays::Rays;
use std::sync::OnceLock;

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/surface_light_shading/params.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) factor: u32,
        pub(crate) light_count: u32,
        pub(crate) flux_of_step: f32,
        pub(crate) shape: u32,
        pub(crate) least: f32,
        pub(crate) ray_count: u32,
        pub(crate) first_row: u32,
        pub(crate) row_count: u32,
        pub(crate) shadows: u32,
        pub(crate) reach: f32,
        pub(crate) sample_offset: u32,
    }
}

/// Bindings of `shaders/pass/surface_light_shading/loop_lights.wgsl` and `tile_lights.wgsl`, in order.
pub(crate) const SHADE_SLOTS: [Slot; 9] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::UintTexture,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageTexture(wgpu::TextureFormat::Rgba32Float),
];

/// Bindings of `shaders/pass/surface_light_shading/draw_lights.wgsl`, in order.
pub(crate) const DRAW_SLOTS: [Slot; 8] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::UintTexture,
    Slot::Storage,
    Slot::Storage,
];

/// What a light is to a receiver near by. Numbers of `SHAPE_POINT` and so on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum LightShape {
    /// A point: as bright as one likes near by.
    Point = 0,
    /// A disc of as much surface as it stands for: at most as bright as that surface. Of lights at impacts, which stand for
    /// none, a point.
    Disc = 1,
    /// A square of as much surface, by Lambert's formula, within five of its sides.
    #[default]
    Square = 2,
}

/// How lights come to pixels, where they throw no shadows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum LightForm {
    /// All lights at every pixel.
    Loop,
    /// Of each light the rectangle around its ball of influence, drawn and blended: into `rgba32float` where the device has
    /// `FLOAT32_BLENDABLE`, else into `rgba16float`, which loses digits. Alpha is 0 everywhere.
    Drawn,
    /// At every pixel the lights that reach its tile of 8 × 8.
    #[default]
    Tiles,
}

/// What stands between surface lights and what they shine on. Numbers of `SHADOWS_AMBIENT` and so on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum IndirectShadows {
    /// Nothing, as in the paper: light leaks through walls and floors.
    Off = 0,
    /// Ambient occlusion: light is less where much of what is around is near. Wrong where a wall stands in the way, cheap.
    AmbientOcclusion = 1,
    /// Rays to a few lights, picked by how much they give: right in the mean, with noise.
    #[default]
    Some = 2,
    /// A ray to each light that gives more than the threshold; those that give less throw no shadows.
    All = 3,
}

/// Speed against accuracy, settable every frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceLightShadingSettings {
    /// Near by. Discs instead of points: 0.70 of the error in a hall of pillars, with photons near by; squares 0.74
    /// (`docs/tradeoff.md`).
    pub shape: LightShape,
    /// Without shadows. All of them give the same picture; `docs/surface_lights.md` has their times.
    pub form: LightForm,
    /// What stands in the way. Ambient occlusion 0.38 of the error without, rays to some of the lights 0.31, to all 0.15
    /// (`docs/tradeoff.md`; `docs/surface_lights.md` has times).
    pub shadows: IndirectShadows,
    /// Rays of a pixel, from 1, for `AmbientOcclusion` and `Some`. Cost grows in proportion; noise falls as the root.
    pub rays: u32,
    /// How far ambient occlusion reaches, a share of the region's radius, above 0.
    pub reach: f32,
    /// Light that may be lost by leaving out lights that give little, as a share of what all of them would give if it were
    /// spread over all surfaces, 0 or more. Higher is faster in large scenes.
    pub threshold: f32,
}

impl Default for SurfaceLightShadingSettings {
    fn default() -> Self {
        Self {
            shape: LightShape::default(),
            form: LightForm::default(),
            shadows: IndirectShadows::default(),
            rays: 8,
            reach: 0.25,
            threshold: 0.01,
        }
    }
}

/// The pass. Pipelines are made when they are first recorded.
#[derive(Debug)]
pub struct SurfaceLightShading {
    device: wgpu::Device,
    shade_layout: wgpu::BindGroupLayout,
    draw_layout: wgpu::BindGroupLayout,
    loop_lights: OnceLock<wgpu::ComputePipeline>,
    tile_lights: OnceLock<wgpu::ComputePipeline>,
    draw_lights: [OnceLock<wgpu::RenderPipeline>; 2],
    rays: OnceLock<Rays>,
}

/// Uniforms and bind groups of one view, or of one band of its rays.
#[derive(Debug)]
pub struct SurfaceLightShadingResources {
    params: wgpu::Buffer,
    shade_groups: BindGroupCache,
    draw_groups: BindGroupCache,
    spread_groups: BindGroupCache,
    sum_groups: BindGroupCache,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceLightShadingInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// What is lit. Its view must be set.
    pub g_buffer: &'a GBuffer,
    /// At which of its pixels.
    pub subsampling: Subsampling,
    /// The lights.
    pub lights: &'a SurfaceLights,
    /// [`PhotonPool::share`](crate::resource::PhotonPool::share): which part of their flux they hold; 1 for lights at impacts.
    pub share: f32,
    /// Of all surfaces, unit frame: [`UnitFrame::area`](crate::scene::UnitFrame::area).
    pub area: f32,
    /// Of the region, unit frame.
    pub radius: f32,
    /// Written; of the size that [`Subsampling::size`] makes of the G-buffer's. `rgba32float`; [`LightForm::Drawn`] takes
    /// `rgba16float` as well, and on devices without `FLOAT32_BLENDABLE` nothing else.
    pub irradiance: &'a Irradiance,
    /// Turns the rays: another in each frame that is accumulated, constant in real time.
    pub sample_offset: u32,
    /// How.
    pub settings: &'a SurfaceLightShadingSettings,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

/// A band of a view's rays.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceLightRays<'a> {
    /// Room for the rays of the band's pixels, [`SurfaceLightShading::rays_a_pixel`] each; where there is less room pixels have
    /// fewer, or no shadows. The first step writes them, a tracer says what they meet, the second step reads that. What is left
    /// over is not written.
    pub rays: &'a SurfaceRays,
    /// Which rows of the irradiance, as first row and number. Each band of a submission needs resources of its own.
    pub rows: [u32; 2],
}

impl SurfaceLightShadingInputs<'_> {
    fn size(&self) -> [u32; 2] {
        self.subsampling.size(self.g_buffer.size())
    }

    fn params(&self, rows: [u32; 2], ray_count: u32) -> gpu::Params {
        let lights = self.lights.count();
        gpu::Params {
            factor: self.subsampling.factor(),
            light_count: lights,
            flux_of_step: self.lights.flux_of_step() / self.share,
            shape: self.settings.shape as u32,
            // All lights give no more than the unit frame's flux, 1.
            least: self.settings.threshold / (self.area * lights.max(1) as f32),
            ray_count,
            first_row: rows[0],
            row_count: rows[1],
            shadows: self.settings.shadows as u32,
            reach: self.settings.reach * self.radius,
            sample_offset: self.sample_offset,
        }
    }
}

impl SurfaceLightShading {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        use wgpu::ShaderStages as S;
        let layout = |label, stages, slots: &[Slot]| device::layout(device, label, stages, slots);
        Self {
            device: device.clone(),
            shade_layout: layout("lightfall::SurfaceLightShading", S::COMPUTE, &SHADE_SLOTS),
            draw_layout: layout("lightfall::SurfaceLightShading::draw", S::VERTEX_FRAGMENT, &DRAW_SLOTS),
            loop_lights: OnceLock::new(),
            tile_lights: OnceLock::new(),
            draw_lights: Default::default(),
            rays: OnceLock::new(),
        }
    }

    /// Rays of a pixel, of so many lights.
    pub fn rays_a_pixel(settings: &SurfaceLightShadingSettings, lights: &SurfaceLights) -> u32 {
        match settings.shadows {
            IndirectShadows::Off => 0,
            IndirectShadows::AmbientOcclusion | IndirectShadows::Some => settings.rays.max(1),
            IndirectShadows::All => lights.count().max(1),
        }
    }

    /// Records the irradiance, without shadows.
    ///
    /// # Errors
    /// [`Error::IncompatibleView`] for an irradiance that the form cannot write; nothing is recorded then.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut SurfaceLightShadingResources,
        inputs: &SurfaceLightShadingInputs<'_>,
    ) -> Result<(), Error> {
        self.check_format(inputs)?;
        let [width, height] = inputs.size();
        let params = inputs.params([0, height], 0);
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let label = "lightfall::SurfaceLightShading";
        if inputs.settings.form == LightForm::Drawn {
            self.draw(encoder, resources, inputs);
            return Ok(());
        }
        let pipeline = match inputs.settings.form {
            LightForm::Loop => self
                .loop_lights
                .get_or_init(|| self.compute(label, (wgsl::SURFACE_LIGHT_LOOP, "loop_lights"), &self.shade_layout)),
            _ => self
                .tile_lights
                .get_or_init(|| self.compute(label, (wgsl::SURFACE_LIGHT_TILES, "tile_lights"), &self.shade_layout)),
        };
        let mut bound = shared_bindings(resources, inputs);
        bound.push(inputs.irradiance.view().into());
        let group = resources
            .shade_groups
            .get(&self.device, label, &self.shade_layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
        Ok(())
    }

    /// Records a band's rays, to be traced before [`SurfaceLightShading::record_shadowed`].
    pub fn record_rays(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut SurfaceLightShadingResources,
        inputs: &SurfaceLightShadingInputs<'_>,
        band: &SurfaceLightRays<'_>,
    ) {
        let rays = self.rays.get_or_init(|| Rays::new(&self.device));
        rays.record_spread(&self.device, encoder, resources, (inputs, band));
    }

    /// Records the irradiance of a band, by what its rays met, with the inputs of `record_rays`.
    ///
    /// # Errors
    /// [`Error::IncompatibleView`] for an irradiance that is not `rgba32float`; nothing is recorded then.
    pub fn record_shadowed(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut SurfaceLightShadingResources,
        inputs: &SurfaceLightShadingInputs<'_>,
        band: &SurfaceLightRays<'_>,
    ) -> Result<(), Error> {
        expect_format(inputs.irradiance, &[wgpu::TextureFormat::Rgba32Float])?;
        let rays = self.rays.get_or_init(|| Rays::new(&self.device));
        rays.record_sum(&self.device, encoder, resources, (inputs, band));
        Ok(())
    }

    fn compute(
        &self,
        label: &'static str,
        (source, entry_point): (&'static str, &'static str),
        layout: &wgpu::BindGroupLayout,
    ) -> wgpu::ComputePipeline {
        let spec = ComputeSpec {
            label,
            source,
            entry_point,
            layouts: &[layout],
            constants: &[],
        };
        device::compute_pipeline(&self.device, &spec)
    }

    fn check_format(&self, inputs: &SurfaceLightShadingInputs<'_>) -> Result<(), Error> {
        let blends = self.device.features().contains(wgpu::Features::FLOAT32_BLENDABLE);
        match (inputs.settings.form, blends) {
            (LightForm::Drawn, true) => expect_format(inputs.irradiance, &Irradiance::FORMATS),
            (LightForm::Drawn, false) => expect_format(inputs.irradiance, &[wgpu::TextureFormat::Rgba16Float]),
            _ => expect_format(inputs.irradiance, &[wgpu::TextureFormat::Rgba32Float]),
        }
    }

    fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut SurfaceLightShadingResources,
        inputs: &SurfaceLightShadingInputs<'_>,
    ) {
        let format = inputs.irradiance.format();
        let is_wide = format == wgpu::TextureFormat::Rgba32Float;
        let pipeline = self.draw_lights[usize::from(is_wide)].get_or_init(|| self.drawing(format));
        let label = "lightfall::SurfaceLightShading::draw";
        let bound = shared_bindings(resources, inputs);
        let group = resources
            .draw_groups
            .get(&self.device, label, &self.draw_layout, &bound);
        let mut pass = device::render_pass(encoder, label, &[inputs.irradiance.view()], None, inputs.timestamps);
        let [width, height] = inputs.size();
        pass.set_viewport(0.0, 0.0, width as f32, height as f32, 0.0, 1.0);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..4, 0..inputs.lights.count());
    }

    fn drawing(&self, format: wgpu::TextureFormat) -> wgpu::RenderPipeline {
        let add = wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: wgpu::BlendFactor::One,
            operation: wgpu::BlendOperation::Add,
        };
        let spec = RenderSpec {
            label: "lightfall::SurfaceLightShading::draw",
            source: wgsl::SURFACE_LIGHT_DRAW,
            fragment: "fragment",
            layouts: &[&self.draw_layout],
            constants: &[],
            buffers: &[],
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            cull_mode: None,
            targets: &[Some(wgpu::ColorTargetState {
                format,
                blend: Some(wgpu::BlendState { color: add, alpha: add }),
                write_mask: wgpu::ColorWrites::ALL,
            })],
            depth_stencil: None,
        };
        device::render_pipeline(&self.device, &spec)
    }
}

fn expect_format(irradiance: &Irradiance, accepted: &[wgpu::TextureFormat]) -> Result<(), Error> {
    if accepted.contains(&irradiance.format()) {
        return Ok(());
    }
    Err(Error::IncompatibleView {
        resource: "SurfaceLightShading irradiance",
        property: "format",
        expected: format!("one of {accepted:?}"),
        found: format!("{:?}", irradiance.format()),
    })
}

/// What all steps bind first.
fn shared_bindings(
    resources: &SurfaceLightShadingResources,
    inputs: &SurfaceLightShadingInputs<'_>,
) -> Vec<device::Bound> {
    let views = inputs.g_buffer.views();
    vec![
        (&resources.params).into(),
        inputs.g_buffer.view_buffer().into(),
        (&views.depth).into(),
        (&views.normal).into(),
        (&views.base_color).into(),
        inputs.g_buffer.surfaces().into(),
        inputs.lights.shining().into(),
        inputs.lights.flux().into(),
    ]
}

impl SurfaceLightShadingResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::SurfaceLightShading::params")?,
            shade_groups: BindGroupCache::default(),
            draw_groups: BindGroupCache::default(),
            spread_groups: BindGroupCache::default(),
            sum_groups: BindGroupCache::default(),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.params.size()
    }
}
