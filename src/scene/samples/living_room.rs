//! The furnished room: many thin things, of which no place sees all.

use super::solids::{band, joined, lathe, rod, rounded_box, sheet, shifted, sphere, upright};
use super::{Builder, cuboid};
use crate::scene::{Light, LightKind, Material, Mesh, Scene};
use glam::{DAffine3, DQuat, DVec3, EulerRot};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Width (x), height (y) and depth (z) of the room in metres, the wall that holds the window included.
const SIZE: [f32; 3] = [7.0, 2.8, 5.5];

/// Thickness of the wall that holds the window: inside, x begins here.
const WALL: f32 = 0.2;

/// Lower and upper corner of the window's opening, (y, z).
const WINDOW: [[f32; 2]; 2] = [[0.8, 1.3], [2.4, 3.7]];

/// Kept between things that touch: coincident faces have no order in depth.
const CLEARANCE: f64 = 0.001;

/// Thickness of the rug.
const RUG: f64 = 0.02;

/// Facets of legs, bars and spindles.
const FACETS: u32 = 12;

/// A living room of 7 × 2.8 × 5.5 m with window and curtains, sofa, dining table, bookcase, plant and folding screen;
/// chairs stand on legs of 3 to 4 cm, panels are 2 cm thin. Low sun shines through the window, a bulb in a shade over the
/// table. One chair is drawn out, turned, and put back, once in four seconds. About 30 000 triangles.
///
/// The sun is a spot far outside: of a directional light's photons 98 in 100 would land on the roof.
pub fn living_room(time: f64) -> Scene {
    let mut builder = Builder::default();
    shell(&mut builder);
    let oak = builder.material(Material::diffuse("oak", [0.52, 0.34, 0.18]));
    let walnut = builder.material(Material::diffuse("walnut", [0.26, 0.15, 0.09]));
    let white = builder.material(Material::diffuse("white paint", [0.78, 0.77, 0.74]));
    window(&mut builder, white);
    curtains(&mut builder, walnut);
    seats(&mut builder, walnut);
    coffee_table(&mut builder, oak);
    dining_table(&mut builder, oak, time);
    bookcase(&mut builder, white);
    plant(&mut builder);
    folding_screen(&mut builder, walnut, white);
    sideboard(&mut builder, walnut);
    pictures(&mut builder, walnut);
    door(&mut builder, white);
    pendant(&mut builder, white);
    street_lamp(&mut builder);
    builder.look(
        "from the door",
        DVec3::new(6.55, 1.6, 5.15),
        DVec3::new(2.6, 0.75, 1.5),
        DVec3::Y,
        66f64.to_radians(),
    );
    builder.look(
        "from the window",
        DVec3::new(0.9, 1.65, 4.95),
        DVec3::new(4.7, 0.75, 1.7),
        DVec3::Y,
        66f64.to_radians(),
    );
    builder.scene
}

/// Upright at this height, turned about +Y.
fn standing(y: f64, x: f64, z: f64, turn: f64) -> DAffine3 {
    DAffine3::from_rotation_translation(DQuat::from_rotation_y(turn), DVec3::new(x, y, z))
}

/// In [0, 1), different for every index and evenly spread: multiples of the golden ratio.
fn fraction(index: u32) -> f64 {
    (0.618_033_988_749_895 * f64::from(index)).fract()
}

