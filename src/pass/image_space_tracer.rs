//! Rays through environment maps: the photon walk, and lists of rays.
//!
//! Inputs: [`EnvMaps`], for most methods their [`DepthHierarchy`], and [`Photons`] with hop 0 or [`SurfaceRays`]. Output:
//! [`Photons`], hops 1 to its number of bounces, and hop 0 of those that start on lamps; or one hop, and the list of the rays
//! that it is not sure of, for another tracer ([`SharedHop`]); or hits of [`SurfaceRays`]. Cost, and errors, of every
//! [`TraceMethod`]: `docs/tracing.md`. Source: Yao et al. 2010, sections 3 and 5; march, hierarchy and order are this crate's.
//! Limits: metal and glass are as facetted as maps show them, and the inside of glass is not seen; geometry that no map sees
//! lets rays pass or loses them; what became of every ray is in the photon records ([`TraceStatistics`](super::TraceStatistics)
//! adds them up).

use super::dispatch_64;
use super::photon_guiding::Guiding;
use super::photon_walk::{PhotonWalk, PhotonWalkInputs, PhotonWalkResources, PreparedWalk, SharedHop};
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::{DepthHierarchy, EnvMaps, PathList, Photons, RANGE_FORMAT, SurfaceRays};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/image_space_tracer/trace_ray.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) map_count: u32,
        pub(crate) map_size: u32,
        pub(crate) iterations: u32,
        pub(crate) epsilon: f32,
        pub(crate) most_fetches: u32,
        pub(crate) doubts_normals: u32,
    }

    /// Twin of `ListParams` in `shaders/pass/image_space_tracer/trace_rays.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct ListParams {
        pub(crate) ray_count: u32,
        pub(crate) row: u32,
    }
}

/// Bindings of group 1: `shaders/pass/image_space_tracer/trace_ray.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 4] = [Slot::Uniform, Slot::UintArray, Slot::Storage, Slot::UintArray];

/// Bindings of group 0 of `shaders/pass/image_space_tracer/trace_rays.wgsl`, in order.
pub(crate) const RAY_SLOTS: [Slot; 3] = [Slot::Uniform, Slot::Storage, Slot::StorageMut];

/// Bindings of `shaders/pass/image_space_tracer/list_lost.wgsl`, in order.
pub(crate) const LIST_SLOTS: [Slot; 4] = [Slot::Uniform, Slot::Storage, Slot::StorageMut, Slot::StorageMut];

/// How a ray is searched for in the maps.
///
/// The first four take the nearest surface that any map shows. The others ask the maps in order of
/// distance, each continuing where the one before knew no further, and tell a hit that is certain from one that is
/// tentative, because something unseen may lie before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum TraceMethod {
    /// The paper's: false position in every map; a stored point within a small angle of the ray (ε = 1 − cos ≤ 0.001) is
    /// a hit; nearest of all maps.
    Paper,
    /// False position; a hit meets the texel's plane from the front and within 1.5 texels of its middle; only maps that
    /// see the ray's origin are asked. As many fetches as the paper's, fewer false hits.
    Plane,
    /// Every map marched in equal angles; nearest of all maps. More maps may make it worse.
    NearestMarch,
    /// Every map walked texel by texel over its depth hierarchy; nearest of all maps. More maps may make it worse.
    NearestWalk,
    /// Maps in order of distance, marched in equal angles; plane test. Fewest fetches: most rays end in the first or second
    /// map. Thin things are missed.
    OrderedMarch,
    /// Maps in order of distance, walked texel by texel over their depth hierarchies: misses nothing that a map shows. Two to
    /// four times the fetches of the march.
    #[default]
    OrderedWalk,
    /// The same, and a certain hit is looked at again from up to three maps that are nearer to it. A tenth more fetches, and
    /// somewhat fewer false hits where there are many edges.
    VerifiedWalk,
}

impl TraceMethod {
    /// Every method.
    pub const ALL: [Self; 7] = [
        Self::Paper,
        Self::Plane,
        Self::NearestMarch,
        Self::NearestWalk,
        Self::OrderedMarch,
        Self::OrderedWalk,
        Self::VerifiedWalk,
    ];

    /// Whether it needs the maps' [`DepthHierarchy`].
    pub fn needs_hierarchy(self) -> bool {
        matches!(self, Self::NearestWalk | Self::OrderedWalk | Self::VerifiedWalk)
    }
}

