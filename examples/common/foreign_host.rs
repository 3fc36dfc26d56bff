//! A miniature engine, standing in for somebody else's: device, encoder and submission are its own, and so are its
//! vertex format, its four bind groups, its shaders, its G-buffer and its final lighting pass. Nothing in this file is
//! made for lightfall; `plug_one_stage.rs` plugs it in. (`capture.rs` does implement a trait of the library's, so that
//! the library can ask for draws.)
//!
//! The engine draws in *render space*: metres, axes of the world, about an origin that it chooses in `f64`.

#![allow(dead_code, reason = "the example shows a part of what the tests use")]

// An engine has wgpu and a maths library of its own. Where the versions differ, matrices pass as arrays.
use lightfall::{glam, wgpu};

#[path = "foreign_host/capture.rs"]
pub(crate) mod capture;
#[path = "foreign_host/world.rs"]
pub(crate) mod world;

use capture::Capture;
use glam::camera::rh::{proj, view};
use glam::{DAffine3, DMat4, DVec3, Mat4, Vec3};
use wgpu::util::DeviceExt as _;
use world::{Vertex, World};

/// Distance of the near plane, metres.
const NEAR: f32 = 1.0 / 16.0;
/// What dynamic offsets of uniforms must be a multiple of, on every device.
const UNIFORM_STRIDE: u32 = 256;

/// How the engine stores a unit normal.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Normals {
    Signed = 0,
    HalfOffset = 1,
    Octahedral = 2,
}

/// What the engine's textures are made of.
#[derive(Clone, Copy)]
pub(crate) struct Formats {
    pub(crate) normal: wgpu::TextureFormat,
    pub(crate) base_color: wgpu::TextureFormat,
    pub(crate) hdr: wgpu::TextureFormat,
}

impl Formats {
    /// As engines have them: normals × 0.5 + 0.5 in ten bits, base colour in eight.
    pub(crate) const PACKED: Self = Self {
        normal: wgpu::TextureFormat::Rgb10a2Unorm,
        base_color: wgpu::TextureFormat::Rgba8UnormSrgb,
        hdr: wgpu::TextureFormat::Rgba16Float,
    };
    /// As the library's own, for comparing.
    pub(crate) const WIDE: Self = Self {
        normal: wgpu::TextureFormat::Rg16Float,
        base_color: wgpu::TextureFormat::Rgba16Float,
        hdr: wgpu::TextureFormat::Rgba32Float,
    };

    /// How normals are stored: in two channels octahedral, in ten bits × 0.5 + 0.5, else as they are.
    pub(crate) fn normals(&self) -> Normals {
        match self.normal {
            wgpu::TextureFormat::Rg16Float => Normals::Octahedral,
            wgpu::TextureFormat::Rgb10a2Unorm => Normals::HalfOffset,
            _ => Normals::Signed,
        }
    }
}

/// Uniforms of group 0.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct FrameUniform {
    lamp_position: [f32; 3],
    /// W/m² that one unit of indirect irradiance stands for.
    indirect_scale: f32,
    lamp_intensity: [f32; 3],
    /// 1, or 0 to leave the lamp's own light out of the picture.
    direct_weight: f32,
    /// Render space to the space in which the box is a cube of half side 1, for the engine's own shadows.
    cube_from_render: [[f32; 4]; 4],
}

/// Uniforms of group 1.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct CameraUniform {
    clip_from_render: [[f32; 4]; 4],
    render_from_clip: [[f32; 4]; 4],
    eye: [f32; 4],
    size: [f32; 4],
}

/// Uniforms of group 2, one slot an object.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct ObjectUniform {
    render_from_object: [[f32; 4]; 4],
}

/// The engine's bind groups are four, all that core WebGPU has: frame,
const FRAME: &str = r"
struct Frame {
    lamp_position: vec3f,
    indirect_scale: f32,
    lamp_intensity: vec3f,
    direct_weight: f32,
    cube_from_render: mat4x4f,
}

