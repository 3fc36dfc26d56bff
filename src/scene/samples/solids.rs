//! Closed solids for the larger samples: whatever is not a box. Triangles face outward, every edge joins exactly two of
//! them, and shading normals bend around round parts and break at edges sharper than [`CREASE`].

use super::super::Mesh;
use glam::{DAffine3, DQuat, DVec2, DVec3, Vec3};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// Sharper edges than this, radians, are edges to the eye too: above what sixteen facets turn by, below a right angle.
const CREASE: f64 = 0.7;

/// Turns a profile of (radius, height) points about +Y, outside to its right: from the lower end of the axis to the
/// upper one, or around and back to its first point, which makes a ring.
pub(super) fn lathe(profile: &[[f64; 2]], facets: u32) -> Mesh {
    let points: Vec<_> = profile.iter().map(|&p| DVec2::from(p)).collect();
    let turns: Vec<_> = (0..facets)
        .map(|i| DVec2::from_angle(TAU * f64::from(i) / f64::from(facets)))
        .collect();
    let is_ring = points.first() == points.last();
    let ends = if is_ring { Ends::Joined } else { Ends::OnAxis };
    let mut mesh = Mesh::default();
    for (piece, normals) in points.windows(2).zip(chain_normals(&points, &ends)) {
        let row = mesh.positions.len() as u32;
        for turn in &turns {
            for end in 0..2 {
                push_vertex(&mut mesh, around(piece[end], *turn), around(normals[end], *turn));
            }
        }
        for facet in 0..facets {
            let (a, d) = (row + 2 * facet, row + 2 * ((facet + 1) % facets));
            if piece[1].x > 0.0 {
                mesh.indices.extend([a, a + 1, d + 1]);
            }
            if piece[0].x > 0.0 {
                mesh.indices.extend([a, d + 1, d]);
            }
        }
    }
    mesh
}

/// A sphere about the origin: `2 facets (rings − 1)` triangles.
pub(super) fn sphere(radius: f64, rings: u32, facets: u32) -> Mesh {
    let profile: Vec<_> = (0..=rings)
        .map(|i| match i {
            0 => [0.0, -radius],
            i if i == rings => [0.0, radius],
            i => {
                let (sin, cos) = (PI * f64::from(i) / f64::from(rings)).sin_cos();
                [radius * sin, -radius * cos]
            }
        })
        .collect();
    lathe(&profile, facets)
}

/// A surface of heights over a rectangle of the x-z plane, `cells` squares along each axis, seen from above. Open, unlike all
/// else here.
pub(super) fn heights(x: [f64; 2], z: [f64; 2], cells: u32, height: impl Fn(f64, f64) -> f64) -> Mesh {
    let mut mesh = Mesh::default();
    let step = [x, z].map(|[from, to]| (to - from) / f64::from(cells));
    let small = [1e-3 * step[0], 1e-3 * step[1]];
    for i in 0..=cells {
        for j in 0..=cells {
            let (x, z) = (x[0] + step[0] * f64::from(i), z[0] + step[1] * f64::from(j));
            let along_x = (height(x + small[0], z) - height(x - small[0], z)) / (2.0 * small[0]);
            let along_z = (height(x, z + small[1]) - height(x, z - small[1])) / (2.0 * small[1]);
            mesh.positions.push(DVec3::new(x, height(x, z), z).as_vec3().to_array());
            let normal = DVec3::new(-along_x, 1.0, -along_z).normalize();
            mesh.normals.push(normal.as_vec3().to_array());
        }
    }
    for (i, j) in (0..cells * cells).map(|k| (k / cells, k % cells)) {
        let a = i * (cells + 1) + j;
        let (b, c, d) = (a + 1, a + cells + 1, a + cells + 2);
        mesh.indices.extend([a, b, d, a, d, c]);
    }
    mesh
}

/// A round bar between two points, of these radii at its ends.
pub(super) fn rod(from: DVec3, to: DVec3, radii: [f64; 2], facets: u32) -> Mesh {
    let length = (to - from).length();
    let bar = lathe(
        &[[0.0, 0.0], [radii[0], 0.0], [radii[1], length], [0.0, length]],
        facets,
    );
    let turn = DQuat::from_rotation_arc(DVec3::Y, (to - from) / length);
    moved(bar, DAffine3::from_rotation_translation(turn, from))
}

