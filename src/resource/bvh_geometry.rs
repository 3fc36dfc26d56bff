//! Meshes, instances and materials of a [`Scene`] as rays meet them: a tree of triangles for each mesh under a tree of
//! instances.

use super::bvh_mesh::{self, BvhMesh, TOP_LEVELS};
use super::texture_arrays::TextureArrays;
use crate::bvh_tree::{Tree, fit};
use crate::gpu::{self as device, Bound, Slot};
use crate::scene::{Instance, Material, Scene, UnitFrame};
use crate::{Error, resource};
use glam::{BVec3A, DAffine3, DMat3, DVec3, Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::cwbvh::node::CwBvhNode;

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `BvhInstance` in `shaders/common/bvh.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct BvhInstance {
        /// Columns of the linear map from the unit frame to the mesh's.
        pub(crate) to_mesh: [[f32; 4]; 3],
        /// Columns of its inverse.
        pub(crate) to_unit: [[f32; 4]; 3],
        /// Where the mesh's centre stands in the unit frame.
        pub(crate) center: [f32; 3],
        pub(crate) root: u32,
        pub(crate) first_triangle: u32,
        pub(crate) material: u32,
        /// Bits 16 to 31: the surface.
        pub(crate) mask: u32,
        /// Of the leaf with the number of this record: which record it means.
        pub(crate) leaf: u32,
    }

    /// Twin of `BvhMaterial` in `shaders/common/bvh_surface.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct BvhMaterial {
        pub(crate) base_color: [f32; 3],
        pub(crate) alpha_cutoff: f32,
        pub(crate) emission: [f32; 3],
        pub(crate) index_of_refraction: f32,
        pub(crate) metallic: f32,
        pub(crate) roughness: f32,
        pub(crate) transmission: f32,
        pub(crate) base_color_texture: u32,
        pub(crate) metallic_roughness_texture: u32,
        pub(crate) emission_texture: u32,
        pub(crate) _pad: [u32; 2],
    }
}

/// Bindings of group 1 of every shader that traces rays through the trees, in order.
pub(crate) const BVH_SLOTS: [Slot; 8] = [
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::FilteredTextureArray,
    Slot::FilteredTextureArray,
    Slot::Sampler,
];

/// Bits of an instance's mask. Twins of `BVH_ALL`, `BVH_CASTS_SHADOW`, `BVH_IN_ENV_MAPS`, `BVH_HAS_HOLES`.
pub(crate) const ALL: u32 = 1;
pub(crate) const CASTS_SHADOW: u32 = 2;
pub(crate) const IN_ENV_MAPS: u32 = 4;
pub(crate) const HAS_HOLES: u32 = 8;

/// Above them the number of the instance's surface. Twin of `BVH_SURFACE_SHIFT`.
pub(crate) const SURFACE_SHIFT: u32 = 16;

/// Speed and memory against accuracy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BvhGeometryConfig {
    /// Largest side, in texels, of the textures that rays see, at least 1. All textures of a scene are resampled to
    /// squares of one size: this, or the longest side of any of them if that is less. Memory grows as the square.
    pub texture_size: u32,
}

impl Default for BvhGeometryConfig {
    fn default() -> Self {
        Self { texture_size: 1024 }
    }
}

/// A scene's triangles on the GPU, for rays.
///
/// A tree of eight-wide compressed nodes (Ylitie et al. 2017) for each mesh, and one over the instances. Bytes on the GPU:
/// 80 a triangle (three corners of position and normal; texture coordinates), 80 a node, of which a mesh has about one for
/// six triangles, 128 an instance, 64 a material; on the CPU 12 a triangle and 80 a node.
/// An instance whose transform is singular has no inside to trace in, so rays do not see it.
#[derive(Debug)]
pub struct BvhGeometry {
    meshes: Vec<MeshPlace>,
    instances: Vec<Instance>,
    materials: Vec<Material>,
    nodes: wgpu::Buffer,
    corners: wgpu::Buffer,
    attributes: wgpu::Buffer,
    instance_buffer: wgpu::Buffer,
    material_buffer: wgpu::Buffer,
    textures: TextureArrays,
    prepared: Prepared,
}

/// A mesh and where its part of the buffers begins.
#[derive(Debug)]
struct MeshPlace {
    mesh: BvhMesh,
    first_node: u32,
    first_triangle: u32,
}

/// What the last `prepare` uploaded, so that only changes are written again.
#[derive(Debug, Default)]
struct Prepared {
    placed: Vec<Placed>,
    materials: Vec<gpu::BvhMaterial>,
}

