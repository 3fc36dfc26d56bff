//! Ready-made [`Geometry`]: vertex and index buffers, instances, materials. Rigid instances are culled per view; meshes
//! that the host deforms on the GPU are drawn in every view.

use super::{CaptureMask, CapturePurpose, CaptureTargets, CaptureView, Geometry, PrepareContext};
use crate::gpu::{self as device, Slot};
use crate::scene::{Instance, Material, Mesh, Scene, Texture};
use crate::{Error, wgsl};
use glam::{DAffine3, Mat3, Mat4, Vec3, Vec4};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `View` in `shaders/resource/mesh_geometry.wgsl`.
    #[derive(Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct MeshView {
        pub(crate) view_projection: [[f32; 4]; 4],
        pub(crate) eye: [f32; 4],
    }

    /// Twin of `Instance`.
    #[derive(Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct MeshInstance {
        pub(crate) transform: [[f32; 4]; 4],
        pub(crate) normal_transform: [[f32; 4]; 3],
        pub(crate) material: u32,
        pub(crate) mirrored: u32,
        pub(crate) surface: u32,
        pub(crate) _pad: u32,
    }

    /// Twin of `Material`.
    #[derive(Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct MeshMaterial {
        pub(crate) base_color: [f32; 3],
        pub(crate) alpha_cutoff: f32,
        pub(crate) emission: [f32; 3],
        pub(crate) metallic: f32,
        pub(crate) roughness: f32,
        pub(crate) transmission: f32,
        pub(crate) index_of_refraction: f32,
        pub(crate) _pad: u32,
    }

    /// One vertex: position, normal (zero: none), texture coordinate.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct MeshVertex {
        pub(crate) position: [f32; 3],
        pub(crate) normal: [f32; 3],
        pub(crate) tex_coord: [f32; 2],
    }
}

/// Bindings of group 0 of `shaders/resource/mesh_geometry.wgsl`, in order.
pub(crate) const SCENE_SLOTS: [Slot; 3] = [
    Slot::DynamicUniform(size_of::<gpu::MeshView>() as u64),
    Slot::Storage,
    Slot::Storage,
];

/// Bindings of group 1, in order.
pub(crate) const MATERIAL_SLOTS: [Slot; 4] = [
    Slot::FilteredTexture,
    Slot::FilteredTexture,
    Slot::FilteredTexture,
    Slot::Sampler,
];

/// Where the vertex stage finds the members of a vertex.
pub(crate) const VERTEX_ATTRIBUTES: [wgpu::VertexAttribute; 3] =
    wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x2];

/// A mesh on the GPU.
#[derive(Debug)]
struct MeshBuffers {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    index_count: u32,
    /// Mesh-space bounding sphere; `None` for a mesh that the host deforms.
    sphere: Option<(Vec3, f32)>,
}

/// Meshes, instances and materials of a [`Scene`], drawn for every kind of view.
#[derive(Debug)]
pub struct MeshGeometry {
    g_buffer_pipeline: wgpu::RenderPipeline,
    surface_pipeline: wgpu::RenderPipeline,
    scene_layout: wgpu::BindGroupLayout,
    meshes: Vec<MeshBuffers>,
    instances: Vec<Instance>,
    materials: Vec<Material>,
    material_groups: Vec<wgpu::BindGroup>,
    instance_buffer: wgpu::Buffer,
    material_buffer: wgpu::Buffer,
    view_buffer: wgpu::Buffer,
    view_capacity: u32,
    view_stride: u32,
    scene_group: Option<wgpu::BindGroup>,
    prepared: Prepared,
    bytes: u64,
}

/// What the last `prepare` uploaded, so that only changes are written again.
#[derive(Default)]
struct Prepared {
    instances: Vec<gpu::MeshInstance>,
    materials: Vec<gpu::MeshMaterial>,
    /// Bounding spheres in the unit frame, by instance.
    spheres: Vec<Option<(Vec3, f32)>>,
    views: Vec<u8>,
}

