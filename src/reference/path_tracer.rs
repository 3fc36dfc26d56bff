//! The renderer that is right: unbiased path tracing on the GPU, one path a pixel and sample, for as long as one likes.
//!
//! Inputs: [`BvhGeometry`], [`Emitters`], a camera. Output: [`PathEstimate`], or [`Radiance`] to look at. Cost: a ray and a
//! shadow ray a scattering; noise falls as one over the root of the number of samples. Sources: Kajiya 1986 (the rendering
//! equation), Veach 1997 (multiple importance sampling), Walter et al. 2007 and Heitz 2018 (rough surfaces). All lights of
//! [`LightKind`](crate::scene::LightKind) and all materials of [`Material`](crate::scene::Material) are modelled. Paths run into
//! lamps with an extent, through mirrors and glass as well; the eye itself does not see them. Limits: a path never finds a light
//! without extent through a smooth mirror or glass, so caustics of those are missing; instance flags are not honoured:
//! everything blocks and reflects; interpolated normals let a few directions pass below the facet
//! that they leave, as in other renderers (Veach 1997, section 5.3.4).

use super::emitters::Emitters;
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, RenderSpec, Slot};
use crate::resource::bvh_geometry::BVH_SLOTS;
use crate::resource::{BLACK_GUARD, BvhGeometry, Radiance};
use crate::scene::{Camera, Projection, UnitFrame};
use crate::{Error, Timestamps, read_back, wgsl};
use glam::DVec3;

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/reference/path_tracer/trace_paths.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) eye: [f32; 3],
        pub(crate) is_parallel: u32,
        pub(crate) forward: [f32; 3],
        pub(crate) bounces: u32,
        pub(crate) right: [f32; 3],
        pub(crate) roulette_from: u32,
        pub(crate) up: [f32; 3],
        pub(crate) component: u32,
        pub(crate) size: [u32; 2],
        pub(crate) emitter_count: u32,
        pub(crate) crossed_count: u32,
        pub(crate) pick_per_area: f32,
        pub(crate) environment_pick: f32,
        pub(crate) environment_norm: f32,
        pub(crate) environment_rotation: f32,
        pub(crate) environment_size: [u32; 2],
        pub(crate) spans_pixel: u32,
        pub(crate) _pad: u32,
    }

    /// Twin of `Params` in `shaders/reference/path_tracer/resolve.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct ResolveParams {
        pub(crate) width: u32,
        pub(crate) output_scale: f32,
    }
}

/// Bindings of group 0 of `shaders/reference/path_tracer/trace_paths.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 4] = [Slot::Uniform, Slot::Storage, Slot::Texture, Slot::StorageMut];

/// Bindings of `shaders/reference/path_tracer/resolve.wgsl`, in order.
pub(crate) const RESOLVE_SLOTS: [Slot; 2] = [Slot::Uniform, Slot::Storage];

/// Which paths count, by the surfaces that scatter light on its way to the eye.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PathComponent {
    /// All.
    #[default]
    All = 0,
    /// At most one surface: emission seen directly and direct light.
    Direct = 1,
    /// At least two.
    Indirect = 2,
    /// The eye sees a diffuse surface that light reached by way of metals and glass alone. Part of `Indirect`.
    Caustic = 3,
    /// The eye sees a metal or glass.
    Specular = 4,
}

/// What to estimate, and how: `roulette_from` alone does not change what the mean tends to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PathTracerSettings {
    /// Which paths count.
    pub component: PathComponent,
    /// Surfaces that light scatters at before the one the eye sees, at most 1000: more are taken as 1000. Fewer leave
    /// out light.
    pub bounces: u32,
    /// Scatterings before Russian roulette may end a path. Fewer are faster and noisier.
    pub roulette_from: u32,
    /// Whether paths begin all over a pixel, as a box filter does; else all go through its middle, which is what passes see
    /// of it.
    pub spans_pixel: bool,
}

impl Default for PathTracerSettings {
    fn default() -> Self {
        Self {
            component: PathComponent::All,
            bounces: 64,
            roulette_from: 4,
            spans_pixel: true,
        }
    }
}

/// Most bounces that settings may ask for.
const MAX_BOUNCES: u32 = 1000;

/// The pass.
#[derive(Debug)]
pub struct PathTracer {
    device: wgpu::Device,
    layout: wgpu::BindGroupLayout,
    geometry_layout: wgpu::BindGroupLayout,
    trace: wgpu::ComputePipeline,
    resolve_layout: wgpu::BindGroupLayout,
    resolve: wgpu::RenderPipeline,
}

/// Means of the samples of one view, and how far they spread: 32 bytes a pixel.
#[derive(Debug)]
pub struct PathTracerResources {
    params: wgpu::Buffer,
    resolve_params: wgpu::Buffer,
    moments: wgpu::Buffer,
    size: [u32; 2],
    samples: u32,
    groups: BindGroupCache,
    geometry_groups: BindGroupCache,
    resolve_groups: BindGroupCache,
}

