//! Indirect light at points of surfaces, kept from frame to frame.

use super::{PathList, SurfaceLights};
use crate::{Error, gpu as device};

/// Irradiance at texels: of each light of [`SurfaceLights`] that of the side of the surface that it stands on, in their order.
/// Gathered by [`TexelGather`](crate::pass::TexelGather) where it has changed, a few texels a frame; shown by
/// [`TexelShading`](crate::pass::TexelShading), or by a host whose places are the texels of its own light map.
#[derive(Debug)]
pub struct IlluminationMap {
    gathered: wgpu::Buffer,
    shown: wgpu::Buffer,
    due: wgpu::Buffer,
    surface_changes: wgpu::Buffer,
    surface_areas: wgpu::Buffer,
    counts: wgpu::Buffer,
    radiosity: wgpu::Buffer,
    places: wgpu::Buffer,
    shifts: wgpu::Buffer,
    chosen: PathList,
    capacity: u32,
    is_stale: bool,
    written: Vec<f32>,
}

impl IlluminationMap {
    /// Room for a texel at each of the lights that there is room for, of which up to `a_frame` are gathered at once.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, lights: &SurfaceLights, a_frame: u32) -> Result<Self, Error> {
        use wgpu::BufferUsages as B;
        let capacity = lights.capacity().max(2);
        let usage = B::STORAGE | B::COPY_DST | B::COPY_SRC;
        let buffer = |label, each: u64| device::buffer(device, label, u64::from(capacity) * each, usage);
        Ok(Self {
            gathered: buffer("lightfall::IlluminationMap::gathered", 16)?,
            shown: buffer("lightfall::IlluminationMap::shown", 16)?,
            due: buffer("lightfall::IlluminationMap::due", 4)?,
            // No more surfaces than texels.
            surface_changes: buffer("lightfall::IlluminationMap::surface_changes", 4)?,
            surface_areas: buffer("lightfall::IlluminationMap::surface_areas", 4)?,
            counts: device::buffer(device, "lightfall::IlluminationMap::counts", 8, usage)?,
            radiosity: buffer("lightfall::IlluminationMap::radiosity", 16)?,
            places: buffer("lightfall::IlluminationMap::places", 4)?,
            shifts: device::buffer(
                device,
                "lightfall::IlluminationMap::shifts",
                16 * u64::from(a_frame.max(1)),
                usage,
            )?,
            chosen: PathList::with_room(device, a_frame)?,
            capacity,
            is_stale: true,
            written: Vec::new(),
        })
    }

    /// Forgets all light, and takes none from before into what is gathered next: for other texels.
    pub fn restart(&mut self) {
        self.is_stale = true;
    }

    /// Whether it was to be forgotten.
    pub(crate) fn take_stale(&mut self) -> bool {
        std::mem::take(&mut self.is_stale)
    }

    /// Says how large the surfaces are that texels lie on.
    pub(crate) fn write_areas(&mut self, queue: &wgpu::Queue, lights: &SurfaceLights) {
        if self.written != lights.surface_areas() {
            self.written = lights.surface_areas().to_vec();
            queue.write_buffer(&self.surface_areas, 0, bytemuck::cast_slice(&self.written));
        }
    }

    /// Irradiance that is shown, of each texel RGB in the unit frame, and alpha: which share of its rays did not meet backs of
    /// surfaces, but 2^-10 at least; 0 before it was gathered. Four `f32`. Texels whose alpha is below a half stand inside of
    /// something, and do not count.
    pub fn shown(&self) -> &wgpu::Buffer {
        &self.shown
    }

    /// The same as it was gathered last, which what is shown goes towards.
    pub fn gathered(&self) -> &wgpu::Buffer {
        &self.gathered
    }

    /// All light that leaves the surface at each texel, per area, RGB in the unit frame: π times its radiance. Alpha: the
    /// photons that it is taken from. Four `f32`. Of the present frame.
    pub fn radiosity(&self) -> &wgpu::Buffer {
        &self.radiosity
    }

    /// Of each of the texels that are chosen in a frame how far it stands from its place: four `f32`, unit frame, the last 0.
    pub fn shifts(&self) -> &wgpu::Buffer {
        &self.shifts
    }

    /// Of each texel one more than its place among those chosen, or 0; while rays are guided.
    pub(crate) fn places(&self) -> &wgpu::Buffer {
        &self.places
    }

    /// Of each texel a `u32`: how much the indirect light of its surface has changed since it was gathered, 0: it is not due.
    pub fn due(&self) -> &wgpu::Buffer {
        &self.due
    }

    /// Two `u32` of the last frame: texels chosen to be gathered, and those that wait. Where draws gather, those chosen are
    /// gathered some frames later, or chosen again.
    pub fn counts(&self) -> &wgpu::Buffer {
        &self.counts
    }

    /// The texels that are chosen in a frame.
    pub fn chosen(&self) -> &PathList {
        &self.chosen
    }

    pub(crate) fn surface_changes(&self) -> &wgpu::Buffer {
        &self.surface_changes
    }

    pub(crate) fn surface_areas(&self) -> &wgpu::Buffer {
        &self.surface_areas
    }

    /// Texels that there is room for.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        let own = [
            &self.gathered,
            &self.shown,
            &self.due,
            &self.surface_changes,
            &self.surface_areas,
            &self.counts,
            &self.radiosity,
            &self.places,
            &self.shifts,
        ];
        own.iter().map(|b| b.size()).sum::<u64>() + self.chosen.memory_use()
    }
}