/// The room's surfaces, facing inward; the window's reveals are as deep as its wall.
fn shell(builder: &mut Builder) {
    let parquet = builder.material(Material::diffuse("parquet", [0.45, 0.29, 0.17]));
    let cream = builder.material(Material::diffuse("cream", [0.76, 0.71, 0.6]));
    let sage = builder.material(Material::diffuse("sage", [0.34, 0.45, 0.36]));
    let ceiling = builder.material(Material::diffuse("ceiling", [0.8; 3]));
    let [w, h, d] = SIZE;
    let v = WALL;
    builder.quad(
        "floor",
        [[v, 0.0, d], [w, 0.0, d], [w, 0.0, 0.0], [v, 0.0, 0.0]],
        parquet,
    );
    builder.quad("ceiling", [[v, h, 0.0], [w, h, 0.0], [w, h, d], [v, h, d]], ceiling);
    builder.quad(
        "back wall",
        [[v, 0.0, 0.0], [w, 0.0, 0.0], [w, h, 0.0], [v, h, 0.0]],
        sage,
    );
    let [[y0, z0], [y1, z1]] = WINDOW;
    let corners = [[0.0, d], [0.0, 0.0], [h, 0.0], [h, d]];
    let opening = [[y0, z1], [y0, z0], [y1, z0], [y1, z1]];
    let at = |x: f32, [y, z]: [f32; 2]| [x, y, z];
    let mut walls = vec![
        [[w, 0.0, d], [v, 0.0, d], [v, h, d], [w, h, d]],
        [[w, 0.0, 0.0], [w, 0.0, d], [w, h, d], [w, h, 0.0]],
    ];
    for i in 0..4 {
        let next = (i + 1) % 4;
        walls.push([
            at(v, corners[i]),
            at(v, corners[next]),
            at(v, opening[next]),
            at(v, opening[i]),
        ]);
        walls.push([
            at(v, opening[i]),
            at(v, opening[next]),
            at(0.0, opening[next]),
            at(0.0, opening[i]),
        ]);
    }
    builder.quad_strip("walls", walls, cream);
    // What light the outside reflects never comes back.
    let black = builder.material(Material::diffuse("outside", [0.0; 3]));
    let outside = (0..4).map(|i| {
        let next = (i + 1) % 4;
        [
            at(0.0, corners[next]),
            at(0.0, corners[i]),
            at(0.0, opening[i]),
            at(0.0, opening[next]),
        ]
    });
    builder.quad_strip("outside", outside.collect(), black);
}

/// Dark bars flush with the outside, so that all of the reveals but a rim is indoors, and a board on the sill.
fn window(builder: &mut Builder, white: usize) {
    let anthracite = builder.material(Material::diffuse("anthracite", [0.06, 0.06, 0.065]));
    let [[y0, z0], [y1, z1]] = WINDOW;
    let (wide, embedded) = (0.05, 0.02);
    let (middle_y, middle_z) = (y0 + 0.68 * (y1 - y0), 0.5 * (z0 + z1));
    let mut bars = Vec::new();
    for (from, to) in [(z0 - embedded, z0 + wide), (z1 - wide, z1 + embedded)] {
        bars.push(cuboid([0.005, y0 - embedded, from], [0.065, y1 + embedded, to]));
    }
    for (from, to) in [(y0 - 0.5 * embedded, y0 + wide), (y1 - wide, y1 + 0.5 * embedded)] {
        bars.push(cuboid([0.01, from, z0], [0.06, to, z1]));
    }
    bars.push(cuboid([0.015, y0, middle_z - 0.03], [0.055, y1, middle_z + 0.03]));
    bars.push(cuboid([0.02, middle_y - 0.02, z0], [0.05, middle_y + 0.02, z1]));
    builder.mesh(joined("window frame", bars), anthracite);
    let wall = WALL + CLEARANCE as f32;
    let sill = cuboid([wall, y0 - 0.04, z0 - 0.1], [WALL + 0.16, y0 - 0.01, z1 + 0.1]);
    builder.mesh(joined("window sill", [sill]), white);
}