@group(0) @binding(0) var<uniform> frame: Frame;
";

/// camera,
const CAMERA: &str = r"
struct Camera {
    clip_from_render: mat4x4f,
    render_from_clip: mat4x4f,
    eye: vec4f,
    size: vec4f,
}

@group(1) @binding(0) var<uniform> camera: Camera;
";

/// object and material.
const OBJECT: &str = r"
@group(2) @binding(0) var<uniform> render_from_object: mat4x4f;
@group(3) @binding(0) var<uniform> tint: vec4f;
";

/// Unit normals as points of a square.
const OCTAHEDRON: &str = r"
fn folded(p: vec2f) -> vec2f {
    return (1.0 - abs(p.yx)) * select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
}

fn octahedral_encode(n: vec3f) -> vec2f {
    let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    return select(folded(p), p, n.z >= 0.0);
}

fn octahedral_decode(p: vec2f) -> vec3f {
    let z = 1.0 - abs(p.x) - abs(p.y);
    return normalize(vec3f(select(folded(p), p, z >= 0.0), z));
}
";

/// Fills the G-buffer.
const G_BUFFER: &str = r"
override normals: u32;

struct Fragment {
    @builtin(position) clip: vec4f,
    @location(0) normal: vec3f,
    @location(1) @interpolate(flat) color: vec3f,
}

@vertex
fn vertex(@location(0) position: vec3f, @location(1) normal: vec4f, @location(2) color: vec4f) -> Fragment {
    let render = render_from_object * vec4f(position, 1.0);
    let turned = (render_from_object * vec4f(normal.xyz, 0.0)).xyz;
    return Fragment(camera.clip_from_render * render, turned, color.rgb * tint.rgb);
}

struct Texel {
    @location(0) normal: vec4f,
    @location(1) base_color: vec4f,
}

@fragment
fn fragment(f: Fragment, @builtin(front_facing) front: bool) -> Texel {
    let n = normalize(select(-f.normal, f.normal, front));
    var stored = select(n, 0.5 * n + 0.5, normals == 1u);
    if normals == 2u {
        stored = vec3f(octahedral_encode(n), 0.0);
    }
    return Texel(vec4f(stored, 0.0), vec4f(f.color, 1.0));
}
";

/// The final lighting: the lamp, with shadows of the engine's own, and indirect irradiance from elsewhere.
const LIGHTING: &str = r"
override normals: u32;

@group(2) @binding(0) var depth_texture: texture_2d<f32>;
@group(2) @binding(1) var normal_texture: texture_2d<f32>;
@group(2) @binding(2) var base_color_texture: texture_2d<f32>;
@group(3) @binding(0) var irradiance_texture: texture_2d<f32>;

const INVERSE_PI: f32 = 0.318309886;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(4u * (index & 1u)) - 1.0, f32(2u * (index & 2u)) - 1.0, 0.0, 1.0);
}

// Whether the box stands between two points: a segment against a cube, slab by slab.
fn is_shaded(p: vec3f, lamp: vec3f) -> bool {
    let start = (frame.cube_from_render * vec4f(p, 1.0)).xyz;
    let along = (frame.cube_from_render * vec4f(lamp - p, 0.0)).xyz;
    let a = (-1.0 - start) / along;
    let b = (1.0 - start) / along;
    let enter = max(max(min(a.x, b.x), min(a.y, b.y)), min(a.z, b.z));
    let leave = min(min(max(a.x, b.x), max(a.y, b.y)), max(a.z, b.z));
    return enter < leave && leave > 1e-3 && enter < 1.0;
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2u(position.xy);
    let base_color = textureLoad(base_color_texture, pixel, 0);
    if base_color.a == 0.0 {
        return vec4f(0.0);
    }
    let ndc = (position.xy / camera.size.xy - 0.5) * vec2f(2.0, -2.0);
    let hom = camera.render_from_clip * vec4f(ndc, textureLoad(depth_texture, pixel, 0).r, 1.0);
    let p = hom.xyz / hom.w;
    let stored = textureLoad(normal_texture, pixel, 0).xyz;
    var n = normalize(select(stored, 2.0 * stored - 1.0, normals == 1u));
    if normals == 2u {
        n = octahedral_decode(stored.xy);
    }

    let to_lamp = frame.lamp_position - p;
    let distance_squared = dot(to_lamp, to_lamp);
    let cosine = max(0.0, dot(n, to_lamp) * inverseSqrt(distance_squared));
    var direct = frame.lamp_intensity * (frame.direct_weight * cosine / distance_squared);
    if is_shaded(p, frame.lamp_position) {
        direct = vec3f(0.0);
    }
    let indirect = textureLoad(irradiance_texture, pixel, 0).rgb * frame.indirect_scale;
    return vec4f(base_color.rgb * INVERSE_PI * (direct + indirect), 1.0);
}
";

