//! What shadows fall on, and what casts them.

use lightfall::glam::{DAffine3, DVec3};
use lightfall::scene::{Camera, Instance, Light, LightKind, Material, Mesh, Projection, Scene};
use std::f64::consts::TAU;

/// Adds a quad, seen and shading from both sides.
fn quad(scene: &mut Scene, corners: [DVec3; 4]) {
    if scene.materials.is_empty() {
        scene.materials.push(Material::diffuse("grey", [0.5; 3]));
    }
    scene.meshes.push(Mesh {
        positions: corners.map(|c| c.as_vec3().to_array()).to_vec(),
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Mesh::default()
    });
    scene.instances.push(Instance::new(scene.meshes.len() - 1, 0));
}

/// A horizontal quad between two corners.
fn level(scene: &mut Scene, y: f64, [x0, z0]: [f64; 2], [x1, z1]: [f64; 2]) {
    let at = |x, z| DVec3::new(x, y, z);
    quad(scene, [at(x0, z1), at(x1, z1), at(x1, z0), at(x0, z0)]);
}

/// A box without a bottom between two corners.
fn block(scene: &mut Scene, low: [f64; 3], high: [f64; 3]) {
    let ([x0, y0, z0], [x1, y1, z1]) = (low, high);
    level(scene, y1, [x0, z0], [x1, z1]);
    let ring = [[x0, z0], [x1, z0], [x1, z1], [x0, z1]];
    for i in 0..4 {
        let ([ax, az], [bx, bz]) = (ring[i], ring[(i + 1) % 4]);
        let at = |x, y, z| DVec3::new(x, y, z);
        quad(scene, [at(bx, y0, bz), at(ax, y0, az), at(ax, y1, az), at(bx, y1, bz)]);
    }
}

fn light(kind: LightKind) -> Light {
    Light {
        kind,
        ..Light::point(DVec3::ZERO, 1.0, [1.0; 3])
    }
}

fn bulb(position: [f64; 3], radius: f64) -> Light {
    let position = DVec3::from(position);
    light(LightKind::Point { position, radius })
}

/// Parallel light from a disc that subtends twice this angle.
fn sun(direction: [f64; 3], angle: f64) -> Light {
    let direction = DVec3::from(direction).normalize();
    light(LightKind::Directional { direction, angle })
}

fn spot(position: [f64; 3], direction: [f64; 3], radius: f64) -> Light {
    light(LightKind::Spot {
        position: DVec3::from(position),
        direction: DVec3::from(direction).normalize(),
        inner_angle: 0.4,
        outer_angle: 0.6,
        radius,
    })
}

/// Straight down, parallel, at a square of `2 * half`, from `height` above the floor.
fn from_above(height: f64, half: f64) -> Camera {
    Camera {
        name: String::new(),
        transform: DAffine3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y, height * DVec3::Y),
        projection: Projection::Orthographic { half_height: half },
    }
}

fn looking(from: [f64; 3], to: [f64; 3], fov_y: f64) -> Camera {
    let (from, to) = (DVec3::from(from), DVec3::from(to));
    let back = (from - to).normalize();
    let right = DVec3::Y.cross(back).normalize();
    Camera {
        name: String::new(),
        transform: DAffine3::from_cols(right, back.cross(right), back, from),
        projection: Projection::Perspective { fov_y },
    }
}

/// A square lamp, a plate over half of the floor, and what the penumbra of the plate's edge is seen by.
#[derive(Clone, Copy)]
pub(crate) struct Edge {
    /// Side of the lamp.
    pub(crate) side: f64,
    /// Of the lamp over the floor.
    pub(crate) height: f64,
    /// Of the plate over the floor.
    pub(crate) gap: f64,
}

impl Edge {
    /// Of the penumbra, in which visibility rises linearly from 0 to 1.
    pub(crate) fn width(&self) -> f64 {
        self.side * self.gap / (self.height - self.gap)
    }

