//! Meshes for tests.

use super::statistics::Random;
use lightfall::glam::{DVec3, Vec3};
use lightfall::resource::cube_face::CUBE_FACES;
use lightfall::scene::{Instance, Light, Material, Mesh, Scene};
use std::f64::consts::{PI, TAU};

/// A mesh of these triangles, each with corners of its own, as meshes have whose normals or texture coordinates are
/// split at every edge.
pub(crate) fn soup(name: &str, triangles: impl IntoIterator<Item = [[f32; 3]; 3]>) -> Mesh {
    let positions: Vec<_> = triangles.into_iter().flatten().collect();
    Mesh {
        name: name.into(),
        indices: (0..positions.len() as u32).collect(),
        positions,
        ..Mesh::default()
    }
}

/// The same triangles, each with corners of its own and its own flat normal.
pub(crate) fn split(mesh: &Mesh) -> Mesh {
    let corner = |&i: &u32| mesh.positions[i as usize];
    let triangles: Vec<[[f32; 3]; 3]> = mesh
        .indices
        .chunks_exact(3)
        .map(|t| [corner(&t[0]), corner(&t[1]), corner(&t[2])])
        .collect();
    let normal = |[a, b, c]: [[f32; 3]; 3]| {
        let [a, b, c] = [a, b, c].map(|p| Vec3::from(p).as_dvec3());
        (b - a).cross(c - a).normalize_or_zero().as_vec3().to_array()
    };
    Mesh {
        normals: triangles.iter().flat_map(|&t| [normal(t); 3]).collect(),
        ..soup(&mesh.name, triangles)
    }
}

/// A closed surface: points of a function of two angles, `rows` × `columns` quads; both directions wrap.
fn closed_patch(name: &str, rows: u32, columns: u32, at: impl Fn(f64, f64) -> DVec3) -> Mesh {
    let mut mesh = Mesh {
        name: name.into(),
        ..Mesh::default()
    };
    for row in 0..rows {
        for column in 0..columns {
            let (v, u) = (f64::from(row) / f64::from(rows), f64::from(column) / f64::from(columns));
            mesh.positions.push(at(v, u).as_vec3().to_array());
            let index = |r: u32, c: u32| (r % rows) * columns + c % columns;
            let [a, b] = [index(row, column), index(row, column + 1)];
            let [d, c] = [index(row + 1, column), index(row + 1, column + 1)];
            mesh.indices.extend([a, b, c, a, c, d]);
        }
    }
    mesh
}

/// A ring of radius 1 about the z axis, its tube of radius `tube`.
pub(crate) fn torus(rows: u32, columns: u32, tube: f64) -> Mesh {
    closed_patch("torus", rows, columns, |v, u| {
        let ((sin_v, cos_v), (sin_u, cos_u)) = ((TAU * v).sin_cos(), (TAU * u).sin_cos());
        let r = 1.0 + tube * cos_v;
        DVec3::new(r * cos_u, r * sin_u, tube * sin_v)
    })
}

/// A closed unit sphere about the origin, facing outward, its surface moved in and out by `bump` of its radius.
pub(crate) fn sphere(rows: u32, columns: u32, bump: f64) -> Mesh {
    let mut mesh = Mesh {
        name: "sphere".into(),
        ..Mesh::default()
    };
    for row in 1..rows {
        let polar = PI * f64::from(row) / f64::from(rows);
        for column in 0..columns {
            let around = TAU * f64::from(column) / f64::from(columns);
            let r = 1.0 + bump * (7.0 * around).sin() * (5.0 * polar).sin() * polar.sin();
            let p = r * DVec3::new(polar.sin() * around.cos(), polar.cos(), -polar.sin() * around.sin());
            mesh.positions.push(p.as_vec3().to_array());
        }
    }
    let (top, bottom) = (mesh.positions.len() as u32, mesh.positions.len() as u32 + 1);
    mesh.positions.extend([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]);
    let ring = |row: u32, column: u32| (row - 1) * columns + column % columns;
    for c in 0..columns {
        mesh.indices.extend([top, ring(1, c), ring(1, c + 1)]);
        mesh.indices.extend([bottom, ring(rows - 1, c + 1), ring(rows - 1, c)]);
        for r in 1..rows - 1 {
            let [a, b] = [ring(r, c), ring(r + 1, c)];
            let [d, e] = [ring(r + 1, c + 1), ring(r, c + 1)];
            mesh.indices.extend([a, b, d, a, d, e]);
        }
    }
    mesh
}

