//! All that shines in a scene, as the path tracer samples it: lights, emissive triangles, the environment.

use crate::Error;
use crate::gpu::{self as device, TextureSpec};
use crate::scene::{EnvironmentImage, Light, LightKind, Scene, UnitFrame};
use glam::{DMat3, DVec3, Vec3};
use std::f64::consts::PI;

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Kinds of [`Emitter`]. Twins of `EMITTER_POINT` and so on.
    pub(crate) const POINT: u32 = 0;
    pub(crate) const SPOT: u32 = 1;
    pub(crate) const DIRECTIONAL: u32 = 2;
    pub(crate) const RECTANGLE: u32 = 3;
    pub(crate) const TRIANGLE: u32 = 4;
    pub(crate) const ENVIRONMENT: u32 = 5;

    /// Twin of `Emitter` in `shaders/reference/path_tracer/emitters.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Emitter {
        pub(crate) position: [f32; 3],
        pub(crate) kind: u32,
        pub(crate) u: [f32; 3],
        pub(crate) pick_until: f32,
        pub(crate) v: [f32; 3],
        pub(crate) pick: f32,
        pub(crate) strength: [f32; 3],
        pub(crate) extent: f32,
        pub(crate) inner: f32,
        pub(crate) outer: f32,
        pub(crate) material: u32,
        pub(crate) _pad: u32,
        pub(crate) tex_coords: [[f32; 2]; 3],
        pub(crate) _pad_end: [f32; 2],
    }
}

/// Everything in a scene that emits light, on the GPU. Each is picked in proportion to its power: 112 bytes an emitter, 16
/// a texel of the environment's image.
#[derive(Debug)]
pub struct Emitters {
    buffer: wgpu::Buffer,
    environment: wgpu::TextureView,
    environment_bytes: u64,
    environment_size: [u32; 2],
    environment_rotation: f32,
    environment_pick: f32,
    environment_norm: f32,
    count: u32,
    crossed_count: u32,
    pick_per_area: f32,
}

/// What the path tracer's uniform takes from here.
pub(super) struct EmitterParams {
    pub(super) count: u32,
    pub(super) crossed_count: u32,
    pub(super) pick_per_area: f32,
    pub(super) environment_pick: f32,
    pub(super) environment_norm: f32,
    pub(super) environment_size: [u32; 2],
    pub(super) environment_rotation: f32,
}

impl Emitters {
    /// Collects and uploads what shines in a scene, as it stands now, in a frame: make it anew when a light or an emissive
    /// instance changes, or the frame does. What emits less than about a millionth of all power is picked too seldom to be
    /// counted right.
    ///
    /// # Errors
    /// As [`Scene::validate`]; [`Error::LimitExceeded`] for more emissive triangles than the device holds, or an environment
    /// image that is not narrower than its largest texture by a texel.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, frame: &UnitFrame, scene: &Scene) -> Result<Self, Error> {
        scene.validate()?;
        let mut list = EmitterList::of(frame, scene);
        let total = list.assign_picks();
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let bytes = (list.emitters.len().max(1) * size_of::<gpu::Emitter>()) as u64;
        let buffer = device::buffer(device, "lightfall::Emitters", bytes, usage)?;
        queue.write_buffer(&buffer, 0, bytemuck::cast_slice(&list.emitters));
        let sky = list.environment.unwrap_or_else(Environment::black);
        let (environment, environment_bytes) = sky.upload(device, queue)?;
        let pick_of = |kind| list.emitters.iter().filter(|e| e.kind == kind).map(|e| e.pick).sum();
        Ok(Self {
            buffer,
            environment,
            environment_bytes,
            environment_size: sky.size,
            environment_rotation: sky.rotation,
            environment_pick: pick_of(gpu::ENVIRONMENT),
            environment_norm: sky.norm,
            count: list.emitters.len() as u32,
            crossed_count: list.crossed_count as u32,
            pick_per_area: if total > 0.0 { (PI / total) as f32 } else { 0.0 },
        })
    }

    /// Lights and emissive triangles that are not dark.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Bytes of buffer and texture.
    pub fn memory_use(&self) -> u64 {
        self.buffer.size() + self.environment_bytes
    }

    pub(super) fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    pub(super) fn environment(&self) -> &wgpu::TextureView {
        &self.environment
    }

    pub(super) fn params(&self) -> EmitterParams {
        EmitterParams {
            count: self.count,
            crossed_count: self.crossed_count,
            pick_per_area: self.pick_per_area,
            environment_pick: self.environment_pick,
            environment_norm: self.environment_norm,
            environment_size: self.environment_size,
            environment_rotation: self.environment_rotation,
        }
    }
}

