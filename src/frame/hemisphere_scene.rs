//! Texels whose light is gathered by the host's draws: which they are is chosen on the GPU and comes back some frames later,
//! for views are made on the CPU.

use super::Settings;
use super::indirect_scene::PhotonPasses;
use crate::Timestamps;
use crate::pass::{HemisphereGatherInputs, HemisphereGatherResources};
use crate::read_back::ReadBackRing;
use crate::resource::{
    CaptureView, GatherShape, Geometry, HemispherePlace, Hemispheres, IlluminationMap, SurfaceLights,
};
use crate::scene::{SurfacePlace, UnitFrame};
use crate::{Error, gpu};
use glam::Vec3;

/// Allocated while light is gathered so.
#[derive(Debug)]
pub(super) struct HemisphereScene {
    hemispheres: Hemispheres,
    gather: HemisphereGatherResources,
    /// Texels that were chosen, and how far they stand from their places, as they come back.
    returned: wgpu::Buffer,
    ring: ReadBackRing,
    /// Whether a list of texels is on its way: until it has come, none else are chosen.
    is_under_way: bool,
    /// Whether what comes back next is of texels that are no more.
    is_stale: bool,
    /// Texels to gather in the next frame that is recorded.
    texels: Vec<ChosenTexel>,
}

/// A texel that light is gathered at.
#[derive(Debug, Clone, Copy)]
struct ChosenTexel {
    index: u32,
    /// From its place, unit frame.
    shift: Vec3,
}

/// What draws take.
#[derive(Clone, Copy)]
pub(super) struct DrawInputs<'a> {
    pub(super) queue: &'a wgpu::Queue,
    pub(super) passes: &'a PhotonPasses,
    pub(super) geometry: &'a dyn Geometry,
    pub(super) views: &'a [CaptureView],
    pub(super) timestamps: Option<&'a Timestamps>,
}