/// What a sample takes.
#[derive(Debug, Clone, Copy)]
pub struct PathTracerInputs<'a> {
    /// For the uniforms of this sample.
    pub queue: &'a wgpu::Queue,
    /// The frame that geometry and emitters were prepared in.
    pub frame: &'a UnitFrame,
    /// What rays meet; prepared.
    pub geometry: &'a BvhGeometry,
    /// What shines.
    pub emitters: &'a Emitters,
    /// The eye.
    pub camera: &'a Camera,
    /// How paths are made; the same for all samples that are summed up.
    pub settings: &'a PathTracerSettings,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

/// What the samples so far say of each pixel, row after row from the top left.
#[derive(Debug, Clone, PartialEq)]
pub struct PathEstimate {
    /// Radiance, W/m²/sr, linear RGB.
    pub mean: Vec<[f32; 3]>,
    /// Standard error of the mean, in the same unit; infinite with fewer than two samples.
    pub standard_error: Vec<[f32; 3]>,
}

impl PathEstimate {
    /// The noise left, in the terms of [`metrics`](super::metrics): mean over pixels and channels of
    /// σ² / (r² + (0.01 · mean r)²), σ the standard error and r the mean; what relMSE is expected to be against an exact
    /// image.
    #[must_use]
    pub fn relative_variance(&self) -> f64 {
        let values = || self.mean.iter().flatten().map(|&x| f64::from(x));
        let count = values().count().max(1) as f64;
        let guard = BLACK_GUARD * values().sum::<f64>() / count;
        let errors = self.standard_error.iter().flatten().map(|&e| f64::from(e).powi(2));
        let relative = values().zip(errors).map(|(r, variance)| {
            let scale = r * r + guard * guard;
            if scale > 0.0 { variance / scale } else { 0.0 }
        });
        relative.sum::<f64>() / count
    }
}

impl PathTracer {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let label = "lightfall::PathTracer";
        let stages = wgpu::ShaderStages::COMPUTE;
        let layout = device::layout(device, label, stages, &SLOTS);
        let geometry_layout = device::layout(device, "lightfall::PathTracer::geometry", stages, &BVH_SLOTS);
        let trace = device::compute_pipeline(
            device,
            &ComputeSpec {
                label: "lightfall::PathTracer::trace",
                source: wgsl::PATH_TRACER,
                entry_point: "trace_paths",
                layouts: &[&layout, &geometry_layout],
                constants: &[],
            },
        );
        let resolve_label = "lightfall::PathTracer::resolve";
        let resolve_layout = device::layout(device, resolve_label, wgpu::ShaderStages::FRAGMENT, &RESOLVE_SLOTS);
        let resolve = device::render_pipeline(
            device,
            &RenderSpec {
                label: resolve_label,
                source: wgsl::PATH_TRACER_RESOLVE,
                fragment: "fragment",
                layouts: &[&resolve_layout],
                constants: &[],
                buffers: &[],
                topology: wgpu::PrimitiveTopology::TriangleList,
                cull_mode: None,
                targets: &[Some(wgpu::TextureFormat::Rgba32Float.into())],
                depth_stencil: None,
            },
        );
        Self {
            device: device.clone(),
            layout,
            geometry_layout,
            trace,
            resolve_layout,
            resolve,
        }
    }

    /// Records one more sample of every pixel. Any number may be recorded into one encoder.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut PathTracerResources,
        inputs: &PathTracerInputs<'_>,
    ) {
        let params = params(resources, inputs);
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let label = "lightfall::PathTracer";
        let bound = [
            (&resources.params).into(),
            inputs.emitters.buffer().into(),
            inputs.emitters.environment().into(),
            (&resources.moments).into(),
        ];
        let group = resources.groups.get(&self.device, label, &self.layout, &bound);
        let bound = inputs.geometry.bound();
        let geometry = resources
            .geometry_groups
            .get(&self.device, label, &self.geometry_layout, &bound);
        if resources.samples == 0 {
            encoder.clear_buffer(&resources.moments, 0, None);
        }
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.trace);
        pass.set_bind_group(0, &group, &[]);
        pass.set_bind_group(1, &geometry, &[]);
        pass.dispatch_workgroups(resources.size[0].div_ceil(8), resources.size[1].div_ceil(8), 1);
        resources.samples += 1;
    }

    /// Records the mean of all samples so far into an image, times `output_scale` ([`UnitFrame::output_scale`]). The image
    /// is `rgba32float` and has the size of the resources; of a larger one the rest is meaningless.
    pub fn record_resolve(
        &self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut PathTracerResources,
        (output_scale, image): (f32, &Radiance),
    ) {
        let params = gpu::ResolveParams {
            width: resources.size[0],
            output_scale,
        };
        queue.write_buffer(&resources.resolve_params, 0, bytemuck::bytes_of(&params));
        let label = "lightfall::PathTracer::resolve";
        let bound = [(&resources.resolve_params).into(), (&resources.moments).into()];
        let group = resources
            .resolve_groups
            .get(&self.device, label, &self.resolve_layout, &bound);
        let mut pass = device::render_pass(encoder, label, &[image.view()], None, None);
        pass.set_pipeline(&self.resolve);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}