impl std::fmt::Debug for Prepared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Prepared({} instances)", self.instances.len())
    }
}

impl MeshGeometry {
    /// Bytes of a vertex: position (3 × f32), normal (3 × f32), texture coordinate (2 × f32).
    pub const VERTEX_BYTES: u64 = size_of::<gpu::MeshVertex>() as u64;

    /// Uploads a scene. It is validated first.
    ///
    /// # Errors
    /// As [`Scene::validate`]; [`Error::LimitExceeded`] for a mesh or texture that the device cannot hold.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene) -> Result<Self, Error> {
        scene.validate()?;
        use wgpu::BufferUsages as U;
        let mut bytes = 0;
        let mut storage = |label, size: usize| {
            bytes += (size as u64).max(4);
            device::buffer(device, label, size as u64, U::STORAGE | U::COPY_DST)
        };
        let instance_buffer = storage(
            "lightfall::MeshGeometry::instances",
            scene.instances.len().max(1) * size_of::<gpu::MeshInstance>(),
        )?;
        let material_buffer = storage(
            "lightfall::MeshGeometry::materials",
            scene.materials.len().max(1) * size_of::<gpu::MeshMaterial>(),
        )?;
        let view_stride =
            (size_of::<gpu::MeshView>() as u32).next_multiple_of(device.limits().min_uniform_buffer_offset_alignment);
        let view_buffer = view_buffer(device, view_stride, 1)?;
        bytes += view_buffer.size();
        let mut meshes = Vec::with_capacity(scene.meshes.len());
        for mesh in &scene.meshes {
            let buffers = upload_mesh(device, queue, mesh)?;
            bytes += buffers.vertices.size() + buffers.indices.size();
            meshes.push(buffers);
        }
        let stages = wgpu::ShaderStages::VERTEX_FRAGMENT;
        let scene_layout = device::layout(device, "lightfall::MeshGeometry::scene", stages, &SCENE_SLOTS);
        let material_layout = device::layout(device, "lightfall::MeshGeometry::material", stages, &MATERIAL_SLOTS);
        let layouts = [&scene_layout, &material_layout];
        let (material_groups, texture_bytes) = material_groups(device, queue, scene, &material_layout)?;
        Ok(Self {
            g_buffer_pipeline: pipeline(device, CapturePurpose::Camera, "fragment_g_buffer", &layouts),
            surface_pipeline: pipeline(device, CapturePurpose::EnvMap, "fragment_surface", &layouts),
            scene_layout,
            meshes,
            instances: scene.instances.clone(),
            materials: scene.materials.clone(),
            material_groups,
            instance_buffer,
            material_buffer,
            view_buffer,
            view_capacity: 1,
            view_stride,
            scene_group: None,
            prepared: Prepared::default(),
            bytes: bytes + texture_bytes,
        })
    }

    /// Moves an instance; takes effect at the next `prepare`.
    ///
    /// # Errors
    /// [`Error::InvalidScene`] if there is no such instance or the transform is not finite.
    pub fn set_transform(&mut self, instance: usize, transform: DAffine3) -> Result<(), Error> {
        let counts = (self.meshes.len(), self.materials.len());
        super::move_instance(&mut self.instances, instance, transform, counts)
    }

    /// The vertex buffer of a mesh, for the host to write deformed vertices into (from a compute shader or a copy), in
    /// the layout of [`MeshGeometry::VERTEX_BYTES`]. From now on the mesh is drawn in every view, because its bounds are
    /// no longer known. `None` if there is no such mesh.
    pub fn deform(&mut self, mesh: usize) -> Option<&wgpu::Buffer> {
        let buffers = self.meshes.get_mut(mesh)?;
        buffers.sphere = None;
        Some(&buffers.vertices)
    }

    /// Instances, as last moved.
    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// Bytes of buffers and textures.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }

    fn upload_instances(&mut self, context: &PrepareContext<'_>) {
        let records: Vec<_> = self.instances.iter().map(|i| instance_record(context, i)).collect();
        if records != self.prepared.instances {
            context
                .queue
                .write_buffer(&self.instance_buffer, 0, bytemuck::cast_slice(&records));
            self.prepared.instances = records;
        }
        self.prepared.spheres = self
            .instances
            .iter()
            .zip(&self.prepared.instances)
            .map(|(instance, record)| {
                let (center, radius) = self.meshes[instance.mesh].sphere?;
                let matrix = Mat4::from_cols_array_2d(&record.transform);
                let scale = (0..3).map(|c| matrix.col(c).length()).fold(0.0, f32::max);
                // The sphere of a sheared mesh stretches by at most the sum of its axes.
                Some((matrix.transform_point3(center), radius * scale * 3f32.sqrt()))
            })
            .collect();
        let materials: Vec<_> = self.materials.iter().map(|m| material_record(context, m)).collect();
        if materials != self.prepared.materials {
            context
                .queue
                .write_buffer(&self.material_buffer, 0, bytemuck::cast_slice(&materials));
            self.prepared.materials = materials;
        }
    }

    fn upload_views(&mut self, context: &PrepareContext<'_>, views: &[CaptureView]) -> Result<(), Error> {
        let needed = views.len() as u32;
        if needed > self.view_capacity {
            self.bytes -= self.view_buffer.size();
            self.view_buffer = view_buffer(context.device, self.view_stride, needed)?;
            self.bytes += self.view_buffer.size();
            self.view_capacity = needed;
            self.scene_group = None;
            self.prepared.views.clear();
        }
        let mut bytes = vec![0; views.len() * self.view_stride as usize];
        for (slot, view) in bytes.chunks_exact_mut(self.view_stride as usize).zip(views) {
            let record = gpu::MeshView {
                view_projection: view.view_projection,
                eye: view.eye,
            };
            slot[..size_of::<gpu::MeshView>()].copy_from_slice(bytemuck::bytes_of(&record));
        }
        if bytes != self.prepared.views {
            context.queue.write_buffer(&self.view_buffer, 0, &bytes);
            self.prepared.views = bytes;
        }
        Ok(())
    }

    fn is_wanted(&self, index: usize, view: &CaptureView) -> bool {
        let instance = &self.instances[index];
        let masked_in = match view.mask {
            CaptureMask::All => true,
            CaptureMask::CastsShadow => instance.casts_shadow,
            CaptureMask::InEnvMaps => instance.in_env_maps,
        };
        masked_in
            && self.prepared.spheres[index].is_none_or(|(center, radius)| {
                view.frustum.iter().all(|plane| {
                    let plane = Vec4::from(*plane);
                    plane.dot(center.extend(1.0)) >= -radius * plane.truncate().length()
                })
            })
    }
}

