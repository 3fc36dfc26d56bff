//! Light gathered by metal, glass and water.

use super::solids::{heights, lathe, sphere};
use super::{Builder, Light, LightKind, Material, Scene, cuboid, inward_box};
use glam::{DAffine3, DVec3};
use std::f64::consts::TAU;

/// A floor before a wall, 6 m wide.
fn corner(builder: &mut Builder, material: usize) {
    let (w, h, near, far) = (3.0, 4.0, 3.0, -2.0);
    builder.quad_strip(
        "floor and wall",
        vec![
            [[-w, 0.0, near], [w, 0.0, near], [w, 0.0, far], [-w, 0.0, far]],
            [[-w, 0.0, far], [w, 0.0, far], [w, h, far], [-w, h, far]],
        ],
        material,
    );
}

/// Radius of all lamps here, metres. A point's light behind glass could be checked with no path tracer.
const LAMP_RADIUS: f64 = 0.08;

fn bulb(position: DVec3, intensity: f32) -> Light {
    Light {
        name: "bulb".into(),
        kind: LightKind::Point {
            position,
            radius: LAMP_RADIUS,
        },
        color: [1.0, 0.93, 0.82],
        intensity,
    }
}

fn metal(name: &str, color: [f32; 3], roughness: f32) -> Material {
    Material {
        name: name.into(),
        metallic: 1.0,
        roughness,
        ..Material::diffuse(name, color)
    }
}

fn clear(name: &str, color: [f32; 3], index_of_refraction: f32) -> Material {
    Material {
        name: name.into(),
        transmission: 1.0,
        roughness: 0.0,
        index_of_refraction,
        ..Material::diffuse(name, color)
    }
}

/// A ball of glass over the floor before a wall, under a bulb. It sinks and rises, once in four seconds.
pub fn glass_sphere(time: f64) -> Scene {
    let mut builder = Builder::default();
    let white = builder.material(Material::diffuse("white", [0.7; 3]));
    let glass = builder.material(clear("glass", [1.0; 3], 1.5));
    corner(&mut builder, white);
    let mut ball = sphere(0.6, 48, 96);
    ball.name = "ball".into();
    let ball = builder.mesh(ball, glass);
    let height = 0.9 - 0.2 * (1.0 - (TAU * time / 4.0).cos());
    builder.scene.instances[ball].transform = DAffine3::from_translation(DVec3::new(0.0, height, 0.0));
    builder.scene.lights.push(bulb(DVec3::new(-1.2, 3.4, 0.8), 30.0));
    builder.look(
        "camera",
        DVec3::new(0.6, 2.2, 4.4),
        DVec3::new(0.3, 0.5, 0.0),
        DVec3::Y,
        45f64.to_radians(),
    );
    builder.scene
}

/// A ring of polished brass with a post inside, whose shadow cuts the caustic. The post goes around, once in four seconds.
pub fn ring_occluder(time: f64) -> Scene {
    let mut builder = Builder::default();
    let white = builder.material(Material::diffuse("white", [0.7; 3]));
    let blue = builder.material(Material::diffuse("blue", [0.2, 0.3, 0.6]));
    let brass = builder.material(metal("brass", [0.9, 0.7, 0.35], 0.0));
    corner(&mut builder, white);
    let mut ring = lathe(&[[1.0, 0.0], [1.05, 0.0], [1.05, 0.5], [1.0, 0.5], [1.0, 0.0]], 128);
    ring.name = "ring".into();
    builder.mesh(ring, brass);
    let mut post = cuboid([-0.08, 0.0, -0.08], [0.08, 0.4, 0.08]);
    post.name = "post".into();
    let post = builder.mesh(post, blue);
    let (sin, cos) = (TAU * (time / 4.0 + 0.1)).sin_cos();
    builder.scene.instances[post].transform = DAffine3::from_translation(DVec3::new(0.45 * cos, 0.0, 0.45 * sin));
    builder.scene.lights.push(bulb(DVec3::new(2.2, 2.0, 0.6), 25.0));
    builder.look(
        "camera",
        DVec3::new(-0.4, 3.2, 3.2),
        DVec3::new(0.0, 0.1, 0.0),
        DVec3::Y,
        45f64.to_radians(),
    );
    builder.scene
}

