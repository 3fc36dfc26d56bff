//! Surfaces that shine, as lamps.

use super::{Light, LightKind, Scene, Texture};
use glam::{DVec3, Vec2, Vec3};
use std::collections::HashMap;
use std::f64::consts::PI;

/// Triangles that turn away from each other by more than this (cosine; 60°) are no one lamp.
const LEAST_AGREEMENT: f64 = 0.5;

/// A triangle is lit by its texture's mean over so many rows of points.
const TEXTURE_ROWS: u32 = 8;

/// A triangle that shines from its front.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EmissiveTriangle {
    /// World space, counter-clockwise seen from the front.
    pub corners: [DVec3; 3],
    /// Emitted radiance, W/m²/sr, linear RGB; of a textured one the mean.
    pub radiance: [f32; 3],
}

/// Emissive triangles that stand together and look the same way, with the rectangle that stands for them.
#[derive(Debug, Clone, PartialEq)]
pub struct Lamp {
    /// A rectangle before them, of their area seen from the front and of their spread, so that none of them lies before it. Shadows
    /// are cast from its middle. Its colour times its intensity is their mean radiance.
    pub light: Light,
    /// What shines.
    pub triangles: Vec<EmissiveTriangle>,
}

impl EmissiveTriangle {
    /// All of a scene, instance by instance. Triangles without area, and those that are dark, are left out.
    pub fn all_of(scene: &Scene) -> Vec<Self> {
        let mut all = Vec::new();
        for instance in &scene.instances {
            let material = &scene.materials[instance.material];
            if !material.is_emissive() {
                continue;
            }
            let mesh = &scene.meshes[instance.mesh];
            // A mirroring transform turns triangles over; their front goes with them.
            let is_mirrored = instance.transform.matrix3.determinant() < 0.0;
            let texture = |index: Option<usize>| index.and_then(|i| scene.textures.get(i));
            let (emission, base) = (texture(material.emission_texture), texture(material.base_color_texture));
            for indices in mesh.indices.chunks_exact(3) {
                let order = if is_mirrored { [0, 2, 1] } else { [0, 1, 2] };
                let vertices = order.map(|i| indices[i] as usize);
                let place = |i: usize| Vec3::from(mesh.positions[i]).as_dvec3();
                let tex_coords = vertices.map(|i| Vec2::from(mesh.tex_coords.get(i).copied().unwrap_or_default()));
                let mut factor = Vec3::ONE;
                if emission.is_some() || material.alpha_cutoff.is_some() {
                    factor = mean_over(tex_coords, |uv| {
                        let is_hole = material.alpha_cutoff.is_some_and(|c| texel(base, uv)[3] < c);
                        let [r, g, b, _] = texel(emission, uv);
                        if is_hole { Vec3::ZERO } else { Vec3::new(r, g, b) }
                    });
                }
                let triangle = Self {
                    corners: vertices.map(|i| instance.transform.transform_point3(place(i))),
                    radiance: (Vec3::from(material.emission) * factor).to_array(),
                };
                if triangle.flux() > 0.0 && triangle.flux().is_finite() {
                    all.push(triangle);
                }
            }
        }
        all
    }

    /// Half the cross product of two edges: area times the unit normal of the front.
    pub(crate) fn area_vector(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        0.5 * (b - a).cross(c - a)
    }

    pub(crate) fn area(&self) -> f64 {
        self.area_vector().length()
    }

    /// W, summed over channels.
    pub(crate) fn flux(&self) -> f64 {
        PI * self.area() * self.radiance_sum()
    }

    fn radiance_sum(&self) -> f64 {
        Vec3::from(self.radiance).as_dvec3().element_sum()
    }
}

