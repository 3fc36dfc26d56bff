//! The lights and lamps of a frame as the GPU sees them, and how many photons each of them emits.

use super::ShadowMaps;
use super::view::axes_along;
use crate::scene::{EmissiveTriangle, Lamp, Light, LightKind, LightSources, UnitFrame};
use crate::{Error, gpu as device};
use glam::{DVec3, Vec3};

/// Most lights a scene may have, suns of an environment and lamps of emissive triangles counted, environments not.
pub const MAX_LIGHTS: usize = 64;

/// Share of the photon budget that is spread evenly, so that a dim lamp in a dark corner is not starved; the rest goes
/// by flux.
const EVEN_SHARE: f64 = 0.25;

/// How many times as many photons a light may have as its flux asks for, or as few, while the division among the lights is
/// kept.
const DIVISION_TOLERANCE: f64 = 1.5;

/// Direct light of a lamp of more triangles than this is that of the rectangle that stands for it.
pub const MAX_DIRECT_POLYGONS: usize = 16;

/// Shadow maps of flat lamps are taken from this far before them, in their extents, so that they do not see their own edges.
const BEFORE_LAMP: f64 = 1.0 / 1024.0;

/// `LightRecord::inner` of suns that stand for a part of the environment, which rays can meet. Twin of `LIGHT_OF_ENVIRONMENT`.
const OF_ENVIRONMENT: f32 = 0.0;

/// Cosine up to which triangles lie in one plane.
const FLAT: f64 = 0.9999;

/// Beyond this a lamp's extent is no larger: infinity times a distance of zero is no number.
const LARGEST_EXTENT: f64 = 1e30;

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Kinds of [`LightRecord`]. Twins of `LIGHT_POINT` and so on.
    pub(crate) const POINT: u32 = 0;
    pub(crate) const SPOT: u32 = 1;
    pub(crate) const DIRECTIONAL: u32 = 2;
    pub(crate) const AREA: u32 = 3;

    /// Twin of `Light` in `shaders/common/light.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct LightRecord {
        pub(crate) position: [f32; 3],
        pub(crate) kind: u32,
        pub(crate) direction: [f32; 3],
        pub(crate) inner: f32,
        pub(crate) intensity: [f32; 3],
        pub(crate) outer: f32,
        pub(crate) right: [f32; 3],
        pub(crate) first_layer: u32,
        pub(crate) up: [f32; 3],
        pub(crate) layer_count: u32,
        pub(crate) photon_flux: [f32; 3],
        pub(crate) half_extent: f32,
        pub(crate) first_photon: u32,
        pub(crate) photon_count: u32,
        pub(crate) density: f32,
        pub(crate) disc_radius: f32,
        pub(crate) extent: f32,
        pub(crate) first_polygon: u32,
        pub(crate) direct_polygons: u32,
        pub(crate) polygon_count: u32,
    }

    /// Twin of `Polygon` in `shaders/common/polygon.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Polygon {
        pub(crate) corner: [f32; 3],
        pub(crate) corners: u32,
        pub(crate) u: [f32; 3],
        pub(crate) until: f32,
        pub(crate) v: [f32; 3],
        pub(crate) area: f32,
        pub(crate) radiance: [f32; 3],
        pub(crate) _pad: f32,
    }
}

/// All [`LightSources`] of a frame but environments, in their order: an `array<Light>` of `shaders/common/light.wgsl`,
/// intensities in the unit frame, and the polygons of those that are flat.
#[derive(Debug)]
pub struct Lights {
    device: wgpu::Device,
    buffer: wgpu::Buffer,
    written: Vec<gpu::LightRecord>,
    polygons: wgpu::Buffer,
    written_polygons: Vec<gpu::Polygon>,
    /// Photons of each of the sources.
    division: Vec<u32>,
    keeps_division: bool,
}