    /// Seen from below the plate: a square of so many widths, the shadow's edge in its middle.
    pub(crate) fn scene(&self, widths: f64) -> Scene {
        let mut scene = Scene::default();
        let reach = 3.0 * self.height;
        level(&mut scene, 0.0, [-reach, -reach], [reach, reach]);
        level(&mut scene, self.gap, [-0.9 * reach, -0.9 * reach], [0.0, 0.9 * reach]);
        let half = 0.5 * self.side;
        scene.lights.push(light(LightKind::Rectangle {
            center: DVec3::new(0.0, self.height, 0.0),
            half_u: half * DVec3::X,
            half_v: half * DVec3::Z,
        }));
        let half = 0.5 * widths * self.width();
        scene.cameras.push(from_above(0.5 * self.gap, half));
        scene
    }

    /// Of a pixel's column, in the same view.
    pub(crate) fn x(&self, widths: f64, size: u32, column: u32) -> f64 {
        ((f64::from(column) + 0.5) / f64::from(size) - 0.5) * widths * self.width()
    }
}

/// A square lamp twice as high as slats whose penumbrae touch, and beside them a plate: seen from below where everything
/// is penumbra, at 0, lit, at 1.6, or dark, at −1.6.
pub(crate) fn slats(beside: f64) -> Scene {
    let mut scene = Scene::default();
    level(&mut scene, 0.0, [-3.0, -3.0], [3.0, 3.0]);
    // Halfway up: shadows are twice as large, and penumbrae as wide as the lamp, 0.05.
    for i in 0..16 {
        let at = 0.05 * f64::from(i) - 0.4;
        level(&mut scene, 1.0, [at, -1.0], [at + 0.025, 1.0]);
    }
    level(&mut scene, 1.0, [-1.3, -1.0], [-0.5, 1.0]);
    scene.lights.push(light(LightKind::Rectangle {
        center: DVec3::new(0.0, 2.0, 0.0),
        half_u: 0.025 * DVec3::X,
        half_v: 0.025 * DVec3::Z,
    }));
    let mut camera = from_above(0.5, 0.5);
    camera.transform.translation.x = beside;
    scene.cameras.push(camera);
    scene
}

/// The slats under some lamps beside each other.
pub(crate) struct Shaded {
    pub(crate) what: String,
    pub(crate) scene: Scene,
    /// Everywhere; else nowhere.
    pub(crate) is_penumbra: bool,
}

pub(crate) fn shaded() -> Vec<Shaded> {
    let views = [("all", 0.0), ("none", 1.6)];
    let counts = [1, 4, 16];
    let all = counts.iter().flat_map(|&count| views.map(|view| (count, view)));
    all.map(|(count, (share, beside))| {
        let mut scene = slats(beside);
        let lamp = scene.lights.remove(0);
        for i in 0..count {
            let LightKind::Rectangle { center, half_u, half_v } = lamp.kind else {
                continue;
            };
            scene.lights.push(light(LightKind::Rectangle {
                center: center + 0.1 * f64::from(i) / f64::from(count) * DVec3::Z,
                half_u,
                half_v,
            }));
        }
        Shaded {
            what: format!("{count}, {share}"),
            scene,
            is_penumbra: beside == 0.0,
        }
    })
    .collect()
}

/// A scene and what it is a picture of.
pub(crate) struct Named {
    pub(crate) name: &'static str,
    pub(crate) scene: Scene,
}

fn on_floor(name: &'static str, camera: Camera, lamp: Light, add: impl FnOnce(&mut Scene)) -> Named {
    let mut scene = Scene::default();
    level(&mut scene, 0.0, [-2.0, -2.0], [2.0, 2.0]);
    add(&mut scene);
    scene.lights.push(lamp);
    scene.cameras.push(camera);
    Named { name, scene }
}