/// Emitters in the unit frame with their powers; first those without geometry that rays can run into.
struct EmitterList {
    emitters: Vec<gpu::Emitter>,
    /// How many of them those are.
    crossed_count: usize,
    powers: Vec<f64>,
    environment: Option<Environment>,
}

impl EmitterList {
    fn of(frame: &UnitFrame, scene: &Scene) -> Self {
        let mut list = Self {
            emitters: Vec::new(),
            crossed_count: 0,
            powers: Vec::new(),
            environment: None,
        };
        let (crossed, others): (Vec<_>, Vec<_>) = scene.lights.iter().partition(|light| is_crossed(light));
        for light in crossed {
            list.add_light(frame, scene, light);
        }
        list.crossed_count = list.emitters.len();
        for light in others {
            list.add_light(frame, scene, light);
        }
        list.add_triangles(frame, scene);
        list
    }

    /// Adds an emitter unless it is dark. `power` is in the unit frame, summed over channels.
    fn add(&mut self, emitter: gpu::Emitter, power: f64) {
        if power > 0.0 {
            self.emitters.push(emitter);
            self.powers.push(power);
        }
    }

    fn add_light(&mut self, frame: &UnitFrame, scene: &Scene, light: &Light) {
        let length = frame.length_scale();
        let region_radius = f64::from(frame.radius()) * length;
        let flux = light.flux(region_radius).element_sum() / frame.flux_scale();
        let intensity = frame.intensity(light.strength()).to_array();
        let radiance = frame.radiance(light.strength()).to_array();
        let dark = gpu::Emitter {
            kind: gpu::POINT,
            strength: intensity,
            inner: 2.0,
            outer: 2.0,
            ..bytemuck::Zeroable::zeroed()
        };
        match light.kind {
            LightKind::Point { position, radius } => {
                let emitter = gpu::Emitter {
                    position: frame.point(position).to_array(),
                    extent: (radius / length) as f32,
                    ..dark
                };
                self.add(emitter, flux);
            }
            LightKind::Spot {
                position,
                direction,
                inner_angle,
                outer_angle,
                radius,
            } => {
                let emitter = gpu::Emitter {
                    kind: gpu::SPOT,
                    position: frame.point(position).to_array(),
                    u: direction.normalize().as_vec3().to_array(),
                    extent: (radius / length) as f32,
                    inner: crate::scene::one_minus_cos(inner_angle) as f32,
                    outer: crate::scene::one_minus_cos(outer_angle) as f32,
                    ..dark
                };
                self.add(emitter, flux);
            }
            LightKind::Directional { direction, angle } => {
                let emitter = gpu::Emitter {
                    kind: gpu::DIRECTIONAL,
                    u: direction.normalize().as_vec3().to_array(),
                    strength: radiance,
                    extent: angle as f32,
                    ..dark
                };
                self.add(emitter, flux);
            }
            LightKind::Rectangle { center, half_u, half_v } => {
                let (u, v) = (half_u / length, half_v / length);
                let emitter = gpu::Emitter {
                    kind: gpu::RECTANGLE,
                    position: frame.point(center).to_array(),
                    u: u.as_vec3().to_array(),
                    v: v.as_vec3().to_array(),
                    strength: radiance,
                    extent: (4.0 * u.cross(v).length()) as f32,
                    ..dark
                };
                self.add(emitter, flux);
            }
            LightKind::Environment { image, rotation } => {
                let image = image.map(|index| &scene.environments[index]);
                let sky = Environment::new(frame.radiance(light.strength()), image, rotation);
                let radius = f64::from(frame.radius());
                let power = sky.mean * 3.0 * 4.0 * PI * PI * radius * radius;
                let emitter = gpu::Emitter {
                    kind: gpu::ENVIRONMENT,
                    ..dark
                };
                self.add(emitter, power);
                self.environment = Some(sky);
            }
        }
    }

    fn add_triangles(&mut self, frame: &UnitFrame, scene: &Scene) {
        for instance in &scene.instances {
            let material = &scene.materials[instance.material];
            let radiance = frame.radiance(Vec3::from(material.emission).as_dvec3());
            if radiance == Vec3::ZERO {
                continue;
            }
            let mesh = &scene.meshes[instance.mesh];
            let to_unit = DMat3::from_diagonal(DVec3::splat(1.0 / frame.length_scale())) * instance.transform.matrix3;
            if !to_unit.inverse().is_finite() {
                // Rays do not see it either.
                continue;
            }
            // A mirroring transform turns triangles over; their front goes with them.
            let is_mirrored = to_unit.determinant() < 0.0;
            for triangle in mesh.indices.chunks_exact(3) {
                let order = if is_mirrored { [0, 2, 1] } else { [0, 1, 2] };
                let corners = order.map(|i| triangle[i] as usize);
                let [a, b, c] = corners.map(|i| Vec3::from(mesh.positions[i]).as_dvec3());
                let (u, v) = (to_unit * (b - a), to_unit * (c - a));
                let area = 0.5 * u.cross(v).length();
                let emitter = gpu::Emitter {
                    kind: gpu::TRIANGLE,
                    position: frame.point(instance.transform.transform_point3(a)).to_array(),
                    u: u.as_vec3().to_array(),
                    v: v.as_vec3().to_array(),
                    strength: radiance.to_array(),
                    extent: area as f32,
                    material: instance.material as u32,
                    tex_coords: corners.map(|i| mesh.tex_coords.get(i).copied().unwrap_or_default()),
                    ..bytemuck::Zeroable::zeroed()
                };
                // What a texture takes away is not counted: the pick only has to be what rays that hit take it for.
                self.add(emitter, PI * radiance.as_dvec3().element_sum() * area);
            }
        }
    }

