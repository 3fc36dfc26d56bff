//! One mesh as rays meet it: triangles in the order of the leaves of a compressed wide tree.

use crate::Error;
use crate::scene::Mesh;
use glam::{DVec3, Vec3};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::cwbvh::node::CwBvhNode;
use std::collections::HashMap;
use std::time::Duration;

/// Groups of nodes that a ray may have to come back to: at most one for each level but the last, and one for the
/// instances left of a leaf. Twin of `BVH_STACK`.
pub(crate) const STACK: usize = 32;
/// Levels of the tree of instances.
pub(crate) const TOP_LEVELS: usize = 10;
/// Levels of the tree of a mesh.
const MESH_LEVELS: usize = STACK - TOP_LEVELS;

/// Twin of `BVH_NO_NORMAL`: a bit pattern that packing a unit vector never gives.
const NO_NORMAL: u32 = 0x8000_8000;
/// Twin of `BVH_ODD`: set where the order in which the corners are stored turns the triangle over.
const ODD: u32 = 1 << 31;

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// One corner of a triangle: `bvh_corners` holds three for each triangle, in leaf order.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Corner {
        /// In the mesh's own frame.
        pub(crate) position: [f32; 3],
        /// Shading normal, octahedral.
        pub(crate) normal: u32,
    }

    /// Twin of `BvhAttributes` in `shaders/common/bvh_surface.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct BvhAttributes {
        pub(crate) tex_coords: [[f32; 2]; 3],
        pub(crate) triangle: u32,
        pub(crate) order: u32,
    }
}

/// The mesh's own frame: centred, and scaled by a power of two so that its bounding box reaches to within (1/2, 1]. All
/// meshes then use the same range of numbers, whatever unit they were modelled in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MeshFrame {
    pub(crate) center: DVec3,
    pub(crate) scale: f64,
}

impl MeshFrame {
    fn of(positions: &[[f32; 3]]) -> Self {
        let points = || positions.iter().map(|&p| Vec3::from(p).as_dvec3());
        let (Some(min), Some(max)) = (points().reduce(DVec3::min), points().reduce(DVec3::max)) else {
            return Self {
                center: DVec3::ZERO,
                scale: 1.0,
            };
        };
        let reach = 0.5 * (max - min).max_element();
        let scale = if reach > 0.0 { reach.log2().ceil().exp2() } else { 1.0 };
        Self {
            center: 0.5 * (min + max),
            scale,
        }
    }

    fn place(&self, position: [f32; 3]) -> Vec3 {
        // Adding zero turns a negative zero into a positive one.
        ((Vec3::from(position).as_dvec3() - self.center) / self.scale).as_vec3() + 0.0
    }
}

/// The tree of a mesh and what is needed to refit it.
#[derive(Debug)]
pub(crate) struct BvhMesh {
    pub(crate) frame: MeshFrame,
    pub(crate) nodes: Vec<CwBvhNode>,
    /// Vertices of each triangle in leaf order; corners ordered so that two triangles that share an edge name its ends
    /// in the same order. 12 bytes a triangle, kept for refitting.
    corners: Vec<[u32; 3]>,
    /// Bounds in the mesh's frame; `None` without triangles.
    pub(crate) bounds: Option<(Vec3, Vec3)>,
    vertex_count: usize,
}

/// What is uploaded of a mesh.
pub(crate) struct MeshUpload {
    pub(crate) corners: Vec<gpu::Corner>,
    pub(crate) attributes: Vec<gpu::BvhAttributes>,
}

