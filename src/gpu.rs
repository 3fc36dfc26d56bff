//! Beside the layers: the only place where GPU objects are made. One helper for each kind, so that the next major
//! version of wgpu is one edit, every object carries its label, and tests can count what a frame creates.

use crate::Error;
use std::cell::Cell;

/// What this thread has created, recorded and waited for so far. Tests compare two readings: nothing may be created or
/// waited for on a settled frame path.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CreationCount {
    /// Textures.
    pub textures: u64,
    /// Buffers.
    pub buffers: u64,
    /// Bind groups.
    pub bind_groups: u64,
    /// Render and compute pipelines.
    pub pipelines: u64,
    /// Bytes of textures and buffers.
    pub bytes: u64,
    /// Render and compute passes begun.
    pub passes: u64,
    /// Times the thread waited for the GPU.
    pub waits: u64,
}

thread_local! {
    static CREATED: Cell<CreationCount> = const { Cell::new(CreationCount {
        textures: 0, buffers: 0, bind_groups: 0, pipelines: 0, bytes: 0, passes: 0, waits: 0,
    }) };
}

/// What the crate has created on this thread so far.
pub fn creation_count() -> CreationCount {
    CREATED.get()
}

/// Notes that the thread waits for the GPU.
pub(crate) fn count_wait() {
    count(|c| c.waits += 1);
}

fn count(update: impl FnOnce(&mut CreationCount)) {
    let mut created = CREATED.get();
    update(&mut created);
    CREATED.set(created);
}

/// A two-dimensional texture, or an array of them.
pub(crate) struct TextureSpec {
    pub(crate) label: &'static str,
    pub(crate) size: [u32; 2],
    pub(crate) layers: u32,
    pub(crate) format: wgpu::TextureFormat,
    pub(crate) usage: wgpu::TextureUsages,
}

impl TextureSpec {
    pub(crate) fn bytes(&self) -> u64 {
        texture_bytes(self.size, self.layers, self.format)
    }
}

/// Bytes of an uncompressed texture without mips.
pub(crate) fn texture_bytes(size: [u32; 2], layers: u32, format: wgpu::TextureFormat) -> u64 {
    let texel = format
        .block_copy_size(None)
        .expect("the crate uses single-aspect formats only");
    u64::from(size[0]) * u64::from(size[1]) * u64::from(layers) * u64::from(texel)
}

/// Creates a texture after checking it against the device's limits.
pub(crate) fn texture(device: &wgpu::Device, spec: &TextureSpec) -> Result<wgpu::Texture, Error> {
    texture_with_mips(device, spec, 1)
}

/// Bytes of such a texture with mips.
pub(crate) fn mip_bytes(spec: &TextureSpec, levels: u32) -> u64 {
    let level = |l: u32| texture_bytes(spec.size.map(|s| (s >> l).max(1)), spec.layers, spec.format);
    (0..levels).map(level).sum()
}

/// The same with mips.
pub(crate) fn texture_with_mips(
    device: &wgpu::Device,
    spec: &TextureSpec,
    levels: u32,
) -> Result<wgpu::Texture, Error> {
    let limits = device.limits();
    let largest = spec.size[0].max(spec.size[1]);
    if spec.size[0] == 0 || spec.size[1] == 0 || largest > limits.max_texture_dimension_2d {
        return Err(Error::LimitExceeded {
            what: format!("{} of {}×{} texels", spec.label, spec.size[0], spec.size[1]),
            needed: u64::from(largest),
            limit: u64::from(limits.max_texture_dimension_2d),
            remedy: "choose a size from 1 to the limit",
        });
    }
    if spec.layers > limits.max_texture_array_layers {
        return Err(Error::LimitExceeded {
            what: format!("{} of {} layers", spec.label, spec.layers),
            needed: u64::from(spec.layers),
            limit: u64::from(limits.max_texture_array_layers),
            remedy: "use fewer maps or lights",
        });
    }
    count(|c| {
        c.textures += 1;
        c.bytes += mip_bytes(spec, levels);
    });
    Ok(device.create_texture(&wgpu::TextureDescriptor {
        label: Some(spec.label),
        size: wgpu::Extent3d {
            width: spec.size[0],
            height: spec.size[1],
            depth_or_array_layers: spec.layers,
        },
        mip_level_count: levels,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: spec.format,
        usage: spec.usage,
        view_formats: &[],
    }))
}