impl Geometry for MeshGeometry {
    fn prepare(&mut self, context: &PrepareContext<'_>, views: &[CaptureView]) -> Result<(), Error> {
        self.upload_instances(context);
        self.upload_views(context, views)?;
        if self.scene_group.is_none() {
            let view = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: &self.view_buffer,
                offset: 0,
                size: wgpu::BufferSize::new(size_of::<gpu::MeshView>() as u64),
            });
            let resources = vec![
                view,
                self.instance_buffer.as_entire_binding(),
                self.material_buffer.as_entire_binding(),
            ];
            let label = "lightfall::MeshGeometry::scene";
            self.scene_group = Some(device::bind_group(context.device, label, &self.scene_layout, resources));
        }
        Ok(())
    }

    fn draw(&self, pass: &mut wgpu::RenderPass<'_>, view: &CaptureView) {
        let Some(scene_group) = &self.scene_group else {
            return;
        };
        pass.set_pipeline(match view.purpose {
            CapturePurpose::Camera => &self.g_buffer_pipeline,
            _ => &self.surface_pipeline,
        });
        pass.set_bind_group(0, scene_group, &[view.index * self.view_stride]);
        for (index, instance) in self.instances.iter().enumerate() {
            let mesh = &self.meshes[instance.mesh];
            if mesh.index_count == 0 || !self.is_wanted(index, view) {
                continue;
            }
            pass.set_bind_group(1, &self.material_groups[instance.material], &[]);
            pass.set_vertex_buffer(0, mesh.vertices.slice(..));
            pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..mesh.index_count, 0, index as u32..index as u32 + 1);
        }
    }
}