impl Lamp {
    /// Groups triangles into at most `most` lamps: those that share corners and look the same way within 60° of the first are
    /// one. While there are more lamps than that, the dimmest joins the nearest one. The same triangles give the same lamps; those
    /// without area, and dark ones, are left out.
    pub fn group(triangles: &[EmissiveTriangle], most: usize) -> Vec<Self> {
        let is_lit = |t: &EmissiveTriangle| t.flux() > 0.0 && t.flux().is_finite();
        let triangles: Vec<_> = triangles.iter().copied().filter(is_lit).collect();
        if most == 0 {
            return Vec::new();
        }
        let mut groups: Vec<Vec<EmissiveTriangle>> = Vec::new();
        for piece in connected(&triangles) {
            // Of the lamps of this piece, the way that their first triangles look.
            let mut ways: Vec<(DVec3, usize)> = Vec::new();
            for triangle in piece {
                let way = triangle.area_vector().normalize_or_zero();
                let known = ways.iter().find(|w| w.0.dot(way) >= LEAST_AGREEMENT).map(|w| w.1);
                let index = known.unwrap_or_else(|| {
                    groups.push(Vec::new());
                    ways.push((way, groups.len() - 1));
                    groups.len() - 1
                });
                groups[index].push(triangle);
            }
        }
        let known = |g: &[EmissiveTriangle]| (g.iter().map(EmissiveTriangle::flux).sum::<f64>(), middle(g));
        let mut of_groups: Vec<(f64, DVec3)> = groups.iter().map(|g| known(g)).collect();
        while groups.len() > most {
            let dimmest = (0..groups.len()).min_by(|&a, &b| of_groups[a].0.total_cmp(&of_groups[b].0));
            let dimmest = dimmest.unwrap_or(0);
            let (joins, (_, center)) = (groups.swap_remove(dimmest), of_groups.swap_remove(dimmest));
            let distance = |g: usize| of_groups[g].1.distance_squared(center);
            if let Some(nearest) = (0..groups.len()).min_by(|&a, &b| distance(a).total_cmp(&distance(b))) {
                groups[nearest].extend(joins);
                of_groups[nearest] = known(&groups[nearest]);
            }
        }
        groups.into_iter().map(Self::of).collect()
    }

    fn of(triangles: Vec<EmissiveTriangle>) -> Self {
        let area: f64 = triangles.iter().map(EmissiveTriangle::area).sum();
        let center = middle(&triangles);
        let sum: DVec3 = triangles.iter().map(EmissiveTriangle::area_vector).sum();
        // Lamps that look all ways look where the first one does, and are seen as a quarter of their area.
        let first = triangles.first().map_or(DVec3::Y, EmissiveTriangle::area_vector);
        let (normal, seen) = match sum.length() {
            length if length > 0.25 * area => (sum / length, length),
            _ => (first.normalize_or(DVec3::Y), 0.25 * area),
        };
        let [half_u, half_v] = half_sides(&triangles, center, normal, seen);
        // Seen from behind its own surface a lamp would stand in its own light.
        let before = |t: &EmissiveTriangle| t.corners.map(|c| normal.dot(c - center));
        let foremost = triangles.iter().flat_map(before).fold(0.0, f64::max);
        let center = center + foremost * normal;
        let power: DVec3 = triangles
            .iter()
            .map(|t| t.area() * Vec3::from(t.radiance).as_dvec3())
            .sum();
        Self {
            light: Light {
                name: String::new(),
                kind: LightKind::Rectangle { center, half_u, half_v },
                color: (power / area).as_vec3().to_array(),
                intensity: 1.0,
            },
            triangles,
        }
    }
}

/// The triangles, in pieces that share corners. Pieces, and triangles in them, are in the order of the list.
fn connected(triangles: &[EmissiveTriangle]) -> Vec<Vec<EmissiveTriangle>> {
    let mut parents: Vec<usize> = (0..triangles.len()).collect();
    let mut first_at: HashMap<[u64; 3], usize> = HashMap::new();
    for (index, triangle) in triangles.iter().enumerate() {
        for corner in triangle.corners {
            // Adding zero makes one of the two zeros.
            let key = (corner + DVec3::ZERO).to_array().map(f64::to_bits);
            let other = root(&mut parents, *first_at.entry(key).or_insert(index));
            let own = root(&mut parents, index);
            parents[own.max(other)] = own.min(other);
        }
    }
    let mut pieces: Vec<Vec<EmissiveTriangle>> = Vec::new();
    let mut piece_of = HashMap::new();
    for (index, triangle) in triangles.iter().enumerate() {
        let piece = *piece_of.entry(root(&mut parents, index)).or_insert_with(|| {
            pieces.push(Vec::new());
            pieces.len() - 1
        });
        pieces[piece].push(*triangle);
    }
    pieces
}

fn root(parents: &mut [usize], mut index: usize) -> usize {
    while parents[index] != index {
        parents[index] = parents[parents[index]];
        index = parents[index];
    }
    index
}

/// Mean of all points of triangles.
fn middle(triangles: &[EmissiveTriangle]) -> DVec3 {
    let area: f64 = triangles.iter().map(EmissiveTriangle::area).sum();
    let sum: DVec3 = triangles
        .iter()
        .map(|t| t.area() * (t.corners[0] + t.corners[1] + t.corners[2]) / 3.0)
        .sum();
    sum / area
}