fn curtains(builder: &mut Builder, wood: usize) {
    let blue = builder.material(Material::diffuse("blue cloth", [0.1, 0.2, 0.46]));
    let folds = 7.0;
    let line: Vec<_> = (0..=64)
        .map(|i| f64::from(i) / 64.0)
        .map(|t| [0.62 * (t - 0.5), 0.035 * (TAU * folds * t).sin()])
        .collect();
    let mut curtain = sheet(&line, 0.02, 2.53);
    curtain.name = "curtain".into();
    let curtain = builder.shape(curtain);
    for z in [0.98, 4.02] {
        builder.place(curtain, blue, standing(0.03, 0.44, z, FRAC_PI_2));
    }
    let (from, to) = (DVec3::new(0.44, 2.6, 0.5), DVec3::new(0.44, 2.6, 4.5));
    let mut parts = vec![rod(from, to, [0.015; 2], FACETS)];
    for end in [from, to] {
        parts.push(shifted(sphere(0.035, 10, 16), end.into()));
        let z = end.z + 0.2 * (0.5 * f64::from(SIZE[2]) - end.z).signum();
        let bracket = DVec3::new(f64::from(WALL) + CLEARANCE, 2.6, z);
        parts.push(rod(bracket, DVec3::new(0.44, 2.6, z), [0.012; 2], 8));
    }
    builder.mesh(joined("curtain rail", parts), wood);
}

/// A sofa and an armchair from the same cushions and arms.
fn seats(builder: &mut Builder, wood: usize) {
    let mustard = builder.material(Material::diffuse("mustard cloth", [0.66, 0.42, 0.08]));
    let teal = builder.material(Material::diffuse("teal cloth", [0.08, 0.32, 0.34]));
    let red = builder.material(Material::diffuse("red cloth", [0.55, 0.1, 0.08]));
    let mut soft = |name: &str, half: [f64; 3], radius| {
        let mut mesh = rounded_box(half.into(), radius, 2);
        mesh.name = name.into();
        builder.shape(mesh)
    };
    let seat = soft("seat cushion", [0.425, 0.09, 0.38], 0.05);
    let back = soft("back cushion", [0.42, 0.26, 0.1], 0.07);
    let arm = soft("arm", [0.1, 0.28, 0.45], 0.06);
    let pillow = soft("pillow", [0.2, 0.2, 0.07], 0.065);
    let base = [
        soft("armchair base", [0.44, 0.14, 0.43], 0.03),
        soft("sofa base", [0.87, 0.14, 0.43], 0.03),
    ];
    let mut foot = rod(DVec3::ZERO, 0.13 * DVec3::Y, [0.015, 0.025], FACETS);
    foot.name = "sofa foot".into();
    let foot = builder.shape(foot);
    for (cushions, cloth, at) in [
        (2u32, mustard, standing(CLEARANCE, 2.2, 0.56, 0.0)),
        (1, teal, standing(CLEARANCE, 1.15, 3.45, 2.2)),
    ] {
        let mut part = |mesh, material, offset: [f64; 3], tilt: f64| {
            let local = DAffine3::from_rotation_translation(DQuat::from_rotation_x(tilt), offset.into());
            builder.place(mesh, material, at * local);
        };
        let half = 0.43 * f64::from(cushions);
        part(base[cushions as usize - 1], cloth, [0.0, 0.26, 0.0], 0.0);
        for i in 0..cushions {
            let x = 0.86 * f64::from(i) - half + 0.43;
            part(seat, cloth, [x, 0.475, 0.06], 0.0);
            part(back, cloth, [x, 0.73, -0.3], -0.16);
        }
        for side in [-1.0, 1.0] {
            part(arm, cloth, [side * (half + 0.105), 0.4, 0.0], 0.0);
            for z in [-0.36, 0.36] {
                part(foot, wood, [side * (half - 0.06), 0.0, z], 0.0);
            }
        }
        part(pillow, red, [0.22 - half, 0.76, -0.06], -0.4);
    }
}

