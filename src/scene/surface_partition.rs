//! Meshes in surfaces: parts without sharp edges.

use super::{Mesh, Scene};
use crate::Error;
use glam::{DMat3, DVec3, Vec3};
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

/// Corners that lie nearer to each other than this share of a mesh's extent are one.
const WELD: f64 = 1e-6;

/// Which surface each triangle of a mesh is part of: triangles that share an edge are on the same one, unless it is sharp
/// (Larsen 2004, chapter 8, where surfaces are divided by hand).
#[derive(Debug, Clone, PartialEq)]
pub struct SurfacePartition {
    /// Of each triangle, from 0.
    of_triangles: Vec<u32>,
    areas: Vec<f64>,
}

impl SurfacePartition {
    /// Angle between the normals of triangles, radians, from which on the edge between them is sharp: the crease angle of VRML.
    pub const CREASE: f64 = 0.5;

    /// Divides a mesh at edges sharper than `crease`, radians: corners at the same place are one, so that texture seams and
    /// flat shading divide nothing. `linear` is what the mesh is shown under, for areas. Takes time in proportion to the
    /// triangles.
    pub fn of(mesh: &Mesh, linear: &DMat3, crease: f64) -> Self {
        let edges = Edges::of(mesh, linear);
        let mut sets = DisjointSets::new(edges.normals.len());
        let least = crease.cos();
        for (a, b) in edges.neighbours() {
            if edges.normals[a].dot(edges.normals[b]) >= least {
                sets.join(a, b);
            }
        }
        Self::new(sets, &edges.areas)
    }

    /// The same, but that surfaces of less than `least_area`, world units squared, are joined to a neighbour, the smallest
    /// first, until they are as large or have none: a mesh of small sharp triangles is one surface, whose parts then go by
    /// their normals. With `least_area` as the area that 50 photons are expected on, estimates from the photons of one surface
    /// are of enough of them.
    pub fn merged(mesh: &Mesh, linear: &DMat3, crease: f64, least_area: f64) -> Self {
        let fine = Self::of(mesh, linear, crease);
        let edges = Edges::of(mesh, linear);
        let mut around: Vec<Vec<usize>> = vec![Vec::new(); fine.areas.len()];
        for (a, b) in edges.neighbours() {
            let [a, b] = [a, b].map(|t| fine.of_triangles[t] as usize);
            if a != b {
                around[a].push(b);
                around[b].push(a);
            }
        }
        let mut sets = DisjointSets::new(fine.areas.len());
        let mut areas = fine.areas.clone();
        let bits = |area: f64| area.max(0.0).to_bits();
        let mut small: BinaryHeap<_> = (0..areas.len()).map(|s| Reverse((bits(areas[s]), s))).collect();
        while let Some(Reverse((area, surface))) = small.pop() {
            if f64::from_bits(area) >= least_area {
                break;
            }
            let root = sets.root(surface);
            if root != surface || bits(areas[root]) != area {
                // It has grown since.
                continue;
            }
            let neighbours = std::mem::take(&mut around[root]);
            let others = neighbours.iter().map(|&n| sets.root(n)).filter(|&n| n != root);
            // The smallest: then the small ones of a heap come together.
            let Some(other) = others.min_by(|&a, &b| areas[a].total_cmp(&areas[b]).then(a.cmp(&b))) else {
                continue;
            };
            let sum = areas[root] + areas[other];
            let own = sets.join(root, other);
            let theirs = std::mem::take(&mut around[other]);
            around[own] = neighbours.into_iter().chain(theirs).collect();
            areas[own] = sum;
            small.push(Reverse((bits(sum), own)));
        }
        let of_triangles: Vec<_> = fine.of_triangles.iter().map(|&s| sets.root(s as usize)).collect();
        Self::numbered(of_triangles, &edges.areas)
    }

    fn new(mut sets: DisjointSets, areas: &[f64]) -> Self {
        let roots = (0..areas.len()).map(|t| sets.root(t)).collect();
        Self::numbered(roots, areas)
    }

    /// Surfaces in the order of their first triangles.
    fn numbered(roots: Vec<usize>, areas: &[f64]) -> Self {
        let mut numbers = HashMap::new();
        let mut partition = Self {
            of_triangles: Vec::with_capacity(roots.len()),
            areas: Vec::new(),
        };
        for (root, area) in roots.into_iter().zip(areas) {
            let number = *numbers.entry(root).or_insert(partition.areas.len());
            if number == partition.areas.len() {
                partition.areas.push(0.0);
            }
            partition.areas[number] += area;
            partition.of_triangles.push(number as u32);
        }
        partition
    }

    /// Of each triangle the surface, from 0.
    pub fn of_triangles(&self) -> &[u32] {
        &self.of_triangles
    }

    /// Of each surface the area, world units squared, one side.
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// Number of surfaces.
    pub fn count(&self) -> usize {
        self.areas.len()
    }

