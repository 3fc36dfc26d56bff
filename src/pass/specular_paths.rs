//! What the eye sees in mirrors and through glass: paths over specular surfaces, up to the first diffuse one.
//!
//! Inputs: [`GBuffer`] with lobes among its surfaces; what a tracer says of the [`SurfaceRays`] that each step writes;
//! [`PhotonGridResources`], [`Lights`] and [`ShadowMaps`] for the light where paths end, the [`Environment`] where they meet
//! nothing. Output: radiance, as an [`Irradiance`]
//! (`rgba32float`, unit frame): of pixels whose surface is specular, zero of all others. Sources: Whitted 1980; Jensen 1996, for
//! paths that end in a photon map; Walter et al. 2007 and Heitz 2018 for rough surfaces.
//!
//! Order, for each band of rows and each round of one path a pixel: [`SpecularPaths::record_rays`]; then for each step the tracer's
//! `record_rays` and [`SpecularPaths::record`]. Cost: pixels × rounds × steps rays; where paths end, lights and the photons around,
//! as an estimate at a pixel costs. Limits: rough surfaces, and glass that reflects or transmits by chance, are noisy with few
//! rounds, the same every frame while `sample_offset` is; direct
//! light where a path ends has hard shadows; indirect light there is estimated without the boundary correction of
//! `PhotonSplatter`, of all surfaces, and its kernels do not narrow as frames are accumulated; what is lost, or specular after the
//! last step, is black.

use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::pass::{Kernel, PhotonGridResources};
use crate::resource::{Environment, GBuffer, Irradiance, Lights, ShadowMaps, SurfaceRays};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/specular_paths/params.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) width: u32,
        pub(crate) first_row: u32,
        pub(crate) row_count: u32,
        pub(crate) step: u32,
        pub(crate) steps: u32,
        pub(crate) round: u32,
        pub(crate) rounds: u32,
        pub(crate) sample_offset: u32,
        pub(crate) light_count: u32,
        pub(crate) shadow_map_size: u32,
        pub(crate) direct_weight: f32,
        pub(crate) indirect_weight: f32,
        pub(crate) skips_glossy: u32,
    }

    /// Twin of `SpecularPath` in `shaders/pass/specular_paths/params.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct SpecularPath {
        pub(crate) throughput: [f32; 3],
        pub(crate) state: u32,
        pub(crate) radiance: [f32; 3],
        pub(crate) _pad: u32,
    }
}

/// Bindings of `shaders/pass/specular_paths/begin_paths.wgsl`, in order.
pub(crate) const BEGIN_SLOTS: [Slot; 11] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::UintTexture,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::Storage,
    Slot::Storage,
    Slot::UintArray,
];

/// Bindings of `shaders/pass/specular_paths/advance_paths.wgsl`, in order.
pub(crate) const ADVANCE_SLOTS: [Slot; 13] = [
    Slot::Uniform,
    Slot::StorageMut,
    Slot::Storage,
    Slot::StorageMut,
    Slot::Uniform,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::UintArray,
    Slot::StorageTexture(wgpu::TextureFormat::Rgba32Float),
    Slot::Uniform,
    Slot::Texture,
];

/// The pass.
#[derive(Debug)]
pub struct SpecularPaths {
    device: wgpu::Device,
    begin_layout: wgpu::BindGroupLayout,
    advance_layout: wgpu::BindGroupLayout,
    begin: wgpu::ComputePipeline,
    advance: wgpu::ComputePipeline,
}

/// Uniforms, paths and bind groups of one band of one view.
#[derive(Debug)]
pub struct SpecularPathsResources {
    /// Of each step of each round.
    params: Vec<wgpu::Buffer>,
    shape: PathShape,
    paths: wgpu::Buffer,
    pixels: u32,
    begin_groups: BindGroupCache,
    advance_groups: BindGroupCache,
}

/// How many paths, and how long.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PathShape {
    /// Rays of a path: specular surfaces on it, the one that the eye sees among them.
    pub steps: u32,
    /// Paths of each pixel.
    pub rounds: u32,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct SpecularPathsInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// Where paths begin. Its view must be set.
    pub g_buffer: &'a GBuffer,
    /// Which rows of it, as first row and number: a band of them, where the rays of all do not fit one list. Each band of a
    /// submission needs resources of its own. No more pixels than rays and resources have room for.
    pub rows: [u32; 2],
    /// A ray for each pixel of the band. Each step writes them, a tracer says what they meet.
    pub rays: &'a SurfaceRays,
    /// Indirect light where paths end: photons, sorted.
    pub photons: &'a PhotonGridResources,
    /// Direct light there, and lamps that paths run into.
    pub lights: &'a Lights,
    /// What lights see.
    pub shadow_maps: &'a ShadowMaps,
    /// What rays see that meet no surface.
    pub environment: &'a Environment,
    /// Written by the last step; `rgba32float` of the G-buffer's size.
    pub radiance: &'a Irradiance,
    /// Factors of light straight from a source, by way of the surface that the eye sees alone, and of all other light.
    pub weights: [f32; 2],
    /// Whether pixels that show rough metal are left out: [`GlossyLight`](super::GlossyLight) lights them.
    pub skips_glossy: bool,
    /// Turns rough reflections: another in each frame that is accumulated, constant in real time.
    pub sample_offset: u32,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl SpecularPathsInputs<'_> {
    fn params(&self, [round, step]: [u32; 2], resources: &SpecularPathsResources) -> gpu::Params {
        let [width, height] = self.g_buffer.size();
        let room = self.rays.count().min(resources.pixels) / width.max(1);
        gpu::Params {
            width,
            first_row: self.rows[0],
            row_count: self.rows[1].min(height.saturating_sub(self.rows[0])).min(room),
            step,
            steps: resources.shape.steps,
            round,
            rounds: resources.shape.rounds,
            sample_offset: self.sample_offset,
            light_count: self.lights.count(),
            shadow_map_size: self.shadow_maps.size(),
            direct_weight: self.weights[0],
            indirect_weight: self.weights[1],
            skips_glossy: u32::from(self.skips_glossy),
        }
    }
}