/// Floors of 4 × 4 m with something on or over them.
pub(crate) fn all() -> Vec<Named> {
    let camera = || looking([0.0, 1.6, 2.6], [0.0, 0.1, 0.0], 0.8);
    vec![
        on_floor("plates", camera(), bulb([0.9, 2.0, 0.3], 0.15), |scene| {
            level(scene, 0.6, [-0.9, -0.6], [-0.1, 0.1]);
            quad(
                scene,
                [[0.3, 0.0, -0.3], [0.3, 0.0, 0.3], [0.3, 0.7, 0.3], [0.3, 0.7, -0.3]].map(DVec3::from),
            );
        }),
        on_floor("depths", camera(), bulb([0.3, 2.5, 0.3], 0.2), |scene| {
            // Bars across each other at three heights.
            level(scene, 0.2, [-0.9, -0.5], [0.9, -0.4]);
            level(scene, 0.7, [-0.15, -0.9], [0.05, 0.9]);
            level(scene, 1.4, [-0.3, -0.6], [0.5, -0.3]);
        }),
        on_floor("poles", camera(), bulb([-1.2, 1.8, 0.4], 0.1), |scene| {
            for i in 0..7 {
                let x = -0.9 + 0.3 * f64::from(i);
                let half = 0.01 + 0.004 * f64::from(i);
                block(scene, [x - half, 0.0, -0.3 - half], [x + half, 0.9, -0.3 + half]);
            }
        }),
        on_floor("contact", camera(), bulb([0.8, 1.6, 0.9], 0.2), |scene| {
            block(scene, [-0.7, 0.0, -0.3], [-0.1, 0.5, 0.3]);
            block(scene, [0.3, 0.0, -0.6], [0.7, 0.04, 0.3]);
        }),
        on_floor("grille", camera(), bulb([0.2, 2.4, -0.2], 0.08), |scene| {
            for i in 0..13 {
                let at = -0.9 + 0.15 * f64::from(i);
                level(scene, 0.9, [at - 0.03, -0.9], [at + 0.03, 0.9]);
                level(scene, 0.92, [-0.9, at - 0.03], [0.9, at + 0.03]);
            }
        }),
        on_floor("grazing", camera(), bulb([-1.8, 0.15, 0.2], 0.05), |scene| {
            block(scene, [-0.5, 0.0, -0.5], [-0.3, 0.1, 0.6]);
            block(scene, [0.4, 0.0, -0.9], [0.6, 0.3, -0.2]);
        }),
        on_floor("lampshade", camera(), bulb([0.0, 0.75, 0.0], 0.05), |scene| {
            let sides = 24;
            let rim = |i: u32, radius: f64, y: f64| {
                let (s, c) = (TAU * f64::from(i % sides) / f64::from(sides)).sin_cos();
                DVec3::new(radius * c, y, radius * s)
            };
            for i in 0..sides {
                let (a, b) = (rim(i, 0.3, 0.6), rim(i + 1, 0.3, 0.6));
                let (c, d) = (rim(i + 1, 0.18, 0.9), rim(i, 0.18, 0.9));
                quad(scene, [a, b, c, d]);
            }
            block(scene, [0.5, 0.0, -0.4], [0.7, 0.35, -0.2]);
        }),
        on_floor("sun", camera(), sun([0.5, -1.0, -0.35], 0.04), |scene| {
            block(scene, [-0.9, 0.0, -0.4], [-0.6, 1.0, -0.1]);
            // A roof of laths.
            for i in 0..8 {
                let x = -0.2 + 0.12 * f64::from(i);
                level(scene, 0.8, [x, -0.6], [x + 0.05, 0.5]);
            }
        }),
        on_floor(
            "spot",
            camera(),
            spot([1.2, 2.2, 0.8], [-1.2, -2.2, -0.8], 0.12),
            |scene| {
                block(scene, [-0.2, 0.0, -0.2], [0.1, 0.6, 0.1]);
                level(scene, 0.9, [0.3, -0.5], [0.5, 0.9]);
            },
        ),
    ]
}