impl Lights {
    /// Room for [`MAX_LIGHTS`].
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(gpu: &wgpu::Device) -> Result<Self, Error> {
        let bytes = (MAX_LIGHTS * size_of::<gpu::LightRecord>()) as u64;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        Ok(Self {
            device: gpu.clone(),
            buffer: device::buffer(gpu, "lightfall::Lights", bytes, usage)?,
            written: Vec::new(),
            polygons: polygon_buffer(gpu, 1)?,
            written_polygons: Vec::new(),
            division: Vec::new(),
            keeps_division: false,
        })
    }

    /// Has photons divided as they were before from now on, while there are as many lights and no light has more than one and a
    /// half times the photons that its flux asks for, or fewer by as much: for photons that stay from frame to frame. What a
    /// light's photons carry always adds up to its flux.
    pub fn keep_division(&mut self) {
        self.keeps_division = true;
    }

    /// Uploads what lights this frame. `photon_count` photons are divided among them: three quarters in proportion to flux, one
    /// quarter evenly among those that shine. Shadow-map layers are numbered as [`ShadowMaps`] does for
    /// [`LightSources::all`].
    ///
    /// # Errors
    /// [`Error::CountMismatch`] above [`MAX_LIGHTS`] of them; [`Error::LimitExceeded`] for more triangles than a storage buffer
    /// holds.
    pub fn write(
        &mut self,
        queue: &wgpu::Queue,
        frame: &UnitFrame,
        sources: &LightSources<'_>,
        photon_count: u32,
    ) -> Result<(), Error> {
        let found = sources.count();
        if found > MAX_LIGHTS {
            return Err(Error::CountMismatch {
                what: "lights that are no environments, suns of these, and lamps (most a scene may have)",
                expected: MAX_LIGHTS,
                found,
            });
        }
        let all = sources.all();
        let suns_from = sources.lights.len();
        let lamps_from = suns_from + sources.suns.len();
        let mut counts = divide_photons(&fluxes(frame, &all), photon_count);
        if self.keeps_division && is_near(&self.division, &counts) {
            counts.clone_from(&self.division);
        }
        let (mut records, mut polygons) = (Vec::with_capacity(found), Vec::new());
        let (mut first_layer, mut first_photon) = (0, 0);
        for (index, (light, &count)) in all.iter().zip(&counts).enumerate() {
            let Some(mut record) = record(frame, light, first_layer, first_photon, count) else {
                continue;
            };
            if let LightKind::Rectangle { .. } = light.kind {
                let lamp = index.checked_sub(lamps_from).map(|i| &sources.lamps[i]);
                add_polygons(frame, light, lamp, &mut record, &mut polygons);
            }
            if (suns_from..lamps_from).contains(&index) {
                record.inner = OF_ENVIRONMENT;
            }
            first_layer += record.layer_count;
            first_photon += count;
            records.push(record);
        }
        if polygons != self.written_polygons {
            let bytes: &[u8] = bytemuck::cast_slice(&polygons);
            if bytes.len() as u64 > self.polygons.size() {
                self.polygons = polygon_buffer(&self.device, polygons.len().next_power_of_two())?;
            }
            queue.write_buffer(&self.polygons, 0, bytes);
            self.written_polygons = polygons;
        }
        if records != self.written {
            queue.write_buffer(&self.buffer, 0, bytemuck::cast_slice(&records));
            self.written = records;
        }
        self.division = counts;
        Ok(())
    }

    /// The records.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// What flat ones are made of: an `array<Polygon>` of `shaders/common/polygon.wgsl`. Another buffer where there are more.
    pub fn polygons(&self) -> &wgpu::Buffer {
        &self.polygons
    }

    /// Whether photons start on a lamp's surface, from where their first hop is traced like any other.
    pub fn have_area(&self) -> bool {
        !self.written_polygons.is_empty()
    }

    /// Lights written.
    pub fn count(&self) -> u32 {
        self.written.len() as u32
    }

    /// As written, in the order that photons name them.
    pub(super) fn records(&self) -> &[gpu::LightRecord] {
        &self.written
    }

