//! Procedural scenes for docs, tests and measurements. Each is a function of time, in seconds; lengths are in metres.

mod caustics;
mod colonnade;
mod courtyard;
mod living_room;
mod nave;
mod solids;

pub use caustics::{dimpled_mirror, glass_sphere, ring_occluder, water};
pub use colonnade::colonnade;
pub use courtyard::courtyard;
pub use living_room::living_room;
pub use nave::nave;

use super::{Camera, EnvironmentImage, Instance, Light, LightKind, Material, Mesh, Projection, Scene};
use glam::{DAffine3, DVec3, Vec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Names accepted by [`by_name`], in the order of this list.
pub const NAMES: [&str; 16] = [
    "cornell",
    "cornell-spot",
    "bumpy-floor",
    "plane",
    "furnace",
    "two-rooms",
    "pillars",
    "penumbra",
    "living-room",
    "colonnade",
    "nave",
    "glass-sphere",
    "ring-occluder",
    "dimpled-mirror",
    "water",
    "courtyard",
];

/// The sample of this name at `time`, or `None` if there is none.
pub fn by_name(name: &str, time: f64) -> Option<Scene> {
    Some(match name {
        "cornell" => cornell(time),
        "cornell-spot" => cornell_spot(time),
        "bumpy-floor" => bumpy_floor([80, 81], time),
        "plane" => plane(),
        "furnace" => furnace(0.5, 1.0),
        "two-rooms" => two_rooms(time),
        "pillars" => pillars(time),
        "penumbra" => penumbra(time),
        "living-room" => living_room(time),
        "colonnade" => colonnade(time),
        "nave" => nave(time),
        "glass-sphere" => glass_sphere(time),
        "ring-occluder" => ring_occluder(time),
        "dimpled-mirror" => dimpled_mirror(time),
        "water" => water(time),
        "courtyard" => courtyard(time),
        _ => return None,
    })
}

/// The Cornell box (measured geometry, one unit a metre at ten times its size) with a bulb under its ceiling; red
/// stands left, green right, as the camera sees it. The short block slides back and forth, once in four seconds.
pub fn cornell(time: f64) -> Scene {
    let mut scene = cornell_walls(time);
    scene.lights.push(Light {
        name: "bulb".into(),
        ..Light::point(DVec3::new(2.78, 5.0, 2.795), 20.0, [1.0, 0.85, 0.6])
    });
    scene
}

/// The Cornell box lit by a spot that sways.
pub fn cornell_spot(time: f64) -> Scene {
    let mut scene = cornell_walls(time);
    scene.lights.push(Light {
        name: "spot".into(),
        kind: LightKind::Spot {
            position: DVec3::new(2.78, 5.4, 2.795),
            direction: DVec3::new(0.3 * (TAU * time / 4.0).sin(), -1.0, 0.1),
            inner_angle: 20f64.to_radians(),
            outer_angle: 32f64.to_radians(),
            radius: 0.0,
        },
        color: [1.0, 0.95, 0.85],
        intensity: 60.0,
    });
    scene
}

/// The Cornell box with a bulb, and a floor of so many cells along x and z, 28 triangles and two for each: with more than a
/// few it has bumps of 10 cm. `[3, 1]`, `[80, 81]` and `[258, 258]` make 34, 12 988 and 133 156 triangles, by name the second.
pub fn bumpy_floor([columns, rows]: [u32; 2], time: f64) -> Scene {
    let mut scene = cornell(time);
    let floor = &mut scene.meshes[0];
    let (width, depth) = (floor.positions[2][0], floor.positions[2][2]);
    let (columns, rows) = (columns.max(1), rows.max(1));
    let wave = |along: f32| (6.0 * std::f32::consts::PI * along).sin().powi(2);
    let part = |i: u32, count: u32| i as f32 / count as f32;
    *floor = Mesh {
        name: floor.name.clone(),
        ..Mesh::default()
    };
    for (row, column) in (0..=rows).flat_map(|row| (0..=columns).map(move |column| (row, column))) {
        let (x, z) = (part(column, columns), part(row, rows));
        floor.positions.push([x * width, 0.1 * wave(x) * wave(z), z * depth]);
    }
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let first = row * (columns + 1) + column;
        let above = first + columns + 1;
        floor
            .indices
            .extend([first, above, above + 1, first, above + 1, first + 1]);
    }
    scene
}