/// The tree of a mesh, for measurements.
#[doc(hidden)]
#[derive(Debug)]
pub struct MeshTree<'a> {
    /// The first one is the root.
    pub nodes: &'a [CwBvhNode],
    /// Vertices of the triangles at the places of the leaves.
    pub corners: &'a [[u32; 3]],
    /// Where the mesh's frame has its origin, and what one unit of it is, in mesh space.
    pub center: DVec3,
    /// See `center`.
    pub scale: f64,
}

/// The record of an instance, and its bounds in the unit frame unless rays cannot meet it.
type Placed = (gpu::BvhInstance, Option<Aabb>);

impl BvhGeometry {
    /// Validates a scene, builds the trees of its meshes and uploads them.
    ///
    /// # Errors
    /// As [`Scene::validate`]; [`Error::LimitExceeded`] for more triangles, nodes or textures than the device holds in one
    /// binding, or a tree deeper than rays can follow.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        scene: &Scene,
        config: &BvhGeometryConfig,
    ) -> Result<Self, Error> {
        scene.validate()?;
        let storage = |label, count: u64, size: usize| {
            use wgpu::BufferUsages as U;
            device::buffer(device, label, count.max(1) * size as u64, U::STORAGE | U::COPY_DST)
        };
        // What is too large is refused before the trees are built, which takes longer.
        let triangles = scene.meshes.iter().map(|m| m.indices.len() as u64 / 3).sum();
        let corners = storage(
            "lightfall::BvhGeometry::corners",
            3 * triangles,
            size_of::<bvh_mesh::gpu::Corner>(),
        )?;
        let attributes = storage(
            "lightfall::BvhGeometry::attributes",
            triangles,
            size_of::<bvh_mesh::gpu::BvhAttributes>(),
        )?;
        let textures = TextureArrays::new(device, queue, scene, config.texture_size.max(1))?;
        let mut meshes: Vec<MeshPlace> = Vec::with_capacity(scene.meshes.len());
        let (mut node_count, mut triangle_count) = (scene.instances.len().max(1) as u64, 0);
        for mesh in &scene.meshes {
            let (mesh, upload) = BvhMesh::build(mesh)?;
            let place = MeshPlace {
                first_node: count(node_count)?,
                first_triangle: count(triangle_count)?,
                mesh,
            };
            write_from(queue, &corners, 3 * place.first_triangle, &upload.corners);
            write_from(queue, &attributes, place.first_triangle, &upload.attributes);
            node_count += place.mesh.nodes.len() as u64;
            triangle_count += place.mesh.triangle_count() as u64;
            meshes.push(place);
        }
        let geometry = Self {
            nodes: storage("lightfall::BvhGeometry::nodes", node_count, size_of::<CwBvhNode>())?,
            corners,
            attributes,
            instance_buffer: storage(
                "lightfall::BvhGeometry::instances",
                scene.instances.len() as u64,
                size_of::<gpu::BvhInstance>(),
            )?,
            material_buffer: storage(
                "lightfall::BvhGeometry::materials",
                scene.materials.len() as u64,
                size_of::<gpu::BvhMaterial>(),
            )?,
            textures,
            instances: scene.instances.clone(),
            materials: scene.materials.clone(),
            meshes,
            prepared: Prepared::default(),
        };
        for place in &geometry.meshes {
            geometry.upload_nodes(queue, place);
        }
        Ok(geometry)
    }

    /// Moves an instance; takes effect at the next [`BvhGeometry::prepare`], which uploads the tree of instances and
    /// nothing of any mesh.
    ///
    /// # Errors
    /// [`Error::InvalidScene`] if there is no such instance or the transform is not finite.
    pub fn set_transform(&mut self, instance: usize, transform: DAffine3) -> Result<(), Error> {
        resource::move_instance(
            &mut self.instances,
            instance,
            transform,
            (self.meshes.len(), self.materials.len()),
        )
    }

    /// Moves the vertices of a mesh, mesh space, and fits its tree to them, on the CPU; instances follow at the next
    /// [`BvhGeometry::prepare`]. `normals` as in [`Mesh`](crate::scene::Mesh). The tree keeps its shape: after large
    /// deformations a new `BvhGeometry` is faster to trace.
    ///
    /// # Errors
    /// [`Error::InvalidScene`] if there is no such mesh or a position is not finite; [`Error::CountMismatch`] for another
    /// number of vertices. Nothing has changed then.
    pub fn deform(
        &mut self,
        queue: &wgpu::Queue,
        mesh: usize,
        positions: &[[f32; 3]],
        normals: &[[f32; 3]],
    ) -> Result<(), Error> {
        let Some(place) = self.meshes.get_mut(mesh) else {
            return Err(Error::scene(
                "mesh",
                format!("#{mesh}"),
                "index",
                "is beyond the last mesh",
            ));
        };
        let expected = place.mesh.vertex_count();
        let counts = [
            ("positions of a deformed mesh", positions.len(), false),
            ("normals of a deformed mesh", normals.len(), true),
        ];
        for (what, found, may_be_none) in counts {
            if found != expected && !(may_be_none && found == 0) {
                return Err(Error::CountMismatch { what, expected, found });
            }
        }
        for (field, values) in [("position", positions), ("normal", normals)] {
            if let Some(at) = values.iter().position(|v| v.iter().any(|x| !x.is_finite())) {
                let problem = format!("is {:?}, not finite", values[at]);
                return Err(Error::scene(
                    "mesh",
                    format!("#{mesh}"),
                    format!("{field} of vertex {at}"),
                    problem,
                ));
            }
        }
        let corners = place.mesh.refit(positions, normals);
        let place = &self.meshes[mesh];
        self.upload_nodes(queue, place);
        write_from(queue, &self.corners, 3 * place.first_triangle, &corners);
        Ok(())
    }

    /// Brings the tree of instances up to date in a frame. Call it once a frame, before passes that trace rays. Returns
    /// the bytes uploaded: none if nothing moved.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the tree is deeper than rays can follow.
    pub fn prepare(&mut self, queue: &wgpu::Queue, frame: &UnitFrame) -> Result<u64, Error> {
        let mut uploaded = 0;
        let mut upload = |buffer: &wgpu::Buffer, bytes: &[u8]| {
            queue.write_buffer(buffer, 0, bytes);
            uploaded += bytes.len() as u64;
        };
        let materials: Vec<_> = self.materials.iter().map(|m| self.material_record(frame, m)).collect();
        if materials != self.prepared.materials {
            upload(&self.material_buffer, bytemuck::cast_slice(&materials));
            self.prepared.materials = materials;
        }
        let placed: Vec<_> = self.instances.iter().map(|i| self.instance_record(frame, i)).collect();
        if placed != self.prepared.placed {
            let (records, nodes) = tree_of_instances(&placed)?;
            upload(&self.instance_buffer, bytemuck::cast_slice(&records));
            upload(&self.nodes, bytemuck::cast_slice(&nodes));
            self.prepared.placed = placed;
        }
        Ok(uploaded)
    }

    /// Instances, as last moved.
    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// Triangles of all meshes.
    pub fn triangle_count(&self) -> usize {
        self.meshes.iter().map(|m| m.mesh.triangle_count()).sum()
    }

    /// Nodes of the trees of all meshes.
    pub fn node_count(&self) -> usize {
        self.meshes.iter().map(|m| m.mesh.nodes.len()).sum()
    }

    /// Bytes of buffers and textures.
    pub fn memory_use(&self) -> u64 {
        let buffers = [
            &self.nodes,
            &self.corners,
            &self.attributes,
            &self.instance_buffer,
            &self.material_buffer,
        ];
        buffers.iter().map(|b| b.size()).sum::<u64>() + self.textures.memory_use()
    }

    /// Bytes kept on the CPU for refitting.
    pub fn cpu_memory_use(&self) -> u64 {
        self.meshes.iter().map(|m| m.mesh.cpu_bytes()).sum()
    }

    /// The tree of a mesh, for measurements.
    #[doc(hidden)]
    pub fn mesh_tree(&self, mesh: usize) -> Option<MeshTree<'_>> {
        self.meshes.get(mesh).map(|place| place.mesh.tree())
    }

    /// What [`BVH_SLOTS`] take.
    pub(crate) fn bound(&self) -> [Bound; 8] {
        [
            (&self.nodes).into(),
            (&self.corners).into(),
            (&self.attributes).into(),
            (&self.instance_buffer).into(),
            (&self.material_buffer).into(),
            (&self.textures.srgb).into(),
            (&self.textures.linear).into(),
            (&self.textures.sampler).into(),
        ]
    }

    fn upload_nodes(&self, queue: &wgpu::Queue, place: &MeshPlace) {
        let absolute = |node: &CwBvhNode| CwBvhNode {
            child_base_idx: node.child_base_idx + place.first_node,
            primitive_base_idx: node.primitive_base_idx + place.first_triangle,
            ..*node
        };
        let nodes: Vec<_> = place.mesh.nodes.iter().map(absolute).collect();
        write_from(queue, &self.nodes, place.first_node, &nodes);
    }

    fn instance_record(&self, frame: &UnitFrame, instance: &Instance) -> Placed {
        let place = &self.meshes[instance.mesh];
        let mesh_frame = &place.mesh.frame;
        let world = instance.transform * DAffine3::from_translation(mesh_frame.center);
        let to_unit = world.matrix3 * (mesh_frame.scale / frame.length_scale());
        let to_mesh = to_unit.inverse();
        let center = frame.point(world.translation);
        let has_holes = self.materials[instance.material].alpha_cutoff.is_some();
        let mask = [
            (true, ALL),
            (instance.casts_shadow, CASTS_SHADOW),
            (instance.in_env_maps, IN_ENV_MAPS),
            (has_holes, HAS_HOLES),
        ];
        let mut record = gpu::BvhInstance {
            to_mesh: columns(&to_mesh),
            to_unit: columns(&to_unit),
            center: center.to_array(),
            root: place.first_node,
            first_triangle: place.first_triangle,
            material: instance.material as u32,
            mask: mask.iter().filter(|m| m.0).map(|m| m.1).sum::<u32>() | u32::from(instance.surface) << SURFACE_SHIFT,
            leaf: 0,
        };
        let is_invertible = to_mesh.is_finite() && record.to_mesh.iter().flatten().all(|x| x.is_finite());
        if !is_invertible {
            // No number is unlike itself: what never changes is not to be uploaded again.
            record.to_mesh = Default::default();
        }
        let bounds = place.mesh.bounds.filter(|_| is_invertible).map(|Aabb { min, max }| {
            let corner = |i: usize| Vec3A::select(BVec3A::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), max, min);
            let points: [_; 8] = std::array::from_fn(|i| {
                let p = to_unit * Vec3::from(corner(i)).as_dvec3() + center.as_dvec3();
                p.as_vec3a()
            });
            padded(Aabb::from_points(&points))
        });
        (record, bounds)
    }

    fn material_record(&self, frame: &UnitFrame, material: &Material) -> gpu::BvhMaterial {
        gpu::BvhMaterial {
            base_color: material.base_color,
            alpha_cutoff: material.alpha_cutoff.unwrap_or(0.0),
            emission: frame.radiance(Vec3::from(material.emission).as_dvec3()).to_array(),
            index_of_refraction: material.index_of_refraction,
            metallic: material.metallic,
            roughness: material.lobe_roughness(),
            transmission: material.transmission,
            base_color_texture: self.textures.layer(material.base_color_texture),
            metallic_roughness_texture: self.textures.layer(material.metallic_roughness_texture),
            emission_texture: self.textures.layer(material.emission_texture),
            _pad: [0; 2],
        }
    }
}