/// The engine.
pub(crate) struct Engine {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) world: World,
    /// World position of render space's origin.
    pub(crate) origin: DVec3,
    pub(crate) formats: Formats,
    /// Pixels in use, from the top left of targets that may be larger.
    pub(crate) size: [u32; 2],
    pub(crate) targets: Targets,
    meshes: Vec<Mesh>,
    frame: wgpu::Buffer,
    camera: wgpu::Buffer,
    objects: wgpu::Buffer,
    groups: Groups,
    g_buffer_pipeline: wgpu::RenderPipeline,
    lighting_pipeline: wgpu::RenderPipeline,
    lighting_groups: wgpu::BindGroup,
    irradiance_layout: wgpu::BindGroupLayout,
    capture: Capture,
}

/// What the engine draws to.
pub(crate) struct Targets {
    pub(crate) depth: wgpu::TextureView,
    pub(crate) normal: wgpu::TextureView,
    pub(crate) base_color: wgpu::TextureView,
    pub(crate) hdr: wgpu::TextureView,
}

struct Mesh {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    index_count: u32,
    material: wgpu::BindGroup,
}

struct Groups {
    frame: wgpu::BindGroup,
    camera: wgpu::BindGroup,
    /// Taken with the object's offset.
    object: wgpu::BindGroup,
}

/// A device with nothing beyond core WebGPU.
pub(crate) fn open_device() -> Result<(wgpu::Device, wgpu::Queue), Box<dyn std::error::Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::PRIMARY,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    let descriptor = wgpu::DeviceDescriptor {
        label: Some("engine"),
        required_features: wgpu::Features::empty(),
        required_limits: wgpu::Limits::default(),
        ..Default::default()
    };
    Ok(pollster::block_on(adapter.request_device(&descriptor))?)
}

