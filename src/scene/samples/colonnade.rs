//! The colonnade: a long hall under the open sky, with thin balusters in great number.

use super::solids::{band, half_circle, joined, lathe, moved, rounded_box, sheet, shifted};
use super::{Builder, cuboid};
use crate::scene::{Light, LightKind, Material, Mesh, Scene};
use glam::{DAffine3, DQuat, DVec3, Vec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Half the hall's length (x), its height (y), and half its width (z), metres.
const HALL: [f32; 3] = [20.0, 12.0, 8.0];

/// Distance of neighbouring columns in a row; eight of them and half a bay at each end fill the hall's length.
const BAY: f64 = 5.0;
const COLUMNS: u32 = 8;

/// Distance of the rows from the middle of the nave.
const ROW: f64 = 4.5;

/// Of each storey: its floor, where its arches spring from, and where its wall ends.
const STOREYS: [[f64; 3]; 2] = [[0.0, 3.6, 6.2], [6.5, 9.1, 11.7]];

/// Of each ring of an arch, from the inside: inner and outer radius, and half its depth. Outer radii reach a little into
/// the next ring, and the last one into the wall.
const RINGS: [[f64; 3]; 2] = [[1.9, 2.17, 0.25], [2.15, 2.42, 0.38]];
/// Radius of the opening in the wall above the rings, and half the wall's depth.
const OPENING: f64 = 2.4;
const WALL_DEPTH: f64 = 0.5;
/// Straight pieces of an arch.
const ARCH_PIECES: u32 = 14;

/// Facets of balusters.
const FACETS: u32 = 16;

/// Kept between things that would touch: coincident faces have no order in depth.
const CLEARANCE: f64 = 0.005;

/// A hall of 40 × 12 × 16 m without a roof over its nave: 32 columns in two storeys, stepped arches, and galleries behind
/// 160 balusters of 5 to 7 cm radius. The sun stands high; a lantern hangs in the middle. A cart rolls along the nave and
/// back, once in four seconds. About 81 000 triangles.
pub fn colonnade(time: f64) -> Scene {
    let mut builder = Builder::default();
    let stone = builder.material(Material::diffuse("stone", [0.62, 0.55, 0.44]));
    let plaster = builder.material(Material::diffuse("plaster", [0.72, 0.68, 0.6]));
    shell(&mut builder, plaster);
    columns(&mut builder, stone);
    arches(&mut builder, stone, plaster);
    galleries(&mut builder, stone, plaster);
    banners(&mut builder);
    cart(&mut builder, time);
    lights(&mut builder);
    builder.look(
        "along the nave",
        DVec3::new(-18.6, 1.7, 1.2),
        DVec3::new(8.0, 4.2, -0.6),
        DVec3::Y,
        68f64.to_radians(),
    );
    builder.look(
        "up to a gallery",
        DVec3::new(-7.5, 1.6, -3.0),
        DVec3::new(0.5, 6.6, 4.5),
        DVec3::Y,
        60f64.to_radians(),
    );
    builder.scene
}

/// Where the columns of a row stand.
fn column_places() -> impl Iterator<Item = f64> {
    (0..COLUMNS).map(|i| BAY * (f64::from(i) - 0.5 * f64::from(COLUMNS - 1)))
}

/// Floor and walls, facing inward.
fn shell(builder: &mut Builder, plaster: usize) {
    let tiles = builder.material(Material::diffuse("tiles", [0.5, 0.3, 0.2]));
    let [x, h, z] = HALL;
    builder.quad("floor", [[-x, 0.0, z], [x, 0.0, z], [x, 0.0, -z], [-x, 0.0, -z]], tiles);
    let walls = vec![
        [[-x, 0.0, -z], [x, 0.0, -z], [x, h, -z], [-x, h, -z]],
        [[x, 0.0, z], [-x, 0.0, z], [-x, h, z], [x, h, z]],
        [[-x, 0.0, z], [-x, 0.0, -z], [-x, h, -z], [-x, h, z]],
        [[x, 0.0, -z], [x, 0.0, z], [x, h, z], [x, h, -z]],
    ];
    builder.quad_strip("walls", walls, plaster);
}

/// A column of this height: square plinth and abacus, and between them base, shaft and capital in the round.
fn column(name: &str, height: f64) -> Mesh {
    let (plinth, abacus) = (0.2, height - 0.2);
    let profile = [
        [0.0, plinth - CLEARANCE],
        [0.46, plinth - CLEARANCE],
        [0.5, plinth + 0.07],
        [0.46, plinth + 0.14],
        [0.38, plinth + 0.2],
        [0.36, plinth + 0.3],
        [0.35, 0.5 * height],
        [0.3, abacus - 0.4],
        [0.34, abacus - 0.36],
        [0.31, abacus - 0.3],
        [0.36, abacus - 0.12],
        [0.46, abacus + CLEARANCE],
        [0.0, abacus + CLEARANCE],
    ];
    let slab = |from: f64, to: f64, half: f64| {
        cuboid(
            [-half as f32, from as f32, -half as f32],
            [half as f32, to as f32, half as f32],
        )
    };
    joined(
        name,
        [
            with_normals(slab(CLEARANCE, plinth, 0.52)),
            lathe(&profile, 24),
            with_normals(slab(abacus, height, 0.56)),
        ],
    )
}

/// The same with the normals of its faces, which a mesh needs once it is joined with round parts.
fn with_normals(mesh: Mesh) -> Mesh {
    let corner = |i: u32| Vec3::from(mesh.positions[i as usize]).as_dvec3();
    let mut flat = Mesh {
        name: mesh.name.clone(),
        ..Mesh::default()
    };
    for t in mesh.indices.chunks_exact(3) {
        let [a, b, c] = [corner(t[0]), corner(t[1]), corner(t[2])];
        let normal = (b - a).cross(c - a).normalize().as_vec3().to_array();
        for p in [a, b, c] {
            flat.indices.push(flat.positions.len() as u32);
            flat.positions.push(p.as_vec3().to_array());
            flat.normals.push(normal);
        }
    }
    flat
}

fn columns(builder: &mut Builder, stone: usize) {
    for (name, [floor, spring, _]) in ["column", "upper column"].into_iter().zip(STOREYS) {
        let shape = builder.shape(column(name, spring - floor));
        for side in [-1.0, 1.0] {
            for x in column_places() {
                let at = DVec3::new(x, floor, side * ROW);
                builder.place(shape, stone, DAffine3::from_translation(at));
            }
        }
    }
}

/// The wall of a bay around its arch, up to this height over where the arch springs from.
fn spandrel(height: f64) -> Mesh {
    let half = 0.5 * BAY - CLEARANCE;
    let mut lower = vec![[-half, 0.0]];
    lower.extend(half_circle(OPENING, ARCH_PIECES));
    lower.push([half, 0.0]);
    let upper: Vec<_> = lower.iter().map(|p| [p[0], height]).collect();
    band(&lower, &upper, [-WALL_DEPTH, WALL_DEPTH])
}

fn arches(builder: &mut Builder, stone: usize, plaster: usize) {
    let rings = RINGS.map(|[inner, outer, depth]| {
        band(
            &half_circle(inner, ARCH_PIECES),
            &half_circle(outer, ARCH_PIECES),
            [-depth, depth],
        )
    });
    let arch = builder.shape(joined("arch", rings));
    for [_, spring, top] in STOREYS {
        let wall = Mesh {
            name: "spandrel".into(),
            ..spandrel(top - spring - CLEARANCE)
        };
        let wall = builder.shape(wall);
        // Over the half bay at each end of the hall a beam.
        let [end, last] = [f64::from(HALL[0]) - CLEARANCE, 0.5 * BAY * f64::from(COLUMNS - 1)];
        let beam = Mesh {
            name: "beam".into(),
            ..cuboid(
                [last as f32, 0.4, -WALL_DEPTH as f32],
                [end as f32, (top - spring - CLEARANCE) as f32, WALL_DEPTH as f32],
            )
        };
        let beam = builder.shape(beam);
        for side in [-1.0, 1.0] {
            // A hair above the abaci.
            let at = |x: f64| DVec3::new(x, spring + CLEARANCE, side * ROW);
            for x in column_places().take(COLUMNS as usize - 1).map(|x| x + 0.5 * BAY) {
                builder.place(arch, stone, DAffine3::from_translation(at(x)));
                builder.place(wall, plaster, DAffine3::from_translation(at(x)));
            }
            for turn in [0.0, PI] {
                let placed = DAffine3::from_rotation_translation(DQuat::from_rotation_y(turn), at(0.0));
                builder.place(beam, plaster, placed);
            }
        }
    }
}

/// A baluster of 0.9 m, 5 to 7 cm in radius at its thickest parts.
fn baluster() -> Mesh {
    let profile = [
        [0.0, CLEARANCE],
        [0.07, CLEARANCE],
        [0.07, 0.08],
        [0.05, 0.12],
        [0.055, 0.2],
        [0.07, 0.3],
        [0.055, 0.45],
        [0.05, 0.62],
        [0.06, 0.72],
        [0.05, 0.78],
        [0.065, 0.9 - CLEARANCE],
        [0.0, 0.9 - CLEARANCE],
    ];
    Mesh {
        name: "baluster".into(),
        ..lathe(&profile, FACETS)
    }
}

/// Where the balusters of a row stand: ten in each bay, five in the half bay at each end.
fn baluster_places() -> impl Iterator<Item = f64> {
    let bays = column_places().take(COLUMNS as usize - 1);
    let whole = bays.flat_map(|x| (0..10).map(move |i| x + 0.5 * BAY + 0.42 * (f64::from(i) - 4.5)));
    let last = 0.5 * BAY * f64::from(COLUMNS - 1);
    let ends = [-1.0, 1.0]
        .into_iter()
        .flat_map(move |side| (0..5).map(move |i| side * (last + 0.65 + 0.4 * f64::from(i))));
    whole.chain(ends)
}

/// Floors of the galleries, their balustrades, and the roofs over them.
fn galleries(builder: &mut Builder, stone: usize, plaster: usize) {
    let [length, height, width] = HALL.map(f64::from);
    let slab = |name: &str, inner: f64, [from, to]: [f64; 2]| Mesh {
        name: name.into(),
        ..cuboid(
            [(CLEARANCE - length) as f32, from as f32, inner as f32],
            [(length - CLEARANCE) as f32, to as f32, (width - CLEARANCE) as f32],
        )
    };
    let [[_, _, lower_top], [floor, ..]] = STOREYS;
    let slabs = [
        slab("gallery", ROW - 0.7, [lower_top, floor]),
        slab("roof", ROW - 0.7, [STOREYS[1][2], height]),
    ];
    let rail = Mesh {
        name: "rail".into(),
        ..cuboid(
            [(CLEARANCE - length) as f32, (floor + 0.9) as f32, (ROW - 0.08) as f32],
            [(length - CLEARANCE) as f32, (floor + 1.02) as f32, (ROW + 0.08) as f32],
        )
    };
    let shapes = [(slabs[0].clone(), plaster), (slabs[1].clone(), plaster), (rail, stone)];
    let shapes = shapes.map(|(mesh, material)| (builder.shape(mesh), material));
    let baluster = builder.shape(baluster());
    for (side, turn) in [(1.0, 0.0), (-1.0, PI)] {
        let turned = DAffine3::from_rotation_y(turn);
        for (shape, material) in shapes {
            builder.place(shape, material, turned);
        }
        for x in baluster_places() {
            let at = DVec3::new(x, floor, side * ROW);
            builder.place(baluster, stone, DAffine3::from_translation(at));
        }
    }
}

/// Cloth that hangs from the galleries into the nave.
fn banners(builder: &mut Builder) {
    let red = builder.material(Material::diffuse("red cloth", [0.6, 0.07, 0.06]));
    let blue = builder.material(Material::diffuse("blue cloth", [0.08, 0.14, 0.5]));
    let folds: Vec<_> = (0..=24)
        .map(|i| {
            let x = f64::from(i) / 24.0;
            [1.6 * (x - 0.5), 0.05 * (3.0 * TAU * x).sin()]
        })
        .collect();
    let banner = Mesh {
        name: "banner".into(),
        ..sheet(&folds, 0.02, 2.6)
    };
    let banner = builder.shape(banner);
    for (i, x) in [-12.5, -2.5, 7.5].into_iter().enumerate() {
        for (side, offset) in [(-1.0, 0), (1.0, 1)] {
            let material = if (i + offset) % 2 == 0 { red } else { blue };
            let at = DVec3::new(x, 3.85, side * (ROW - 0.85));
            builder.place(banner, material, DAffine3::from_translation(at));
        }
    }
}

/// A handcart with four wheels.
fn cart(builder: &mut Builder, time: f64) {
    let wood = builder.material(Material::diffuse("wood", [0.42, 0.27, 0.14]));
    let hay = builder.material(Material::diffuse("hay", [0.68, 0.55, 0.2]));
    let wheel = lathe(
        &[[0.0, -0.04], [0.3, -0.04], [0.32, 0.0], [0.3, 0.04], [0.0, 0.04]],
        FACETS,
    );
    let wheel = |x: f64, z: f64| {
        let turned = DAffine3::from_rotation_x(FRAC_PI_2);
        shifted(moved(wheel.clone(), turned), [x, 0.33, z])
    };
    let bed = shifted(rounded_box(DVec3::new(0.9, 0.06, 0.5), 0.02, 1), [0.0, 0.62, 0.0]);
    let wheels = [(-0.6, -0.58), (-0.6, 0.58), (0.6, -0.58), (0.6, 0.58)].map(|(x, z)| wheel(x, z));
    let cart = builder.shape(joined("cart", [bed].into_iter().chain(wheels)));
    let load = Mesh {
        name: "load".into(),
        ..shifted(rounded_box(DVec3::new(0.75, 0.3, 0.42), 0.15, 3), [0.0, 1.0, 0.0])
    };
    let load = builder.shape(load);
    let along = -9.0 * (TAU * time / 4.0).cos();
    let placed = DAffine3::from_translation(DVec3::new(along, 0.0, -0.8));
    builder.place(cart, wood, placed);
    builder.place(load, hay, placed);
}

fn lights(builder: &mut Builder) {
    builder.scene.lights.push(Light {
        name: "sun".into(),
        kind: LightKind::Directional {
            direction: DVec3::new(0.35, -1.0, 0.3),
            angle: 0.0,
        },
        color: [1.0, 0.94, 0.82],
        intensity: 4.0,
    });
    builder.scene.lights.push(Light {
        name: "lantern".into(),
        ..Light::point(DVec3::new(0.0, 4.6, 0.0), 25.0, [1.0, 0.75, 0.45])
    });
}