/// A view of all layers as an array.
pub(crate) fn array_view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..Default::default()
    })
}

/// A view of one mip level of all layers.
pub(crate) fn level_view(texture: &wgpu::Texture, level: u32) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        base_mip_level: level,
        mip_level_count: Some(1),
        ..Default::default()
    })
}

/// A view of one layer.
pub(crate) fn layer_view(texture: &wgpu::Texture, layer: u32) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2),
        base_array_layer: layer,
        array_layer_count: Some(1),
        ..Default::default()
    })
}

/// Checks the size of a buffer against the device's limits.
pub(crate) fn check_buffer(
    device: &wgpu::Device,
    label: &'static str,
    size: u64,
    usage: wgpu::BufferUsages,
) -> Result<(), Error> {
    let limits = device.limits();
    let limit = if usage.contains(wgpu::BufferUsages::STORAGE) {
        limits.max_buffer_size.min(limits.max_storage_buffer_binding_size)
    } else {
        limits.max_buffer_size
    };
    if size > limit {
        return Err(Error::LimitExceeded {
            what: format!("{label} of {size} bytes"),
            needed: size,
            limit,
            remedy: "use fewer photons, bounces, rays, instances or pixels, or request a larger limit",
        });
    }
    Ok(())
}

/// Creates a buffer after checking it against the device's limits. Sizes are rounded up to a multiple of four.
pub(crate) fn buffer(
    device: &wgpu::Device,
    label: &'static str,
    size: u64,
    usage: wgpu::BufferUsages,
) -> Result<wgpu::Buffer, Error> {
    let size = size.max(4).next_multiple_of(4);
    check_buffer(device, label, size, usage)?;
    count(|c| {
        c.buffers += 1;
        c.bytes += size;
    });
    Ok(device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage,
        mapped_at_creation: false,
    }))
}

/// A uniform buffer for one POD.
pub(crate) fn uniform_buffer<T>(device: &wgpu::Device, label: &'static str) -> Result<wgpu::Buffer, Error> {
    let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
    buffer(device, label, size_of::<T>() as u64, usage)
}

/// What a binding slot takes. All slots of a pass are visible to all of its stages.
#[derive(Clone, Copy)]
pub(crate) enum Slot {
    Uniform,
    DynamicUniform(u64),
    Storage,
    StorageMut,
    /// `texture_2d<f32>`, read by `textureLoad` only; depth textures fit as well.
    Texture,
    /// `texture_2d<f32>` for filtering.
    FilteredTexture,
    /// `texture_2d<u32>`.
    UintTexture,
    /// `texture_2d_array<f32>`, read by `textureLoad` only.
    TextureArray,
    /// `texture_2d_array<f32>` for filtering.
    #[cfg(feature = "bvh")]
    FilteredTextureArray,
    /// `texture_2d_array<u32>`.
    UintArray,
    /// `texture_storage_2d<.., write>`.
    StorageTexture(wgpu::TextureFormat),
    /// `texture_storage_2d_array<.., write>`.
    StorageArray(wgpu::TextureFormat),
    Sampler,
}