/// A low table on a rug, with a vase and a bowl.
fn coffee_table(builder: &mut Builder, wood: usize) {
    let red = builder.material(Material::diffuse("red wool", [0.5, 0.09, 0.07]));
    let blue = builder.material(Material::diffuse("blue glaze", [0.1, 0.22, 0.45]));
    let low = CLEARANCE as f32;
    let rug = cuboid([1.0, low, 1.2], [3.7, low + RUG as f32, 3.0]);
    builder.mesh(joined("rug", [rug]), red);
    let mut parts = vec![shifted(
        rounded_box(DVec3::new(0.55, 0.02, 0.3), 0.01, 2),
        [0.0, 0.4, 0.0],
    )];
    for (x, z) in [(-0.46, -0.22), (-0.46, 0.22), (0.46, -0.22), (0.46, 0.22)] {
        parts.push(rod(
            DVec3::new(1.04 * x, 0.0, 1.06 * z),
            DVec3::new(x, 0.39, z),
            [0.015, 0.02],
            FACETS,
        ));
    }
    let table = builder.mesh(joined("coffee table", parts), wood);
    let floor = RUG + 2.0 * CLEARANCE;
    builder.scene.instances[table].transform = standing(floor, 2.3, 2.0, 0.0);
    let mut vase = lathe(
        &[
            [0.0, 0.0],
            [0.05, 0.0],
            [0.075, 0.05],
            [0.085, 0.1],
            [0.075, 0.16],
            [0.045, 0.21],
            [0.035, 0.25],
            [0.05, 0.29],
            [0.03, 0.29],
            [0.02, 0.25],
            [0.03, 0.21],
            [0.055, 0.16],
            [0.06, 0.1],
            [0.05, 0.05],
            [0.0, 0.03],
        ],
        24,
    );
    vase.name = "vase".into();
    let vase = builder.shape(vase);
    builder.place(vase, blue, standing(floor + 0.42 + CLEARANCE, 2.55, 1.95, 0.0));
}

/// Table, four chairs, and a bowl of fruit. The nearest chair moves.
fn dining_table(builder: &mut Builder, wood: usize, time: f64) {
    let beech = builder.material(Material::diffuse("beech", [0.6, 0.42, 0.26]));
    let white = builder.material(Material::diffuse("china", [0.75, 0.75, 0.72]));
    let orange = builder.material(Material::diffuse("orange", [0.75, 0.32, 0.04]));
    let (x, z) = (4.9, 3.3);
    let mut parts = vec![shifted(
        rounded_box(DVec3::new(0.8, 0.02, 0.45), 0.01, 2),
        [0.0, 0.73, 0.0],
    )];
    for (x, z) in [(-0.7, -0.36), (-0.7, 0.36), (0.7, -0.36), (0.7, 0.36)] {
        parts.push(rod(
            DVec3::new(x, 0.0, z),
            DVec3::new(x, 0.715, z),
            [0.02, 0.025],
            FACETS,
        ));
    }
    for side in [-1.0f32, 1.0] {
        parts.push(cuboid(
            [-0.7, 0.64, 0.36 * side - 0.01],
            [0.7, 0.72, 0.36 * side + 0.01],
        ));
        parts.push(cuboid(
            [0.7 * side - 0.01, 0.645, -0.36],
            [0.7 * side + 0.01, 0.725, 0.36],
        ));
    }
    let table = builder.mesh(joined("dining table", parts), wood);
    builder.scene.instances[table].transform = standing(CLEARANCE, x, z, 0.0);
    let chair = builder.shape(chair());
    let out = 0.5 * (1.0 - (TAU * time / 4.0).cos());
    for (dx, dz, turn) in [
        (-0.38, -0.55, 0.0),
        (0.38, -0.6, 0.1),
        (0.4, 0.55, PI),
        (-0.4 - 0.2 * out, 0.56 + 0.5 * out, PI - 0.7 * out),
    ] {
        builder.place(chair, beech, standing(CLEARANCE, x + dx, z + dz, turn));
    }
    let mut bowl = lathe(
        &[
            [0.0, 0.0],
            [0.06, 0.0],
            [0.07, 0.02],
            [0.13, 0.05],
            [0.17, 0.1],
            [0.15, 0.1],
            [0.115, 0.065],
            [0.06, 0.035],
            [0.0, 0.03],
        ],
        32,
    );
    bowl.name = "bowl".into();
    let top = 0.75 + 2.0 * CLEARANCE;
    let bowl = builder.mesh(bowl, white);
    builder.scene.instances[bowl].transform = standing(top, x, z, 0.0);
    let mut fruit = sphere(0.04, 10, 16);
    fruit.name = "fruit".into();
    let fruit = builder.shape(fruit);
    for i in 0..4 {
        let (sin, cos) = (FRAC_PI_2 * f64::from(i)).sin_cos();
        builder.place(fruit, orange, standing(top + 0.09, x + 0.06 * cos, z + 0.06 * sin, 0.0));
    }
}