impl Engine {
    /// Uploads a world. Targets hold `largest` pixels, of which `size` are in use.
    pub(crate) fn new(
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        world: World,
        formats: Formats,
        size: [u32; 2],
        largest: [u32; 2],
    ) -> Self {
        let uniform = |bytes: usize| uniform_buffer(device, bytes as u64);
        let frame = uniform(size_of::<FrameUniform>());
        let camera = uniform(size_of::<CameraUniform>());
        let objects = uniform(world.objects.len() * UNIFORM_STRIDE as usize);
        let layouts = Layouts::new(device);
        let groups = Groups {
            frame: buffer_group(device, &layouts.uniform, &frame, None),
            camera: buffer_group(device, &layouts.uniform, &camera, None),
            object: buffer_group(
                device,
                &layouts.offset_uniform,
                &objects,
                Some(size_of::<ObjectUniform>() as u64),
            ),
        };
        let meshes = world.objects.iter().map(|o| Mesh::new(device, &layouts, o)).collect();
        let targets = Targets::new(device, &formats, size, largest);
        let constants = [("normals", f64::from(formats.normals() as u32))];
        let g_buffer_pipeline = pipeline(
            device,
            &[
                &layouts.uniform,
                &layouts.uniform,
                &layouts.offset_uniform,
                &layouts.uniform,
            ],
            &[FRAME, CAMERA, OBJECT, OCTAHEDRON, G_BUFFER].concat(),
            &[Vertex::layout()],
            &[formats.normal, formats.base_color],
            Some(depth_state()),
            &constants,
        );
        let g_buffer_layout = texture_layout(device, 3);
        let irradiance_layout = texture_layout(device, 1);
        let lighting_pipeline = pipeline(
            device,
            &[&layouts.uniform, &layouts.uniform, &g_buffer_layout, &irradiance_layout],
            &[FRAME, CAMERA, OCTAHEDRON, LIGHTING].concat(),
            &[],
            &[formats.hdr],
            None,
            &constants,
        );
        let read = [&targets.depth, &targets.normal, &targets.base_color];
        Self {
            lighting_groups: texture_group(device, &g_buffer_layout, &read),
            capture: Capture::new(device, &layouts),
            device: device.clone(),
            queue: queue.clone(),
            origin: 0.5 * (world.bounds()[0] + world.bounds()[1]),
            world,
            formats,
            size,
            targets,
            meshes,
            frame,
            camera,
            objects,
            groups,
            g_buffer_pipeline,
            lighting_pipeline,
            irradiance_layout,
        }
    }

    /// Render space to clip space: reverse-Z with the far plane at infinity, as the engine likes it.
    pub(crate) fn clip_from_render(&self) -> Mat4 {
        let eye = &self.world.eye;
        let aspect = self.size[0] as f32 / self.size[1] as f32;
        proj::directx::perspective_infinite_reverse(eye.fov_y as f32, aspect, NEAR)
            * view::look_to_mat4(self.eye(), eye.direction.as_vec3(), eye.up.as_vec3())
    }

    /// Where the engine looks from, render space.
    pub(crate) fn eye(&self) -> Vec3 {
        (self.world.eye.position - self.origin).as_vec3()
    }

