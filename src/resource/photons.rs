//! Photons: where light arrived, from where, and how much.

use crate::{Error, gpu};
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec2Swizzles as _, Vec3};

/// Bytes of one photon record.
pub const PHOTON_BYTES: u64 = size_of::<Photon>() as u64;

/// One slot of the photon buffer: what became of one hop of one path.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Photon {
    /// Where the hop ended, unit frame.
    pub position: [f32; 3],
    /// Low two bits: a [`PhotonState`]. Bits 2 to 7: bits 0 to 5 of the surface's lobe, 0 if it is diffuse. Bit 8: the path
    /// came straight from its light. Bit 9: the tracer is not sure of the hop. Bit 10: the hop begins here, at its light, and
    /// is still to be traced; `position`, `normal` and `direction` are those of its start. Bit 11: the surface's back is hit.
    /// Bit 12: it came by way of metal and glass alone, in a [`PhotonMap::Global`]. Bit 13, beside bit 10: the light's rays are
    /// parallel. Bit 14, beside bit 8 or 10: the light is flat. Bits 15 to 31 are 0 where no photons are guided and after the
    /// path's end, else (see [`GuidingTables`](super::GuidingTables)): bit 15, this one is; bits 16 to 23, the cell that it
    /// started in; bits 24 to 31, b where those that are guided come this way 2^((b − 128) / 8) times as densely as those that
    /// are spread evenly.
    pub state: u32,
    /// Radiant flux that the hop carried, unit frame, before the surface takes its share.
    pub flux: [f32; 3],
    /// Density of photons of this hop per unit area at its end: q(ω)·cosθ/d² (q the solid-angle pdf of its
    /// direction), 1 / (unit-frame length)². On metal and glass instead, in the upper and the lower 16 bits, the upper halves
    /// of the radius of a photon's footprint and of its growth in a unit of length.
    pub density: f32,
    /// Normal on the side hit, octahedral (`pack2x16snorm`): the geometric one, of metal and glass the shading normal.
    pub normal: u32,
    /// Direction of travel, octahedral.
    pub direction: u32,
    /// Reflectance of the surface, 11-11-10.
    pub reflectance: u32,
    /// Bits 0 to 7: index of the light that the path began at, in [`Lights`](super::Lights). Bits 8 to 15: bits 6 to 13 of the
    /// surface's lobe. Bits 16 to 31: [`Instance::surface`](crate::scene::Instance::surface) of what was hit, 0 where it has
    /// none.
    pub light_and_surface: u32,
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
    /// Bit of `state` that marks a hop of which the tracer is not sure: a surer one should walk it again.
    pub const TENTATIVE: u32 = 512;

    /// Bit of `state` that marks a photon at its light, whose first hop is not traced yet.
    pub const STARTED: u32 = 1024;

    /// Bit of `state` that marks one for which a caustic map stands.
    pub const CAUSTIC: u32 = 4096;

    pub(crate) const GUIDANCE_ONE: f32 = 128.0;
    pub(crate) const GUIDANCE_STEPS: f32 = 8.0;

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

    /// Whether a surer tracer should walk this hop again: it is lost or tentative.
    pub fn is_unresolved(&self) -> bool {
        self.state() == PhotonState::Lost || self.state & Self::TENTATIVE != 0
    }

    /// A unit vector as `normal` and `direction` hold it: the bits that `octahedral_pack` of the shaders makes.
    pub fn pack_unit_vector(v: Vec3) -> u32 {
        let p = v.truncate() / (v.x.abs() + v.y.abs() + v.z.abs());
        let folded = (Vec2::ONE - p.yx().abs()) * Vec2::select(p.cmpge(Vec2::ZERO), Vec2::ONE, Vec2::NEG_ONE);
        let encoded = if v.z >= 0.0 { p } else { folded };
        let [x, y] = encoded.to_array().map(snorm16);
        u32::from(x) | u32::from(y) << 16
    }

    /// The unit vector that `normal` or `direction` holds, as `octahedral_unpack` of the shaders takes it.
    pub fn unpack_unit_vector(bits: u32) -> Vec3 {
        let [x, y] = [bits, bits >> 16].map(|b| (f32::from(b as u16 as i16) / 32767.0).max(-1.0));
        let p = Vec2::new(x, y);
        let z = 1.0 - p.x.abs() - p.y.abs();
        let folded = (Vec2::ONE - p.yx().abs()) * Vec2::select(p.cmpge(Vec2::ZERO), Vec2::ONE, Vec2::NEG_ONE);
        (if z >= 0.0 { p } else { folded }).extend(z).normalize()
    }

    /// Linear RGB in [0, 1] as `reflectance` holds it, 11-11-10.
    pub fn pack_reflectance(rgb: [f32; 3]) -> u32 {
        let steps = |value: f32, most: f32| (value.clamp(0.0, 1.0) * most).round() as u32;
        steps(rgb[0], 2047.0) | steps(rgb[1], 2047.0) << 11 | steps(rgb[2], 1023.0) << 22
    }

    /// Index of the light that the path began at, in [`Lights`](super::Lights).
    pub fn light(&self) -> u32 {
        self.light_and_surface & 0xff
    }

    /// The surface that it arrived at; 0: none in particular.
    pub fn surface(&self) -> u16 {
        (self.light_and_surface >> 16) as u16
    }

    /// How many times as densely guided photons come this one's way as those that are spread evenly, in steps of an eighth of a
    /// doubling; 1 where none are guided.
    pub fn guidance(&self) -> f32 {
        match self.state >> 24 {
            0 => 1.0,
            steps => ((steps as f32 - Self::GUIDANCE_ONE) / Self::GUIDANCE_STEPS).exp2(),
        }
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

/// Which paths a set of photons holds, after Jensen's photon maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum PhotonMap {
    /// All.
    #[default]
    All,
    /// All; but of those that come from a light by way of metal and glass alone the first photon at a diffuse surface is not
    /// splatted, for one of a caustic map is.
    Global,
    /// Those alone, as far as that photon.
    Caustic,
}

