//! The engine's scene on the CPU: objects in a vertex format of its own, a lamp, an eye, and paths of light that it
//! traces through its triangles by itself. World space is in metres and `f64`.

use lightfall::glam::{DAffine3, DMat3, DVec3};
use std::f64::consts::{FRAC_1_PI, PI, TAU};

/// One vertex, 20 bytes.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Vertex {
    pub(crate) position: [f32; 3],
    /// `snorm8x4`
    pub(crate) normal: [i8; 4],
    /// `unorm8x4`, linear reflectance
    pub(crate) color: [u8; 4],
}

/// A mesh, where it stands, and what it is painted with.
#[derive(Clone)]
pub(crate) struct Object {
    pub(crate) vertices: Vec<Vertex>,
    pub(crate) indices: Vec<u16>,
    /// Object to world: rotation and translation.
    pub(crate) transform: DAffine3,
    /// Multiplies the vertices' colours.
    pub(crate) tint: [f32; 3],
}

/// Shines equally in all directions.
#[derive(Clone, Copy)]
pub(crate) struct Lamp {
    pub(crate) position: DVec3,
    /// W/sr
    pub(crate) intensity: DVec3,
}

/// Where the engine looks from.
#[derive(Clone, Copy)]
pub(crate) struct Eye {
    pub(crate) position: DVec3,
    pub(crate) direction: DVec3,
    pub(crate) up: DVec3,
    /// Radians.
    pub(crate) fov_y: f64,
}

/// Everything there is.
#[derive(Clone)]
pub(crate) struct World {
    pub(crate) objects: Vec<Object>,
    pub(crate) lamp: Lamp,
    pub(crate) eye: Eye,
}

/// Where one hop of a path arrived, and with how much.
#[derive(Clone, Copy)]
pub(crate) struct Landing {
    /// World space.
    pub(crate) position: DVec3,
    pub(crate) direction: DVec3,
    /// Geometric, on the side hit.
    pub(crate) normal: DVec3,
    /// W, before the surface takes its share.
    pub(crate) flux: DVec3,
    /// Photons per m² that a path of this kind makes here: solid-angle pdf of its direction · cos / distance².
    pub(crate) density: f64,
    pub(crate) reflectance: DVec3,
}

/// Somewhere far from the origin, as places in an engine's world are.
const PLACE: DVec3 = DVec3::new(1200.0, 35.0, -800.0);
/// Extent of the room, metres.
const ROOM: [f32; 3] = [4.0, 3.0, 4.0];
/// Half the extent of the box.
const BOX: [f32; 3] = [0.5, 0.75, 0.5];

const WHITE: [u8; 4] = [186, 186, 186, 255];
const RED: [u8; 4] = [166, 13, 13, 255];
const GREEN: [u8; 4] = [31, 115, 38, 255];

impl World {
    /// A room without its front wall, seen from outside, and a box in it that slides about.
    pub(crate) fn room() -> Self {
        let [x, y, z] = ROOM;
        let mut walls = Object::new(PLACE);
        walls.quad([[0.0, 0.0, z], [x, 0.0, z], [x, 0.0, 0.0], [0.0; 3]], WHITE);
        walls.quad([[0.0, y, 0.0], [x, y, 0.0], [x, y, z], [0.0, y, z]], WHITE);
        walls.quad([[0.0; 3], [x, 0.0, 0.0], [x, y, 0.0], [0.0, y, 0.0]], WHITE);
        walls.quad([[0.0, 0.0, z], [0.0; 3], [0.0, y, 0.0], [0.0, y, z]], RED);
        walls.quad([[x, 0.0, 0.0], [x, 0.0, z], [x, y, z], [x, y, 0.0]], GREEN);
        let mut world = Self {
            objects: vec![walls, Object::block(BOX, WHITE, [1.0, 0.75, 0.5])],
            lamp: Lamp {
                position: PLACE + DVec3::new(2.0, 2.5, 2.0),
                intensity: DVec3::new(12.0, 11.0, 9.0),
            },
            eye: Eye {
                position: PLACE + DVec3::new(2.0, 1.5, 8.5),
                direction: DVec3::NEG_Z,
                up: DVec3::Y,
                fov_y: 0.65,
            },
        };
        world.set_time(0.0);
        world
    }

