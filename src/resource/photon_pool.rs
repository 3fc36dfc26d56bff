//! The photons that surface lights are made of: a ring of paths.

use super::Photons;
use crate::{Error, gpu as device};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Impact` in `shaders/common/impact.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Impact {
        pub(crate) light: u32,
        pub(crate) red: u32,
        pub(crate) green: u32,
        pub(crate) blue: u32,
        pub(crate) offset: [f32; 3],
        pub(crate) pad: u32,
    }
}

/// Paths that are replaced one after the other, the oldest first: of each impact the light that it counts for, what it counts
/// there, in whole steps, and where it arrived, from the light's place; a storage buffer of 32 bytes an impact, `hop` × paths +
/// `path` in order. Emptied where lights are other ones ([`PhotonPool::restart`]).
#[derive(Debug)]
pub struct PhotonPool {
    buffer: wgpu::Buffer,
    paths: u32,
    hops: u32,
    /// The oldest path.
    next: u32,
    /// Paths that were streamed since the last restart.
    streamed: u64,
    is_stale: bool,
    notes_changes: bool,
    /// If what discs lose near by is kept.
    near: Option<Photons>,
}

impl PhotonPool {
    /// Bytes of a pool, without photons near by.
    pub fn size_in_bytes(paths: u32, hops: u32) -> u64 {
        u64::from(paths.max(1)) * u64::from(hops.max(1)) * size_of::<gpu::Impact>() as u64
    }

    /// Room for `paths` of up to `hops` impacts each: [`Photons::bounces`](super::Photons::bounces) + 1 of the photons
    /// that are streamed; as many as bounces where photons near by are kept.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, paths: u32, hops: u32) -> Result<Self, Error> {
        use wgpu::BufferUsages as B;
        let bytes = Self::size_in_bytes(paths, hops);
        let usage = B::STORAGE | B::COPY_DST | B::COPY_SRC;
        Ok(Self {
            buffer: device::buffer(device, "lightfall::PhotonPool", bytes, usage)?,
            paths: paths.max(1),
            hops: hops.max(1),
            next: 0,
            streamed: 0,
            is_stale: false,
            notes_changes: false,
            near: None,
        })
    }

    /// Keeps of each path one of the photons that came a short way at most, from now on, 48 bytes each: for what lights that
    /// are discs ([`LightShape::Disc`](crate::pass::LightShape::Disc)) lose near by. The photons that are streamed have one hop
    /// more then, whose light ends there. Unlike impacts these do not move along with what they lie on, but are replaced with
    /// their paths.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn keep_near(&mut self, device: &wgpu::Device) -> Result<(), Error> {
        self.near = Some(Photons::of_indirect_light(device, self.paths)?);
        self.restart();
        Ok(())
    }

    /// Has lights note what comes and goes from now on ([`SurfaceLights::changes`](super::SurfaceLights::changes)): the last
    /// hop for that alone, for whoever asks what has changed is lit by the hops before.
    pub fn note_changes(&mut self) {
        self.notes_changes = true;
    }

    pub(crate) fn notes_changes(&self) -> bool {
        self.notes_changes
    }

    /// Whether it is not full of photons since the last restart, or waits for the first.
    pub fn is_filling(&self) -> bool {
        self.is_stale || self.streamed < u64::from(self.paths)
    }

    pub(crate) fn is_stale(&self) -> bool {
        self.is_stale
    }

    /// What lights that are discs lose near by, one photon a path or none, for [`PhotonSplatter`](crate::pass::PhotonSplatter);
    /// its irradiance is to be divided by [`PhotonPool::share`], too. `None` unless it is kept.
    pub fn near(&self) -> Option<&Photons> {
        self.near.as_ref()
    }

    /// Empties it with the next photons that are streamed, and takes all flux from the lights: for other lights, or another
    /// unit frame. Between, the old light stays.
    pub fn restart(&mut self) {
        self.is_stale = true;
        self.next = 0;
    }

    /// Of so many new paths, the place of the first; whether the pool is to be emptied before.
    pub(crate) fn advance(&mut self, paths: u32) -> (u32, bool) {
        let is_stale = std::mem::take(&mut self.is_stale);
        if is_stale {
            self.streamed = 0;
        }
        let first = self.next;
        self.next = (first + paths) % self.paths;
        self.streamed += u64::from(paths);
        (first, is_stale)
    }

    /// The impacts.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// Paths that it holds.
    pub fn paths(&self) -> u32 {
        self.paths
    }

    /// Most impacts of a path.
    pub fn hops(&self) -> u32 {
        self.hops
    }

    /// The path that is replaced next. Emit photons from this index of the random sequence, and a path that comes again is the
    /// same one: where nothing moves nothing changes, to the bit.
    pub fn next(&self) -> u32 {
        self.next
    }

    /// Which part of the paths is there since the last restart, and of their flux: above 0 and at most 1. What surface lights
    /// shine while the pool fills is to be divided by it.
    pub fn share(&self) -> f32 {
        (self.streamed.clamp(1, u64::from(self.paths)) as f64 / f64::from(self.paths)) as f32
    }

    /// Bytes this resource allocated.
    pub fn memory_use(&self) -> u64 {
        self.buffer.size() + self.near.as_ref().map_or(0, Photons::memory_use)
    }
}