/// Speed against accuracy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageSpaceTracerSettings {
    /// Steps of false position for each map and ray, 1 to 32; the paper uses 5. More cost a fetch each and find a few
    /// more crossings: 3, 5, 8 find 64, 65, 66 % of a living room's hits right (`docs/tracing.md`). Other methods do not use
    /// it.
    pub iterations: u32,
    /// Fetches after which a walk over hierarchies gives a ray up as lost, for a surer tracer to find; 0: never. 200 halve what
    /// the slowest ray of a group takes in furnished scenes (`docs/tracing.md`).
    pub most_fetches: u32,
    /// Whether ordered walks call a hit tentative where neighbouring texels face different ways, so that the facet
    /// that is hit may be another. A surer tracer then finds the right normal of nearly all, and has about
    /// twice as much to do: with twelve maps of 512² texels 99.6 % of rays and more are right (`docs/tracing.md`).
    pub doubts_normals: bool,
    /// Scatterings before Russian roulette may end a path. Lower is faster and noisier: 1, 2, 4 have 0.82
    /// and 1.02 of the error before in a hall of pillars (`docs/tradeoff.md`).
    pub roulette_from: u32,
}

impl Default for ImageSpaceTracerSettings {
    fn default() -> Self {
        Self {
            iterations: 8,
            most_fetches: 0,
            doubts_normals: false,
            roulette_from: 4,
        }
    }
}

/// Bytes of the texel that stands in for a hierarchy.
const NO_HIERARCHY_BYTES: u64 = 4;

/// ε of Yao et al. 2010, section 8.
const PAPER_EPSILON: f32 = 0.001;

/// The pass.
#[derive(Debug)]
pub struct ImageSpaceTracer {
    device: wgpu::Device,
    walk: PhotonWalk,
    method: TraceMethod,
    layout: wgpu::BindGroupLayout,
    walk_pipeline: wgpu::ComputePipeline,
    walk_listed: wgpu::ComputePipeline,
    ray_layout: wgpu::BindGroupLayout,
    trace: wgpu::ComputePipeline,
    list_layout: wgpu::BindGroupLayout,
    count_lost: wgpu::ComputePipeline,
    sum_blocks: wgpu::ComputePipeline,
    write_lost: wgpu::ComputePipeline,
}