/// A 200 m square plane of reflectance 0.5, seen from 2 m above, a 10 W/sr bulb 1 m above its centre.
pub fn plane() -> Scene {
    let mut builder = Builder::default();
    let grey = builder.material(Material::diffuse("grey", [0.5; 3]));
    builder.quad(
        "plane",
        [
            [-100.0, 0.0, 100.0],
            [100.0, 0.0, 100.0],
            [100.0, 0.0, -100.0],
            [-100.0, 0.0, -100.0],
        ],
        grey,
    );
    builder.scene.lights.push(Light::point(DVec3::Y, 10.0, [1.0; 3]));
    builder.look(
        "camera",
        DVec3::new(0.0, 2.0, 0.0),
        DVec3::ZERO,
        DVec3::NEG_Z,
        FRAC_PI_2,
    );
    builder.scene
}

/// A closed unit sphere seen from inside, of this reflectance and emitted radiance: everywhere L = L_e / (1 − ρ).
pub fn furnace(reflectance: f32, emitted_radiance: f32) -> Scene {
    let mut builder = Builder::default();
    let wall = builder.material(Material {
        emission: [emitted_radiance; 3],
        ..Material::diffuse("wall", [reflectance; 3])
    });
    builder.mesh(inward_sphere("furnace", 24, 48), wall);
    builder.look("camera", DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, FRAC_PI_2);
    builder.scene
}

/// Thickness of the door in [`two_rooms`], metres.
pub const DOOR_THICKNESS: f64 = 0.05;

/// Two rooms of 4 × 3 × 4 m with a doorway between them, a bulb in the near one (z < 0), the camera in the far one.
/// The door, [`DOOR_THICKNESS`] thick and wider than its frame, is closed at time 0 and open from 1 to 3; the cycle
/// lasts four seconds.
pub fn two_rooms(time: f64) -> Scene {
    let mut builder = Builder::default();
    let white = builder.material(Material::diffuse("white", [0.73; 3]));
    let orange = builder.material(Material::diffuse("orange", [0.7, 0.4, 0.15]));
    let wood = builder.material(Material::diffuse("wood", [0.45, 0.3, 0.2]));
    let half_wall = 0.1f32;
    for (name, near, far) in [
        ("near room", -4.0 - half_wall, -half_wall),
        ("far room", half_wall, 4.0 + half_wall),
    ] {
        builder.quad_strip(name, room_shell(near, far, name == "near room"), white);
    }
    builder.quad_strip("wall between", dividing_wall(half_wall), orange);
    let openness = openness(time);
    let mut door = cuboid([-0.55, 0.0, -0.04], [0.55, 2.15, -0.04 + DOOR_THICKNESS as f32]);
    door.name = "door".into();
    let wall_face = -f64::from(half_wall);
    let door = builder.mesh(door, wood);
    builder.scene.instances[door].transform = DAffine3::from_translation(DVec3::new(1.2 * openness, 0.0, wall_face));
    builder.scene.lights.push(Light {
        name: "bulb".into(),
        ..Light::point(DVec3::new(-0.8, 2.4, -2.2), 20.0, [1.0, 0.9, 0.75])
    });
    builder.look(
        "far room",
        DVec3::new(1.6, 1.8, 3.8),
        DVec3::new(-0.2, 0.4, 1.2),
        DVec3::Y,
        70f64.to_radians(),
    );
    builder.scene
}