    /// Divides the picks by power; returns the sum of powers.
    fn assign_picks(&mut self) -> f64 {
        let total: f64 = self.powers.iter().sum();
        let mut so_far = 0.0;
        for (emitter, power) in self.emitters.iter_mut().zip(&self.powers) {
            so_far += power;
            emitter.pick = (power / total) as f32;
            emitter.pick_until = (so_far / total) as f32;
        }
        total
    }
}

/// Whether rays can run into a light that is no surface and not all around: it has an extent.
fn is_crossed(light: &Light) -> bool {
    match light.kind {
        LightKind::Rectangle { .. } => true,
        LightKind::Point { radius, .. } | LightKind::Spot { radius, .. } => radius > 0.0,
        LightKind::Directional { angle, .. } => angle > 0.0,
        LightKind::Environment { .. } => false,
    }
}

/// The environment as a table to be searched.
struct Environment {
    size: [u32; 2],
    rotation: f32,
    /// Row by row; in each one texel more than the image has. RGB: radiance; A: running share of the row, or in the last
    /// column of all rows.
    texels: Vec<[f32; 4]>,
    /// Mean over the sphere and the channels.
    mean: f64,
    /// 1 / integral of the mean of channels over the sphere.
    norm: f32,
}

impl Environment {
    fn black() -> Self {
        Self::new(Vec3::ZERO, None, 0.0)
    }

    fn new(strength: Vec3, image: Option<&EnvironmentImage>, rotation: f64) -> Self {
        let (width, height) = image.map_or((1, 1), |i| (i.width as usize, i.height as usize));
        let texel =
            |row: usize, column: usize| strength * image.map_or(Vec3::ONE, |i| Vec3::from(i.rgb[row * width + column]));
        let solid_angle = |row: usize| image.map_or(4.0 * PI, |i| i.texel_solid_angle(row as u32));
        let mut texels = Vec::with_capacity((width + 1) * height);
        let mut rows = Vec::with_capacity(height);
        for row in 0..height {
            let weight = |column| mean_of_channels(texel(row, column)) * solid_angle(row);
            let shares = running_sum((0..width).map(weight));
            let all = shares.last().copied().unwrap_or_default();
            for (column, share) in shares.iter().enumerate() {
                texels.push(texel(row, column).extend(part(*share, all)).to_array());
            }
            texels.push([0.0; 4]);
            rows.push(all);
        }
        let until = running_sum(rows.into_iter());
        let integral = until.last().copied().unwrap_or_default();
        for (row, share) in until.iter().enumerate() {
            texels[row * (width + 1) + width][3] = part(*share, integral);
        }
        Self {
            size: [width as u32, height as u32],
            rotation: rotation as f32,
            texels,
            mean: integral / (4.0 * PI),
            norm: if integral > 0.0 { (1.0 / integral) as f32 } else { 0.0 },
        }
    }

    fn upload(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<(wgpu::TextureView, u64), Error> {
        let spec = TextureSpec {
            label: "lightfall::Emitters::environment",
            size: [self.size[0] + 1, self.size[1]],
            layers: 1,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        };
        let texture = device::texture(device, &spec)?;
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(16 * spec.size[0]),
            rows_per_image: None,
        };
        queue.write_texture(
            texture.as_image_copy(),
            bytemuck::cast_slice(&self.texels),
            layout,
            texture.size(),
        );
        Ok((texture.create_view(&Default::default()), spec.bytes()))
    }
}

/// Twin of `environment_mean`.
fn mean_of_channels(radiance: Vec3) -> f64 {
    radiance.as_dvec3().element_sum() / 3.0
}

fn running_sum(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let add = |sum: &mut f64, value| {
        *sum += value;
        Some(*sum)
    };
    values.scan(0.0, add).collect()
}

/// A running sum as a part of all: 1 at the end, exactly.
fn part(sum: f64, all: f64) -> f32 {
    if all > 0.0 { (sum / all) as f32 } else { 0.0 }
}