/// Uniforms and bind groups.
#[derive(Debug)]
pub struct ImageSpaceTracerResources {
    walk: PhotonWalkResources,
    params: wgpu::Buffer,
    groups: BindGroupCache,
    list_groups: BindGroupCache,
    ray_params: wgpu::Buffer,
    ray_groups: BindGroupCache,
    /// Stands in for the hierarchy where the method needs none.
    no_hierarchy: wgpu::TextureView,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct ImageSpaceTracerInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// What photons meet.
    pub env_maps: &'a EnvMaps,
    /// Of these maps; what [`TraceMethod::needs_hierarchy`].
    pub hierarchy: Option<&'a DepthHierarchy>,
    /// Hop 0 is read, and written where it starts on a lamp; the others are written; of a shared hop, the one before it and
    /// itself.
    pub photons: &'a Photons,
    /// `None`: the whole walk. A hop: this one, whose lost rays are listed.
    pub shared: Option<SharedHop<'a>>,
    /// What guided their emission, if anything did ([`PhotonSpread::Guided`]).
    ///
    /// [`PhotonSpread::Guided`]: super::PhotonSpread::Guided
    pub guiding: Option<Guiding<'a>>,
    /// As for the emitter.
    pub sample_offset: u32,
    /// How to trace.
    pub settings: &'a ImageSpaceTracerSettings,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

/// What tracing a list of rays needs.
#[derive(Debug, Clone, Copy)]
pub struct ImageSpaceTracerRayInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// What rays meet.
    pub env_maps: &'a EnvMaps,
    /// Of these maps; what [`TraceMethod::needs_hierarchy`].
    pub hierarchy: Option<&'a DepthHierarchy>,
    /// The rays; what becomes of them is written.
    pub rays: &'a SurfaceRays,
    /// How to trace.
    pub settings: &'a ImageSpaceTracerSettings,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl ImageSpaceTracer {
    /// The pass on this device, for one way of searching. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device, method: TraceMethod) -> Self {
        let stages = wgpu::ShaderStages::COMPUTE;
        let walk = PhotonWalk::new(device, "lightfall::ImageSpaceTracer::walk");
        let layout = device::layout(device, "lightfall::ImageSpaceTracer", stages, &SLOTS);
        let ray_layout = device::layout(device, "lightfall::ImageSpaceTracer::rays", stages, &RAY_SLOTS);
        let list_layout = device::layout(device, "lightfall::ImageSpaceTracer::list", stages, &LIST_SLOTS);
        let by_method = |label, source, entry_point, layouts: &[&wgpu::BindGroupLayout]| {
            device::compute_pipeline(
                device,
                &ComputeSpec {
                    label,
                    source,
                    entry_point,
                    layouts,
                    constants: &[("method", f64::from(method as u32))],
                },
            )
        };
        let step = |label, entry_point| {
            device::compute_pipeline(
                device,
                &ComputeSpec {
                    label,
                    source: wgsl::IMAGE_SPACE_TRACER_LIST,
                    entry_point,
                    layouts: &[&list_layout],
                    constants: &[],
                },
            )
        };
        Self {
            device: device.clone(),
            method,
            walk_pipeline: by_method(
                "lightfall::ImageSpaceTracer::walk",
                wgsl::IMAGE_SPACE_TRACER,
                "walk_photons",
                &[&walk.layout, &layout],
            ),
            walk_listed: by_method(
                "lightfall::ImageSpaceTracer::walk_listed",
                wgsl::IMAGE_SPACE_TRACER,
                "walk_listed",
                &[&walk.layout, &layout, &walk.list_layout],
            ),
            trace: by_method(
                "lightfall::ImageSpaceTracer::trace_rays",
                wgsl::IMAGE_SPACE_TRACER_RAYS,
                "trace_rays",
                &[&ray_layout, &layout],
            ),
            count_lost: step("lightfall::ImageSpaceTracer::count_lost", "count_lost"),
            sum_blocks: step("lightfall::ImageSpaceTracer::sum_blocks", "sum_blocks"),
            write_lost: step("lightfall::ImageSpaceTracer::write_lost", "write_lost"),
            walk,
            layout,
            ray_layout,
            list_layout,
        }
    }

    /// How it searches.
    pub fn method(&self) -> TraceMethod {
        self.method
    }

    /// Records the walk, or a shared hop and the list of the rays that it is not sure of.
    ///
    /// # Errors
    /// [`Error::MissingInput`] if the method needs a hierarchy and none is given. Nothing is recorded then.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut ImageSpaceTracerResources,
        inputs: &ImageSpaceTracerInputs<'_>,
    ) -> Result<(), Error> {
        let Some((walk, maps)) = self.prepare(resources, inputs)? else {
            return Ok(());
        };
        let mut pass = device::compute_pass(encoder, "lightfall::ImageSpaceTracer", inputs.timestamps);
        pass.set_pipeline(&self.walk_pipeline);
        pass.set_bind_group(0, &walk.group, &[]);
        pass.set_bind_group(1, &maps, &[]);
        pass.dispatch_workgroups(walk.groups[0], walk.groups[1], 1);
        drop(pass);
        if let Some(hop) = inputs.shared {
            self.record_list(encoder, resources, inputs, (&walk, hop.lost));
        }
        Ok(())
    }

    /// Records the walk of some paths alone, over what is there.
    ///
    /// # Errors
    /// As [`ImageSpaceTracer::record`].
    pub fn record_listed(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut ImageSpaceTracerResources,
        inputs: &ImageSpaceTracerInputs<'_>,
        list: &PathList,
    ) -> Result<(), Error> {
        let whole = ImageSpaceTracerInputs {
            shared: None,
            ..*inputs
        };
        let Some((walk, maps)) = self.prepare(resources, &whole)? else {
            return Ok(());
        };
        let listed = self.walk.list_group(&mut resources.walk, list);
        let mut pass = device::compute_pass(encoder, "lightfall::ImageSpaceTracer", inputs.timestamps);
        pass.set_pipeline(&self.walk_listed);
        pass.set_bind_group(0, &walk.group, &[]);
        pass.set_bind_group(1, &maps, &[]);
        pass.set_bind_group(2, &listed, &[]);
        pass.dispatch_workgroups_indirect(list.buffer(), 0);
        Ok(())
    }

    /// Uniforms and bindings of a walk, and of what it meets.
    fn prepare(
        &self,
        resources: &mut ImageSpaceTracerResources,
        inputs: &ImageSpaceTracerInputs<'_>,
    ) -> Result<Option<(PreparedWalk, wgpu::BindGroup)>, Error> {
        let walk = PhotonWalkInputs {
            queue: inputs.queue,
            photons: inputs.photons,
            shared: inputs.shared,
            sample_offset: inputs.sample_offset,
            roulette_from: inputs.settings.roulette_from,
            guiding: inputs.guiding,
        };
        let maps = self.maps_group(
            resources,
            inputs.queue,
            (inputs.env_maps, inputs.hierarchy),
            inputs.settings,
        )?;
        let walk = self.walk.prepare(&mut resources.walk, &walk);
        Ok(walk.map(|walk| (walk, maps)))
    }

    /// Records the tracing of a list of rays.
    ///
    /// # Errors
    /// As [`ImageSpaceTracer::record`].
    pub fn record_rays(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut ImageSpaceTracerResources,
        inputs: &ImageSpaceTracerRayInputs<'_>,
    ) -> Result<(), Error> {
        let maps = self.maps_group(
            resources,
            inputs.queue,
            (inputs.env_maps, inputs.hierarchy),
            inputs.settings,
        )?;
        let (groups, row) = dispatch_64(inputs.rays.count());
        let params = gpu::ListParams {
            ray_count: inputs.rays.count(),
            row,
        };
        inputs
            .queue
            .write_buffer(&resources.ray_params, 0, bytemuck::bytes_of(&params));
        let label = "lightfall::ImageSpaceTracer::rays";
        let bound = [
            (&resources.ray_params).into(),
            inputs.rays.buffer().into(),
            inputs.rays.hits().into(),
        ];
        let rays = resources.ray_groups.get(&self.device, label, &self.ray_layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.trace);
        pass.set_bind_group(0, &rays, &[]);
        pass.set_bind_group(1, &maps, &[]);
        pass.dispatch_workgroups(groups[0], groups[1], 1);
        Ok(())
    }

    /// Writes what all rays read of the maps, and binds it.
    fn maps_group(
        &self,
        resources: &mut ImageSpaceTracerResources,
        queue: &wgpu::Queue,
        (env_maps, hierarchy): (&EnvMaps, Option<&DepthHierarchy>),
        settings: &ImageSpaceTracerSettings,
    ) -> Result<wgpu::BindGroup, Error> {
        if hierarchy.is_none() && self.method.needs_hierarchy() {
            return Err(Error::MissingInput {
                stage: "ImageSpaceTracer",
                input: "hierarchy",
                remedy: "record DepthHierarchyBuild after the maps are captured, or choose a method that needs none",
            });
        }
        let params = gpu::Params {
            map_count: env_maps.centers().len() as u32,
            map_size: env_maps.size(),
            iterations: settings.iterations.clamp(1, 32),
            epsilon: PAPER_EPSILON,
            most_fetches: match settings.most_fetches {
                0 => u32::MAX,
                most => most,
            },
            doubts_normals: u32::from(settings.doubts_normals),
        };
        queue.write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let bound = [
            (&resources.params).into(),
            env_maps.view().into(),
            env_maps.centers_buffer().into(),
            hierarchy.map_or(&resources.no_hierarchy, DepthHierarchy::view).into(),
        ];
        let label = "lightfall::ImageSpaceTracer";
        Ok(resources.groups.get(&self.device, label, &self.layout, &bound))
    }

    fn record_list(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut ImageSpaceTracerResources,
        inputs: &ImageSpaceTracerInputs<'_>,
        (walk, lost): (&PreparedWalk, &PathList),
    ) {
        let bound = [
            (&walk.params).into(),
            inputs.photons.buffer().into(),
            lost.buffer().into(),
            lost.blocks().into(),
        ];
        let label = "lightfall::ImageSpaceTracer::list";
        let (groups, layout) = (&mut resources.list_groups, &self.list_layout);
        let group = groups.get(&self.device, label, layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_bind_group(0, &group, &[]);
        let steps = [
            (&self.count_lost, walk.groups),
            (&self.sum_blocks, [1, 1]),
            (&self.write_lost, walk.groups),
        ];
        for (pipeline, [x, y]) in steps {
            pass.set_pipeline(pipeline);
            pass.dispatch_workgroups(x, y, 1);
        }
    }
}