    /// Of those that are flat.
    pub(super) fn written_polygons(&self) -> &[gpu::Polygon] {
        &self.written_polygons
    }

    /// Whether each light written has an extent, and so a penumbra.
    pub(crate) fn have_extent(&self) -> impl Iterator<Item = bool> {
        self.written.iter().map(|l| l.extent > 0.0)
    }

    /// The lights written by number, those of most flux first.
    pub(crate) fn by_flux(&self) -> Vec<usize> {
        let flux = |l: &gpu::LightRecord| l.photon_flux.iter().sum::<f32>() * l.photon_count.max(1) as f32;
        let mut order: Vec<_> = (0..self.written.len()).collect();
        order.sort_by(|&a, &b| flux(&self.written[b]).total_cmp(&flux(&self.written[a])));
        order
    }

    /// Photons that the lights written emit in all.
    pub fn photon_count(&self) -> u32 {
        self.written.iter().map(|l| l.photon_count).sum()
    }

    /// Bytes this resource allocated.
    pub fn memory_use(&self) -> u64 {
        self.buffer.size() + self.polygons.size()
    }
}

fn polygon_buffer(gpu: &wgpu::Device, count: usize) -> Result<wgpu::Buffer, Error> {
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
    let bytes = (count * size_of::<gpu::Polygon>()) as u64;
    device::buffer(gpu, "lightfall::Lights::polygons", bytes, usage)
}

/// The polygons of a flat light, and which of them are what: those that direct light is of, then those that photons start on,
/// unless these are the same.
fn add_polygons(
    frame: &UnitFrame,
    light: &Light,
    lamp: Option<&Lamp>,
    record: &mut gpu::LightRecord,
    polygons: &mut Vec<gpu::Polygon>,
) {
    let first = polygons.len();
    let triangles = lamp.map_or(&[][..], |l| &l.triangles);
    if triangles.is_empty() || triangles.len() > MAX_DIRECT_POLYGONS {
        polygons.extend(parallelogram(frame, light));
    }
    record.direct_polygons = (polygons.len() - first) as u32;
    let flux: f64 = triangles.iter().map(EmissiveTriangle::flux).sum();
    let mut so_far = 0.0;
    polygons.extend(triangles.iter().map(|triangle| {
        so_far += triangle.flux();
        triangle_polygon(frame, triangle, so_far / flux)
    }));
    // Nothing shines behind the plane of a flat lamp.
    let plane = Vec3::from(record.direction).as_dvec3();
    let is_flat = |t: &EmissiveTriangle| t.area_vector().dot(plane) >= FLAT * t.area();
    record.inner = if triangles.iter().all(is_flat) { 1.0 } else { 0.0 };
    record.first_polygon = first as u32;
    record.polygon_count = (polygons.len() - first) as u32;
    if record.direct_polygons == 0 {
        record.direct_polygons = record.polygon_count;
    }
}

fn parallelogram(frame: &UnitFrame, light: &Light) -> Option<gpu::Polygon> {
    let LightKind::Rectangle { center, half_u, half_v } = light.kind else {
        return None;
    };
    let corner = center - half_u - half_v;
    Some(polygon(
        frame,
        4,
        [corner, 2.0 * half_u, 2.0 * half_v],
        1.0,
        light.strength(),
        1.0,
    ))
}

fn triangle_polygon(frame: &UnitFrame, triangle: &EmissiveTriangle, until: f64) -> gpu::Polygon {
    let [a, b, c] = triangle.corners;
    let radiance = Vec3::from(triangle.radiance).as_dvec3();
    polygon(frame, 3, [a, b - a, c - a], 0.5, radiance, until)
}

/// `place`: a corner and the two sides that meet there; `share`: of the parallelogram that they span.
fn polygon(
    frame: &UnitFrame,
    corners: u32,
    place: [DVec3; 3],
    share: f64,
    radiance: DVec3,
    until: f64,
) -> gpu::Polygon {
    let [u, v] = [place[1], place[2]].map(|side| side / frame.length_scale());
    gpu::Polygon {
        corner: frame.point(place[0]).to_array(),
        corners,
        u: u.as_vec3().to_array(),
        until: until as f32,
        v: v.as_vec3().to_array(),
        area: (share * u.cross(v).length()) as f32,
        radiance: frame.radiance(radiance).to_array(),
        _pad: 0.0,
    }
}