    /// Uploads what this frame is drawn with. `indirect_scale` goes to the lighting pass with the irradiance it is
    /// given.
    pub(crate) fn upload(&self, indirect_scale: f32, direct_weight: f32) {
        let (world, clip_from_render) = (&self.world, self.clip_from_render());
        let cube = world.objects.last().map_or(DAffine3::IDENTITY, |block| {
            let corner = block
                .vertices
                .first()
                .map_or(DVec3::ONE, |v| DVec3::from(v.position.map(f64::from)));
            block.transform * DAffine3::from_scale(corner.abs())
        });
        let render = |m: &DAffine3| DAffine3::from_translation(-self.origin) * *m;
        let frame = FrameUniform {
            lamp_position: (world.lamp.position - self.origin).as_vec3().to_array(),
            indirect_scale,
            lamp_intensity: world.lamp.intensity.as_vec3().to_array(),
            direct_weight,
            cube_from_render: DMat4::from(render(&cube)).inverse().as_mat4().to_cols_array_2d(),
        };
        self.queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&frame));
        let camera = CameraUniform {
            clip_from_render: clip_from_render.to_cols_array_2d(),
            render_from_clip: clip_from_render.as_dmat4().inverse().as_mat4().to_cols_array_2d(),
            eye: self.eye().extend(1.0).to_array(),
            size: [self.size[0] as f32, self.size[1] as f32, 0.0, 0.0],
        };
        self.queue.write_buffer(&self.camera, 0, bytemuck::bytes_of(&camera));
        for (index, object) in (0..).zip(&world.objects) {
            let uniform = ObjectUniform {
                render_from_object: DMat4::from(render(&object.transform)).as_mat4().to_cols_array_2d(),
            };
            let offset = index * u64::from(UNIFORM_STRIDE);
            self.queue
                .write_buffer(&self.objects, offset, bytemuck::bytes_of(&uniform));
        }
    }

    /// The engine's first pass.
    pub(crate) fn record_g_buffer(&self, encoder: &mut wgpu::CommandEncoder) {
        let colors = [&self.targets.normal, &self.targets.base_color];
        let mut pass = begin_pass(encoder, &colors, Some(&self.targets.depth));
        pass.set_viewport(0.0, 0.0, self.size[0] as f32, self.size[1] as f32, 0.0, 1.0);
        pass.set_pipeline(&self.g_buffer_pipeline);
        pass.set_bind_group(1, &self.groups.camera, &[]);
        self.draw_objects(&mut pass);
    }

    /// The engine's last pass: adds indirect light, of `indirect_scale`, to its own.
    pub(crate) fn record_lighting(&self, encoder: &mut wgpu::CommandEncoder, irradiance: &wgpu::TextureView) {
        let irradiance = texture_group(&self.device, &self.irradiance_layout, &[irradiance]);
        let mut pass = begin_pass(encoder, &[&self.targets.hdr], None);
        pass.set_pipeline(&self.lighting_pipeline);
        pass.set_bind_group(0, &self.groups.frame, &[]);
        pass.set_bind_group(1, &self.groups.camera, &[]);
        pass.set_bind_group(2, &self.lighting_groups, &[]);
        pass.set_bind_group(3, &irradiance, &[]);
        pass.draw(0..3, 0..1);
    }

    /// Everything, with frame, object and material bound; pipeline and camera are the caller's.
    fn draw_objects(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(0, &self.groups.frame, &[]);
        for (index, mesh) in (0..).zip(&self.meshes) {
            pass.set_bind_group(2, &self.groups.object, &[index * UNIFORM_STRIDE]);
            pass.set_bind_group(3, &mesh.material, &[]);
            pass.set_vertex_buffer(0, mesh.vertices.slice(..));
            pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint16);
            pass.draw_indexed(0..mesh.index_count, 0, 0..1);
        }
    }
}

impl Targets {
    fn new(device: &wgpu::Device, formats: &Formats, size: [u32; 2], largest: [u32; 2]) -> Self {
        let texture = |format, [width, height]: [u32; 2]| {
            use wgpu::TextureUsages as U;
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some("engine"),
                size: wgpu::Extent3d {
                    width,
                    height,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: U::RENDER_ATTACHMENT | U::TEXTURE_BINDING | U::COPY_SRC,
                view_formats: &[],
            });
            texture.create_view(&Default::default())
        };
        Self {
            depth: texture(wgpu::TextureFormat::Depth32Float, largest),
            normal: texture(formats.normal, largest),
            base_color: texture(formats.base_color, largest),
            hdr: texture(formats.hdr, size),
        }
    }
}

impl Mesh {
    fn new(device: &wgpu::Device, layouts: &Layouts, object: &world::Object) -> Self {
        let buffer = |contents: &[u8], usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("engine"),
                contents,
                usage,
            })
        };
        let [r, g, b] = object.tint;
        let tint = buffer(bytemuck::bytes_of(&[r, g, b, 1.0]), wgpu::BufferUsages::UNIFORM);
        Self {
            vertices: buffer(bytemuck::cast_slice(&object.vertices), wgpu::BufferUsages::VERTEX),
            indices: buffer(bytemuck::cast_slice(&object.indices), wgpu::BufferUsages::INDEX),
            index_count: object.indices.len() as u32,
            material: buffer_group(device, &layouts.uniform, &tint, None),
        }
    }
}

impl Vertex {
    fn layout() -> wgpu::VertexBufferLayout<'static> {
        const ATTRIBUTES: [wgpu::VertexAttribute; 3] =
            wgpu::vertex_attr_array![0 => Float32x3, 1 => Snorm8x4, 2 => Unorm8x4];
        wgpu::VertexBufferLayout {
            array_stride: size_of::<Self>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &ATTRIBUTES,
        }
    }
}

