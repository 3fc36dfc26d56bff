//! The nave: a vaulted church between its aisles, closed on all sides and lit by a single spot.

use super::solids::{band, half_circle, joined, lathe, moved, rod, rounded_box, sheet, shifted};
use super::{Builder, cuboid};
use crate::scene::{Light, LightKind, Material, Mesh, Scene};
use glam::{DAffine3, DQuat, DVec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Half the church's length (x) and width (z), and the height of its ends, metres.
const LENGTH: f64 = 20.0;
const WIDTH: f64 = 9.0;
const HEIGHT: f64 = 16.0;

/// Distance of neighbouring piers in a row, and how many of them there are; a bay more than that fills the length.
const BAY: f64 = 5.0;
const PIERS: u32 = 7;

/// Distance of the rows from the middle of the nave.
const ROW: f64 = 5.0;

/// Where arches, the roofs of the aisles and the vault spring from.
const ARCH_SPRING: f64 = 5.0;
const AISLE: f64 = 8.0;
const VAULT_SPRING: f64 = 10.0;

/// Of an arch of the arcade: radius of its opening, of the wall's above it, and half the wall's depth.
const ARCH: f64 = 1.75;
const OPENING: f64 = 2.1;
const WALL_DEPTH: f64 = 0.4;

/// Straight pieces of an arch, and of the vault.
const ARCH_PIECES: u32 = 16;
const VAULT_PIECES: u32 = 48;

/// Facets of a pier's core, and of its shafts and other small round things.
const CORE_FACETS: u32 = 24;
const FACETS: u32 = 16;

/// Kept between things that would touch: coincident faces have no order in depth.
const CLEARANCE: f64 = 0.005;

/// A church of 40 × 16 × 18 m under a barrel vault: fourteen clustered piers, aisles, pews, and tapestries. A spot over the
/// entrance is the only light; a censer swings along the nave, once in four seconds. About 77 000 triangles.
pub fn nave(time: f64) -> Scene {
    let mut builder = Builder::default();
    let stone = builder.material(Material::diffuse("stone", [0.66, 0.6, 0.5]));
    let plaster = builder.material(Material::diffuse("plaster", [0.75, 0.71, 0.63]));
    let wood = builder.material(Material::diffuse("wood", [0.4, 0.24, 0.12]));
    shell(&mut builder, plaster);
    piers(&mut builder, stone);
    arcade(&mut builder, stone, plaster);
    vault(&mut builder, stone, plaster);
    pews(&mut builder, wood);
    choir(&mut builder, stone);
    tapestries(&mut builder);
    censer(&mut builder, time);
    builder.scene.lights.push(Light {
        name: "spot".into(),
        kind: LightKind::Spot {
            position: DVec3::new(-17.0, 11.5, 0.0),
            direction: DVec3::new(19.0, -11.0, 2.0),
            inner_angle: 22f64.to_radians(),
            outer_angle: 34f64.to_radians(),
            radius: 0.0,
        },
        color: [1.0, 0.93, 0.8],
        intensity: 2000.0,
    });
    builder.look(
        "along the nave",
        DVec3::new(-18.5, 1.7, 0.7),
        DVec3::new(6.0, 5.2, -0.4),
        DVec3::Y,
        68f64.to_radians(),
    );
    builder.look(
        "from an aisle",
        DVec3::new(-11.0, 1.7, 7.2),
        DVec3::new(3.0, 4.0, -4.0),
        DVec3::Y,
        62f64.to_radians(),
    );
    builder.scene
}

/// Where the piers of a row stand.
fn pier_places() -> impl Iterator<Item = f64> {
    (0..PIERS).map(|i| BAY * (f64::from(i) - 0.5 * f64::from(PIERS - 1)))
}

/// Where the middles of bays are.
fn bay_places() -> impl Iterator<Item = f64> {
    (0..=PIERS).map(|i| BAY * (f64::from(i) - 0.5 * f64::from(PIERS)))
}

/// Floor, walls of the aisles and both ends, facing inward.
fn shell(builder: &mut Builder, plaster: usize) {
    let tiles = builder.material(Material::diffuse("tiles", [0.45, 0.4, 0.36]));
    let [x, h, z] = [LENGTH, HEIGHT, WIDTH].map(|v| v as f32);
    let top = (AISLE + 0.3) as f32;
    builder.quad("floor", [[-x, 0.0, z], [x, 0.0, z], [x, 0.0, -z], [-x, 0.0, -z]], tiles);
    let walls = vec![
        [[-x, 0.0, -z], [x, 0.0, -z], [x, top, -z], [-x, top, -z]],
        [[x, 0.0, z], [-x, 0.0, z], [-x, top, z], [x, top, z]],
        [[-x, 0.0, z], [-x, 0.0, -z], [-x, h, -z], [-x, h, z]],
        [[x, 0.0, -z], [x, 0.0, z], [x, h, z], [x, h, -z]],
    ];
    builder.quad_strip("walls", walls, plaster);
}

/// A round shaft from y = 0 to `height`, with base and capital.
fn shaft(radius: f64, height: f64, facets: u32) -> Mesh {
    let at = |share: f64, y: f64| [radius * share, y];
    let top = height - CLEARANCE;
    let profile = [
        at(0.0, CLEARANCE),
        at(1.25, CLEARANCE),
        at(1.25, 0.25),
        at(1.32, 0.3),
        at(1.35, 0.36),
        at(1.3, 0.42),
        at(1.15, 0.46),
        at(1.12, 0.6),
        at(1.0, 0.68),
        at(1.0, 0.5 * height),
        at(1.0, height - 0.75),
        at(1.1, height - 0.72),
        at(1.05, height - 0.5),
        at(1.15, height - 0.36),
        at(1.32, height - 0.24),
        at(1.4, height - 0.2),
        at(1.4, top),
        at(0.0, top),
    ];
    lathe(&profile, facets)
}

/// Clustered piers, and on each a shaft that carries a rib of the vault.
fn piers(builder: &mut Builder, stone: usize) {
    let around = (0..4).map(|i| {
        let (sin, cos) = (FRAC_PI_2 * f64::from(i)).sin_cos();
        let own = shaft(0.15, ARCH_SPRING - 2.0 * CLEARANCE, FACETS);
        shifted(own, [0.5 * cos, CLEARANCE, 0.5 * sin])
    });
    let core = shaft(0.45, ARCH_SPRING, CORE_FACETS);
    let pier = builder.shape(joined("pier", std::iter::once(core).chain(around)));
    let upper = Mesh {
        name: "wall shaft".into(),
        ..shaft(0.15, VAULT_SPRING - ARCH_SPRING, FACETS)
    };
    let upper = builder.shape(upper);
    for side in [-1.0, 1.0] {
        for x in pier_places() {
            builder.place(pier, stone, DAffine3::from_translation(DVec3::new(x, 0.0, side * ROW)));
            let on_wall = DVec3::new(x, ARCH_SPRING, side * (ROW - WALL_DEPTH));
            builder.place(upper, stone, DAffine3::from_translation(on_wall));
        }
    }
}

/// Arches between the piers, the wall over them up to the vault, and the roofs of the aisles.
fn arcade(builder: &mut Builder, stone: usize, plaster: usize) {
    let half_circle = |radius| half_circle(radius, ARCH_PIECES);
    let rings = [[ARCH, 1.95, 0.2], [1.93, OPENING + 0.02, 0.32]]
        .map(|[inner, outer, depth]| band(&half_circle(inner), &half_circle(outer), [-depth, depth]));
    let arch = builder.shape(joined("arch", rings));
    let half = 0.5 * BAY - CLEARANCE;
    let mut lower = vec![[-half, 0.0]];
    lower.extend(half_circle(OPENING));
    lower.push([half, 0.0]);
    let upper: Vec<_> = lower
        .iter()
        .map(|p| [p[0], VAULT_SPRING - ARCH_SPRING - CLEARANCE])
        .collect();
    let wall = Mesh {
        name: "spandrel".into(),
        ..band(&lower, &upper, [-WALL_DEPTH, WALL_DEPTH])
    };
    let wall = builder.shape(wall);
    for (x, side) in bay_places().flat_map(|x| [(x, -1.0), (x, 1.0)]) {
        let at = DAffine3::from_translation(DVec3::new(x, ARCH_SPRING + CLEARANCE, side * ROW));
        builder.place(arch, stone, at);
        builder.place(wall, plaster, at);
    }
    let [x, from, to] = [LENGTH, ROW + WALL_DEPTH, WIDTH].map(|v| (v - CLEARANCE) as f32);
    let roof = Mesh {
        name: "roof of an aisle".into(),
        ..cuboid(
            [0.01 - x, AISLE as f32, from - 0.1],
            [x - 0.01, (AISLE + 0.3) as f32, to],
        )
    };
    let roof = builder.shape(roof);
    for turn in [0.0, PI] {
        builder.place(roof, plaster, DAffine3::from_rotation_y(turn));
    }
}

/// A barrel over the nave, with a rib over each pair of piers.
fn vault(builder: &mut Builder, stone: usize, plaster: usize) {
    let half_circle = |radius| half_circle(radius, VAULT_PIECES);
    let across = DAffine3::from_rotation_y(FRAC_PI_2);
    let (inner, length) = (ROW - 0.1, LENGTH - CLEARANCE);
    let barrel = band(&half_circle(inner), &half_circle(ROW + 0.3), [-length, length]);
    let rib = band(&half_circle(inner - 0.25), &half_circle(inner - CLEARANCE), [-0.2, 0.2]);
    let at = |x: f64| DAffine3::from_translation(DVec3::new(x, VAULT_SPRING + CLEARANCE, 0.0));
    let barrel = builder.shape(Mesh {
        name: "vault".into(),
        ..moved(barrel, across)
    });
    builder.place(barrel, plaster, at(0.0));
    let rib = builder.shape(Mesh {
        name: "rib".into(),
        ..moved(rib, across)
    });
    for x in pier_places() {
        builder.place(rib, stone, at(x));
    }
}

/// Two blocks of pews that face the choir.
fn pews(builder: &mut Builder, wood: usize) {
    let plank = |half: [f64; 3], at: [f64; 3]| shifted(rounded_box(half.into(), 0.02, 1), at);
    let pew = joined(
        "pew",
        [
            plank([0.2, 0.025, 1.25], [0.0, 0.45, 0.0]),
            plank([0.025, 0.3, 1.25], [-0.22, 0.75, 0.0]),
            plank([0.28, 0.5, 0.04], [-0.02, 0.5 + CLEARANCE, 1.3]),
            plank([0.28, 0.5, 0.04], [-0.02, 0.5 + CLEARANCE, -1.3]),
        ],
    );
    let pew = builder.shape(pew);
    for (row, side) in (0..14).flat_map(|row| [(row, -1.0), (row, 1.0)]) {
        let at = DVec3::new(-11.0 + 1.2 * f64::from(row), 0.0, 2.4 * side);
        builder.place(pew, wood, DAffine3::from_translation(at));
    }
}

/// Steps at the far end, an altar on them, candlesticks beside it, and a carpet that leads there.
fn choir(builder: &mut Builder, stone: usize) {
    let red = builder.material(Material::diffuse("carpet", [0.55, 0.06, 0.05]));
    let linen = builder.material(Material::diffuse("linen", [0.8, 0.78, 0.72]));
    let brass = builder.material(Material::diffuse("brass", [0.6, 0.45, 0.15]));
    let slab = |name: &str, from: [f64; 3], to: [f64; 3]| Mesh {
        name: name.into(),
        ..cuboid(from.map(|v| v as f32), to.map(|v| v as f32))
    };
    let end = LENGTH - CLEARANCE;
    for step in 0..3 {
        let (y, x) = (0.18 * f64::from(step), 13.0 + 0.4 * f64::from(step));
        let from = [x, if step == 0 { CLEARANCE } else { y - CLEARANCE }, -3.6];
        let inset = CLEARANCE * f64::from(step);
        let (from, to) = ([x, from[1], from[2] + inset], [end - inset, y + 0.18, 3.6 - inset]);
        builder.mesh(slab("step", from, to), stone);
    }
    builder.mesh(slab("altar", [16.0, 0.54 - CLEARANCE, -1.3], [17.0, 1.5, 1.3]), stone);
    builder.mesh(slab("altar cloth", [15.9, 1.505, -1.5], [17.1, 1.53, 1.5]), linen);
    builder.mesh(slab("carpet", [-18.0, CLEARANCE, -0.7], [12.9, 0.02, 0.7]), red);
    let profile = [
        [0.0, CLEARANCE],
        [0.22, CLEARANCE],
        [0.2, 0.06],
        [0.06, 0.12],
        [0.05, 0.3],
        [0.09, 0.36],
        [0.05, 0.42],
        [0.04, 0.9],
        [0.08, 0.96],
        [0.04, 1.02],
        [0.04, 1.4],
        [0.14, 1.46],
        [0.14, 1.5],
        [0.03, 1.52],
        [0.03, 1.8],
        [0.0, 1.8],
    ];
    let candlestick = builder.shape(Mesh {
        name: "candlestick".into(),
        ..lathe(&profile, FACETS)
    });
    for (x, side) in [14.5, 16.5, 18.5].into_iter().flat_map(|x| [(x, -1.0), (x, 1.0)]) {
        builder.place(
            candlestick,
            brass,
            DAffine3::from_translation(DVec3::new(x, 0.54, 2.6 * side)),
        );
    }
}

/// Cloth along the walls of the aisles.
fn tapestries(builder: &mut Builder) {
    let cloths = [
        builder.material(Material::diffuse("red cloth", [0.6, 0.08, 0.06])),
        builder.material(Material::diffuse("blue cloth", [0.08, 0.15, 0.5])),
        builder.material(Material::diffuse("green cloth", [0.1, 0.4, 0.12])),
    ];
    let folds: Vec<_> = (0..=40)
        .map(|i| {
            let x = f64::from(i) / 40.0;
            [2.4 * (x - 0.5), 0.06 * (4.0 * TAU * x).sin()]
        })
        .collect();
    let tapestry = builder.shape(Mesh {
        name: "tapestry".into(),
        ..sheet(&folds, 0.02, 3.6)
    });
    for (i, x) in bay_places().enumerate() {
        for (side, shift) in [(-1.0, 0), (1.0, 1)] {
            let at = DVec3::new(x, 2.2, side * (WIDTH - 0.12));
            let cloth = cloths[(i + shift) % cloths.len()];
            builder.place(tapestry, cloth, DAffine3::from_translation(at));
        }
    }
}

/// A censer on a chain from the crown of the vault.
fn censer(builder: &mut Builder, time: f64) {
    let silver = builder.material(Material::diffuse("silver", [0.7, 0.7, 0.68]));
    const CHAIN: f64 = 11.0;
    let bowl = [
        [0.0, -0.4],
        [0.18, -0.4],
        [0.2, -0.34],
        [0.1, -0.28],
        [0.28, -0.16],
        [0.36, 0.0],
        [0.36, 0.06],
        [0.3, 0.2],
        [0.16, 0.34],
        [0.1, 0.46],
        [0.0, 0.46],
    ];
    let bowl = shifted(lathe(&bowl, CORE_FACETS), [0.0, -CHAIN, 0.0]);
    let chain = rod(
        DVec3::new(0.0, 0.47 - CHAIN, 0.0),
        DVec3::new(0.0, -CLEARANCE, 0.0),
        [0.02; 2],
        8,
    );
    let censer = builder.mesh(joined("censer", [bowl, chain]), silver);
    let swing = DQuat::from_rotation_z(0.5 * (TAU * time / 4.0).sin());
    let crown = DVec3::new(2.5, VAULT_SPRING + ROW - 0.1 - CLEARANCE, 0.0);
    builder.scene.instances[censer].transform = DAffine3::from_rotation_translation(swing, crown);
}
