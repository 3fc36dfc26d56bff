//! Lists of rays and of what they hit.

use crate::{Error, gpu};
use bytemuck::{Pod, Zeroable};
use std::marker::PhantomData;

/// A ray, unit frame.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Ray {
    /// Where it starts.
    pub origin: [f32; 3],
    /// Hits count from 0 up to this, in lengths of `direction`; [`Ray::FURTHEST`] for all.
    pub furthest: f32,
    /// Which way it goes; not zero, of any length.
    pub direction: [f32; 3],
    /// Which instances it meets: [`Ray::ALL`], or those that share one of the other bits.
    pub mask: u32,
}

impl Ray {
    /// Further than any two points of a scene are apart.
    pub const FURTHEST: f32 = 1e30;
    /// Every instance.
    pub const ALL: u32 = 1;
    /// Instances that cast shadows.
    pub const CASTS_SHADOW: u32 = 2;
    /// Instances that environment maps see.
    pub const IN_ENV_MAPS: u32 = 4;
}

/// What a ray hit.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RayHit {
    /// In lengths of the ray's direction; the ray's own limit if it hit nothing.
    pub distance: f32,
    /// Index of the instance; [`RayHit::NOTHING`] if it hit nothing.
    pub instance: u32,
    /// Index of the triangle in its mesh; [`RayHit::NOTHING`] if it hit nothing.
    pub triangle: u32,
    /// 1 if it hit the front, 0 if the back.
    pub is_front: u32,
    /// Weights of the triangle's second and third vertex.
    pub barycentric: [f32; 2],
    /// Nodes whose children the ray was tested against.
    pub nodes_visited: u32,
    /// Triangles the ray was tested against.
    pub triangles_visited: u32,
}

impl RayHit {
    /// Instance and triangle of a ray that hit nothing.
    pub const NOTHING: u32 = u32::MAX;

    /// Whether the ray hit anything.
    pub fn is_hit(&self) -> bool {
        self.instance != Self::NOTHING
    }
}

/// Rays against triangles on the GPU, 32 bytes each, and room for what they hit, 32 bytes each.
pub type Rays = RayList<Ray, RayHit>;

/// A list of rays on the GPU, and room for what becomes of them: [`Rays`] or
/// [`SurfaceRays`](super::SurfaceRays).
#[derive(Debug)]
pub struct RayList<R, H> {
    rays: wgpu::Buffer,
    hits: wgpu::Buffer,
    count: u32,
    records: PhantomData<(R, H)>,
}

impl<R: Pod, H: Pod> RayList<R, H> {
    /// Room for `count` rays. Both buffers are also `COPY_SRC`; rays may be written by [`RayList::write`], a copy or a
    /// shader.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] for more than one storage binding holds.
    pub fn new(device: &wgpu::Device, count: u32) -> Result<Self, Error> {
        use wgpu::BufferUsages as U;
        let usage = U::STORAGE | U::COPY_DST | U::COPY_SRC;
        let bytes = |size: usize| u64::from(count.max(1)) * size as u64;
        Ok(Self {
            rays: gpu::buffer(device, "lightfall::RayList::rays", bytes(size_of::<R>()), usage)?,
            hits: gpu::buffer(device, "lightfall::RayList::hits", bytes(size_of::<H>()), usage)?,
            count,
            records: PhantomData,
        })
    }

    /// Uploads rays.
    ///
    /// # Errors
    /// [`Error::CountMismatch`] unless there are as many as there is room for.
    pub fn write(&self, queue: &wgpu::Queue, rays: &[R]) -> Result<(), Error> {
        if rays.len() != self.count as usize {
            return Err(Error::CountMismatch {
                what: "rays written over a list of rays",
                expected: self.count as usize,
                found: rays.len(),
            });
        }
        queue.write_buffer(&self.rays, 0, bytemuck::cast_slice(rays));
        Ok(())
    }

    /// An array of the rays.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.rays
    }

    /// An array of what became of them.
    pub fn hits(&self) -> &wgpu::Buffer {
        &self.hits
    }

    /// How many rays.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Bytes of both buffers.
    pub fn memory_use(&self) -> u64 {
        self.rays.size() + self.hits.size()
    }
}