/// A chair that faces +z, its seat 45 cm high.
fn chair() -> Mesh {
    let mut parts = vec![
        shifted(rounded_box(DVec3::new(0.22, 0.02, 0.21), 0.015, 2), [0.0, 0.43, 0.0]),
        shifted(rounded_box(DVec3::new(0.21, 0.05, 0.0125), 0.01, 2), [0.0, 0.89, -0.27]),
    ];
    for side in [-1.0, 1.0] {
        let at = |x: f64, y: f64, z: f64| DVec3::new(side * x, y, z);
        parts.push(rod(at(0.2, 0.0, 0.19), at(0.18, 0.42, 0.17), [0.015, 0.02], FACETS));
        parts.push(rod(at(0.2, 0.0, -0.21), at(0.18, 0.42, -0.17), [0.015, 0.02], FACETS));
        parts.push(rod(at(0.19, 0.44, -0.18), at(0.19, 0.9, -0.27), [0.018, 0.015], FACETS));
        parts.push(rod(at(0.19, 0.2, 0.18), at(0.19, 0.2, -0.19), [0.012; 2], FACETS));
        parts.push(rod(at(0.06, 0.44, -0.18), at(0.065, 0.86, -0.26), [0.012; 2], FACETS));
    }
    parts.push(rod(
        DVec3::new(0.0, 0.44, -0.18),
        DVec3::new(0.0, 0.86, -0.26),
        [0.012; 2],
        FACETS,
    ));
    parts.push(rod(
        DVec3::new(-0.19, 0.2, 0.0),
        DVec3::new(0.19, 0.2, 0.0),
        [0.012; 2],
        FACETS,
    ));
    joined("chair", parts)
}

/// Panels of 2 cm that reach into each other, and books.
fn bookcase(builder: &mut Builder, white: usize) {
    let (left, width, height, depth) = (3.5, 1.9, 2.15, 0.3);
    let boards = 6;
    let board_y = |i: u32| 0.06 + (height - 0.09) * i as f32 / (boards - 1) as f32;
    let mut parts = vec![
        cuboid([0.0, 0.0, 0.0], [0.02, height, depth]),
        cuboid([width - 0.02, 0.0, 0.0], [width, height, depth]),
        cuboid([0.01, 0.055, 0.003], [width - 0.01, height - 0.035, 0.023]),
        cuboid(
            [0.5 * width - 0.01, 0.06, 0.012],
            [0.5 * width + 0.01, height - 0.03, depth - 0.01],
        ),
    ];
    for i in 0..boards {
        let y = board_y(i);
        parts.push(cuboid(
            [0.008, y - 0.01, 0.009],
            [width - 0.008, y + 0.01, depth - 0.005],
        ));
    }
    let case = builder.mesh(joined("bookcase", parts), white);
    let at = standing(CLEARANCE, left, CLEARANCE, 0.0);
    builder.scene.instances[case].transform = at;
    let colors = [
        ("red book", [0.45, 0.08, 0.07]),
        ("green book", [0.1, 0.28, 0.14]),
        ("blue book", [0.08, 0.14, 0.36]),
        ("ochre book", [0.6, 0.42, 0.14]),
        ("ivory book", [0.7, 0.66, 0.55]),
    ]
    .map(|(name, color)| builder.material(Material::diffuse(name, color)));
    let book = builder.shape(book());
    let mut count = 0;
    for (shelf, half) in (0..boards - 1).flat_map(|shelf| [(shelf, 0), (shelf, 1)]) {
        let from = f64::from(half) * 0.5 * f64::from(width) + 0.03;
        let room = 0.42 + 0.4 * fraction(7 * shelf + 3 * half as u32 + 2);
        let mut x = from;
        while x < from + room {
            count += 1;
            let size = DVec3::new(
                0.024 + 0.026 * fraction(count),
                0.21 + 0.12 * fraction(3 * count + 1),
                0.17 + 0.06 * fraction(5 * count + 2),
            );
            let foot = DVec3::new(x, f64::from(board_y(shelf)) + 0.01 + CLEARANCE, 0.035);
            let local = DAffine3::from_scale_rotation_translation(size, DQuat::IDENTITY, foot);
            builder.place(book, colors[(fraction(2 * count) * 5.0) as usize], at * local);
            x += size.x + CLEARANCE;
        }
    }
}