/// A hall of 12 × 4 × 8 m with two rows of three pillars and a partition that leaves a passage to an alcove: no place sees
/// all of it. A bulb hangs in the middle; a crate slides along the hall and back, once in four seconds.
pub fn pillars(time: f64) -> Scene {
    let mut builder = Builder::default();
    let white = builder.material(Material::diffuse("white", [0.73; 3]));
    let sandstone = builder.material(Material::diffuse("sandstone", [0.6, 0.5, 0.35]));
    let blue = builder.material(Material::diffuse("blue", [0.1, 0.2, 0.6]));
    builder.quad_strip("hall", inward_box([-6.0, 0.0, -4.0], [6.0, 4.0, 4.0]), white);
    for x in [-3.5, -0.5, 2.5] {
        for z in [-1.6, 1.6] {
            let mut pillar = cuboid([x - 0.3, 0.0, z - 0.3], [x + 0.3, 4.0, z + 0.3]);
            pillar.name = "pillar".into();
            builder.mesh(pillar, sandstone);
        }
    }
    let mut partition = cuboid([4.0, 0.0, -4.0], [4.2, 4.0, 2.5]);
    partition.name = "partition".into();
    builder.mesh(partition, blue);
    let mut crate_box = cuboid([-0.5, 0.0, -0.5], [0.5, 1.0, 0.5]);
    crate_box.name = "crate".into();
    let crate_box = builder.mesh(crate_box, sandstone);
    let along = -4.5 + 7.0 * 0.5 * (1.0 - (TAU * time / 4.0).cos());
    builder.scene.instances[crate_box].transform = DAffine3::from_translation(DVec3::new(along, 0.0, 0.0));
    builder.scene.lights.push(Light {
        name: "bulb".into(),
        ..Light::point(DVec3::new(1.0, 3.2, 0.2), 40.0, [1.0, 0.92, 0.8])
    });
    builder.look(
        "hall",
        DVec3::new(-5.6, 2.2, 3.4),
        DVec3::new(1.0, 1.2, -0.6),
        DVec3::Y,
        65f64.to_radians(),
    );
    builder.scene
}

/// Radius of the lamp in [`penumbra`], metres.
pub const LAMP_RADIUS: f64 = 0.2;

/// A post that stands on a 6 m square floor and a slab that hovers over it, under a spherical lamp of [`LAMP_RADIUS`]: the
/// post's shadow is sharp at its foot and widens away from it. The slab rises and sinks, once in four seconds.
pub fn penumbra(time: f64) -> Scene {
    let mut builder = Builder::default();
    let grey = builder.material(Material::diffuse("grey", [0.6; 3]));
    let blue = builder.material(Material::diffuse("blue", [0.25, 0.35, 0.6]));
    let ochre = builder.material(Material::diffuse("ochre", [0.65, 0.5, 0.2]));
    let (l, r) = (-3.0, 3.0);
    builder.quad("floor", [[l, 0.0, r], [r, 0.0, r], [r, 0.0, l], [l, 0.0, l]], grey);
    let mut post = cuboid([-1.15, 0.0, -0.15], [-0.85, 1.5, 0.15]);
    post.name = "post".into();
    builder.mesh(post, blue);
    let mut slab = cuboid([0.3, 0.0, -0.5], [1.3, 0.1, 0.5]);
    slab.name = "slab".into();
    let slab = builder.mesh(slab, ochre);
    let height = 0.5 + 0.3 * (1.0 - (TAU * time / 4.0).cos());
    builder.scene.instances[slab].transform = DAffine3::from_translation(DVec3::new(0.0, height, 0.0));
    builder.scene.lights.push(Light {
        name: "lamp".into(),
        kind: LightKind::Point {
            position: DVec3::new(0.6, 3.0, -1.2),
            radius: LAMP_RADIUS,
        },
        color: [1.0, 0.93, 0.8],
        intensity: 25.0,
    });
    builder.look(
        "camera",
        DVec3::new(0.4, 2.4, 4.2),
        DVec3::new(0.0, 0.3, 0.3),
        DVec3::Y,
        50f64.to_radians(),
    );
    builder.scene
}

/// How far the door of [`two_rooms`] is open, from 0 to 1.
fn openness(time: f64) -> f64 {
    let t = time.rem_euclid(4.0);
    let ramp = if t < 2.0 { t } else { 4.0 - t };
    ramp.clamp(0.0, 1.0)
}