/// Layouts of groups that hold one uniform buffer.
struct Layouts {
    uniform: wgpu::BindGroupLayout,
    offset_uniform: wgpu::BindGroupLayout,
}

impl Layouts {
    fn new(device: &wgpu::Device) -> Self {
        let layout = |has_dynamic_offset| {
            let ty = wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset,
                min_binding_size: None,
            };
            group_layout(device, &[ty])
        };
        Self {
            uniform: layout(false),
            offset_uniform: layout(true),
        }
    }
}

fn group_layout(device: &wgpu::Device, types: &[wgpu::BindingType]) -> wgpu::BindGroupLayout {
    let entry = |(binding, &ty)| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
        ty,
        count: None,
    };
    let entries: Vec<_> = (0..).zip(types).map(entry).collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("engine"),
        entries: &entries,
    })
}

fn texture_layout(device: &wgpu::Device, count: usize) -> wgpu::BindGroupLayout {
    let ty = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: false },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    group_layout(device, &vec![ty; count])
}

fn group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    resources: Vec<wgpu::BindingResource<'_>>,
) -> wgpu::BindGroup {
    let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
    let entries: Vec<_> = (0..).zip(resources).map(entry).collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("engine"),
        layout,
        entries: &entries,
    })
}

/// A group of one uniform buffer, or of `slot` bytes of it that a dynamic offset chooses.
fn buffer_group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    buffer: &wgpu::Buffer,
    slot: Option<u64>,
) -> wgpu::BindGroup {
    let size = slot.and_then(wgpu::BufferSize::new);
    let binding = wgpu::BufferBinding {
        buffer,
        offset: 0,
        size,
    };
    group(device, layout, vec![wgpu::BindingResource::Buffer(binding)])
}

fn texture_group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    views: &[&wgpu::TextureView],
) -> wgpu::BindGroup {
    let resource = |&view| wgpu::BindingResource::TextureView(view);
    group(device, layout, views.iter().map(resource).collect())
}

fn uniform_buffer(device: &wgpu::Device, size: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("engine"),
        size,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

fn depth_state() -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: wgpu::TextureFormat::Depth32Float,
        depth_write_enabled: Some(true),
        depth_compare: Some(wgpu::CompareFunction::Greater),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    }
}

/// A pipeline with entry points `vertex` and `fragment` that draws both sides of triangles.
fn pipeline(
    device: &wgpu::Device,
    layouts: &[&wgpu::BindGroupLayout],
    source: &str,
    buffers: &[wgpu::VertexBufferLayout<'_>],
    formats: &[wgpu::TextureFormat],
    depth_stencil: Option<wgpu::DepthStencilState>,
    constants: &[(&str, f64)],
) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("engine"),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let layouts: Vec<_> = layouts.iter().copied().map(Some).collect();
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("engine"),
        bind_group_layouts: &layouts,
        immediate_size: 0,
    });
    let buffers: Vec<_> = buffers.iter().cloned().map(Some).collect();
    let targets: Vec<_> = formats.iter().map(|&format| Some(format.into())).collect();
    let options = wgpu::PipelineCompilationOptions {
        constants,
        ..Default::default()
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("engine"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: options.clone(),
            buffers: &buffers,
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: options,
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// A pass that clears colours to zero and depth to infinitely far.
pub(crate) fn begin_pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    colors: &[&wgpu::TextureView],
    depth: Option<&wgpu::TextureView>,
) -> wgpu::RenderPass<'a> {
    let attachment = |&view| {
        Some(wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                store: wgpu::StoreOp::Store,
            },
        })
    };
    let colors: Vec<_> = colors.iter().map(attachment).collect();
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("engine"),
        color_attachments: &colors,
        depth_stencil_attachment: depth.map(|view| wgpu::RenderPassDepthStencilAttachment {
            view,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(0.0),
                store: wgpu::StoreOp::Store,
            }),
            stencil_ops: None,
        }),
        ..Default::default()
    })
}