impl PathTracerResources {
    /// Room for the samples of an image of this size.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] for no pixels, or more than one storage binding holds.
    pub fn new(device: &wgpu::Device, size: [u32; 2]) -> Result<Self, Error> {
        let largest = device.limits().max_texture_dimension_2d;
        if size.contains(&0) || size.iter().any(|&s| s > largest) {
            return Err(Error::LimitExceeded {
                what: format!("an image of {}×{} pixels", size[0], size[1]),
                needed: u64::from(size[0].max(size[1])),
                limit: u64::from(largest),
                remedy: "choose a size from 1 to the limit",
            });
        }
        let bytes = 32 * u64::from(size[0]) * u64::from(size[1]);
        use wgpu::BufferUsages as U;
        Ok(Self {
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::PathTracer::params")?,
            resolve_params: device::uniform_buffer::<gpu::ResolveParams>(device, "lightfall::PathTracer::resolve")?,
            moments: device::buffer(
                device,
                "lightfall::PathTracer::moments",
                bytes,
                U::STORAGE | U::COPY_SRC | U::COPY_DST,
            )?,
            size,
            samples: 0,
            groups: BindGroupCache::default(),
            geometry_groups: BindGroupCache::default(),
            resolve_groups: BindGroupCache::default(),
        })
    }

    /// Forgets all samples: the scene, the camera or the settings have changed.
    pub fn restart(&mut self) {
        self.samples = 0;
    }

    /// Samples so far.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Reads the estimate back, in world units. Waits for the GPU.
    ///
    /// # Errors
    /// [`Error::ReadBack`]; [`Error::UnrepresentableRadiance`] as [`UnitFrame::output_scale`].
    pub fn read_blocking(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &UnitFrame,
    ) -> Result<PathEstimate, Error> {
        let scale = f64::from(frame.output_scale(1.0)?);
        let count = f64::from(self.samples);
        let moments: Vec<[[f32; 4]; 2]> = read_back::read_buffer_blocking(device, queue, &self.moments)?;
        let mean = |[mean, _]: &[[f32; 4]; 2], c: usize| if count > 0.0 { f64::from(mean[c]) } else { 0.0 };
        let error = |[_, spread]: &[[f32; 4]; 2], c: usize| {
            if count > 1.0 {
                (f64::from(spread[c]) / (count * (count - 1.0))).sqrt()
            } else {
                f64::INFINITY
            }
        };
        let all = |of: &dyn Fn(&[[f32; 4]; 2], usize) -> f64| {
            let pixel = |moments| [0, 1, 2].map(|c| (scale * of(moments, c)) as f32);
            moments.iter().map(pixel).collect()
        };
        Ok(PathEstimate {
            mean: all(&mean),
            standard_error: all(&error),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.params.size() + self.resolve_params.size() + self.moments.size()
    }
}

fn params(resources: &PathTracerResources, inputs: &PathTracerInputs<'_>) -> gpu::Params {
    let PathTracerInputs {
        frame,
        camera,
        settings,
        ..
    } = inputs;
    let size = resources.size;
    let emitters = inputs.emitters.params();
    let axes = camera.transform.matrix3;
    let (half_height, is_parallel) = match camera.projection {
        Projection::Perspective { fov_y } => ((0.5 * fov_y).tan(), false),
        Projection::Orthographic { half_height } => (half_height / frame.length_scale(), true),
    };
    let aspect = f64::from(size[0]) / f64::from(size[1]);
    let unit = |axis: DVec3, length: f64| -> [f32; 3] { (axis.normalize() * length).as_vec3().to_array() };
    gpu::Params {
        eye: frame.point(camera.transform.translation).to_array(),
        is_parallel: u32::from(is_parallel),
        forward: unit(-axes.z_axis, 1.0),
        right: unit(axes.x_axis, half_height * aspect),
        bounces: settings.bounces.min(MAX_BOUNCES),
        up: unit(axes.y_axis, half_height),
        roulette_from: settings.roulette_from,
        size,
        component: settings.component as u32,
        emitter_count: emitters.count,
        crossed_count: emitters.crossed_count,
        pick_per_area: emitters.pick_per_area,
        environment_pick: emitters.environment_pick,
        environment_norm: emitters.environment_norm,
        environment_size: emitters.environment_size,
        environment_rotation: emitters.environment_rotation,
        spans_pixel: u32::from(settings.spans_pixel),
        _pad: 0,
    }
}