impl HemisphereScene {
    pub(super) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        settings: &Settings,
        (shape, map): (GatherShape, &IlluminationMap),
    ) -> Result<Self, Error> {
        let own = &settings.illumination_maps;
        let bytes = map.chosen().buffer().size() + map.shifts().size();
        let usage = wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        Ok(Self {
            hemispheres: Hemispheres::new(device, queue, (shape, own.hemisphere_size), own.gather.a_frame)?,
            gather: HemisphereGatherResources::new(device)?,
            returned: gpu::buffer(device, "lightfall::HemisphereScene::returned", bytes, usage)?,
            ring: ReadBackRing::new(device, "lightfall::HemisphereScene::ring", bytes)?,
            is_under_way: false,
            is_stale: false,
            texels: Vec::new(),
        })
    }

    /// Forgets what was to be gathered: texels are other ones.
    pub(super) fn restart(&mut self) {
        self.is_stale = self.is_under_way;
        self.texels.clear();
    }

    /// The views of this frame: of the texels that were chosen, where these are now.
    pub(super) fn plan(
        &mut self,
        queue: &wgpu::Queue,
        frame: &UnitFrame,
        places: &[SurfacePlace],
    ) -> Result<Vec<CaptureView>, Error> {
        let is_lost = self.ring.take_lost();
        let arrived = self.ring.take_words();
        if is_lost || arrived.is_some() {
            self.is_under_way = false;
            let is_stale = std::mem::take(&mut self.is_stale);
            if let Some(words) = arrived.filter(|_| !is_stale) {
                self.texels = chosen(&words, self.hemispheres.capacity());
            }
        }
        self.texels.retain(|t| t.index as usize / 2 < places.len());
        self.texels.truncate(self.hemispheres.capacity() as usize);
        self.stand(queue, frame, places)
    }

    /// The views of texels from one on, at most [`HemisphereScene::capacity`], which stand so far from their places, unit
    /// frame.
    pub(super) fn plan_texels(
        &mut self,
        queue: &wgpu::Queue,
        (frame, places): (&UnitFrame, &[SurfacePlace]),
        (first, shifts): (u32, &[Vec3]),
    ) -> Result<Vec<CaptureView>, Error> {
        let texels = (first..).zip(shifts);
        self.texels = texels.map(|(index, &shift)| ChosenTexel { index, shift }).collect();
        self.stand(queue, frame, places)
    }

    fn stand(
        &mut self,
        queue: &wgpu::Queue,
        frame: &UnitFrame,
        places: &[SurfacePlace],
    ) -> Result<Vec<CaptureView>, Error> {
        // Two texels a place, the first on the side that its normal points to.
        let of_texel = |texel: &ChosenTexel| {
            let place = &places[texel.index as usize / 2];
            let side = if texel.index.is_multiple_of(2) { 1.0 } else { -1.0 };
            HemispherePlace {
                position: frame.point(place.position) + texel.shift,
                normal: (side * place.normal).as_vec3(),
                texel: texel.index,
            }
        };
        let standing: Vec<_> = self.texels.iter().map(of_texel).collect();
        self.hemispheres.set(queue, &standing)?;
        Ok(self.hemispheres.views())
    }

    /// Records what was planned, and the return of the texels that were chosen now.
    pub(super) fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        inputs: &DrawInputs<'_>,
        (lights, map): (&SurfaceLights, &IlluminationMap),
    ) -> Result<(), Error> {
        // Texels that are drawn now were due when texels were chosen in this frame.
        let draws = !self.texels.is_empty();
        self.record_draws(encoder, inputs, (lights, map))?;
        if !draws && !self.is_under_way {
            let list = map.chosen().buffer();
            encoder.copy_buffer_to_buffer(list, 0, &self.returned, 0, list.size());
            encoder.copy_buffer_to_buffer(map.shifts(), 0, &self.returned, list.size(), map.shifts().size());
            self.ring.record(encoder, &self.returned);
            self.is_under_way = true;
        }
        Ok(())
    }

    /// Records what was planned alone.
    pub(super) fn record_draws(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        inputs: &DrawInputs<'_>,
        (lights, map): (&SurfaceLights, &IlluminationMap),
    ) -> Result<(), Error> {
        let Some(pass) = &inputs.passes.hemisphere_gather else {
            return Ok(());
        };
        // Recorded twice after one `prepare`: the first has gathered them.
        if self.texels.is_empty() {
            return Ok(());
        }
        let gather_inputs = HemisphereGatherInputs {
            queue: inputs.queue,
            hemispheres: &self.hemispheres,
            geometry: inputs.geometry,
            views: inputs.views,
            lights,
            map,
            timestamps: inputs.timestamps,
        };
        pass.record(encoder, &mut self.gather, &gather_inputs)?;
        self.texels.clear();
        Ok(())
    }

    /// Texels that are gathered at once.
    pub(super) fn capacity(&self) -> u32 {
        self.hemispheres.capacity()
    }

    pub(super) fn memory_use(&self) -> u64 {
        let ring = ReadBackRing::size_in_bytes(self.ring.size());
        self.hemispheres.memory_use() + self.gather.memory_use() + self.returned.size() + ring
    }
}

/// What has come back: workgroups of a dispatch, how many texels there are, they, as many as there is room for, and their
/// shifts.
fn chosen(words: &[u32], room: u32) -> Vec<ChosenTexel> {
    const HEADER: usize = 4;
    let count = words.get(HEADER - 1).copied().unwrap_or(0).min(room) as usize;
    let texels = words.iter().skip(HEADER);
    let shifts = words.get(HEADER + room as usize..).unwrap_or_default().chunks_exact(4);
    let texel = |(&index, shift): (&u32, &[u32])| ChosenTexel {
        index,
        shift: Vec3::from([shift[0], shift[1], shift[2]].map(f32::from_bits)),
    };
    texels.zip(shifts).take(count).map(texel).collect()
}