/// A bind group layout whose slots are numbered from 0.
pub(crate) fn layout(
    device: &wgpu::Device,
    label: &'static str,
    stages: wgpu::ShaderStages,
    slots: &[Slot],
) -> wgpu::BindGroupLayout {
    let buffer = |ty, dynamic: Option<u64>| wgpu::BindingType::Buffer {
        ty,
        has_dynamic_offset: dynamic.is_some(),
        min_binding_size: dynamic.and_then(wgpu::BufferSize::new),
    };
    let texture = |sample_type, view_dimension| wgpu::BindingType::Texture {
        sample_type,
        view_dimension,
        multisampled: false,
    };
    let (flat, array) = (wgpu::TextureViewDimension::D2, wgpu::TextureViewDimension::D2Array);
    let entries: Vec<_> = slots
        .iter()
        .enumerate()
        .map(|(binding, slot)| wgpu::BindGroupLayoutEntry {
            binding: binding as u32,
            visibility: stages,
            ty: match *slot {
                Slot::Uniform => buffer(wgpu::BufferBindingType::Uniform, None),
                Slot::DynamicUniform(size) => buffer(wgpu::BufferBindingType::Uniform, Some(size)),
                Slot::Storage => buffer(wgpu::BufferBindingType::Storage { read_only: true }, None),
                Slot::StorageMut => buffer(wgpu::BufferBindingType::Storage { read_only: false }, None),
                Slot::Texture => texture(wgpu::TextureSampleType::Float { filterable: false }, flat),
                Slot::FilteredTexture => texture(wgpu::TextureSampleType::Float { filterable: true }, flat),
                Slot::UintTexture => texture(wgpu::TextureSampleType::Uint, flat),
                Slot::TextureArray => texture(wgpu::TextureSampleType::Float { filterable: false }, array),
                #[cfg(feature = "bvh")]
                Slot::FilteredTextureArray => texture(wgpu::TextureSampleType::Float { filterable: true }, array),
                Slot::UintArray => texture(wgpu::TextureSampleType::Uint, array),
                Slot::StorageTexture(format) => wgpu::BindingType::StorageTexture {
                    access: wgpu::StorageTextureAccess::WriteOnly,
                    format,
                    view_dimension: flat,
                },
                Slot::StorageArray(format) => wgpu::BindingType::StorageTexture {
                    access: wgpu::StorageTextureAccess::WriteOnly,
                    format,
                    view_dimension: array,
                },
                Slot::Sampler => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
            },
            count: None,
        })
        .collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(label),
        entries: &entries,
    })
}

/// Creates a bind group; bindings are numbered from 0.
pub(crate) fn bind_group(
    device: &wgpu::Device,
    label: &'static str,
    layout: &wgpu::BindGroupLayout,
    resources: Vec<wgpu::BindingResource<'_>>,
) -> wgpu::BindGroup {
    count(|c| c.bind_groups += 1);
    let entries: Vec<_> = (0..)
        .zip(resources)
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(label),
        layout,
        entries: &entries,
    })
}

/// One resource that a cached bind group refers to; compared by identity.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Bound {
    View(wgpu::TextureView),
    Buffer(wgpu::Buffer),
    #[cfg(feature = "bvh")]
    Sampler(wgpu::Sampler),
}

impl From<&wgpu::TextureView> for Bound {
    fn from(view: &wgpu::TextureView) -> Self {
        Self::View(view.clone())
    }
}

impl From<&wgpu::Buffer> for Bound {
    fn from(buffer: &wgpu::Buffer) -> Self {
        Self::Buffer(buffer.clone())
    }
}

#[cfg(feature = "bvh")]
impl From<&wgpu::Sampler> for Bound {
    fn from(sampler: &wgpu::Sampler) -> Self {
        Self::Sampler(sampler.clone())
    }
}

/// Bind groups remembered by what they bind, so that a settled frame creates none.
#[derive(Debug)]
pub(crate) struct BindGroupCache {
    groups: Vec<(Vec<Bound>, wgpu::BindGroup)>,
    capacity: usize,
}

/// A host that swaps between more than this many views of the same seam pays for a new bind group now and then.
const CACHED_BIND_GROUPS: usize = 8;

impl Default for BindGroupCache {
    fn default() -> Self {
        Self::for_uses(1)
    }
}

impl BindGroupCache {
    /// For a pass that binds `uses` different groups of one layout in a frame.
    pub(crate) fn for_uses(uses: usize) -> Self {
        Self {
            groups: Vec::new(),
            capacity: CACHED_BIND_GROUPS * uses.max(1),
        }
    }