/// Photon records of `count` paths of up to `bounces` scatterings: slot `b` × `count` + `i` is hop `b` of path `i`. Hop 0 ends
/// at the first surface that light from the source meets; of what [`PhotonPool::near`](super::PhotonPool::near) holds, at any.
#[derive(Debug)]
pub struct Photons {
    buffer: wgpu::Buffer,
    count: u32,
    bounces: u32,
    map: PhotonMap,
    /// The first slot of indirect light.
    first_indirect: u32,
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
            map: PhotonMap::All,
            first_indirect: count,
            bytes,
        })
    }

    /// Room for `count` photons of indirect light, one hop each: hop 0 counts in density estimation as later ones do.
    ///
    /// # Errors
    /// As [`Photons::new`].
    pub(crate) fn of_indirect_light(device: &wgpu::Device, count: u32) -> Result<Self, Error> {
        Ok(Self {
            first_indirect: 0,
            ..Self::new(device, count, 0)?
        })
    }

    /// Around a host's own buffer of records. What the buffer holds behind them must be zeros: `EnvMapSelector` takes its
    /// samples from the whole of it.
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
            map: PhotonMap::All,
            first_indirect: count,
            bytes: 0,
        })
    }

    /// The same buffer for another number of paths.
    ///
    /// # Errors
    /// [`Error::CountMismatch`] for more than there is room for.
    pub(crate) fn part(&self, count: u32) -> Result<Self, Error> {
        Ok(Self {
            map: self.map,
            bytes: self.bytes,
            ..Self::from_buffer(&self.buffer, count, self.bounces)?
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

    /// Which paths the tracers walk.
    pub fn map(&self) -> PhotonMap {
        self.map
    }

    /// Says which paths the tracers walk from now on: at first all.
    pub fn set_map(&mut self, map: PhotonMap) {
        self.map = map;
    }

    /// The first slot that density estimation reads.
    pub(crate) fn first_indirect(&self) -> u32 {
        self.first_indirect
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

/// As `pack2x16snorm` rounds.
fn snorm16(value: f32) -> u16 {
    (0.5 + 32767.0 * value.clamp(-1.0, 1.0)).floor() as i16 as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_packed_unit_vector_comes_back() {
        // Half a step of either coordinate moves the point of the octahedron by at most 2.5 / 65534, and the octahedron
        // comes no nearer to the origin than 1 / √3.
        let worst = 2.5 / 65534.0 * 3f32.sqrt();
        for i in 0..1000u32 {
            let z = 1.0 - 2.0 * i as f32 / 999.0;
            let (sin, cos) = (2.4 * i as f32).sin_cos();
            let v = Vec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
            let error = (Photon::unpack_unit_vector(Photon::pack_unit_vector(v)) - v).length();
            assert!(error < worst, "{v}: {error}");
        }
        assert_eq!(Photon::pack_unit_vector(Vec3::Z), 0);
        assert_eq!(Photon::pack_unit_vector(Vec3::NEG_Z), 0x7fff_7fff);
    }

    #[test]
    fn a_packed_reflectance_comes_back() {
        let rgb = [0.73, 0.05, 0.151];
        let photon = Photon {
            reflectance: Photon::pack_reflectance(rgb),
            ..Zeroable::zeroed()
        };
        let [r, g, b] = photon.reflectance();
        assert!((r - rgb[0]).abs() < 0.51 / 2047.0 && (g - rgb[1]).abs() < 0.51 / 2047.0);
        assert!((b - rgb[2]).abs() < 0.51 / 1023.0);
        assert_eq!(Photon::pack_reflectance([1.0, 2.0, -1.0]), 0x003f_ffff);
    }
}