    /// A closed sphere of radius 2 m, seen from its middle; the lamp stands off it.
    pub(crate) fn sphere() -> Self {
        Self {
            objects: vec![Object::inward_sphere(PLACE, 2.0, [128, 128, 128, 255])],
            lamp: Lamp {
                position: PLACE + DVec3::new(0.6, 0.5, -0.3),
                intensity: DVec3::new(10.0, 5.0, 2.5),
            },
            eye: Eye {
                position: PLACE,
                direction: DVec3::NEG_Z,
                up: DVec3::Y,
                fov_y: 0.5 * PI,
            },
        }
    }

    /// Moves the last object of the room, the box: back and forth once in four seconds.
    pub(crate) fn set_time(&mut self, seconds: f64) {
        let slide = 1.3 + 1.2 * (1.0 - (TAU * seconds / 4.0).cos()) * 0.5;
        if let Some(block) = self.objects.get_mut(1) {
            let at = PLACE + DVec3::new(slide, f64::from(BOX[1]), 1.4);
            block.transform = DAffine3::from_mat3_translation(DMat3::from_rotation_y(0.35), at);
        }
    }

    /// Corners of what encloses everything, world space.
    pub(crate) fn bounds(&self) -> [DVec3; 2] {
        let corners = || self.objects.iter().flat_map(Object::corners);
        let (none, all) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        [corners().fold(none, DVec3::min), corners().fold(all, DVec3::max)]
    }

    /// Area of all surfaces, one side counted, m².
    pub(crate) fn area(&self) -> f64 {
        self.triangles().iter().map(|t| 0.5 * t.e1.cross(t.e2).length()).sum()
    }

    /// W by channel.
    pub(crate) fn flux(&self) -> DVec3 {
        4.0 * PI * self.lamp.intensity
    }

    /// Paths of light from the lamp, hop by hop: item `hop · paths + i` is where hop `hop` of path `i` arrived, `None`
    /// where the path had ended or left by the open side. All of a path's flux goes on, less what surfaces absorb.
    pub(crate) fn trace_paths(&self, paths: u32, bounces: u32, seed: u64) -> Vec<Option<Landing>> {
        let triangles = self.triangles();
        let mut random = Random(seed);
        let mut landings = vec![None; paths as usize * (bounces as usize + 1)];
        for path in 0..paths as usize {
            let (mut from, mut direction) = (self.lamp.position, random.on_sphere());
            let (mut flux, mut pdf) = (self.flux() / f64::from(paths), 0.25 * FRAC_1_PI);
            for hop in 0..=bounces as usize {
                let Some((distance, triangle)) = nearest(&triangles, from, direction) else {
                    break;
                };
                let normal = triangle.normal * -triangle.normal.dot(direction).signum();
                let landing = Landing {
                    position: from + distance * direction,
                    direction,
                    normal,
                    flux,
                    density: pdf * -normal.dot(direction) / (distance * distance),
                    reflectance: triangle.reflectance,
                };
                landings[hop * paths as usize + path] = Some(landing);
                // Lambert: cosine-weighted, so that flux times reflectance goes on.
                flux *= landing.reflectance;
                from = landing.position + 1e-9 * normal;
                direction = (normal + random.on_sphere()).normalize();
                pdf = normal.dot(direction) * FRAC_1_PI;
            }
        }
        landings
    }

    fn triangles(&self) -> Vec<Triangle> {
        let of = |object: &Object| {
            let corners: Vec<DVec3> = object.corners().collect();
            let tint = DVec3::from(object.tint.map(f64::from));
            let triangle = |t: &[u16]| {
                let [a, b, c] = [t[0], t[1], t[2]].map(|i| corners[usize::from(i)]);
                let (e1, e2) = (b - a, c - a);
                let [red, green, blue, _] = object.vertices[usize::from(t[0])].color.map(f64::from);
                Triangle {
                    a,
                    e1,
                    e2,
                    normal: e1.cross(e2).normalize(),
                    reflectance: DVec3::new(red, green, blue) / 255.0 * tint,
                }
            };
            object.indices.chunks_exact(3).map(triangle).collect::<Vec<_>>()
        };
        self.objects.iter().flat_map(of).collect()
    }
}

impl Object {
    fn new(at: DVec3) -> Self {
        Self {
            vertices: Vec::new(),
            indices: Vec::new(),
            transform: DAffine3::from_translation(at),
            tint: [1.0; 3],
        }
    }