    /// The mesh in parts, one for each surface.
    pub fn split(&self, mesh: &Mesh) -> Vec<Mesh> {
        let mut parts = vec![Vec::new(); self.count()];
        for (triangle, &surface) in mesh.indices.chunks_exact(3).zip(&self.of_triangles) {
            parts[surface as usize].extend_from_slice(triangle);
        }
        let part = |indices: Vec<u32>| {
            let mut numbers = HashMap::new();
            let mut used = Vec::new();
            let indices = indices
                .into_iter()
                .map(|i| {
                    *numbers.entry(i).or_insert_with(|| {
                        used.push(i as usize);
                        used.len() as u32 - 1
                    })
                })
                .collect();
            fn taken<T: Copy>(all: &[T], used: &[usize]) -> Vec<T> {
                match all.is_empty() {
                    true => Vec::new(),
                    false => used.iter().map(|&i| all[i]).collect(),
                }
            }
            Mesh {
                name: mesh.name.clone(),
                positions: taken(&mesh.positions, &used),
                normals: taken(&mesh.normals, &used),
                tex_coords: taken(&mesh.tex_coords, &used),
                indices,
            }
        };
        parts.into_iter().map(part).collect()
    }

    /// A scene whose instances are surfaces, with numbers ([`Instance::surface`](super::Instance::surface)) from 1: then
    /// photons keep to the surface that they arrive at, where passes are told so. Surfaces that fewer than 50 of `photons`
    /// photons are expected on, if these were spread evenly, are joined to a neighbour. What shines stays as it is, for its
    /// triangles are one lamp.
    ///
    /// # Errors
    /// [`Error::CountMismatch`] for more than 65 535 surfaces: take fewer photons, or a wider crease.
    pub fn split_scene(scene: &Scene, crease: f64, photons: u32) -> Result<Scene, Error> {
        let area_of = |i: &super::Instance| {
            Edges::of(&scene.meshes[i.mesh], &i.transform.matrix3)
                .areas
                .iter()
                .sum::<f64>()
        };
        let total: f64 = scene.instances.iter().map(area_of).sum();
        let least_area = 50.0 * total / f64::from(photons.max(1));
        let mut split = Scene {
            meshes: Vec::new(),
            instances: Vec::new(),
            ..scene.clone()
        };
        for instance in &scene.instances {
            let mesh = &scene.meshes[instance.mesh];
            let partition = Self::merged(mesh, &instance.transform.matrix3, crease, least_area);
            let parts = match scene.materials[instance.material].is_emissive() {
                true => vec![mesh.clone()],
                false => partition.split(mesh),
            };
            for part in parts {
                split.instances.push(super::Instance {
                    mesh: split.meshes.len(),
                    surface: u16::try_from(split.instances.len() + 1).unwrap_or(u16::MAX),
                    ..instance.clone()
                });
                split.meshes.push(part);
            }
        }
        match split.instances.len() {
            found if found > usize::from(u16::MAX) => Err(Error::CountMismatch {
                what: "surfaces of a scene (most that have numbers)",
                expected: usize::from(u16::MAX),
                found,
            }),
            _ => Ok(split),
        }
    }
}

/// What of triangles says where one surface ends.
struct Edges {
    normals: Vec<DVec3>,
    areas: Vec<f64>,
    /// Of each edge, by its corners, the triangles that have it.
    triangles: HashMap<[u32; 2], Vec<usize>>,
}

impl Edges {
    fn of(mesh: &Mesh, linear: &DMat3) -> Self {
        let at = |i: u32| DVec3::from(Vec3::from(mesh.positions[i as usize]));
        let positions = || mesh.positions.iter().map(|p| DVec3::from(Vec3::from(*p)));
        let low = positions().reduce(DVec3::min).unwrap_or(DVec3::ZERO);
        let high = positions().reduce(DVec3::max).unwrap_or(DVec3::ZERO);
        let step = (WELD * (high - low).max_element()).max(f64::MIN_POSITIVE);
        let mut numbers = HashMap::<[i64; 3], u32>::new();
        let welded: Vec<u32> = positions()
            .map(|p| {
                let next = numbers.len() as u32;
                *numbers
                    .entry(((p - low) / step).round().to_array().map(|v| v as i64))
                    .or_insert(next)
            })
            .collect();
        let mut edges = Self {
            normals: Vec::new(),
            areas: Vec::new(),
            triangles: HashMap::new(),
        };
        for (triangle, corners) in mesh.indices.chunks_exact(3).enumerate() {
            let [a, b, c] = [0, 1, 2].map(|k| *linear * at(corners[k]));
            let cross = (b - a).cross(c - a);
            edges.normals.push(cross.normalize_or_zero());
            edges.areas.push(0.5 * cross.length());
            for (from, to) in [(0, 1), (1, 2), (2, 0)] {
                let [from, to] = [from, to].map(|k: usize| welded[corners[k] as usize]);
                edges
                    .triangles
                    .entry([from.min(to), from.max(to)])
                    .or_default()
                    .push(triangle);
            }
        }
        edges
    }

