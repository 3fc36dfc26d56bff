//! Caustics from photons as points on the screen, evened out by a filter.
//!
//! Inputs: [`Photons`] of a caustic map, in one part or in several that are traced in turn; [`GBuffer`]. Output: [`Irradiance`]
//! (`rgba32float`) at every pixel; alpha is 1 where a filter has been, else all is 0. E = Σ w Φ / Σ w A over the pixels within
//! k of a pixel that see the same surface, w = √(1 + 2k² − x² − y²), A what each covers of it: brightness does not depend on
//! distance or angle of view. Only tiles that photons reach are filtered. Source: Larsen 2004, chapter 12, Eq. 12.1 and 12.2,
//! with changes: the area divides by the cosine; k comes from a length in the scene; pixels of other surfaces count neither
//! above nor below the line; a list of tiles stands in for occlusion queries.
//!
//! Cost: photons; of tiles that hold light, pixels × (2 k + 1)². Limits: a filter of the screen is no finer than a pixel and no
//! wider than 15; photons hidden behind what the pixel sees are lost.

use super::dispatch_64;
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot, Step};
use crate::resource::{GBuffer, Irradiance, Photons};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/caustic_filter/params.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) first_slot: u32,
        pub(crate) slot_count: u32,
        pub(crate) row: u32,
        pub(crate) steps: f32,
        pub(crate) share: f32,
        pub(crate) radius: f32,
        pub(crate) least_pixels: f32,
        pub(crate) most_pixels: f32,
    }

    /// Twin of `TileList` in `shaders/pass/caustic_filter/filter_tiles.wgsl`, with the first of its tiles.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct TileList {
        pub(crate) workgroups: [u32; 3],
        pub(crate) count: u32,
        pub(crate) tiles: [u32; 1],
    }
}

/// Bindings of `shaders/pass/caustic_filter/plot_photons.wgsl`, in order.
pub(crate) const PLOT_SLOTS: [Slot; 10] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::UintTexture,
    Slot::Storage,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::StorageMut,
];

/// Bindings of `shaders/pass/caustic_filter/filter_tiles.wgsl`, in order.
pub(crate) const FILTER_SLOTS: [Slot; 9] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::UintTexture,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageTexture(wgpu::TextureFormat::Rgba32Float),
];

/// Side of a tile, pixels. Twin of `TILE`.
const TILE: u32 = 8;

/// Widest filter, pixels to each side.
const MOST_PIXELS: u32 = 7;

/// Steps of the sums in the unit frame's flux: a caustic is a part of it.
const STEPS: f32 = (1u32 << 30) as f32;

/// Speed against accuracy, settable every frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CausticFilterSettings {
    /// Radius of the filter, a share of the region's radius, above 0. Wider is smoother and blurrier.
    pub radius: f32,
    /// Fewest and most pixels to each side, from 0 and up to 7, whatever the radius. Cost grows as the square.
    pub pixels: [u32; 2],
}

impl Default for CausticFilterSettings {
    fn default() -> Self {
        Self {
            radius: 0.01,
            pixels: [1, MOST_PIXELS],
        }
    }
}

/// The pass.
#[derive(Debug)]
pub struct CausticFilter {
    device: wgpu::Device,
    plot: Step,
    filter: Step,
}

