//! What caustic photons are aimed at, and how many of them each light emits.

use super::lights::{divide_photons, gpu::LightRecord};
use super::{Lights, MAX_LIGHTS};
use crate::scene::{BoundingSphere, UnitFrame};
use crate::{Error, gpu as device};
use glam::Vec3;
use std::f32::consts::PI;

/// Most balls that photons are aimed at. Twin of `PHOTON_TARGETS_MOST`.
pub(crate) const MOST_TARGETS: usize = 64;

pub(crate) mod gpu {
    use super::{MAX_LIGHTS, MOST_TARGETS};
    use bytemuck::{Pod, Zeroable};

    /// Twin of `PhotonTargets` in `shaders/common/photon_targets.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct PhotonTargets {
        pub(crate) balls: [[f32; 4]; MOST_TARGETS],
        pub(crate) ranges: [[u32; 2]; MAX_LIGHTS],
        pub(crate) ball_count: u32,
        pub(crate) _pad: [u32; 3],
    }
}

/// Balls around specular surfaces, and for each light which photons are its own.
#[derive(Debug)]
pub struct PhotonTargets {
    buffer: wgpu::Buffer,
    written: Option<Box<gpu::PhotonTargets>>,
}

impl PhotonTargets {
    /// Aimed at nothing yet.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(gpu: &wgpu::Device) -> Result<Self, Error> {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let bytes = size_of::<gpu::PhotonTargets>() as u64;
        Ok(Self {
            buffer: device::buffer(gpu, "lightfall::PhotonTargets", bytes, usage)?,
            written: None,
        })
    }

    /// Uploads this frame's targets, world space; beyond 64 those that stand together share a ball. `photon_count` photons are
    /// divided among the lights: three quarters in proportion to the flux that goes towards the targets, one quarter evenly
    /// among those that send any.
    pub fn write(
        &mut self,
        queue: &wgpu::Queue,
        frame: &UnitFrame,
        lights: &Lights,
        targets: &[BoundingSphere],
        photon_count: u32,
    ) {
        let balls = BoundingSphere::group(targets, MOST_TARGETS);
        let ball = |sphere: &BoundingSphere| {
            let radius = (sphere.radius / frame.length_scale()) as f32;
            frame.point(sphere.center).extend(radius).to_array()
        };
        let mut record = gpu::PhotonTargets {
            balls: [[0.0; 4]; MOST_TARGETS],
            ranges: [[0; 2]; MAX_LIGHTS],
            ball_count: balls.len() as u32,
            _pad: [0; 3],
        };
        for (slot, sphere) in record.balls.iter_mut().zip(&balls) {
            *slot = ball(sphere);
        }
        let balls = &record.balls[..balls.len()];
        let flux: Vec<f64> = lights.records().iter().map(|light| aimed_flux(light, balls)).collect();
        let mut first = 0;
        for (range, count) in record.ranges.iter_mut().zip(divide_photons(&flux, photon_count)) {
            *range = [first, count];
            first += count;
        }
        if self.written.as_deref() != Some(&record) {
            queue.write_buffer(&self.buffer, 0, bytemuck::bytes_of(&record));
            self.written = Some(Box::new(record));
        }
    }

    /// The record: a `PhotonTargets` of `shaders/common/photon_targets.wgsl`.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.buffer.size()
    }
}

/// Flux that a light sends towards balls, as if its intensity were the same in all directions that it has any, and no two
/// balls overlapped.
fn aimed_flux(light: &LightRecord, balls: &[[f32; 4]]) -> f64 {
    let all = f64::from(Vec3::from(light.photon_flux).element_sum()) * f64::from(light.photon_count.max(1));
    let eye = Vec3::from(light.position);
    let share = |&[x, y, z, radius]: &[f32; 4]| {
        if light.kind == super::lights::gpu::DIRECTIONAL {
            return light.density * PI * radius * radius;
        }
        let sine_squared = radius * radius / (Vec3::new(x, y, z) - eye).length_squared();
        let one_minus_cos = match sine_squared < 1.0 {
            true => sine_squared / (1.0 + (1.0 - sine_squared).sqrt()),
            false => 2.0,
        };
        light.density * 2.0 * PI * one_minus_cos
    };
    all * f64::from(balls.iter().map(share).sum::<f32>().min(1.0))
}