/// Five quads of a 4 m wide, 3 m high room from z = `near` to `far`, facing inward, without its wall to the other room.
fn room_shell(near: f32, far: f32, end_wall_is_near: bool) -> Vec<[[f32; 3]; 4]> {
    let (l, r, t) = (-2.0, 2.0, 3.0);
    let end = if end_wall_is_near {
        [[l, 0.0, near], [r, 0.0, near], [r, t, near], [l, t, near]]
    } else {
        [[r, 0.0, far], [l, 0.0, far], [l, t, far], [r, t, far]]
    };
    vec![
        [[l, 0.0, far], [r, 0.0, far], [r, 0.0, near], [l, 0.0, near]],
        [[l, t, near], [r, t, near], [r, t, far], [l, t, far]],
        [[l, 0.0, far], [l, 0.0, near], [l, t, near], [l, t, far]],
        [[r, 0.0, near], [r, 0.0, far], [r, t, far], [r, t, near]],
        end,
    ]
}

/// Both faces of the wall between the rooms, with a doorway 0.9 m wide and 2 m high, and the doorway's jambs and lintel.
fn dividing_wall(half: f32) -> Vec<[[f32; 3]; 4]> {
    let (l, r, t) = (-2.0, 2.0, 3.0);
    let (a, b, h) = (-0.45, 0.45, 2.0);
    let mut quads = Vec::new();
    for (x0, x1, y0, y1) in [(l, a, 0.0, t), (b, r, 0.0, t), (a, b, h, t)] {
        quads.push([[x1, y0, -half], [x0, y0, -half], [x0, y1, -half], [x1, y1, -half]]);
        quads.push([[x0, y0, half], [x1, y0, half], [x1, y1, half], [x0, y1, half]]);
    }
    quads.push([[a, 0.0, half], [a, 0.0, -half], [a, h, -half], [a, h, half]]);
    quads.push([[b, 0.0, -half], [b, 0.0, half], [b, h, half], [b, h, -half]]);
    quads.push([[a, h, -half], [b, h, -half], [b, h, half], [a, h, half]]);
    quads.push([[a, 0.0, half], [b, 0.0, half], [b, 0.0, -half], [a, 0.0, -half]]);
    quads
}

/// The measured Cornell box without its light, a hundredth of its millimetres, and the customary camera.
fn cornell_walls(time: f64) -> Scene {
    let mut builder = Builder::default();
    let white = builder.material(Material::diffuse("white", [0.73; 3]));
    let red = builder.material(Material::diffuse("red", [0.65, 0.05, 0.05]));
    let green = builder.material(Material::diffuse("green", [0.12, 0.45, 0.15]));
    let (w, h, d) = (5.56, 5.488, 5.592);
    builder.quad(
        "floor",
        [[0.0, 0.0, 0.0], [0.0, 0.0, d], [w, 0.0, d], [w, 0.0, 0.0]],
        white,
    );
    builder.quad("ceiling", [[0.0, h, 0.0], [w, h, 0.0], [w, h, d], [0.0, h, d]], white);
    builder.quad("back wall", [[0.0, 0.0, d], [0.0, h, d], [w, h, d], [w, 0.0, d]], white);
    builder.quad(
        "green wall",
        [[0.0, 0.0, 0.0], [0.0, h, 0.0], [0.0, h, d], [0.0, 0.0, d]],
        green,
    );
    builder.quad("red wall", [[w, 0.0, 0.0], [w, 0.0, d], [w, h, d], [w, h, 0.0]], red);
    let short = [[1.30, 0.65], [0.82, 2.25], [2.40, 2.72], [2.90, 1.14]];
    #[expect(clippy::approx_constant, reason = "a corner that was measured so")]
    let tall = [[4.23, 2.47], [2.65, 2.96], [3.14, 4.56], [4.72, 4.06]];
    let short = builder.mesh(prism("short block", short, 1.65), white);
    builder.mesh(prism("tall block", tall, 3.3), white);
    let slide = 0.5 * (1.0 - (TAU * time / 4.0).cos());
    builder.scene.instances[short].transform = DAffine3::from_translation(DVec3::new(1.2 * slide, 0.0, 0.0));
    builder.look(
        "camera",
        DVec3::new(2.78, 2.73, -8.0),
        DVec3::new(2.78, 2.73, 0.0),
        DVec3::Y,
        0.686_047_880_841_406_8,
    );
    builder.scene
}