/// A book that fills the unit cube, its round back at z = 1.
fn book() -> Mesh {
    let line: Vec<_> = (0..=6).map(|i| f64::from(i) / 6.0).collect();
    let back: Vec<_> = line.iter().map(|&x| [x, 0.1 * (2.0 * x - 1.0).powi(2) - 1.0]).collect();
    let front: Vec<_> = line.iter().map(|&x| [x, 0.0]).collect();
    let mut book = upright(band(&back, &front, [0.0, 1.0]));
    book.name = "book".into();
    book
}

/// Leaves are flattened spheres around the crown of a potted stem.
fn plant(builder: &mut Builder) {
    let green = builder.material(Material::diffuse("leaf", [0.13, 0.38, 0.08]));
    let brown = builder.material(Material::diffuse("bark", [0.25, 0.17, 0.1]));
    let clay = builder.material(Material::diffuse("terracotta", [0.58, 0.27, 0.15]));
    let at = standing(CLEARANCE, 0.87, 0.72, 0.0);
    let mut pot = lathe(
        &[
            [0.0, 0.0],
            [0.14, 0.0],
            [0.19, 0.3],
            [0.215, 0.3],
            [0.215, 0.35],
            [0.18, 0.35],
            [0.175, 0.29],
            [0.0, 0.29],
        ],
        32,
    );
    pot.name = "pot".into();
    let pot = builder.mesh(pot, clay);
    builder.scene.instances[pot].transform = at;
    let crown = DVec3::new(0.0, 1.25, 0.0);
    let leaves: Vec<_> = (0..48u32)
        .map(|i| {
            let up = 1.0 - 2.0 * (f64::from(i) + 0.5) / 48.0;
            let (sin, cos) = (TAU * fraction(i)).sin_cos();
            let around = (1.0 - up * up).sqrt() * (0.75 + 0.25 * fraction(3 * i));
            crown + DVec3::new(0.4 * around * cos, 0.52 * up, 0.4 * around * sin)
        })
        .collect();
    let mut stems = vec![rod(DVec3::new(0.0, 0.27, 0.0), crown, [0.03, 0.012], FACETS)];
    for leaf in leaves.iter().step_by(3) {
        let fork = DVec3::new(0.0, 0.4 + 0.55 * (leaf.y - 0.4), 0.0);
        stems.push(rod(fork, *leaf, [0.011, 0.01], 8));
    }
    let stem = builder.mesh(joined("stem", stems), brown);
    builder.scene.instances[stem].transform = at;
    let mut leaf = sphere(1.0, 6, 8);
    leaf.name = "leaf".into();
    let leaf = builder.shape(leaf);
    for (i, center) in (0..).zip(leaves) {
        let turn = DQuat::from_euler(EulerRot::YXZ, TAU * fraction(5 * i), fraction(7 * i) - 0.5, 0.0);
        let size = (0.095 + 0.04 * fraction(11 * i)) * DVec3::new(1.0, 0.45, 1.0);
        let local = DAffine3::from_scale_rotation_translation(size, turn, center);
        builder.place(leaf, green, at * local);
    }
}

