//! Lists of rays that leave surfaces, and what environment maps, or triangles, say of them.

use super::{Photon, RayList};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A ray that leaves a surface, unit frame.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SurfaceRay {
    /// Where on the surface.
    pub position: [f32; 3],
    /// Geometric normal of the surface on the side it leaves, octahedral ([`Photon::pack_unit_vector`]).
    pub normal: u32,
    /// Unit.
    pub direction: [f32; 3],
    /// For whoever made it; tracers do not read it.
    pub tag: u32,
}

impl SurfaceRay {
    /// A ray from `position` on a surface of this unit `normal`, along a unit `direction`.
    pub fn new(position: Vec3, normal: Vec3, direction: Vec3) -> Self {
        Self {
            position: position.to_array(),
            normal: Photon::pack_unit_vector(normal),
            direction: direction.to_array(),
            tag: 0,
        }
    }
}

/// What became of a ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SurfaceHitKind {
    /// It meets a surface.
    Surface,
    /// It meets a surface, unless something that no map sees is in the way or the map that showed it was misread.
    Tentative,
    /// It meets nothing.
    Escaped,
    /// The maps cannot tell.
    Lost,
}

/// What the maps, or triangles, say of a ray.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SurfaceHit {
    /// From where the ray starts, unit frame: 2^-12 above its position through maps, some units in the last place above it
    /// among triangles. 0 if it meets nothing.
    pub distance: f32,
    /// A [`SurfaceHitKind`] as a number, from 1 in the order Surface, Escaped, Lost, Tentative.
    pub kind: u32,
    /// Geometric normal on the side hit, octahedral.
    pub normal: u32,
    /// Reflectance, 11-11-10.
    pub reflectance: u32,
    /// Texels fetched on the way, of maps and hierarchies alike; this and the following are 0 among triangles.
    pub fetches: u32,
    /// Maps walked through.
    pub maps: u32,
    /// Steps of the innermost loops.
    pub steps: u32,
    /// How the surface scatters, as surface texels have it; bit 14: its back is hit.
    pub lobe: u32,
}

impl SurfaceHit {
    /// What became of the ray.
    pub fn kind(&self) -> SurfaceHitKind {
        match self.kind {
            1 => SurfaceHitKind::Surface,
            2 => SurfaceHitKind::Escaped,
            4 => SurfaceHitKind::Tentative,
            _ => SurfaceHitKind::Lost,
        }
    }
}

/// Rays that leave surfaces, on the GPU, 32 bytes each, and room for what becomes of them, 32 bytes each.
pub type SurfaceRays = RayList<SurfaceRay, SurfaceHit>;
