//! An open court under a sky.

use super::solids::sphere;
use super::{Builder, EnvironmentImage, Light, LightKind, Material, Scene, cuboid};
use glam::{DAffine3, DQuat, DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Columns and rows of the sky's image.
const SKY: [u32; 2] = [128, 64];

/// A court of 8 × 8 m between a red and a white wall, with a block, a post, a table and a chrome ball, lit by nothing but a hazy
/// evening sky. The block turns, once in eight seconds.
pub fn courtyard(time: f64) -> Scene {
    let mut builder = Builder::default();
    let stone = builder.material(Material::diffuse("stone", [0.55, 0.52, 0.48]));
    let white = builder.material(Material::diffuse("white", [0.75; 3]));
    let red = builder.material(Material::diffuse("red", [0.6, 0.12, 0.08]));
    let wood = builder.material(Material::diffuse("wood", [0.45, 0.3, 0.18]));
    let chrome = builder.material(Material {
        metallic: 1.0,
        roughness: 0.0,
        ..Material::diffuse("chrome", [0.9; 3])
    });
    let (half, height) = (4.0, 2.6);
    builder.quad(
        "ground",
        [
            [-half, 0.0, half],
            [half, 0.0, half],
            [half, 0.0, -half],
            [-half, 0.0, -half],
        ],
        stone,
    );
    builder.mesh(cuboid([-half - 0.2, 0.0, -half], [-half, height, half]), red);
    builder.mesh(cuboid([-half - 0.2, 0.0, -half - 0.2], [half, height, -half]), white);
    builder.mesh(cuboid([1.8, 0.0, -2.6], [2.1, 2.4, -2.3]), white);
    let block = builder.mesh(cuboid([-0.7, 0.0, -0.7], [0.7, 1.4, 0.7]), white);
    builder.scene.instances[block].name = "block".into();
    builder.scene.instances[block].transform = DAffine3::from_rotation_translation(
        DQuat::from_rotation_y(0.4 + TAU * time / 8.0),
        DVec3::new(-1.6, 0.0, -1.2),
    );
    builder.mesh(cuboid([0.2, 0.72, 0.3], [2.2, 0.8, 1.5]), wood);
    for (x, z) in [(0.2, 0.3), (2.1, 0.3), (0.2, 1.4), (2.1, 1.4)] {
        builder.mesh(cuboid([x, 0.0, z], [x + 0.1, 0.72, z + 0.1]), wood);
    }
    let ball = builder.mesh(sphere(0.5, 32, 64), chrome);
    builder.scene.instances[ball].transform = DAffine3::from_translation(DVec3::new(-0.3, 0.5, 1.2));
    builder.scene.environments.push(evening());
    builder.scene.lights.push(Light {
        name: "sky".into(),
        kind: LightKind::Environment {
            image: Some(0),
            rotation: 0.0,
        },
        color: [1.0; 3],
        intensity: 1.0,
    });
    builder.look(
        "camera",
        DVec3::new(2.6, 2.3, 5.6),
        DVec3::new(-0.5, 0.7, -0.6),
        DVec3::Y,
        50f64.to_radians(),
    );
    builder.scene
}

/// Blue above, pale at the horizon, brown below, and a glow half way up in front and to the right.
fn evening() -> EnvironmentImage {
    let [width, height] = SKY;
    let glow = DVec3::new(0.75, 0.55, 0.35).normalize();
    let texel = |column: u32, row: u32| {
        let uv =
            (DVec2::new(f64::from(column), f64::from(row)) + 0.5) / DVec2::new(f64::from(width), f64::from(height));
        let direction = EnvironmentImage::direction_at(uv, 0.0);
        let up = direction.y;
        if up < 0.0 {
            return [0.1, 0.08, 0.06];
        }
        let off = glow.dot(direction).clamp(-1.0, 1.0).acos() / (0.06 * PI);
        let pale = (1.0 - up).powi(3);
        let sky = DVec3::new(0.25, 0.45, 0.9).lerp(DVec3::new(0.95, 0.85, 0.75), pale);
        (sky + DVec3::new(30.0, 22.0, 13.0) * (-off * off).exp())
            .as_vec3()
            .to_array()
    };
    let texels = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
    EnvironmentImage {
        name: "evening".into(),
        width,
        height,
        rgb: texels.map(|(column, row)| texel(column, row)).collect(),
    }
}