/// Working memory for one view, made for its size.
#[derive(Debug)]
pub struct CausticFilterResources {
    params: wgpu::Buffer,
    sums: wgpu::Buffer,
    flags: wgpu::Buffer,
    tiles: wgpu::Buffer,
    size: [u32; 2],
    plot_groups: BindGroupCache,
    filter_groups: BindGroupCache,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct CausticFilterInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// Light to show; hop 0 is left out. In several parts of as many paths each, where a part is traced anew a frame: each
    /// holds all of the light.
    pub photons: &'a [&'a Photons],
    /// Where it lands. Its view must be set, of no more pixels than the resources are made for.
    pub g_buffer: &'a GBuffer,
    /// Written; `rgba32float`, of the G-buffer's size.
    pub irradiance: &'a Irradiance,
    /// Radius of the region, unit frame.
    pub radius: f32,
    /// How.
    pub settings: &'a CausticFilterSettings,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl CausticFilter {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let step = |label, source, entry_point, slots: &[Slot]| {
            let spec = ComputeSpec {
                label,
                source,
                entry_point,
                layouts: &[],
                constants: &[],
            };
            Step::new(device, slots, &spec)
        };
        Self {
            plot: step(
                "lightfall::CausticFilter::plot",
                wgsl::CAUSTIC_FILTER_PLOT,
                "plot_photons",
                &PLOT_SLOTS,
            ),
            filter: step(
                "lightfall::CausticFilter",
                wgsl::CAUSTIC_FILTER,
                "filter_tiles",
                &FILTER_SLOTS,
            ),
            device: device.clone(),
        }
    }

    /// Records the irradiance.
    ///
    /// # Errors [`Error::CountMismatch`] for photons in parts of unlike numbers, or a G-buffer of more pixels than the
    /// resources have room for; nothing is recorded then.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut CausticFilterResources,
        inputs: &CausticFilterInputs<'_>,
    ) -> Result<(), Error> {
        let size = inputs.g_buffer.size();
        for axis in [0, 1] {
            if size[axis] > resources.size[axis] {
                return Err(Error::CountMismatch {
                    what: "pixels of a row or column of the G-buffer (most that CausticFilterResources have room for)",
                    expected: resources.size[axis] as usize,
                    found: size[axis] as usize,
                });
            }
        }
        let slots = |p: &Photons| (p.first_indirect(), p.slots() - p.first_indirect());
        let (first_slot, slot_count) = inputs.photons.first().map_or((0, 0), |p| slots(p));
        if let Some(other) = inputs.photons.iter().find(|p| slots(p) != (first_slot, slot_count)) {
            return Err(Error::CountMismatch {
                what: "photons of a part (as many as the first has)",
                expected: slot_count as usize,
                found: slots(other).1 as usize,
            });
        }
        let (groups, row) = dispatch_64(slot_count);
        let settings = inputs.settings;
        let most = settings.pixels[1].min(MOST_PIXELS);
        let params = gpu::Params {
            first_slot,
            slot_count,
            row,
            steps: STEPS,
            share: 1.0 / inputs.photons.len().max(1) as f32,
            radius: settings.radius * inputs.radius,
            least_pixels: settings.pixels[0].min(most) as f32,
            most_pixels: most as f32,
        };
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        for buffer in [&resources.sums, &resources.flags] {
            encoder.clear_buffer(buffer, 0, None);
        }
        encoder.clear_buffer(
            &resources.tiles,
            0,
            Some(std::mem::offset_of!(gpu::TileList, tiles) as u64),
        );
        let label = "lightfall::CausticFilter";
        // Where no photon is there is no light.
        drop(device::render_pass(
            encoder,
            label,
            &[inputs.irradiance.view()],
            None,
            inputs.timestamps,
        ));
        let views = inputs.g_buffer.views();
        let seen = || -> Vec<device::Bound> {
            vec![
                (&resources.params).into(),
                inputs.g_buffer.view_buffer().into(),
                (&views.depth).into(),
                (&views.normal).into(),
                (&views.base_color).into(),
                inputs.g_buffer.surfaces().into(),
            ]
        };
        let mut filtered = seen();
        filtered.extend([
            (&resources.sums).into(),
            (&resources.tiles).into(),
            inputs.irradiance.view().into(),
        ]);
        let plots: Vec<Vec<device::Bound>> = inputs
            .photons
            .iter()
            .map(|photons| {
                let mut bound = seen();
                bound.extend([
                    photons.buffer().into(),
                    (&resources.sums).into(),
                    (&resources.flags).into(),
                    (&resources.tiles).into(),
                ]);
                bound
            })
            .collect();
        if resources.plot_groups.uses() < plots.len() {
            resources.plot_groups = BindGroupCache::for_uses(plots.len());
        }
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.plot.pipeline);
        for bound in &plots {
            let group = resources.plot_groups.get(&self.device, label, &self.plot.layout, bound);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
        }
        let group = resources
            .filter_groups
            .get(&self.device, label, &self.filter.layout, &filtered);
        pass.set_pipeline(&self.filter.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups_indirect(&resources.tiles, 0);
        Ok(())
    }
}

impl CausticFilterResources {
    /// For views of up to `size` pixels: 12 bytes each.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, size: [u32; 2]) -> Result<Self, Error> {
        use wgpu::BufferUsages as B;
        let [pixels, tiles] = [size, size.map(|s| s.div_ceil(TILE))].map(|[x, y]| u64::from(x) * u64::from(y));
        let header = std::mem::offset_of!(gpu::TileList, tiles) as u64;
        let usage = B::STORAGE | B::COPY_DST | B::COPY_SRC;
        Ok(Self {
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::CausticFilter::params")?,
            sums: device::buffer(device, "lightfall::CausticFilter::sums", 12 * pixels, usage)?,
            flags: device::buffer(device, "lightfall::CausticFilter::flags", 4 * tiles, usage)?,
            tiles: device::buffer(
                device,
                "lightfall::CausticFilter::tiles",
                header + 4 * tiles,
                usage | B::INDIRECT,
            )?,
            size,
            plot_groups: BindGroupCache::default(),
            filter_groups: BindGroupCache::default(),
        })
    }

    /// The tiles that were filtered last: three workgroup counts, how many, and their numbers, row by row of 8 × 8 pixels. All
    /// `u32`.
    pub fn tiles(&self) -> &wgpu::Buffer {
        &self.tiles
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        let own = [&self.params, &self.sums, &self.flags, &self.tiles];
        own.iter().map(|b| b.size()).sum()
    }
}