/// Four leaves in zigzag: paper of 2 cm in frames of 3 cm.
fn folding_screen(builder: &mut Builder, wood: usize, white: usize) {
    let (width, height) = (0.5f32, 1.75f32);
    let mut bars = Vec::new();
    for x in [0.0, width - 0.03] {
        bars.push(cuboid([x, 0.0, -0.015], [x + 0.03, height, 0.015]));
    }
    for (y, thickness) in [(0.1, 0.04), (0.62, 0.02), (1.15, 0.02), (height - 0.06, 0.04)] {
        bars.push(cuboid([0.01, y, -0.0125], [width - 0.01, y + thickness, 0.0125]));
    }
    let frame = builder.shape(joined("screen frame", bars));
    let paper = builder.shape(joined(
        "screen paper",
        [cuboid([0.02, 0.12, -0.01], [width - 0.02, height - 0.04, 0.01])],
    ));
    let mut corner = DVec3::new(5.45, CLEARANCE, 0.75);
    for turn in [-0.5, 0.6, -0.6, 0.5f64] {
        let at = DAffine3::from_rotation_translation(DQuat::from_rotation_y(turn), corner);
        builder.place(frame, wood, at);
        builder.place(paper, white, at);
        let along = DVec3::new(turn.cos(), 0.0, -turn.sin());
        corner += (f64::from(width) + 0.01) * along;
    }
}

/// A cabinet on legs along the wall opposite the window, with a flat screen on it.
fn sideboard(builder: &mut Builder, wood: usize) {
    let black = builder.material(Material::diffuse("black", [0.04; 3]));
    let at = standing(CLEARANCE, 6.72, 3.1, -FRAC_PI_2);
    let mut parts = vec![
        shifted(rounded_box(DVec3::new(0.8, 0.2, 0.2), 0.01, 2), [0.0, 0.4, 0.0]),
        shifted(rounded_box(DVec3::new(0.38, 0.17, 0.01), 0.008, 1), [-0.395, 0.4, 0.2]),
        shifted(rounded_box(DVec3::new(0.38, 0.17, 0.01), 0.008, 1), [0.395, 0.4, 0.2]),
    ];
    for (x, z) in [(-0.7, -0.14), (-0.7, 0.14), (0.7, -0.14), (0.7, 0.14)] {
        parts.push(rod(
            DVec3::new(x, 0.0, z),
            DVec3::new(x, 0.21, z),
            [0.015, 0.02],
            FACETS,
        ));
    }
    let cabinet = builder.mesh(joined("sideboard", parts), wood);
    builder.scene.instances[cabinet].transform = at;
    let monitor = joined(
        "monitor",
        [
            shifted(rounded_box(DVec3::new(0.55, 0.32, 0.015), 0.01, 2), [0.0, 0.4, 0.0]),
            rod(
                DVec3::new(0.0, 0.01, 0.0),
                DVec3::new(0.0, 0.12, 0.0),
                [0.02; 2],
                FACETS,
            ),
            shifted(rounded_box(DVec3::new(0.18, 0.01, 0.1), 0.008, 1), [0.0, 0.01, 0.0]),
        ],
    );
    let monitor = builder.mesh(monitor, black);
    builder.scene.instances[monitor].transform = at * DAffine3::from_translation(DVec3::new(0.0, 0.6 + CLEARANCE, 0.0));
}

/// Three framed pictures over the sofa.
fn pictures(builder: &mut Builder, wood: usize) {
    let bar = |from: [f32; 2], to: [f32; 2], depth: f32| cuboid([from[0], from[1], 0.0], [to[0], to[1], depth]);
    let frame = joined(
        "picture frame",
        [
            bar([-0.24, -0.3], [-0.2, 0.3], 0.04),
            bar([0.2, -0.3], [0.24, 0.3], 0.04),
            shifted(bar([-0.21, -0.295], [0.21, -0.26], 0.035), [0.0, 0.0, 0.002]),
            shifted(bar([-0.21, 0.26], [0.21, 0.295], 0.035), [0.0, 0.0, 0.002]),
        ],
    );
    let frame = builder.shape(frame);
    let canvas = builder.shape(joined("canvas", [cuboid([-0.21, -0.27, 0.005], [0.21, 0.27, 0.025])]));
    for (x, name, color) in [
        (1.4, "blue canvas", [0.12, 0.3, 0.55]),
        (2.2, "yellow canvas", [0.75, 0.6, 0.15]),
        (3.0, "rose canvas", [0.65, 0.25, 0.25]),
    ] {
        let paint = builder.material(Material::diffuse(name, color));
        let at = standing(1.75, x, CLEARANCE, 0.0);
        builder.place(frame, wood, at);
        builder.place(canvas, paint, at);
    }
}