fn view_buffer(device: &wgpu::Device, stride: u32, count: u32) -> Result<wgpu::Buffer, Error> {
    let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
    let size = u64::from(stride) * u64::from(count);
    device::buffer(device, "lightfall::MeshGeometry::views", size, usage)
}

fn instance_record(context: &PrepareContext<'_>, instance: &Instance) -> gpu::MeshInstance {
    let transform = context.frame.transform(&instance.transform);
    // Cofactors turn normals rightly even where the matrix is singular; the sign restores mirrored ones.
    let m = Mat3::from_mat4(transform);
    let cofactors = Mat3::from_cols(
        m.y_axis.cross(m.z_axis),
        m.z_axis.cross(m.x_axis),
        m.x_axis.cross(m.y_axis),
    );
    let mirrored = m.determinant() < 0.0;
    let sign = if mirrored { -1.0 } else { 1.0 };
    // Normalised by their largest entry, so that tiny instances keep their digits.
    let largest = cofactors.to_cols_array().iter().fold(0f32, |a, &b| a.max(b.abs()));
    let scale = sign / largest.max(f32::MIN_POSITIVE);
    gpu::MeshInstance {
        transform: transform.to_cols_array_2d(),
        normal_transform: [cofactors.x_axis, cofactors.y_axis, cofactors.z_axis]
            .map(|c| (c * scale).extend(0.0).to_array()),
        material: instance.material as u32,
        mirrored: u32::from(mirrored),
        surface: u32::from(instance.surface),
        _pad: 0,
    }
}

fn material_record(context: &PrepareContext<'_>, material: &Material) -> gpu::MeshMaterial {
    let emission = Vec3::from(material.emission).as_dvec3();
    gpu::MeshMaterial {
        base_color: material.base_color,
        alpha_cutoff: material.alpha_cutoff.unwrap_or(0.0),
        emission: context.frame.radiance(emission).to_array(),
        metallic: material.metallic,
        roughness: material.lobe_roughness(),
        transmission: material.transmission,
        index_of_refraction: material.index_of_refraction,
        _pad: 0,
    }
}

fn upload_mesh(device: &wgpu::Device, queue: &wgpu::Queue, mesh: &Mesh) -> Result<MeshBuffers, Error> {
    use wgpu::BufferUsages as U;
    let vertices: Vec<_> = mesh
        .positions
        .iter()
        .enumerate()
        .map(|(i, &position)| gpu::MeshVertex {
            position,
            normal: mesh.normals.get(i).copied().unwrap_or_default(),
            tex_coord: mesh.tex_coords.get(i).copied().unwrap_or_default(),
        })
        .collect();
    let upload = |label, bytes: &[u8], usage| {
        let buffer = device::buffer(device, label, bytes.len() as u64, usage | U::COPY_DST)?;
        queue.write_buffer(&buffer, 0, bytes);
        Ok::<_, Error>(buffer)
    };
    let vertex_usage = U::VERTEX | U::STORAGE;
    Ok(MeshBuffers {
        vertices: upload(
            "lightfall::MeshGeometry::vertices",
            bytemuck::cast_slice(&vertices),
            vertex_usage,
        )?,
        indices: upload(
            "lightfall::MeshGeometry::indices",
            bytemuck::cast_slice(&mesh.indices),
            U::INDEX,
        )?,
        index_count: mesh.indices.len() as u32,
        sphere: Some(bounding_sphere(&mesh.positions)),
    })
}

