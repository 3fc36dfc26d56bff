//! Photons: where light arrived, from where, and how much.

use crate::{Error, gpu};
use bytemuck::{Pod, Zeroable};

/// Bytes of one photon record.
pub const PHOTON_BYTES: u64 = size_of::<Photon>() as u64;

/// One slot of the photon buffer: what became of one hop of one path.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Photon {
    /// Where the hop ended, unit frame.
    pub position: [f32; 3],
    /// Low two bits: a [`PhotonState`]. Bit 8: the path came straight from its light.
    pub state: u32,
    /// Radiant flux that the hop carried, unit frame, before the surface takes its share.
    pub flux: [f32; 3],
    /// Density of photons of this hop per unit area at its end: q(ω)·cosθ/d² (q the solid-angle pdf of its
    /// direction), 1 / (unit-frame length)².
    pub density: f32,
    /// Geometric normal on the side hit, octahedral (`pack2x16snorm`).
    pub normal: u32,
    /// Direction of travel, octahedral.
    pub direction: u32,
    /// Reflectance of the surface, 11-11-10.
    pub reflectance: u32,
    /// Index of the light the path began at.
    pub light: u32,
}

/// What became of a hop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum PhotonState {
    /// The path had ended before.
    Empty = 0,
    /// It arrived at a surface and was stored.
    Stored = 1,
    /// It left the scene.
    Escaped = 2,
    /// The tracer could not tell where it went.
    Lost = 3,
}

impl Photon {
    /// Bit of `state` that marks a photon straight from its light.
    pub const FIRST_HIT: u32 = 256;

    /// What became of this hop.
    pub fn state(&self) -> PhotonState {
        match self.state & 3 {
            0 => PhotonState::Empty,
            1 => PhotonState::Stored,
            2 => PhotonState::Escaped,
            _ => PhotonState::Lost,
        }
    }

    /// Whether the path came straight from its light: direct light, which is not splatted.
    pub fn is_first_hit(&self) -> bool {
        self.state & Self::FIRST_HIT != 0
    }

    /// Reflectance of the surface hit.
    pub fn reflectance(&self) -> [f32; 3] {
        let bits = self.reflectance;
        [
            (bits & 2047) as f32 / 2047.0,
            (bits >> 11 & 2047) as f32 / 2047.0,
            (bits >> 22) as f32 / 1023.0,
        ]
    }
}

/// Photon records of `count` paths of up to `bounces` scatterings: slot `b` × `count` + `i` is hop `b` of path `i`.
/// Hop 0 ends at the first surface that light from the source meets.
#[derive(Debug)]
pub struct Photons {
    buffer: wgpu::Buffer,
    count: u32,
    bounces: u32,
    bytes: u64,
}

impl Photons {
    /// Bytes of `count` paths of up to `bounces` scatterings.
    pub fn size_in_bytes(count: u32, bounces: u32) -> u64 {
        PHOTON_BYTES * u64::from(count) * (u64::from(bounces) + 1)
    }

    /// Most paths that one storage binding holds under these limits.
    pub fn max_count(limits: &wgpu::Limits, bounces: u32) -> u32 {
        let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        (bytes / (PHOTON_BYTES * (u64::from(bounces) + 1))).min(u64::from(u32::MAX)) as u32
    }

    /// Room for `count` paths of up to `bounces` scatterings.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] above [`Photons::max_count`].
    pub fn new(device: &wgpu::Device, count: u32, bounces: u32) -> Result<Self, Error> {
        let bytes = Self::size_in_bytes(count, bounces).max(PHOTON_BYTES);
        use wgpu::BufferUsages as U;
        let buffer = gpu::buffer(
            device,
            "lightfall::Photons",
            bytes,
            U::STORAGE | U::COPY_SRC | U::COPY_DST,
        )?;
        Ok(Self {
            buffer,
            count,
            bounces,
            bytes,
        })
    }

    /// Around a host's own buffer of records.
    ///
    /// # Errors
    /// [`Error::CountMismatch`] if it is too small, [`Error::IncompatibleView`] without storage usage.
    pub fn from_buffer(buffer: &wgpu::Buffer, count: u32, bounces: u32) -> Result<Self, Error> {
        if !buffer.usage().contains(wgpu::BufferUsages::STORAGE) {
            return Err(Error::IncompatibleView {
                resource: "Photons buffer",
                property: "usage",
                expected: format!("at least {:?}", wgpu::BufferUsages::STORAGE),
                found: format!("{:?}", buffer.usage()),
            });
        }
        let needed = Self::size_in_bytes(count, bounces).max(PHOTON_BYTES);
        if buffer.size() < needed {
            return Err(Error::CountMismatch {
                what: "bytes in the photon buffer",
                expected: needed as usize,
                found: buffer.size() as usize,
            });
        }
        Ok(Self {
            buffer: buffer.clone(),
            count,
            bounces,
            bytes: 0,
        })
    }

    /// The records.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// Paths emitted.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Most scatterings a path may have.
    pub fn bounces(&self) -> u32 {
        self.bounces
    }

    /// Slots over all hops.
    pub fn slots(&self) -> u32 {
        self.count * (self.bounces + 1)
    }

    /// Bytes this resource allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}