/// Half sides of the rectangle of this area that spreads along two axes across the normal as the triangles do. Points of a
/// rectangle lie half a side / √3 from its middle in the mean square.
fn half_sides(triangles: &[EmissiveTriangle], center: DVec3, normal: DVec3, area: f64) -> [DVec3; 2] {
    let x = normal.any_orthonormal_vector();
    let y = normal.cross(x);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for triangle in triangles {
        let corners = triangle.corners.map(|c| c - center);
        let sum = corners[0] + corners[1] + corners[2];
        // The second moment of a triangle is that of its corners and of their sum, a twelfth of its area each.
        for p in [corners[0], corners[1], corners[2], sum] {
            let (px, py, weight) = (p.dot(x), p.dot(y), triangle.area() / 12.0);
            xx += weight * px * px;
            xy += weight * px * py;
            yy += weight * py * py;
        }
    }
    let turn = 0.5 * (2.0 * xy).atan2(xx - yy);
    let (sin, cos) = turn.sin_cos();
    let along = |c: f64, s: f64| (xx * c * c + 2.0 * xy * c * s + yy * s * s).max(0.0).sqrt();
    // No lamp is a line: a thousandth of the other side at least.
    let (major, minor) = (along(cos, sin), along(-sin, cos));
    let ratio = (major.max(1e-300) / minor.max(1e-300)).clamp(1e-3, 1e3).sqrt();
    let half = 0.5 * area.sqrt();
    [half * ratio * (cos * x + sin * y), half / ratio * (cos * y - sin * x)]
}

/// Of a function of texture coordinates, at points spread evenly over a triangle.
fn mean_over(corners: [Vec2; 3], f: impl Fn(Vec2) -> Vec3) -> Vec3 {
    let (mut sum, mut count) = (Vec3::ZERO, 0.0);
    let mut add = |v: f32, w: f32| {
        let [v, w] = [v, w].map(|x| x / TEXTURE_ROWS as f32);
        sum += f(corners[0] + v * (corners[1] - corners[0]) + w * (corners[2] - corners[0]));
        count += 1.0;
    };
    // Middles of the small triangles that rows divide it into, and of those between them, which stand upside down.
    for row in 0..TEXTURE_ROWS {
        for place in 0..TEXTURE_ROWS - row {
            let (v, w) = (row as f32, place as f32);
            add(v + 1.0 / 3.0, w + 1.0 / 3.0);
            if row + place + 1 < TEXTURE_ROWS {
                add(v + 2.0 / 3.0, w + 2.0 / 3.0);
            }
        }
    }
    sum / count
}