/// Flux of each light over all channels, none of an environment.
fn fluxes(frame: &UnitFrame, lights: &[Light]) -> Vec<f64> {
    let region_radius = f64::from(frame.radius()) * frame.length_scale();
    let flux_of = |l: &Light| match l.is_environment() {
        true => 0.0,
        false => l.flux(region_radius).element_sum(),
    };
    lights.iter().map(flux_of).collect()
}

/// Photons per light by its flux; sums to `total` if any light shines. Each of them that shines gets one before the rest is
/// divided; with fewer photons than lights the last ones get none, and their light is missing.
pub(super) fn divide_photons(flux: &[f64], total: u32) -> Vec<u32> {
    let all: f64 = flux.iter().sum();
    let shining = flux.iter().filter(|&&f| f > 0.0).count() as f64;
    let mut ones_left = total.min(shining as u32);
    let rest = f64::from(total - ones_left);
    let mut share_so_far = 0.0;
    let mut given = 0;
    flux.iter()
        .map(|&f| {
            let mut one = 0;
            if f > 0.0 {
                share_so_far += (1.0 - EVEN_SHARE) * f / all + EVEN_SHARE / shining;
                one = ones_left.min(1);
                ones_left -= one;
            }
            // Rounding the running sum, not each share, makes the parts add up.
            let until = (share_so_far * rest).round().min(rest) as u32;
            let count = one + until - given;
            given = until;
            count
        })
        .collect()
}

/// Whether a division of photons is of as many as another one, and within the tolerance of it.
fn is_near(division: &[u32], wanted: &[u32]) -> bool {
    let near = |(&a, &b): (&u32, &u32)| f64::from(a.max(b)) <= DIVISION_TOLERANCE * f64::from(a.min(b));
    let sum = |counts: &[u32]| counts.iter().sum::<u32>();
    division.len() == wanted.len() && sum(division) == sum(wanted) && division.iter().zip(wanted).all(near)
}

/// `None` for an environment. Polygons are left to be added.
fn record(
    frame: &UnitFrame,
    light: &Light,
    first_layer: u32,
    first_photon: u32,
    count: u32,
) -> Option<gpu::LightRecord> {
    let region_radius = f64::from(frame.radius()) * frame.length_scale();
    let photon_flux = light.flux(region_radius) / f64::from(count.max(1));
    let shape = ShadowMaps::light_shape(frame, light)?;
    let axes = axes_along(shape.direction);
    let (mut inner, mut outer, mut kind) = (2.0, 2.0, gpu::POINT);
    let (mut position, mut intensity) = (Vec3::ZERO, frame.intensity(light.strength()));
    let mut density = 1.0 / light.effective_solid_angle().max(f64::MIN_POSITIVE);
    let extent;
    match light.kind {
        LightKind::Rectangle { center, half_u, half_v } => {
            kind = gpu::AREA;
            // The disc of its area.
            let radius = (4.0 * half_u.cross(half_v).length() / std::f64::consts::PI).sqrt();
            position = frame.point(eye_before(light).unwrap_or(center));
            intensity = frame.radiance(light.strength());
            density = std::f64::consts::FRAC_1_PI;
            extent = radius / frame.length_scale();
        }
        LightKind::Point { position: p, radius } => {
            position = frame.point(p);
            extent = radius / frame.length_scale();
        }
        LightKind::Spot {
            position: p,
            inner_angle,
            outer_angle,
            radius,
            ..
        } => {
            kind = gpu::SPOT;
            position = frame.point(p);
            extent = radius / frame.length_scale();
            inner = crate::scene::one_minus_cos(inner_angle);
            outer = crate::scene::one_minus_cos(outer_angle);
        }
        LightKind::Directional { angle, .. } => {
            kind = gpu::DIRECTIONAL;
            extent = angle.tan();
            intensity = frame.radiance(light.strength());
            let radius = f64::from(frame.radius());
            density = 1.0 / (std::f64::consts::PI * radius * radius);
        }
        LightKind::Environment { .. } => return None,
    }
    Some(gpu::LightRecord {
        position: position.to_array(),
        kind,
        direction: axes.forward.to_array(),
        inner: inner as f32,
        intensity: intensity.to_array(),
        outer: outer as f32,
        right: axes.right.to_array(),
        first_layer,
        up: axes.up.to_array(),
        layer_count: shape.layers,
        photon_flux: frame.intensity(photon_flux).to_array(),
        half_extent: shape.half_extent,
        first_photon,
        photon_count: count,
        density: density as f32,
        disc_radius: frame.radius(),
        extent: extent.min(LARGEST_EXTENT) as f32,
        first_polygon: 0,
        direct_polygons: 0,
        polygon_count: 0,
    })
}