impl BvhMesh {
    /// Builds the tree. Transient memory: 32 bytes a triangle for its bounds and what `obvhs` takes.
    pub(crate) fn build(mesh: &Mesh) -> Result<(Self, MeshUpload), Error> {
        let count = mesh.indices.len() / 3;
        let frame = MeshFrame::of(&mesh.positions);
        let place = |vertex: u32| frame.place(mesh.positions[vertex as usize]);
        let boxes: Vec<_> = mesh
            .indices
            .chunks_exact(3)
            .map(|t| Aabb::from_points(&[place(t[0]).into(), place(t[1]).into(), place(t[2]).into()]))
            .collect();
        let tree = build_tree(&boxes);
        check_depth(&tree, MESH_LEVELS, || format!("mesh {:?}", mesh.name))?;
        let ranks = Ranks::of(&mesh.positions);
        let mut corners = Vec::with_capacity(count);
        let mut attributes = Vec::with_capacity(count);
        for &triangle in &tree.primitive_indices {
            let first = 3 * triangle as usize;
            let own = [mesh.indices[first], mesh.indices[first + 1], mesh.indices[first + 2]];
            let slots = ranks.order(own);
            let ordered = slots.map(|slot| own[slot]);
            let tex_coord = |vertex: u32| mesh.tex_coords.get(vertex as usize).copied().unwrap_or_default();
            attributes.push(gpu::BvhAttributes {
                tex_coords: ordered.map(tex_coord),
                triangle,
                order: pack_order(slots),
            });
            corners.push(ordered);
        }
        let mut built = Self {
            frame,
            nodes: tree.nodes,
            corners,
            bounds: None,
            vertex_count: mesh.positions.len(),
        };
        built.bounds = (count > 0).then(|| (tree.total_aabb.min.into(), tree.total_aabb.max.into()));
        let upload = MeshUpload {
            corners: built.placed_corners(&mesh.positions, &mesh.normals),
            attributes,
        };
        Ok((built, upload))
    }

    /// Triangles.
    pub(crate) fn triangle_count(&self) -> usize {
        self.corners.len()
    }

    /// Vertices.
    pub(crate) fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// Bytes kept on the CPU.
    pub(crate) fn cpu_bytes(&self) -> u64 {
        (size_of_val(&self.nodes[..]) + size_of_val(&self.corners[..])) as u64
    }

    fn placed_corners(&self, positions: &[[f32; 3]], normals: &[[f32; 3]]) -> Vec<gpu::Corner> {
        let corner = |&vertex: &u32| gpu::Corner {
            position: self.frame.place(positions[vertex as usize]).to_array(),
            normal: pack_normal(normals.get(vertex as usize).copied().unwrap_or_default()),
        };
        self.corners.iter().flatten().map(corner).collect()
    }

    /// Moves the vertices and fits every node to them. The shape of the tree stays as it was built, so that rays get
    /// slower, never wrong, as the mesh departs from the shape it was built for.
    pub(crate) fn refit(&mut self, positions: &[[f32; 3]], normals: &[[f32; 3]]) -> Vec<gpu::Corner> {
        self.frame = MeshFrame::of(positions);
        let corners = self.placed_corners(positions, normals);
        let mut bounds = vec![Bounds::EMPTY; self.nodes.len()];
        // Children stand behind their parents.
        for index in (0..self.nodes.len()).rev() {
            let children = child_bounds(&self.nodes[index], &corners, &bounds);
            bounds[index] = children
                .iter()
                .flatten()
                .copied()
                .fold(Bounds::EMPTY, |all, one| Bounds {
                    min: all.min.min(one.min),
                    max: all.max.max(one.max),
                });
            quantise(&mut self.nodes[index], &bounds[index], &children);
        }
        if self.bounds.is_some() {
            self.bounds = Some((bounds[0].min, bounds[0].max));
        }
        corners
    }
}

/// A tree over boxes. `obvhs` builds it by parallel locally-ordered clustering, reinserts a twentieth of its nodes, and
/// collapses it into nodes of eight (Ylitie et al. 2017).
pub(crate) fn build_tree(boxes: &[Aabb]) -> CwBvh {
    if boxes.is_empty() {
        return CwBvh {
            nodes: vec![CwBvhNode::default()],
            ..Default::default()
        };
    }
    build_cwbvh(boxes, BvhBuildParams::medium_build(), &mut Duration::default())
}

/// Refuses a tree that is deeper than the rays' stack.
pub(crate) fn check_depth(tree: &CwBvh, levels: usize, what: impl Fn() -> String) -> Result<(), Error> {
    let mut depths = vec![0usize; tree.nodes.len()];
    for (index, node) in tree.nodes.iter().enumerate() {
        for child in 0..node.imask.count_ones() {
            depths[(node.child_base_idx + child) as usize] = depths[index] + 1;
        }
    }
    let deepest = depths.iter().max().map_or(0, |d| d + 1);
    if deepest > levels {
        return Err(Error::LimitExceeded {
            what: format!("the tree over {}", what()),
            needed: deepest as u64,
            limit: levels as u64,
            remedy: "split it, or spread what lies in one place",
        });
    }
    Ok(())
}

