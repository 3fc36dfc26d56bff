//! All that lights a frame.

use super::{Lamp, Light};

/// The lights of a scene, what stands for its environment, and what stands for its emissive triangles: in this order shadow maps
/// are numbered and photons name their light.
#[derive(Debug, Clone, Copy, Default)]
pub struct LightSources<'a> {
    /// Those of the host; an environment among them is passed over.
    pub lights: &'a [Light],
    /// Parts of the environment, [`Sun::light`](super::Sun::light). Rays that meet no surface see the environment itself.
    pub suns: &'a [Light],
    /// Emissive triangles.
    pub lamps: &'a [Lamp],
}

impl LightSources<'_> {
    /// One after the other: what shadow maps are made for.
    pub fn all(&self) -> Vec<Light> {
        let lamps = self.lamps.iter().map(|l| &l.light);
        self.lights.iter().chain(self.suns).chain(lamps).cloned().collect()
    }

    /// How many of them there are, environments left out.
    pub fn count(&self) -> usize {
        let lights = self.lights.iter().filter(|l| !l.is_environment()).count();
        lights + self.suns.len() + self.lamps.len()
    }
}