    /// Pairs of triangles that share an edge.
    fn neighbours(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.triangles.values().flat_map(|all| {
            let pairs = all.iter().enumerate();
            pairs.flat_map(move |(i, &a)| all[i + 1..].iter().map(move |&b| (a, b)))
        })
    }
}

/// Union-find.
struct DisjointSets(Vec<usize>);

impl DisjointSets {
    fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    fn root(&mut self, mut of: usize) -> usize {
        while self.0[of] != of {
            self.0[of] = self.0[self.0[of]];
            of = self.0[of];
        }
        of
    }

    /// The root of both from now on: the lower one, whatever the order of joins.
    fn join(&mut self, a: usize, b: usize) -> usize {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
        a.min(b)
    }
}

#[cfg(all(test, feature = "samples"))]
mod tests {
    use super::*;
    use crate::scene::samples;

    /// A grid of so many quads whose corners rise and fall.
    fn bumpy(side: u32, height: f32) -> Mesh {
        let at = |x: u32, y: u32| [x as f32, if (x + y).is_multiple_of(2) { height } else { 0.0 }, y as f32];
        let mut mesh = Mesh::default();
        for (x, y) in (0..side).flat_map(|x| (0..side).map(move |y| (x, y))) {
            let first = mesh.positions.len() as u32;
            // Corners of their own, as flat shading has them.
            mesh.positions
                .extend([at(x, y), at(x, y + 1), at(x + 1, y + 1), at(x + 1, y)]);
            mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
        }
        mesh
    }

    #[test]
    fn a_surface_ends_at_sharp_edges_and_not_at_seams() {
        let flat = SurfacePartition::of(&bumpy(8, 0.0), &DMat3::IDENTITY, SurfacePartition::CREASE);
        assert_eq!(flat.count(), 1);
        assert!((flat.areas()[0] - 64.0).abs() < 1e-9);
        let sharp = SurfacePartition::of(&bumpy(8, 2.0), &DMat3::IDENTITY, SurfacePartition::CREASE);
        assert!(sharp.count() > 10, "{}", sharp.count());
        // A room's shell has six sides.
        let scene = samples::two_rooms(0.0);
        let near = scene.instances.iter().find(|i| i.name == "near room").unwrap();
        let room = SurfacePartition::of(
            &scene.meshes[near.mesh],
            &near.transform.matrix3,
            SurfacePartition::CREASE,
        );
        assert_eq!(room.count(), 5, "the sixth is the wall between");
        // Stretched, what was gentle is sharp.
        let gentle = bumpy(8, 0.1);
        let tall = DMat3::from_diagonal(DVec3::new(1.0, 20.0, 1.0));
        assert_eq!(
            SurfacePartition::of(&gentle, &DMat3::IDENTITY, SurfacePartition::CREASE).count(),
            1
        );
        assert!(SurfacePartition::of(&gentle, &tall, SurfacePartition::CREASE).count() > 10);
    }

    #[test]
    fn small_surfaces_are_joined_until_they_are_large_enough() {
        let mesh = bumpy(16, 2.0);
        let linear = DMat3::IDENTITY;
        let fine = SurfacePartition::of(&mesh, &linear, SurfacePartition::CREASE);
        let total: f64 = fine.areas().iter().sum();
        for share in [0.02, 0.1, 0.4] {
            let merged = SurfacePartition::merged(&mesh, &linear, SurfacePartition::CREASE, share * total);
            let areas = merged.areas();
            assert!(
                areas.iter().all(|&a| a >= share * total) && merged.count() > 1,
                "{share}: {areas:?}"
            );
            assert!((areas.iter().sum::<f64>() / total - 1.0).abs() < 1e-9);
            // Whole surfaces come together, and none is torn apart.
            let mut seen = HashMap::new();
            for (&a, &b) in fine.of_triangles().iter().zip(merged.of_triangles()) {
                assert_eq!(*seen.entry(a).or_insert(b), b);
            }
        }
        // What has no neighbour stays.
        let all = SurfacePartition::merged(&mesh, &linear, SurfacePartition::CREASE, 2.0 * total);
        assert_eq!(all.count(), 1);
    }

    #[test]
    fn a_split_scene_is_the_same_scene_with_numbers() {
        let scene = samples::cornell(0.3);
        let split = SurfacePartition::split_scene(&scene, SurfacePartition::CREASE, 50_000).unwrap();
        split.validate().unwrap();
        let triangles = |s: &Scene| -> usize {
            let own = s.instances.iter().map(|i| s.meshes[i.mesh].indices.len() / 3);
            own.sum()
        };
        assert_eq!(triangles(&split), triangles(&scene));
        assert!(split.instances.len() > scene.instances.len());
        assert!(split.instances.iter().zip(1..).all(|(i, number)| i.surface == number));
        // Few photons: one surface each.
        let few = SurfacePartition::split_scene(&scene, SurfacePartition::CREASE, 1).unwrap();
        assert_eq!(few.instances.len(), scene.instances.len());
    }
}