/// The box from −1 to 1, its faces cut into two triangles; its numbers are exact.
pub(crate) fn cube() -> Mesh {
    let corner = |i: u32| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1.0 } else { -1.0 });
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    Mesh {
        name: "cube".into(),
        positions: (0..8).map(corner).collect(),
        indices: quads.iter().flat_map(|&[a, b, c, d]| [a, b, c, a, c, d]).collect(),
        ..Mesh::default()
    }
}

/// A closed prism over a regular polygon, from z = −1 to 1, its ends fans about a corner: long thin triangles.
pub(crate) fn prism(sides: u32) -> Mesh {
    let at = |i: u32, z: f32| {
        let (sin, cos) = (TAU * f64::from(i) / f64::from(sides)).sin_cos();
        [cos as f32, sin as f32, z]
    };
    let mut mesh = Mesh {
        name: "prism".into(),
        positions: (0..sides)
            .map(|i| at(i, -1.0))
            .chain((0..sides).map(|i| at(i, 1.0)))
            .collect(),
        ..Mesh::default()
    };
    for i in 0..sides {
        let next = (i + 1) % sides;
        mesh.indices.extend([i, next, sides + next, i, sides + next, sides + i]);
        if i > 0 && next > 0 {
            mesh.indices.extend([0, next, i, sides, sides + i, sides + next]);
        }
    }
    mesh
}

/// A square from −1 to 1 in x and z, `cells` × `cells` quads of two triangles, `height` its y.
pub(crate) fn grid(cells: u32, height: impl Fn(f64, f64) -> f64) -> Mesh {
    let line = cells + 1;
    let at = |i: u32| 2.0 * f64::from(i) / f64::from(cells) - 1.0;
    let point = |i: u32| {
        let (x, z) = (at(i % line), at(i / line));
        [x as f32, height(x, z) as f32, z as f32]
    };
    let cell = |i: u32| {
        let a = i / cells * line + i % cells;
        [a, a + line, a + 1, a + 1, a + line, a + line + 1]
    };
    Mesh {
        name: "grid".into(),
        positions: (0..line * line).map(point).collect(),
        indices: (0..cells * cells).flat_map(cell).collect(),
        ..Mesh::default()
    }
}

/// Triangles strewn through the box from −1 to 1: a third of them of ordinary shape, the others up to a million times
/// as long as wide.
pub(crate) fn slivers(count: u32, seed: u64) -> Mesh {
    let mut random = Random(seed);
    let triangles: Vec<_> = (0..count)
        .map(|_| {
            let mut signed = || 2.0 * f64::from(random.unit()) - 1.0;
            let a = DVec3::new(signed(), signed(), signed());
            let b = a + 0.4 * DVec3::new(signed(), signed(), signed());
            let aspect = 10f64.powf(-3.0 - 3.0 * signed()).min(1.0);
            let c = a.lerp(b, signed().abs()) + 0.4 * aspect * DVec3::new(signed(), signed(), signed());
            [a, b, c].map(|p| p.as_vec3().to_array())
        })
        .collect();
    soup("slivers", triangles)
}

/// A closed box of these half extents around the origin, seen from inside.
pub(crate) fn room(half: DVec3) -> Scene {
    let mut mesh = Mesh::default();
    for face in CUBE_FACES {
        let at = |s: f32, t: f32| (half.as_vec3() * (face.forward + s * face.right + t * face.up)).to_array();
        let first = mesh.positions.len() as u32;
        mesh.positions
            .extend([at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)]);
        mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
    }
    Scene {
        meshes: vec![mesh],
        materials: vec![Material::diffuse("white", [0.7; 3])],
        instances: vec![Instance::new(0, 0)],
        lights: vec![Light::point(DVec3::ZERO, 1.0, [1.0; 3])],
        ..Scene::default()
    }
}