    /// A closed box around its own origin.
    fn block([x, y, z]: [f32; 3], color: [u8; 4], tint: [f32; 3]) -> Self {
        let mut object = Self {
            tint,
            ..Self::new(PLACE)
        };
        object.quad([[-x, -y, z], [x, -y, z], [x, y, z], [-x, y, z]], color);
        object.quad([[x, -y, -z], [-x, -y, -z], [-x, y, -z], [x, y, -z]], color);
        object.quad([[x, -y, z], [x, -y, -z], [x, y, -z], [x, y, z]], color);
        object.quad([[-x, -y, -z], [-x, -y, z], [-x, y, z], [-x, y, -z]], color);
        object.quad([[-x, y, z], [x, y, z], [x, y, -z], [-x, y, -z]], color);
        object.quad([[-x, -y, -z], [x, -y, -z], [x, -y, z], [-x, -y, z]], color);
        object
    }

    /// A sphere of flat quads that face its middle.
    fn inward_sphere(at: DVec3, radius: f64, color: [u8; 4]) -> Self {
        const RINGS: u32 = 16;
        let mut object = Self::new(at);
        let point = |ring: u32, step: u32| {
            let (theta, phi) = (
                PI * f64::from(ring) / f64::from(RINGS),
                PI * f64::from(step) / f64::from(RINGS),
            );
            let (sin, cos) = theta.sin_cos();
            (radius * DVec3::new(sin * phi.cos(), cos, sin * phi.sin()))
                .as_vec3()
                .to_array()
        };
        for (ring, step) in (0..RINGS).flat_map(|ring| (0..2 * RINGS).map(move |step| (ring, step))) {
            let corners = [(0, 0), (0, 1), (1, 1), (1, 0)].map(|(r, s)| point(ring + r, step + s));
            object.quad(corners, color);
        }
        object
    }

    /// Two triangles, counter-clockwise from the front.
    fn quad(&mut self, corners: [[f32; 3]; 4], color: [u8; 4]) {
        let [a, b, c, d] = corners.map(|p| DVec3::from(p.map(f64::from)));
        // Diagonals, so that a quad which ends in a point has a normal too.
        let normal = ((c - a).cross(d - b)).normalize();
        let [x, y, z] = (127.0 * normal).round().to_array().map(|v| v as i8);
        let first = self.vertices.len() as u16;
        self.vertices.extend(corners.map(|position| Vertex {
            position,
            normal: [x, y, z, 0],
            color,
        }));
        for triangle in [[0, 1, 2], [0, 2, 3]] {
            let [a, b, c] = triangle.map(|i: usize| corners[i]);
            if a != b && b != c && c != a {
                self.indices.extend(triangle.map(|i| first + i as u16));
            }
        }
    }

    /// All vertices, world space.
    fn corners(&self) -> impl Iterator<Item = DVec3> {
        let place = |v: &Vertex| self.transform.transform_point3(DVec3::from(v.position.map(f64::from)));
        self.vertices.iter().map(place)
    }
}

struct Triangle {
    a: DVec3,
    e1: DVec3,
    e2: DVec3,
    normal: DVec3,
    reflectance: DVec3,
}

/// Distance along a ray and the triangle that it meets first (Möller and Trumbore 1997, both sides).
fn nearest(triangles: &[Triangle], from: DVec3, direction: DVec3) -> Option<(f64, &Triangle)> {
    let hit = |t: &Triangle| {
        let p = direction.cross(t.e2);
        let determinant = t.e1.dot(p);
        let s = from - t.a;
        let u = s.dot(p) / determinant;
        let q = s.cross(t.e1);
        let v = direction.dot(q) / determinant;
        let distance = t.e2.dot(q) / determinant;
        // A ray along the plane divides by zero and fails every comparison.
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0).then_some(distance)
    };
    let hits = triangles.iter().filter_map(|t| Some((hit(t)?, t)));
    hits.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// SplitMix64 (Steele et al. 2014).
struct Random(u64);

impl Random {
    /// In [0, 1).
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn on_sphere(&mut self) -> DVec3 {
        let z = 1.0 - 2.0 * self.unit();
        let (sin, cos) = (TAU * self.unit()).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    }
}