/// The solid between two lines of as many (x, y) points, which run along +X and do not cross, from z = `near` to `far`.
pub(super) fn band(lower: &[[f64; 2]], upper: &[[f64; 2]], [near, far]: [f64; 2]) -> Mesh {
    let [lower, upper] = [lower, upper].map(|line| line.iter().map(|&p| DVec2::from(p)).collect::<Vec<_>>());
    let [below, above] = [&lower, &upper].map(|line| chain_normals(line, &Ends::Free));
    let mut mesh = Mesh::default();
    for i in 0..lower.len() - 1 {
        let (a, b, c, d) = (lower[i], lower[i + 1], upper[i + 1], upper[i]);
        push_face(&mut mesh, [a, b, c, d].map(|p| p.extend(far)), [DVec3::Z; 4]);
        push_face(&mut mesh, [b, a, d, c].map(|p| p.extend(near)), [DVec3::NEG_Z; 4]);
        let [at_a, at_b] = below[i].map(|n| n.extend(0.0));
        let underside = [a.extend(near), b.extend(near), b.extend(far), a.extend(far)];
        push_face(&mut mesh, underside, [at_a, at_b, at_b, at_a]);
        let [at_d, at_c] = above[i].map(|n| -n.extend(0.0));
        let top = [d.extend(far), c.extend(far), c.extend(near), d.extend(near)];
        push_face(&mut mesh, top, [at_d, at_c, at_c, at_d]);
    }
    for (a, d, [first, second]) in [
        (lower[0], upper[0], [near, far]),
        (lower[lower.len() - 1], upper[upper.len() - 1], [far, near]),
    ] {
        let corners = [a.extend(first), a.extend(second), d.extend(second), d.extend(first)];
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        push_face(&mut mesh, corners, [normal; 4]);
    }
    mesh
}

/// Half a circle of so many straight pieces, from left to right over the origin.
pub(super) fn half_circle(radius: f64, pieces: u32) -> Vec<[f64; 2]> {
    (0..=pieces)
        .map(|i| {
            let (sin, cos) = (PI * (1.0 - f64::from(i) / f64::from(pieces))).sin_cos();
            [radius * cos, radius * sin]
        })
        .collect()
}

/// A strip of cloth or paper of this thickness along a line of (x, z) points that runs along +X, from y = 0 to `height`.
pub(super) fn sheet(line: &[[f64; 2]], thickness: f64, height: f64) -> Mesh {
    // In the plane of `band`, y points along −z here.
    let points: Vec<_> = line.iter().map(|p| DVec2::new(p[0], -p[1])).collect();
    let last = points.len() - 1;
    let side = |sign: f64| -> Vec<[f64; 2]> {
        (0..=last)
            .map(|i| {
                let along = (points[(i + 1).min(last)] - points[i.max(1) - 1]).normalize();
                (points[i] + 0.5 * sign * thickness * along.perp()).into()
            })
            .collect()
    };
    upright(band(&side(-1.0), &side(1.0), [0.0, height]))
}

/// Lays what was extruded along +Z upright, along +Y; its +Y becomes −Z.
pub(super) fn upright(mesh: Mesh) -> Mesh {
    moved(mesh, DAffine3::from_rotation_x(-FRAC_PI_2))
}