/// A closed door in its frame, in the wall that both cameras have at a side.
fn door(builder: &mut Builder, white: usize) {
    let wall = SIZE[2] - CLEARANCE as f32;
    let bar = |from: [f32; 2], to: [f32; 2], depth: f32| cuboid([from[0], from[1], wall - depth], [to[0], to[1], wall]);
    let low = CLEARANCE as f32;
    let mut parts = vec![
        bar([2.9, low], [2.98, 2.1], 0.05),
        bar([3.8, low], [3.88, 2.1], 0.05),
        shifted(bar([2.89, 2.09], [3.89, 2.17], 0.05), [0.0, 0.0, -0.004]),
        shifted(bar([2.97, 3.0 * low], [3.81, 2.095], 0.03), [0.0, 0.0, -0.008]),
    ];
    let handle = |x, z| DVec3::new(x, 1.05, SIZE[2] as f64 - z);
    parts.push(rod(handle(3.72, 0.03), handle(3.72, 0.1), [0.012; 2], FACETS));
    parts.push(rod(handle(3.735, 0.09), handle(3.6, 0.09), [0.011; 2], FACETS));
    builder.mesh(joined("door", parts), white);
}

/// A lamp over the dining table: a bulb under a dish, flat enough for its inside to be seen from the whole room.
fn pendant(builder: &mut Builder, white: usize) {
    let (x, z) = (4.9, 3.3);
    let dish = lathe(
        &[
            [0.0, 0.06],
            [0.05, 0.06],
            [0.14, 0.045],
            [0.29, -0.02],
            [0.3, 0.0],
            [0.15, 0.07],
            [0.05, 0.09],
            [0.0, 0.09],
        ],
        32,
    );
    let cord = f64::from(SIZE[1]) - 1.7 - CLEARANCE;
    let rose = lathe(
        &[[0.0, cord - 0.04], [0.05, cord - 0.04], [0.05, cord], [0.0, cord]],
        16,
    );
    let line = rod(0.08 * DVec3::Y, (cord - 0.02) * DVec3::Y, [0.01; 2], 8);
    let lamp = builder.mesh(joined("pendant lamp", [dish, rose, line]), white);
    builder.scene.instances[lamp].transform = standing(1.7, x, z, 0.0);
    builder.scene.lights.push(Light {
        name: "bulb".into(),
        ..Light::point(DVec3::new(x, 1.7, z), 10.0, [1.0, 0.82, 0.58])
    });
}

/// Lights nothing but the window and a rim around it: 20 W/m² at its middle.
fn street_lamp(builder: &mut Builder) {
    let [[y0, z0], [y1, z1]] = WINDOW.map(|corner| corner.map(f64::from));
    let middle = DVec3::new(0.0, 0.5 * (y0 + y1), 0.5 * (z0 + z1));
    let direction = DVec3::new(1.0, -0.66, -0.22).normalize();
    let distance = 15.0;
    let radius = 0.5 * DVec3::new(0.0, y1 - y0, z1 - z0).length();
    let angle = (radius / distance).atan();
    builder.scene.lights.push(Light {
        name: "street lamp".into(),
        kind: LightKind::Spot {
            position: middle - distance * direction,
            direction,
            inner_angle: angle,
            outer_angle: 1.05 * angle,
            radius: 0.0,
        },
        color: [0.8, 0.9, 1.0],
        intensity: (20.0 * distance * distance) as f32,
    });
}
