//! One mesh as rays meet it: triangles in the order of the leaves of a compressed wide tree.

use super::bvh_geometry::MeshTree;
use crate::Error;
use crate::bvh_tree::{Tree, fit};
use crate::scene::Mesh;
use glam::{DVec3, Vec3};
use obvhs::aabb::Aabb;
use obvhs::cwbvh::node::CwBvhNode;
use std::cmp::Ordering;

/// Groups of nodes that a ray may have to come back to: at most one for each level but the last, and one for the
/// instances left of a leaf. Twin of `BVH_STACK`.
pub(crate) const STACK: u32 = 32;
/// Levels of the tree of instances.
pub(crate) const TOP_LEVELS: u32 = 10;
/// Levels of the tree of a mesh.
const MESH_LEVELS: u32 = STACK - TOP_LEVELS;

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
    /// Vertices of each triangle in leaf order, in the order of [`corner_order`] when the tree was built. 12 bytes a
    /// triangle, kept for refitting.
    corners: Vec<[u32; 3]>,
    /// In the mesh's frame; `None` without triangles.
    pub(crate) bounds: Option<Aabb>,
    vertex_count: usize,
}

/// What is uploaded of a mesh.
pub(crate) struct MeshUpload {
    pub(crate) corners: Vec<gpu::Corner>,
    pub(crate) attributes: Vec<gpu::BvhAttributes>,
}

impl BvhMesh {
    /// Builds the tree.
    pub(crate) fn build(mesh: &Mesh) -> Result<(Self, MeshUpload), Error> {
        let frame = MeshFrame::of(&mesh.positions);
        let placed: Vec<_> = mesh.positions.iter().map(|&p| frame.place(p)).collect();
        let triangles = mesh.indices.as_chunks().0;
        let boxes = triangles
            .iter()
            .map(|t| around(t.map(|vertex| placed[vertex as usize])));
        let tree = Tree::over(boxes, MESH_LEVELS, || format!("mesh {:?}", mesh.name))?;
        let mut corners = Vec::with_capacity(tree.order.len());
        let mut attributes = Vec::with_capacity(tree.order.len());
        for &triangle in &tree.order {
            let own = triangles[triangle as usize];
            let slots = corner_order(own.map(|vertex| placed[vertex as usize]));
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
        let corners = built.fit_to(&placed, &mesh.normals);
        Ok((built, MeshUpload { corners, attributes }))
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

    pub(crate) fn tree(&self) -> MeshTree<'_> {
        MeshTree {
            nodes: &self.nodes,
            corners: &self.corners,
            center: self.frame.center,
            scale: self.frame.scale,
        }
    }

    /// Moves the vertices and fits every node to them. The shape of the tree stays as it was built, so that rays get
    /// slower, never wrong, as the mesh departs from the shape it was built for.
    pub(crate) fn refit(&mut self, positions: &[[f32; 3]], normals: &[[f32; 3]]) -> Vec<gpu::Corner> {
        self.frame = MeshFrame::of(positions);
        let placed: Vec<_> = positions.iter().map(|&p| self.frame.place(p)).collect();
        self.fit_to(&placed, normals)
    }

    fn fit_to(&mut self, placed: &[Vec3], normals: &[[f32; 3]]) -> Vec<gpu::Corner> {
        let place = |vertex: u32| placed[vertex as usize];
        self.bounds = fit(&mut self.nodes, |leaf| around(self.corners[leaf].map(place)));
        let corner = |&vertex: &u32| gpu::Corner {
            position: place(vertex).to_array(),
            normal: pack_normal(normals.get(vertex as usize).copied().unwrap_or_default()),
        };
        self.corners.iter().flatten().map(corner).collect()
    }
}

fn around(corners: [Vec3; 3]) -> Aabb {
    Aabb::from_points(&corners.map(Into::into))
}

/// The corners of a triangle as places in it, sorted by where they are: triangles that share an edge name its ends in the
/// same order, even where normals or texture coordinates split its vertices.
fn corner_order(corners: [Vec3; 3]) -> [usize; 3] {
    let mut slots = [0, 1, 2];
    let place = |slot: usize| corners[slot].to_array();
    slots.sort_by(|&a, &b| place(a).partial_cmp(&place(b)).unwrap_or(Ordering::Equal));
    slots
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_that_share_an_edge_name_its_ends_in_the_same_order() {
        let [a, b, c, d] = [[0.1, 0.2, 0.3], [0.1, -0.5, 0.3], [0.1, 0.2, -0.7], [0.4, 0.0, 0.0]].map(Vec3::from);
        let before = |corners: [Vec3; 3], first: Vec3, second: Vec3| {
            let order = corner_order(corners).map(|slot| corners[slot]);
            order.iter().position(|&p| p == first) < order.iter().position(|&p| p == second)
        };
        for (p, q, others) in [(a, b, [c, d]), (a, c, [b, d]), (b, c, [a, d]), (a, d, [b, c])] {
            let named: Vec<_> = others
                .iter()
                .flat_map(|&r| [[p, q, r], [q, p, r], [r, p, q], [q, r, p]])
                .map(|corners| before(corners, p, q))
                .collect();
            assert!(named.iter().all(|&n| n == named[0]), "{p} {q}: {named:?}");
        }
    }

    #[test]
    fn the_order_of_corners_can_be_undone() {
        let corners = [[0.3, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0]].map(Vec3::from);
        for places in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            let slots = corner_order(places.map(|place| corners[place]));
            let packed = pack_order(slots);
            assert_eq!([0, 2, 4].map(|shift| (packed >> shift & 3) as usize), slots);
            // The sorted corners turn 0.1, 0.2, 0.3: as corners[1], corners[2], corners[0] do.
            let turns_like_sorted = [[1, 2, 0], [2, 0, 1], [0, 1, 2]].contains(&places);
            assert_eq!(packed & ODD == 0, turns_like_sorted, "{places:?}");
        }
    }

    #[test]
    fn a_mesh_reaches_to_within_one_of_its_centre() {
        for (from, to) in [(-1.0, 1.0), (3.0, 3.5), (-1e30, 1e30), (1e-30, 2e-30), (7.0, 7.0)] {
            let frame = MeshFrame::of(&[[from, 0.0, 0.0], [to, 0.0, 0.0]]);
            let ends = [from, to].map(|x| frame.place([x, 0.0, 0.0]).x);
            assert_eq!(ends[0], -ends[1]);
            assert!(ends[1] <= 1.0 && (ends[1] > 0.5 || from == to), "{from} {to}: {ends:?}");
        }
    }
}