/// Collects meshes, materials and instances.
#[derive(Default)]
struct Builder {
    scene: Scene,
}

impl Builder {
    fn material(&mut self, material: Material) -> usize {
        self.scene.materials.push(material);
        self.scene.materials.len() - 1
    }

    /// Adds a mesh and one instance of it; returns the instance's index.
    fn mesh(&mut self, mesh: Mesh, material: usize) -> usize {
        let shape = self.shape(mesh);
        self.place(shape, material, DAffine3::IDENTITY)
    }

    /// Adds a mesh to be placed; returns its index.
    fn shape(&mut self, mesh: Mesh) -> usize {
        self.scene.meshes.push(mesh);
        self.scene.meshes.len() - 1
    }

    /// Adds an instance, named as its mesh; returns its index.
    fn place(&mut self, mesh: usize, material: usize, transform: DAffine3) -> usize {
        self.scene.instances.push(Instance {
            name: self.scene.meshes[mesh].name.clone(),
            transform,
            ..Instance::new(mesh, material)
        });
        self.scene.instances.len() - 1
    }

    fn quad(&mut self, name: &str, corners: [[f32; 3]; 4], material: usize) {
        self.quad_strip(name, vec![corners], material);
    }

    fn quad_strip(&mut self, name: &str, quads: Vec<[[f32; 3]; 4]>, material: usize) {
        let mut mesh = Mesh {
            name: name.into(),
            ..Mesh::default()
        };
        for quad in quads {
            push_quad(&mut mesh, quad);
        }
        self.mesh(mesh, material);
    }

    fn look(&mut self, name: &str, from: DVec3, to: DVec3, up: DVec3, fov_y: f64) {
        let back = (from - to).normalize();
        let right = up.cross(back).normalize();
        self.scene.cameras.push(Camera {
            name: name.into(),
            transform: DAffine3::from_cols(right, back.cross(right), back, from),
            projection: Projection::Perspective { fov_y },
        });
    }
}