/// A box about the origin with edges and corners rounded by `radius` in `steps` steps: `12 (2 steps + 1)²` triangles.
pub(super) fn rounded_box(half: DVec3, radius: f64, steps: u32) -> Mesh {
    let core = half - radius;
    let lines = |axis: usize| -> Vec<f64> {
        let rounding = (0..=steps).map(|i| match i {
            0 => half[axis],
            i => core[axis] + radius * (FRAC_PI_4 * (1.0 - f64::from(i) / f64::from(steps))).tan(),
        });
        let upper: Vec<_> = rounding.collect();
        upper.iter().map(|x| -x).chain(upper.iter().rev().copied()).collect()
    };
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let (across, along) = (lines(u), lines(v));
        for side in [-1.0, 1.0] {
            let first = mesh.positions.len() as u32;
            for &b in &along {
                for &a in &across {
                    let mut on_box = DVec3::ZERO;
                    (on_box[axis], on_box[u], on_box[v]) = (side * half[axis], a, b);
                    let in_core = on_box.clamp(-core, core);
                    let normal = (on_box - in_core).normalize();
                    push_vertex(&mut mesh, in_core + radius * normal, normal);
                }
            }
            let row = across.len() as u32;
            for i in (0..along.len() as u32 - 1).flat_map(|y| (0..row - 1).map(move |x| first + y * row + x)) {
                let quad = if side > 0.0 {
                    [i, i + 1, i + row + 1, i + row]
                } else {
                    [i, i + row, i + row + 1, i + 1]
                };
                mesh.indices
                    .extend([0, 1, 2, 0, 2, 3].map(|corner: usize| quad[corner]));
            }
        }
    }
    mesh
}

/// The mesh where a rigid transform takes it.
pub(super) fn moved(mut mesh: Mesh, transform: DAffine3) -> Mesh {
    for position in &mut mesh.positions {
        *position = transform
            .transform_point3(Vec3::from(*position).as_dvec3())
            .as_vec3()
            .to_array();
    }
    for normal in &mut mesh.normals {
        *normal = transform
            .transform_vector3(Vec3::from(*normal).as_dvec3())
            .as_vec3()
            .to_array();
    }
    mesh
}

/// The mesh shifted.
pub(super) fn shifted(mesh: Mesh, by: [f64; 3]) -> Mesh {
    moved(mesh, DAffine3::from_translation(by.into()))
}

/// Several parts as one mesh, without texture coordinates.
pub(super) fn joined(name: &str, parts: impl IntoIterator<Item = Mesh>) -> Mesh {
    let mut whole = Mesh {
        name: name.into(),
        ..Mesh::default()
    };
    for part in parts {
        let first = whole.positions.len() as u32;
        whole.positions.extend(part.positions);
        whole.normals.extend(part.normals);
        whole.indices.extend(part.indices.iter().map(|i| first + i));
    }
    whole
}

/// A point of a profile, turned.
fn around(point: DVec2, turn: DVec2) -> DVec3 {
    DVec3::new(point.x * turn.x, point.y, point.x * turn.y)
}

fn push_vertex(mesh: &mut Mesh, position: DVec3, normal: DVec3) {
    mesh.positions.push(position.as_vec3().to_array());
    mesh.normals.push(normal.as_vec3().to_array());
}

/// Appends a quad, counter-clockwise from the front.
fn push_face(mesh: &mut Mesh, corners: [DVec3; 4], normals: [DVec3; 4]) {
    let first = mesh.positions.len() as u32;
    for (corner, normal) in corners.into_iter().zip(normals) {
        push_vertex(mesh, corner, normal);
    }
    mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
}

/// What a line's first and last piece take as their neighbours.
enum Ends {
    /// Nothing.
    Free,
    /// Their own mirror images in the axis x = 0.
    OnAxis,
    /// Each other.
    Joined,
}

/// Unit normals, to its right, at both ends of each piece of a line: the mean with the neighbouring piece's, unless a
/// [`CREASE`] parts them.
fn chain_normals(points: &[DVec2], ends: &Ends) -> Vec<[DVec2; 2]> {
    let flat: Vec<_> = points.windows(2).map(|p| -(p[1] - p[0]).normalize().perp()).collect();
    let last = flat.len() - 1;
    let beyond = |own: DVec2, other: DVec2| match ends {
        Ends::Free => own,
        Ends::OnAxis => DVec2::new(-own.x, own.y),
        Ends::Joined => other,
    };
    let blend = |own: DVec2, other: DVec2| {
        let is_smooth = own.dot(other) > CREASE.cos();
        if is_smooth { (own + other).normalize() } else { own }
    };
    (0..=last)
        .map(|i| {
            let before = if i > 0 {
                flat[i - 1]
            } else {
                beyond(flat[0], flat[last])
            };
            let after = if i < last {
                flat[i + 1]
            } else {
                beyond(flat[last], flat[0])
            };
            [blend(flat[i], before), blend(flat[i], after)]
        })
        .collect()
}