/// Which of two vertices comes first along an edge. Vertices in the same place have the same rank, so that triangles
/// which share an edge agree even where normals or texture coordinates split its vertices.
struct Ranks {
    ranks: Vec<u32>,
}

impl Ranks {
    fn of(positions: &[[f32; 3]]) -> Self {
        let mut first = HashMap::with_capacity(positions.len());
        let rank = |(vertex, position): (u32, &[f32; 3])| {
            *first.entry(position.map(|x| (x + 0.0).to_bits())).or_insert(vertex)
        };
        Self {
            ranks: (0..).zip(positions).map(rank).collect(),
        }
    }

    /// The corners of a triangle by rank, as places in the triangle.
    fn order(&self, corners: [u32; 3]) -> [usize; 3] {
        let mut slots = [0, 1, 2];
        slots.sort_by_key(|&slot| self.ranks[corners[slot] as usize]);
        slots
    }
}

/// Two bits for the place in the mesh's triangle of each stored corner, and [`ODD`].
fn pack_order(slots: [usize; 3]) -> u32 {
    let is_odd = [[0, 1], [0, 2], [1, 2]]
        .iter()
        .filter(|[a, b]| slots[*a] > slots[*b])
        .count()
        % 2
        == 1;
    let places = slots[0] | slots[1] << 2 | slots[2] << 4;
    places as u32 | if is_odd { ODD } else { 0 }
}

fn pack_normal(normal: [f32; 3]) -> u32 {
    // In f64, because tiny and huge normals are normals all the same.
    let normal = Vec3::from(normal).as_dvec3();
    let length = normal.length();
    if length > 0.0 && length.is_finite() {
        super::Photon::pack_unit_vector((normal / length).as_vec3())
    } else {
        NO_NORMAL
    }
}

#[derive(Debug, Clone, Copy)]
struct Bounds {
    min: Vec3,
    max: Vec3,
}

impl Bounds {
    const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };
}

/// Bounds of each child of a node; `None` where there is none.
fn child_bounds(node: &CwBvhNode, corners: &[gpu::Corner], nodes: &[Bounds]) -> [Option<Bounds>; 8] {
    std::array::from_fn(|child| {
        let meta = u32::from(node.child_meta[child]);
        if meta == 0 {
            return None;
        }
        if node.imask >> child & 1 == 1 {
            let before = (u32::from(node.imask) & ((1 << child) - 1)).count_ones();
            return Some(nodes[(node.child_base_idx + before) as usize]);
        }
        let first = (node.primitive_base_idx + (meta & 31)) as usize;
        let count = (meta >> 5).count_ones() as usize;
        let points = corners[3 * first..3 * (first + count)]
            .iter()
            .map(|c| Vec3::from(c.position));
        Some(points.fold(Bounds::EMPTY, |all, p| Bounds {
            min: all.min.min(p),
            max: all.max.max(p),
        }))
    })
}

/// Writes bounds into a node: its lower corner, a power of two for each axis, and eight bits for each plane of each child,
/// rounded outward.
fn quantise(node: &mut CwBvhNode, bounds: &Bounds, children: &[Option<Bounds>; 8]) {
    const STEPS: f32 = 255.0;
    const SMALLEST: f32 = 1e-20;
    if bounds.min.x > bounds.max.x {
        return;
    }
    let steps = ((bounds.max - bounds.min).max(Vec3::splat(SMALLEST)) / STEPS).map(|s| s.log2().ceil().exp2());
    node.p = bounds.min;
    node.e = steps.to_array().map(|s| (s.to_bits() >> 23) as u8);
    for (child, bounds_of_child) in children.iter().enumerate() {
        let Some(of_child) = bounds_of_child else {
            continue;
        };
        let low = ((of_child.min - node.p) / steps)
            .floor()
            .clamp(Vec3::ZERO, Vec3::splat(STEPS));
        let high = ((of_child.max - node.p) / steps)
            .ceil()
            .clamp(Vec3::ZERO, Vec3::splat(STEPS));
        let planes = [
            (&mut node.child_min_x, &mut node.child_max_x, low.x, high.x),
            (&mut node.child_min_y, &mut node.child_max_y, low.y, high.y),
            (&mut node.child_min_z, &mut node.child_max_z, low.z, high.z),
        ];
        for (min, max, low, high) in planes {
            min[child] = low as u8;
            max[child] = high as u8;
        }
    }
}