    /// Room for uses.
    pub(crate) fn uses(&self) -> usize {
        self.capacity / CACHED_BIND_GROUPS
    }

    /// The bind group of these resources, made now if it is not remembered.
    pub(crate) fn get(
        &mut self,
        device: &wgpu::Device,
        label: &'static str,
        layout: &wgpu::BindGroupLayout,
        bound: &[Bound],
    ) -> wgpu::BindGroup {
        if let Some((_, group)) = self.groups.iter().find(|(key, _)| key == bound) {
            return group.clone();
        }
        let resources = bound
            .iter()
            .map(|b| match b {
                Bound::View(view) => wgpu::BindingResource::TextureView(view),
                Bound::Buffer(buffer) => buffer.as_entire_binding(),
                #[cfg(feature = "bvh")]
                Bound::Sampler(sampler) => wgpu::BindingResource::Sampler(sampler),
            })
            .collect();
        let group = bind_group(device, label, layout, resources);
        if self.groups.len() == self.capacity {
            self.groups.remove(0);
        }
        self.groups.push((bound.to_vec(), group.clone()));
        group
    }
}

fn shader(device: &wgpu::Device, label: &'static str, source: &'static str) -> wgpu::ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    })
}

fn pipeline_layout(
    device: &wgpu::Device,
    label: &'static str,
    layouts: &[&wgpu::BindGroupLayout],
) -> wgpu::PipelineLayout {
    let layouts: Vec<_> = layouts.iter().copied().map(Some).collect();
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: &layouts,
        immediate_size: 0,
    })
}

/// One entry point of a compute shader.
pub(crate) struct ComputeSpec<'a> {
    pub(crate) label: &'static str,
    pub(crate) source: &'static str,
    pub(crate) entry_point: &'static str,
    pub(crate) layouts: &'a [&'a wgpu::BindGroupLayout],
    pub(crate) constants: &'a [(&'a str, f64)],
}

/// A compute shader of one entry point, with a layout of its own as group 0.
#[derive(Debug)]
pub(crate) struct Step {
    pub(crate) layout: wgpu::BindGroupLayout,
    pub(crate) pipeline: wgpu::ComputePipeline,
}

impl Step {
    /// `spec` without layouts.
    pub(crate) fn new(device: &wgpu::Device, slots: &[Slot], spec: &ComputeSpec<'_>) -> Self {
        let layout = layout(device, spec.label, wgpu::ShaderStages::COMPUTE, slots);
        let pipeline = compute_pipeline(
            device,
            &ComputeSpec {
                layouts: &[&layout],
                ..*spec
            },
        );
        Self { layout, pipeline }
    }
}

pub(crate) fn compute_pipeline(device: &wgpu::Device, spec: &ComputeSpec<'_>) -> wgpu::ComputePipeline {
    count(|c| c.pipelines += 1);
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(spec.label),
        layout: Some(&pipeline_layout(device, spec.label, spec.layouts)),
        module: &shader(device, spec.label, spec.source),
        entry_point: Some(spec.entry_point),
        compilation_options: wgpu::PipelineCompilationOptions {
            constants: spec.constants,
            ..Default::default()
        },
        cache: None,
    })
}

/// A render pipeline with entry points `vertex` and `fragment`.
pub(crate) struct RenderSpec<'a> {
    pub(crate) label: &'static str,
    pub(crate) source: &'static str,
    pub(crate) fragment: &'static str,
    pub(crate) layouts: &'a [&'a wgpu::BindGroupLayout],
    pub(crate) constants: &'a [(&'a str, f64)],
    pub(crate) buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    pub(crate) topology: wgpu::PrimitiveTopology,
    pub(crate) cull_mode: Option<wgpu::Face>,
    pub(crate) targets: &'a [Option<wgpu::ColorTargetState>],
    pub(crate) depth_stencil: Option<wgpu::DepthStencilState>,
}