impl ImageSpaceTracerResources {
    /// For the whole walk.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Self::for_shared_hops(device, 0)
    }

    /// For the whole walk, and for up to `bounces` hops that are shared with another tracer.
    ///
    /// # Errors
    /// As [`ImageSpaceTracerResources::new`].
    pub fn for_shared_hops(device: &wgpu::Device, bounces: u32) -> Result<Self, Error> {
        let no_hierarchy = device::TextureSpec {
            label: "lightfall::ImageSpaceTracer::no_hierarchy",
            size: [1; 2],
            layers: 1,
            format: RANGE_FORMAT,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
        };
        Ok(Self {
            walk: PhotonWalkResources::new(device, "lightfall::ImageSpaceTracer::walk", bounces)?,
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::ImageSpaceTracer::params")?,
            groups: BindGroupCache::default(),
            list_groups: BindGroupCache::for_uses(bounces as usize),
            ray_params: device::uniform_buffer::<gpu::ListParams>(device, "lightfall::ImageSpaceTracer::ray_params")?,
            ray_groups: BindGroupCache::default(),
            no_hierarchy: device::array_view(&device::texture(device, &no_hierarchy)?),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.walk.memory_use() + self.params.size() + self.ray_params.size() + NO_HIERARCHY_BYTES
    }
}