/// The nearest texel, linear; white where there is no image.
fn texel(texture: Option<&Texture>, uv: Vec2) -> [f32; 4] {
    let Some(texture) = texture else {
        return [1.0; 4];
    };
    let place = |coordinate: f32, size: u32| {
        let texel = ((coordinate - coordinate.floor()) * size as f32) as u32;
        texel.min(size.saturating_sub(1)) as usize
    };
    let index = place(uv.y, texture.height) * texture.width as usize + place(uv.x, texture.width);
    let mut values = [0, 1, 2, 3].map(|c| f32::from(texture.rgba[4 * index + c]) / 255.0);
    if texture.srgb {
        for value in &mut values[..3] {
            *value = if *value <= 0.04045 {
                *value / 12.92
            } else {
                ((*value + 0.055) / 1.055).powf(2.4)
            };
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Instance, Material, Mesh};
    use glam::DAffine3;

    fn triangle(corners: [[f64; 3]; 3]) -> EmissiveTriangle {
        EmissiveTriangle {
            corners: corners.map(DVec3::from),
            radiance: [1.0, 2.0, 3.0],
        }
    }

    /// A parallelogram from `corner` along two sides, as two triangles that share a diagonal.
    fn panel(corner: [f64; 3], u: [f64; 3], v: [f64; 3]) -> [EmissiveTriangle; 2] {
        let [corner, u, v] = [corner, u, v].map(DVec3::from);
        [
            [corner, corner + u, corner + u + v],
            [corner, corner + u + v, corner + v],
        ]
        .map(|c| triangle(c.map(|p| p.to_array())))
    }

    fn rectangle(lamp: &Lamp) -> (DVec3, DVec3, DVec3) {
        match lamp.light.kind {
            LightKind::Rectangle { center, half_u, half_v } => (center, half_u, half_v),
            _ => panic!("{:?}", lamp.light.kind),
        }
    }

    #[test]
    fn two_triangles_of_a_rectangle_are_that_rectangle() {
        let lamps = Lamp::group(&panel([1.0, 2.0, 3.0], [4.0, 0.0, 0.0], [0.0, 0.0, -1.0]), 8);
        assert_eq!(lamps.len(), 1);
        let (center, half_u, half_v) = rectangle(&lamps[0]);
        assert!((center - DVec3::new(3.0, 2.0, 2.5)).length() < 1e-12, "{center}");
        let normal = half_u.cross(half_v).normalize();
        assert!((normal - DVec3::Y).length() < 1e-12, "{normal}");
        let mut lengths = [half_u.length(), half_v.length()];
        lengths.sort_by(f64::total_cmp);
        assert!(
            (lengths[0] - 0.5).abs() < 1e-9 && (lengths[1] - 2.0).abs() < 1e-9,
            "{lengths:?}"
        );
        let flux: f64 = lamps[0].triangles.iter().map(EmissiveTriangle::flux).sum();
        assert!((lamps[0].light.flux(1.0).element_sum() - flux).abs() < 1e-6 * flux);
        lamps[0].light.validate(0).unwrap();
    }

    #[test]
    fn what_is_apart_or_looks_elsewhere_is_another_lamp_while_there_is_room() {
        let ceiling = panel([0.0, 2.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
        let wall = panel([0.0, 2.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]);
        let other = panel([9.0, 2.0, 0.0], [0.0, 0.0, 0.5], [0.5, 0.0, 0.0]);
        let all = [ceiling, wall, other].concat();
        let counts = |most| {
            Lamp::group(&all, most)
                .iter()
                .map(|l| l.triangles.len())
                .collect::<Vec<_>>()
        };
        assert_eq!(counts(8), [2, 2, 2]);
        // The dimmest is the small one; the wall's middle is nearer to it than the ceiling's, by a hair.
        assert_eq!(counts(2).iter().sum::<usize>(), 6);
        assert_eq!(counts(1), [6]);
        assert!(counts(0).is_empty());
        for lamp in Lamp::group(&all, 1) {
            lamp.light.validate(0).unwrap();
        }
    }

    #[test]
    fn lamps_that_look_all_ways_and_thin_ones_are_valid_lights() {
        let ball: Vec<_> = (0..8)
            .map(|octant| {
                let [x, y, z] = [0, 1, 2].map(|axis| if octant >> axis & 1 == 0 { 1.0 } else { -1.0 });
                let (a, b, c) = ([x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]);
                triangle(if x * y * z > 0.0 { [a, b, c] } else { [a, c, b] })
            })
            .collect();
        for most in [1, 3, 64] {
            let lamps = Lamp::group(&ball, most);
            assert!(!lamps.is_empty() && lamps.len() <= most, "{}", lamps.len());
            assert_eq!(lamps.iter().map(|l| l.triangles.len()).sum::<usize>(), ball.len());
            lamps.iter().for_each(|l| l.light.validate(0).unwrap());
        }
        let thread = [triangle([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1e-9, 0.0]])];
        Lamp::group(&thread, 8)[0].light.validate(0).unwrap();
    }

    #[test]
    fn no_corner_of_a_lamp_lies_before_its_rectangle_and_what_is_dark_or_has_no_area_is_left_out() {
        let roof = [
            panel([0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.5, 0.0]),
            panel([1.0, 0.5, 0.0], [0.0, 0.0, 1.0], [1.0, -0.5, 0.0]),
        ];
        let mut all = roof.concat();
        all.push(triangle([[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]));
        all.push(EmissiveTriangle {
            radiance: [0.0; 3],
            ..triangle([[5.0; 3], [6.0, 5.0, 5.0], [5.0, 6.0, 5.0]])
        });
        let lamps = Lamp::group(&all, 8);
        assert_eq!(lamps.iter().map(|l| l.triangles.len()).collect::<Vec<_>>(), [4]);
        let (center, half_u, half_v) = rectangle(&lamps[0]);
        assert!((half_u.cross(half_v).normalize() - DVec3::Y).length() < 1e-12);
        assert!((center - DVec3::new(1.0, 0.5, 0.5)).length() < 1e-12, "{center}");
    }

    #[test]
    fn mirrored_instances_keep_their_front_and_textures_count_by_their_mean() {
        let mut scene = Scene {
            meshes: vec![Mesh {
                positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
                tex_coords: vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
                indices: vec![0, 1, 2],
                ..Mesh::default()
            }],
            materials: vec![Material {
                emission: [2.0, 0.0, 0.0],
                ..Material::default()
            }],
            instances: vec![Instance {
                transform: DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)),
                ..Instance::new(0, 0)
            }],
            ..Scene::default()
        };
        let front = EmissiveTriangle::all_of(&scene)[0].area_vector();
        assert_eq!(front, DVec3::new(0.0, 0.0, 0.5));
        // Black where u < 1/2: three quarters of the triangle.
        scene.textures.push(Texture {
            name: String::new(),
            width: 2,
            height: 1,
            srgb: false,
            rgba: vec![0, 0, 0, 255, 255, 255, 255, 255],
        });
        scene.materials[0].emission_texture = Some(0);
        let mean = EmissiveTriangle::all_of(&scene)[0].radiance[0];
        assert!((mean - 0.5).abs() < 1e-6, "{mean}");
    }
}