/// Appends a quad, counter-clockwise from the front.
fn push_quad(mesh: &mut Mesh, corners: [[f32; 3]; 4]) {
    let [a, b, c, _] = corners.map(Vec3::from);
    let normal = (b - a).cross(c - a).normalize().to_array();
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(corners);
    mesh.normals.extend([normal; 4]);
    mesh.tex_coords.extend([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
}

/// A vertical prism over a quadrilateral given as (x, z) corners, clockwise from above; open at the bottom.
fn prism(name: &str, base: [[f32; 2]; 4], height: f32) -> Mesh {
    let mut mesh = Mesh {
        name: name.into(),
        ..Mesh::default()
    };
    let at = |i: usize, y: f32| [base[i % 4][0], y, base[i % 4][1]];
    push_quad(&mut mesh, [at(0, height), at(1, height), at(2, height), at(3, height)]);
    for i in 0..4 {
        push_quad(
            &mut mesh,
            [at(i + 1, 0.0), at(i + 1, height), at(i, height), at(i, 0.0)],
        );
    }
    mesh
}

/// A closed axis-aligned box, facing outward.
fn cuboid(min: [f32; 3], max: [f32; 3]) -> Mesh {
    let mut mesh = Mesh::default();
    for quad in box_faces(min, max) {
        push_quad(&mut mesh, quad);
    }
    mesh
}

/// The faces of a box as seen from inside it.
fn inward_box(min: [f32; 3], max: [f32; 3]) -> Vec<[[f32; 3]; 4]> {
    box_faces(min, max).map(|[a, b, c, d]| [d, c, b, a]).to_vec()
}

fn box_faces([x0, y0, z0]: [f32; 3], [x1, y1, z1]: [f32; 3]) -> [[[f32; 3]; 4]; 6] {
    [
        [[x0, y0, z1], [x1, y0, z1], [x1, y1, z1], [x0, y1, z1]],
        [[x1, y0, z0], [x0, y0, z0], [x0, y1, z0], [x1, y1, z0]],
        [[x1, y0, z1], [x1, y0, z0], [x1, y1, z0], [x1, y1, z1]],
        [[x0, y0, z0], [x0, y0, z1], [x0, y1, z1], [x0, y1, z0]],
        [[x0, y1, z1], [x1, y1, z1], [x1, y1, z0], [x0, y1, z0]],
        [[x0, y0, z0], [x1, y0, z0], [x1, y0, z1], [x0, y0, z1]],
    ]
}

/// A unit sphere whose triangles face inward.
fn inward_sphere(name: &str, rings: u32, segments: u32) -> Mesh {
    let mut mesh = Mesh {
        name: name.into(),
        ..Mesh::default()
    };
    for ring in 0..=rings {
        let theta = PI * f64::from(ring) / f64::from(rings);
        for segment in 0..=segments {
            let phi = TAU * f64::from(segment) / f64::from(segments);
            let p = DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()).as_vec3();
            mesh.positions.push(p.to_array());
            mesh.normals.push((-p).to_array());
            mesh.tex_coords
                .push([segment as f32 / segments as f32, ring as f32 / rings as f32]);
        }
    }
    let row = segments + 1;
    for ring in 0..rings {
        for segment in 0..segments {
            let a = ring * row + segment;
            let (b, c, d) = (a + 1, a + row, a + row + 1);
            if ring > 0 {
                mesh.indices.extend([a, c, b]);
            }
            if ring + 1 < rings {
                mesh.indices.extend([b, c, d]);
            }
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    /// Geometric normals of an instance's triangles with their centroids, world space.
    fn facets(scene: &Scene, instance: usize) -> Vec<(DVec3, DVec3)> {
        let instance = &scene.instances[instance];
        let mesh = &scene.meshes[instance.mesh];
        let at = |i: u32| {
            instance
                .transform
                .transform_point3(Vec3::from(mesh.positions[i as usize]).as_dvec3())
        };
        mesh.indices
            .chunks_exact(3)
            .map(|t| {
                let (a, b, c) = (at(t[0]), at(t[1]), at(t[2]));
                ((b - a).cross(c - a).normalize(), (a + b + c) / 3.0)
            })
            .collect()
    }

    #[test]
    fn every_sample_is_valid_at_any_time() {
        for name in NAMES {
            for time in [0.0, 0.5, 1.0, 2.75, -1.0] {
                by_name(name, time).unwrap().validate().unwrap();
            }
        }
        assert!(by_name("teapot", 0.0).is_none());
    }

    #[test]
    fn something_moves_in_each_sample_that_says_so() {
        let moving = [
            "cornell",
            "cornell-spot",
            "bumpy-floor",
            "two-rooms",
            "pillars",
            "penumbra",
            "living-room",
            "colonnade",
            "nave",
            "glass-sphere",
            "ring-occluder",
            "dimpled-mirror",
            "water",
            "courtyard",
        ];
        for name in moving {
            let (a, b) = (by_name(name, 0.0).unwrap(), by_name(name, 1.0).unwrap());
            assert!(a.instances != b.instances || a.lights != b.lights, "{name}");
        }
    }

    #[test]
    fn walls_face_the_inside_and_blocks_face_outward() {
        let scene = cornell(0.0);
        let inside = DVec3::new(2.78, 2.74, 2.8);
        for wall in 0..5 {
            for (normal, at) in facets(&scene, wall) {
                assert!(normal.dot(inside - at) > 0.0, "{}", scene.instances[wall].name);
            }
        }
        for block in 5..7 {
            let all = facets(&scene, block);
            let middle = all.iter().map(|f| f.1).sum::<DVec3>() / all.len() as f64;
            for (normal, at) in all {
                assert!(normal.dot(at - middle) > 0.0, "{}", scene.instances[block].name);
            }
        }
        for (normal, _) in facets(&bumpy_floor([80, 81], 0.0), 0) {
            assert!(normal.y > 0.0);
        }
        for (normal, at) in facets(&furnace(0.5, 1.0), 0) {
            assert!(normal.dot(at) < 0.0);
        }
        let rooms = two_rooms(0.0);
        for (room, inside) in [(0, DVec3::new(0.0, 1.5, -2.1)), (1, DVec3::new(0.0, 1.5, 2.1))] {
            for (normal, at) in facets(&rooms, room) {
                assert!(normal.dot(inside - at) > 0.0, "room {room}");
            }
        }
        let door = facets(&rooms, 3);
        let middle = door.iter().map(|f| f.1).sum::<DVec3>() / door.len() as f64;
        for (normal, at) in door {
            assert!(normal.dot(at - middle) > 0.0, "door");
        }
    }

    /// Flux through a closed surface of the field p/3, which is its volume, and the directed edges that no triangle meets
    /// from the other side.
    fn volume_and_open_edges(mesh: &Mesh) -> (f64, usize) {
        let mut edges = HashMap::new();
        let mut volume = 0.0;
        let key = |i: u32| mesh.positions[i as usize].map(|x| (x + 0.0).to_bits());
        let at = |i: u32| Vec3::from(mesh.positions[i as usize]).as_dvec3();
        for t in mesh.indices.chunks_exact(3) {
            volume += at(t[0]).dot(at(t[1]).cross(at(t[2]))) / 6.0;
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                *edges.entry((key(a), key(b))).or_insert(0i32) += 1;
                *edges.entry((key(b), key(a))).or_insert(0i32) -= 1;
            }
        }
        (volume, edges.values().filter(|&&count| count != 0).count())
    }

    #[test]
    fn the_larger_samples_are_as_large_as_they_say() {
        for (name, triangles, size) in [
            ("living-room", 30_122, DVec3::new(7.0, 2.8, 5.5)),
            ("colonnade", 77_430, DVec3::new(40.0, 12.0, 16.0)),
            ("nave", 80_000, DVec3::new(40.0, 16.0, 18.0)),
        ] {
            let scene = by_name(name, 0.0).unwrap();
            let found = scene.triangle_count();
            let inside: Vec<_> = scene.instances.iter().filter(|i| i.name != "outside").collect();
            let corners = inside.iter().flat_map(|i| {
                let mesh = &scene.meshes[i.mesh];
                let place = |p: &[f32; 3]| i.transform.transform_point3(Vec3::from(*p).as_dvec3());
                mesh.positions.iter().map(place).collect::<Vec<_>>()
            });
            let (min, max) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| {
                (min.min(p), max.max(p))
            });
            println!("{name}: {found} triangles, {}", max - min);
            assert!(
                (found as f64 / f64::from(triangles) - 1.0).abs() < 0.1,
                "{name}: {found}"
            );
            assert!(
                (max - min - size).abs().max_element() < 0.02 * size.length(),
                "{name}: {}",
                max - min
            );
        }
        for (cells, triangles) in [([3, 1], 34), ([80, 81], 12_988), ([258, 258], 133_156)] {
            assert_eq!(bumpy_floor(cells, 0.0).triangle_count(), triangles);
        }
        let colonnade = colonnade(0.0);
        let count = |name: &str| colonnade.instances.iter().filter(|i| i.name == name).count();
        assert_eq!([count("baluster"), count("column") + count("upper column")], [160, 32]);
    }

    #[test]
    fn solids_of_the_larger_samples_are_closed_and_face_outward() {
        // Rooms face inward and are open: at the window, to the sky.
        const SHELLS: [&str; 5] = ["floor", "ceiling", "back wall", "walls", "outside"];
        for name in ["living-room", "colonnade", "nave"] {
            let scene = by_name(name, 0.0).unwrap();
            for mesh in scene.meshes.iter().filter(|m| !SHELLS.contains(&m.name.as_str())) {
                let (volume, open_edges) = volume_and_open_edges(mesh);
                assert_eq!(open_edges, 0, "{name}: {}", mesh.name);
                assert!(volume > 0.0, "{name}: {}: {volume}", mesh.name);
            }
        }
    }

    #[test]
    fn no_triangle_of_a_sample_is_without_area() {
        for name in NAMES {
            for mesh in by_name(name, 0.3).unwrap().meshes {
                let at = |i: u32| Vec3::from(mesh.positions[i as usize]).as_dvec3();
                for t in mesh.indices.chunks_exact(3) {
                    let across = (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0]));
                    assert!(across.length() > 1e-9, "{name}: {}: {t:?}", mesh.name);
                }
            }
        }
    }
}