/// A dimpled mirror that leans on the floor and throws a pattern onto the wall. The bulb sways, once in four seconds.
pub fn dimpled_mirror(time: f64) -> Scene {
    let mut builder = Builder::default();
    let white = builder.material(Material::diffuse("white", [0.7; 3]));
    let mirror = builder.material(metal("mirror", [0.95; 3], 0.0));
    corner(&mut builder, white);
    let dimples = |x: f64, z: f64| 0.012 * (TAU * x / 0.5).cos() * (TAU * z / 0.5).cos();
    let mut plate = heights([-0.75, 0.75], [-0.75, 0.75], 96, dimples);
    plate.name = "plate".into();
    let plate = builder.mesh(plate, mirror);
    builder.scene.instances[plate].transform =
        DAffine3::from_translation(DVec3::new(0.0, 0.3, 0.9)) * DAffine3::from_rotation_x(-0.25);
    let sway = 0.5 * (TAU * time / 4.0).sin();
    builder.scene.lights.push(bulb(DVec3::new(sway, 2.6, 2.2), 30.0));
    builder.look(
        "camera",
        DVec3::new(1.2, 2.4, 4.6),
        DVec3::new(0.0, 1.2, -0.6),
        DVec3::Y,
        50f64.to_radians(),
    );
    builder.scene
}

/// Length of the waves of [`water`], metres: they repeat after it along x and z.
const WAVE: f64 = 0.8;

/// A pool of 2 × 2 m whose floor is lit by what the waves refract, and by nothing else. The waves run on, once over their
/// length in four seconds.
pub fn water(time: f64) -> Scene {
    let mut builder = Builder::default();
    let tiles = builder.material(Material::diffuse("tiles", [0.6, 0.75, 0.75]));
    let stone = builder.material(Material::diffuse("stone", [0.5, 0.45, 0.4]));
    let water = builder.material(clear("water", [0.95, 1.0, 1.0], 1.33));
    let (half, rim, top, bottom) = (1.0, 0.9, 0.1, -0.8);
    let mut inside = inward_box([-half, bottom, -half], [half, top, half]);
    // Open above: the fifth face is the lid.
    inside.remove(4);
    builder.quad_strip("pool", inside, tiles);
    // The rim is wide enough to hide how far the waves reach.
    let out = half + rim;
    for [x0, x1, z0, z1] in [
        [-out, out, -out, -half],
        [-out, out, half, out],
        [-out, -half, -half, half],
        [half, out, -half, half],
    ] {
        let mut slab = cuboid([x0, bottom, z0], [x1, top, z1]);
        slab.name = "rim".into();
        builder.mesh(slab, stone);
    }
    let waves = |x: f64, z: f64| {
        let wave = |i: f64, j: f64, height: f64, at: f64| height * (TAU * (i * x + j * z) / WAVE + at).sin();
        wave(1.0, 0.0, 0.008, 0.0)
            + wave(1.0, 1.0, 0.006, 1.3)
            + wave(1.0, -2.0, 0.003, 2.1)
            + wave(2.0, 1.0, 0.003, 4.0)
    };
    let reach = f64::from(half) + WAVE;
    let mut surface = heights([-reach, reach], [-reach, reach], 112, waves);
    surface.name = "water".into();
    let surface = builder.mesh(surface, water);
    let run = WAVE * ((time / 4.0).rem_euclid(1.0) - 0.5);
    builder.scene.instances[surface].transform = DAffine3::from_translation(DVec3::new(run, 0.0, 0.0));
    builder.scene.lights.push(Light {
        name: "spot".into(),
        kind: LightKind::Spot {
            position: DVec3::new(-0.6, 3.5, -0.4),
            direction: DVec3::new(0.15, -1.0, 0.1).normalize(),
            inner_angle: 20f64.to_radians(),
            outer_angle: 30f64.to_radians(),
            radius: LAMP_RADIUS,
        },
        color: [1.0, 0.97, 0.9],
        intensity: 60.0,
    });
    builder.look(
        "camera",
        DVec3::new(0.3, 2.6, 2.6),
        DVec3::new(0.0, -0.5, 0.0),
        DVec3::Y,
        50f64.to_radians(),
    );
    builder.scene
}