impl SpecularPaths {
    /// The pass on this device. Needs no features and no more than default limits. `kernel` and `keeps_to_surfaces` as in
    /// [`PhotonSplatterConfig`](super::PhotonSplatterConfig).
    pub fn new(device: &wgpu::Device, kernel: Kernel, keeps_to_surfaces: bool) -> Self {
        let layout = |label, slots: &[Slot]| device::layout(device, label, wgpu::ShaderStages::COMPUTE, slots);
        let begin_layout = layout("lightfall::SpecularPaths::begin", &BEGIN_SLOTS);
        let advance_layout = layout("lightfall::SpecularPaths", &ADVANCE_SLOTS);
        let begin = ComputeSpec {
            label: "lightfall::SpecularPaths::begin",
            source: wgsl::SPECULAR_PATHS_BEGIN,
            entry_point: "begin_paths",
            layouts: &[&begin_layout],
            constants: &[],
        };
        let advance = ComputeSpec {
            label: "lightfall::SpecularPaths",
            source: wgsl::SPECULAR_PATHS_ADVANCE,
            entry_point: "advance_paths",
            layouts: &[&advance_layout],
            constants: &[
                ("kernel", f64::from(kernel as u32)),
                ("splat_keeps_to_surfaces", f64::from(u8::from(keeps_to_surfaces))),
            ],
        };
        Self {
            device: device.clone(),
            begin: device::compute_pipeline(device, &begin),
            advance: device::compute_pipeline(device, &advance),
            begin_layout,
            advance_layout,
        }
    }

    /// Records the first rays of a round, to be traced before its first step.
    pub fn record_rays(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut SpecularPathsResources,
        inputs: &SpecularPathsInputs<'_>,
        round: u32,
    ) {
        for step in 0..resources.shape.steps {
            if let Some(buffer) = resources.params([round, step]) {
                let params = inputs.params([round, step], resources);
                inputs.queue.write_buffer(buffer, 0, bytemuck::bytes_of(&params));
            }
        }
        let Some(buffer) = resources.params([round, 0]) else {
            return;
        };
        let first = inputs.params([round, 0], resources);
        let views = inputs.g_buffer.views();
        let bound = [
            buffer.into(),
            inputs.g_buffer.view_buffer().into(),
            (&views.depth).into(),
            (&views.normal).into(),
            (&views.base_color).into(),
            inputs.g_buffer.surfaces().into(),
            inputs.rays.buffer().into(),
            (&resources.paths).into(),
            inputs.lights.buffer().into(),
            inputs.lights.polygons().into(),
            inputs.shadow_maps.view().into(),
        ];
        let label = "lightfall::SpecularPaths::begin";
        let cache = &mut resources.begin_groups;
        let group = cache.get(&self.device, label, &self.begin_layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.begin);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(first.width.div_ceil(8), first.row_count.div_ceil(8), 1);
    }

    /// Records a round's step, counted from 0, with the inputs of `record_rays`. Those that the resources were not made for are
    /// left out.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut SpecularPathsResources,
        inputs: &SpecularPathsInputs<'_>,
        [round, step]: [u32; 2],
    ) {
        let Some(buffer) = resources.params([round, step]) else {
            return;
        };
        let params = inputs.params([round, step], resources);
        let bound = [
            buffer.into(),
            inputs.rays.buffer().into(),
            inputs.rays.hits().into(),
            (&resources.paths).into(),
            inputs.photons.params().into(),
            inputs.photons.splats().into(),
            inputs.photons.first_splats().into(),
            inputs.lights.buffer().into(),
            inputs.lights.polygons().into(),
            inputs.shadow_maps.view().into(),
            inputs.radiance.view().into(),
            inputs.environment.buffer().into(),
            inputs.environment.view().into(),
        ];
        let label = "lightfall::SpecularPaths";
        let cache = &mut resources.advance_groups;
        let group = cache.get(&self.device, label, &self.advance_layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.advance);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(params.width.div_ceil(8), params.row_count.div_ceil(8), 1);
    }
}

impl SpecularPathsResources {
    /// For so many pixels.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, pixels: u32, shape: PathShape) -> Result<Self, Error> {
        let params = || device::uniform_buffer::<gpu::Params>(device, "lightfall::SpecularPaths::params");
        let bytes = u64::from(pixels.max(1)) * size_of::<gpu::SpecularPath>() as u64;
        Ok(Self {
            params: (0..shape.steps * shape.rounds)
                .map(|_| params())
                .collect::<Result<_, _>>()?,
            shape,
            paths: device::buffer(
                device,
                "lightfall::SpecularPaths::paths",
                bytes,
                wgpu::BufferUsages::STORAGE,
            )?,
            pixels,
            begin_groups: BindGroupCache::for_uses(shape.rounds.max(1) as usize),
            advance_groups: BindGroupCache::for_uses((shape.steps * shape.rounds).max(1) as usize),
        })
    }

    /// What they were made for.
    pub fn shape(&self) -> PathShape {
        self.shape
    }

    fn params(&self, [round, step]: [u32; 2]) -> Option<&wgpu::Buffer> {
        let is_known = step < self.shape.steps;
        let index = round as usize * self.shape.steps as usize + step as usize;
        self.params.get(index).filter(|_| is_known)
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.paths.size() + self.params.iter().map(wgpu::Buffer::size).sum::<u64>()
    }
}