/// Where a flat light's shadow maps are taken from, world space: a little before its middle.
pub(super) fn eye_before(light: &Light) -> Option<DVec3> {
    let LightKind::Rectangle { center, half_u, half_v } = light.kind else {
        return None;
    };
    let front = half_u.cross(half_v);
    Some(center + BEFORE_LAMP * front.length().sqrt() * front.normalize())
}

/// How a light looks at the scene: along which axis, how wide, with how many layers.
pub(super) struct LightShape {
    pub(super) direction: DVec3,
    /// Tangent of the half angle, or half the width of parallel rays, unit frame; 1 for cubes.
    pub(super) half_extent: f32,
    /// 6 for a cube, else 1.
    pub(super) layers: u32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneBounds;

    fn frame() -> UnitFrame {
        UnitFrame::new(&SceneBounds::new(DVec3::splat(-1.0), DVec3::splat(1.0)).unwrap(), 1.0).unwrap()
    }

    #[test]
    fn photons_are_divided_by_flux_with_a_quarter_shared_evenly() {
        let light = |i| Light::point(DVec3::ZERO, i, [1.0; 3]);
        let counts = divide_photons(&fluxes(&frame(), &[light(1.0), light(3.0), light(0.0)]), 1000);
        assert_eq!(counts, [313, 687, 0]);
        assert_eq!(counts.iter().sum::<u32>(), 1000);
        assert_eq!(divide_photons(&fluxes(&frame(), &[light(0.0)]), 1000), [0]);
        let one_bright_among_many: Vec<_> = (0..64).map(|i| light(if i == 0 { 1e6 } else { 1.0 })).collect();
        let counts = divide_photons(&fluxes(&frame(), &one_bright_among_many), 100);
        assert!(counts.iter().all(|&c| c >= 1), "{counts:?}");
        assert_eq!(counts.iter().sum::<u32>(), 100);
        let sky = Light {
            kind: LightKind::Environment {
                image: None,
                rotation: 0.0,
            },
            ..light(1e9)
        };
        let counts = divide_photons(&fluxes(&frame(), &[sky.clone(), light(1.0), sky, light(3.0)]), 1000);
        assert_eq!(counts, [0, 313, 0, 687]);
    }

    #[test]
    fn a_division_is_near_where_no_light_is_off_by_more_than_half() {
        assert!(is_near(&[500, 500, 0], &[600, 400, 0]));
        assert!(is_near(&[600, 400], &[400, 600]));
        for (kept, wanted) in [
            (&[500, 500][..], &[700, 300][..]),
            // One that begins or ends to shine.
            (&[1000, 0], &[999, 1]),
            (&[999, 1], &[1000, 0]),
            // Others in number.
            (&[500, 500], &[500, 501]),
            (&[1000], &[500, 500]),
            (&[], &[1000]),
        ] {
            assert!(!is_near(kept, wanted), "{kept:?}, {wanted:?}");
        }
    }
}