/// The records of all instances with their leaves, and the nodes of the tree over them.
fn tree_of_instances(placed: &[Placed]) -> Result<(Vec<gpu::BvhInstance>, Vec<CwBvhNode>), Error> {
    let mut records: Vec<_> = placed.iter().map(|(record, _)| *record).collect();
    let (seen, boxes): (Vec<u32>, Vec<Aabb>) = (0..)
        .zip(placed)
        .filter_map(|(index, (_, bounds))| bounds.map(|b| (index, b)))
        .unzip();
    let mut tree = Tree::over(boxes.iter().copied(), TOP_LEVELS, || "the instances".into())?;
    fit(&mut tree.nodes, |leaf| boxes[tree.order[leaf] as usize]);
    for (record, &box_) in records.iter_mut().zip(&tree.order) {
        record.leaf = seen[box_ as usize];
    }
    Ok((records, tree.nodes))
}

/// Writes values into an array of them.
fn write_from<T: bytemuck::Pod>(queue: &wgpu::Queue, buffer: &wgpu::Buffer, first: u32, values: &[T]) {
    let offset = u64::from(first) * size_of::<T>() as u64;
    queue.write_buffer(buffer, offset, bytemuck::cast_slice(values));
}

/// A number of nodes or triangles as an index.
fn count(n: u64) -> Result<u32, Error> {
    u32::try_from(n).map_err(|_| Error::LimitExceeded {
        what: "nodes or triangles of a scene".into(),
        needed: n,
        limit: u64::from(u32::MAX),
        remedy: "leave out some meshes",
    })
}

/// Grown by what rounding may have moved a corner.
fn padded(bounds: Aabb) -> Aabb {
    let pad = f32::EPSILON * bounds.min.abs().max(bounds.max.abs()).max_element();
    Aabb::new(bounds.min - pad, bounds.max + pad)
}

fn columns(m: &DMat3) -> [[f32; 4]; 3] {
    [m.x_axis, m.y_axis, m.z_axis].map(|c| c.as_vec3().extend(0.0).to_array())
}