pub(crate) fn render_pipeline(device: &wgpu::Device, spec: &RenderSpec<'_>) -> wgpu::RenderPipeline {
    count(|c| c.pipelines += 1);
    let module = shader(device, spec.label, spec.source);
    let compilation_options = wgpu::PipelineCompilationOptions {
        constants: spec.constants,
        ..Default::default()
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(spec.label),
        layout: Some(&pipeline_layout(device, spec.label, spec.layouts)),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: compilation_options.clone(),
            buffers: spec.buffers,
        },
        primitive: wgpu::PrimitiveState {
            topology: spec.topology,
            cull_mode: spec.cull_mode,
            ..Default::default()
        },
        depth_stencil: spec.depth_stencil.clone(),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(spec.fragment),
            compilation_options,
            targets: spec.targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// Begins a compute pass, timed if there is a sink.
pub(crate) fn compute_pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    label: &'static str,
    timestamps: Option<&crate::Timestamps>,
) -> wgpu::ComputePass<'a> {
    count(|c| c.passes += 1);
    let span = timestamps.and_then(|t| t.span(label));
    encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: Some(label),
        timestamp_writes: span.map(|s| wgpu::ComputePassTimestampWrites {
            query_set: s.query_set,
            beginning_of_pass_write_index: Some(s.begin),
            end_of_pass_write_index: Some(s.end),
        }),
    })
}

/// A render pass that clears its colour targets to zero and its depth to infinitely far (reverse-Z).
pub(crate) fn render_pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    label: &'static str,
    colors: &[&wgpu::TextureView],
    depth: Option<&wgpu::TextureView>,
    timestamps: Option<&crate::Timestamps>,
) -> wgpu::RenderPass<'a> {
    let load = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
    let depth = depth.map(|d| (d, wgpu::LoadOp::Clear(0.0)));
    begin_render_pass(encoder, label, (colors, load), depth, timestamps)
}

/// A render pass that draws over what its targets hold.
pub(crate) fn render_pass_over<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    label: &'static str,
    colors: &[&wgpu::TextureView],
    depth: Option<&wgpu::TextureView>,
    timestamps: Option<&crate::Timestamps>,
) -> wgpu::RenderPass<'a> {
    let depth = depth.map(|d| (d, wgpu::LoadOp::Load));
    begin_render_pass(encoder, label, (colors, wgpu::LoadOp::Load), depth, timestamps)
}

fn begin_render_pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    label: &'static str,
    (colors, load_color): (&[&wgpu::TextureView], wgpu::LoadOp<wgpu::Color>),
    depth: Option<(&wgpu::TextureView, wgpu::LoadOp<f32>)>,
    timestamps: Option<&crate::Timestamps>,
) -> wgpu::RenderPass<'a> {
    count(|c| c.passes += 1);
    let span = timestamps.and_then(|t| t.span(label));
    let attachments: Vec<_> = colors
        .iter()
        .map(|view| {
            Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: load_color,
                    store: wgpu::StoreOp::Store,
                },
            })
        })
        .collect();
    let depth = depth.map(|(view, load)| wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations {
            load,
            store: wgpu::StoreOp::Store,
        }),
        stencil_ops: None,
    });
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &attachments,
        depth_stencil_attachment: depth,
        timestamp_writes: span.map(|s| wgpu::RenderPassTimestampWrites {
            query_set: s.query_set,
            beginning_of_pass_write_index: Some(s.begin),
            end_of_pass_write_index: Some(s.end),
        }),
        occlusion_query_set: None,
        multiview_mask: None,
    })
}

/// Workgroups of a two-dimensional dispatch for `count` one-dimensional workgroups, none above 65 535 an axis.
pub(crate) fn dispatch_size(count: u32) -> [u32; 2] {
    const MAX: u32 = 65_535;
    if count <= MAX {
        [count, 1]
    } else {
        let rows = count.div_ceil(MAX);
        [count.div_ceil(rows), rows]
    }
}