/// Sphere around the bounding box.
fn bounding_sphere(positions: &[[f32; 3]]) -> (Vec3, f32) {
    let points = || positions.iter().map(|&p| Vec3::from(p));
    let min = points().reduce(Vec3::min).unwrap_or_default();
    let max = points().reduce(Vec3::max).unwrap_or_default();
    (0.5 * min + 0.5 * max, 0.5 * (max - min).length())
}

fn pipeline(
    device: &wgpu::Device,
    purpose: CapturePurpose,
    fragment: &'static str,
    layouts: &[&wgpu::BindGroupLayout],
) -> wgpu::RenderPipeline {
    let targets = CaptureTargets::of(purpose);
    let colors: Vec<_> = targets.colors.iter().map(|&format| Some(format.into())).collect();
    device::render_pipeline(
        device,
        &device::RenderSpec {
            label: "lightfall::MeshGeometry",
            source: wgsl::MESH_GEOMETRY,
            fragment,
            layouts,
            constants: &[],
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: MeshGeometry::VERTEX_BYTES,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &VERTEX_ATTRIBUTES,
            })],
            topology: wgpu::PrimitiveTopology::TriangleList,
            cull_mode: None,
            targets: &colors,
            depth_stencil: Some(targets.depth_stencil()),
        },
    )
}

/// One bind group per material, and the bytes of all textures.
fn material_groups(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    scene: &Scene,
    layout: &wgpu::BindGroupLayout,
) -> Result<(Vec<wgpu::BindGroup>, u64), Error> {
    let white = Texture {
        name: "white".into(),
        width: 1,
        height: 1,
        srgb: false,
        rgba: vec![255; 4],
    };
    let mut bytes = 0;
    let mut views = Vec::with_capacity(scene.textures.len() + 1);
    for texture in scene.textures.iter().chain([&white]) {
        let (view, texture_bytes) = upload_texture(device, queue, texture)?;
        bytes += texture_bytes;
        views.push(view);
    }
    let sampler = material_sampler(device);
    let view = |texture: Option<usize>| wgpu::BindingResource::TextureView(&views[texture.unwrap_or(views.len() - 1)]);
    let groups = scene
        .materials
        .iter()
        .map(|m| {
            let resources = vec![
                view(m.base_color_texture),
                view(m.emission_texture),
                view(m.metallic_roughness_texture),
                wgpu::BindingResource::Sampler(&sampler),
            ];
            device::bind_group(device, "lightfall::MeshGeometry::material", layout, resources)
        })
        .collect();
    Ok((groups, bytes))
}

/// How textures of materials are read: coordinates repeat, filtering is linear.
pub(crate) fn material_sampler(device: &wgpu::Device) -> wgpu::Sampler {
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("lightfall::material_sampler"),
        address_mode_u: wgpu::AddressMode::Repeat,
        address_mode_v: wgpu::AddressMode::Repeat,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..Default::default()
    })
}

fn upload_texture(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    texture: &Texture,
) -> Result<(wgpu::TextureView, u64), Error> {
    let spec = device::TextureSpec {
        label: "lightfall::MeshGeometry::texture",
        size: [texture.width, texture.height],
        layers: 1,
        format: if texture.srgb {
            wgpu::TextureFormat::Rgba8UnormSrgb
        } else {
            wgpu::TextureFormat::Rgba8Unorm
        },
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
    };
    let image = device::texture(device, &spec)?;
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(4 * texture.width),
        rows_per_image: None,
    };
    queue.write_texture(image.as_image_copy(), &texture.rgba, layout, image.size());
    Ok((image.create_view(&Default::default()), spec.bytes()))
}
