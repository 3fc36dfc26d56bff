//! Soft shadows of lamps with an extent.
//!
//! Inputs: [`GBuffer`], [`Lights`], [`ShadowMaps`], [`NearestOccluders`], and triangles for rays. Output: [`Visibility`], one
//! layer a light, or [`PendingPenumbrae`], where [`FusedComposite`](super::FusedComposite) does the gathering. A light without
//! extent gets the hard test of [`DirectLight`](super::DirectLight) and nothing else. One with an extent has its penumbra found
//! by a [`ShadowMethod`]:
//!
//! - *In image space* (`Cross`, `Disc`; `gather.rs`). A *test* says of each pixel whether the lamp's centre is seen, and how far
//!   before the receiver its occluder stands; tiles of 8 × 8 pixels that see both light and shadow within reach are listed; there
//!   a *search* takes the mean distance d of the occluders around each receiver, on the arms of a cross that every pixel turns
//!   differently, which gives the penumbra's radius, R d / (D − d) for a lamp of radius R at distance D; and a *blur* takes the
//!   mean visibility over the ellipse that this radius covers on the receiver's plane, one axis after the other, or all of it
//!   at once. Source: Yao et al., soft shadows and image-space photon mapping, section 3.4, Eq. 3 to 5, with changes: Eq. 2's
//!   constant search is bounded by the nearest occluder. A tap counts only where its own penumbra reaches the receiver. Both run
//!   on the receiver's plane instead of the screen's, weighted as a disc-shaped lamp is, so that the straight edge of an occluder
//!   parallel to the lamp has the exact profile V(x) = 1/2 + (x √(1 − x²) + asin x) / π, x in radii, of a `Cross` if it lies along
//!   an axis, and its second moment anyhow.
//! - *In the shadow maps* (`Pcf`, `Pcss`; `over_pixels.rs`): the same radius and the same ellipse, but points of the receiver's
//!   plane are tested in the shadow maps, whatever the eye sees there. Sources: Reeves, Salesin and Cook 1987; Fernando 2005.
//! - *By rays* to points all over the lamp (`Rays`; `over_pixels.rs`): the share of its light that comes unhindered.
//!
//! Cost: pixels × lights with an extent × taps: of `Cross`, in listed tiles alone, 4 `search_taps` + 4 `blur_taps` + 2 of two
//! fetches; of `Pcss` 4 `search_taps` + `disc_taps` tests; `docs/shadows.md` measures them.
//!
//! Limits: in image space, a penumbra whose shadow lies off the screen, or hidden, as a whole is not looked for (what else is
//! off the screen, or hidden, is asked of the shadow maps); penumbrae wider than `max_radius` are cut to it; the blur of an
//! edge that slants between the axes of a `Cross` reaches up to √2 radii. In shadow maps, the receiver's plane is taken to go
//! on below other surfaces. In both, one mean distance stands for occluders behind each other; a spot's disc is taken to face
//! the receiver, a flat lamp is the disc of its area; receivers tilted beyond 83° count as tilted so far.

pub(crate) mod gather;
pub(crate) mod over_pixels;

use crate::gpu::{self as device};
use crate::resource::pending_penumbrae::gpu::PenumbraParams;
#[cfg(feature = "bvh")]
use crate::resource::{BvhGeometry, bvh_geometry::BVH_SLOTS};
use crate::resource::{GBuffer, Lights, NearestOccluders, PendingPenumbrae, ShadowMaps, Visibility};
use crate::{Error, Timestamps, wgsl};
use gather::{Gather, GatherBuffers, MAP_SLOTS};
use over_pixels::{OverPixels, OverPixelsGroups};
use std::sync::OnceLock;

/// Most taps to each side. More are not refused but not taken: at two hundred fetches a pixel the dither is long gone.
pub(crate) const MAX_TAPS: u32 = 64;

/// Most taps of a disc, and most rays to a lamp: not refused above either.
pub(crate) const MAX_POINTS: u32 = 4096;

/// How a penumbra is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ShadowMethod {
    /// Not at all: the lamp is a point in its middle.
    Hard,
    /// Percentage-closer filtering: a disc of one radius on the receiver, tested in the shadow maps.
    Pcf,
    /// Percentage-closer soft shadows: the same, of the radius that the occluders found around give.
    Pcss,
    /// In image space, the blur along one axis after the other.
    #[default]
    Cross,
    /// In image space, the blur over a disc.
    Disc,
    /// Rays to points of the lamp, against triangles. Where none are at hand, shadows are hard.
    Rays,
}

/// What tells where the lamp's centre is seen from, for all methods in image space and for hard shadows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OccluderTest {
    /// The shadow maps: what stands nearest to the lamp, as sharp as a texel.
    #[default]
    ShadowMaps,
    /// A ray against triangles: what stands nearest to the receiver, exactly. Where none are at hand, the shadow maps.
    Triangles,
}

/// Where the width of penumbrae comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PenumbraSearch {
    /// No search (the paper's faster variant, its chapter 5): every edge is blurred by one radius, that of an occluder a
    /// quarter of the way to the lamp: a third of the lamp's own. For parallel light the way is the region's diameter.
    /// Shadows do not harden towards contact.
    Off,
    /// From the distance of the occluders around each receiver.
    #[default]
    On,
}

/// Speed against accuracy, settable every frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoftShadowSettings {
    /// How penumbrae are found.
    pub method: ShadowMethod,
    /// What tells where the lamp's centre is seen from.
    pub test: OccluderTest,
    /// Where the width of penumbrae comes from, in image space. Off saves the search and gets widths wrong.
    pub search: PenumbraSearch,
    /// Taps on each of the four arms of the search, up to 64, of `Pcss` a quarter of them. More find smaller occluders and
    /// steadier widths, at a cost in proportion: 2 instead of 4, with 3 to blur instead of 5, have 1.15 times the error for
    /// three quarters of the time.
    pub search_taps: u32,
    /// Taps of a `Cross` to each side of each axis, 1 to 64. More have less grain in wide penumbrae, at a cost in
    /// proportion: 7 instead of 5 have 0.95 of the error for a tenth more time, 20 with 16 to search 0.9 for 2.7 times the time.
    pub blur_taps: u32,
    /// Taps of a `Disc`, `Pcf` and `Pcss`, up to 4096, likewise. Of a disc 16, 32, 128: mean errors of 0.069, 0.060, 0.054; of
    /// `Pcss` with as many to search 16, 32, and 128 with 64: 0.076, 0.054, 0.041, for 0.6, 1 and 3 times a cross's time.
    pub disc_taps: u32,
    /// Rays to the lamp from each pixel, up to 4096. 4, 16, 64: 0.139, 0.050, 0.018 for twice, 7 and 28 times a cross's time;
    /// accumulated over frames they are exact.
    pub rays: u32,
    /// Widest radius of a penumbra in image space, pixels. Higher lets large lamps cast penumbrae as wide as they are, with more
    /// grain and fetches further apart; lower cuts them.
    pub max_radius: f32,
    /// How far from the receiver's plane another surface may lie and still count, as a share of the penumbra's radius (where
    /// the paper has a fixed σ); the shadow map is asked about points that no such surface shows. Higher blurs across steps and
    /// around curves; lower asks the map more often.
    pub range_scale: f32,
}

impl Default for SoftShadowSettings {
    /// "4 + 5" of the paper's Table 1. `docs/shadows.md` measures what other taps are worth. Grain goes by the number of taps
    /// and not by how far apart they are, so that the widest radius only bounds how scattered fetches are; a quarter of a
    /// 512-pixel image leaves common penumbrae alone. The error is the same for any range scale from 0.05 to 1; one in the
    /// middle.
    fn default() -> Self {
        Self {
            method: ShadowMethod::default(),
            test: OccluderTest::default(),
            search: PenumbraSearch::On,
            search_taps: 4,
            blur_taps: 5,
            disc_taps: 32,
            rays: 16,
            max_radius: 128.0,
            range_scale: 0.5,
        }
    }
}

impl SoftShadowSettings {
    /// `Pcss` with 64 taps of search and 128 of filtering: a third to two thirds of the default's error, for some three times its
    /// time; as much error where occluders stand behind each other, where light grazes and inside of a lampshade
    /// (`docs/shadows.md`).
    pub fn accurate() -> Self {
        Self {
            method: ShadowMethod::Pcss,
            search_taps: 16,
            disc_taps: 128,
            ..Self::default()
        }
    }

    /// Whether triangles are read.
    pub fn uses_triangles(&self) -> bool {
        match self.method {
            ShadowMethod::Rays => true,
            ShadowMethod::Hard | ShadowMethod::Cross | ShadowMethod::Disc => self.test == OccluderTest::Triangles,
            ShadowMethod::Pcf | ShadowMethod::Pcss => false,
        }
    }

    /// Whether [`NearestOccluders`] are read: they bound every search.
    pub fn searches(&self) -> bool {
        match self.method {
            ShadowMethod::Cross | ShadowMethod::Disc => self.search == PenumbraSearch::On,
            ShadowMethod::Pcss => true,
            ShadowMethod::Hard | ShadowMethod::Pcf | ShadowMethod::Rays => false,
        }
    }
}

/// What follows the hard test of a light. Twins of `GATHERED_NOT` and so on in `shaders/pass/soft_shadow/params.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Gathered {
    Not,
    BySteps,
    Later,
}

/// Where a pass writes what it found.
#[derive(Debug, Clone, Copy)]
pub enum ShadowTarget<'a> {
    /// All of it: visibility.
    Visibility(&'a Visibility),
    /// Without the gathering in image space, whether over a `Cross` or a `Disc`: [`FusedComposite`](super::FusedComposite) does it,
    /// over a disc.
    Pending(&'a PendingPenumbrae),
}

/// The pass. Pipelines of a method are made when it is first recorded.
#[derive(Debug)]
pub struct SoftShadow {
    device: wgpu::Device,
    gather: Gather,
    filter: OnceLock<OverPixels>,
    #[cfg(feature = "bvh")]
    trace: OnceLock<OverPixels>,
}

/// Uniforms, bind groups and textures that all lights share, for one view.
#[derive(Debug)]
pub struct SoftShadowResources {
    /// One a light: all lights of a frame are in one submission.
    params: Vec<wgpu::Buffer>,
    written: Vec<Option<PenumbraParams>>,
    gather: GatherBuffers,
    filter: OverPixelsGroups,
    #[cfg(feature = "bvh")]
    trace: OverPixelsGroups,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct SoftShadowInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// Surfaces that receive shadows. Its view must be set.
    pub g_buffer: &'a GBuffer,
    /// Sources.
    pub lights: &'a Lights,
    /// What they see.
    pub shadow_maps: &'a ShadowMaps,
    /// How near to them anything stands.
    pub nearest: &'a NearestOccluders,
    /// What rays meet, prepared for this frame: for methods that [use triangles](SoftShadowSettings::uses_triangles).
    #[cfg(feature = "bvh")]
    pub bvh: Option<&'a BvhGeometry>,
    /// Written, of the G-buffer's size. Lights beyond those that it, or the resources, have room for are left out.
    pub target: ShadowTarget<'a>,
    /// How to find penumbrae, one for each light; the last one counts for those beyond. None: shadows are hard.
    pub settings: &'a [SoftShadowSettings],
    /// Number of the frame where frames are accumulated: rays go elsewhere in each.
    pub sample_offset: u32,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

/// One light of a frame, and what is the same for all steps of it.
#[derive(Clone, Copy)]
struct OneLight<'a> {
    layer: &'a wgpu::TextureView,
    params: &'a wgpu::Buffer,
    settings: SoftShadowSettings,
    gathered: Gathered,
}

impl<'a> ShadowTarget<'a> {
    fn layers(&self) -> &'a Visibility {
        match self {
            Self::Visibility(visibility) => visibility,
            Self::Pending(pending) => pending.layers(),
        }
    }
}

impl<'a> SoftShadowInputs<'a> {
    fn gathered(&self, settings: &SoftShadowSettings) -> Gathered {
        match (settings.method, self.target) {
            (ShadowMethod::Cross | ShadowMethod::Disc, ShadowTarget::Visibility(_)) => Gathered::BySteps,
            (ShadowMethod::Cross | ShadowMethod::Disc, ShadowTarget::Pending(_)) => Gathered::Later,
            _ => Gathered::Not,
        }
    }

    fn settings_of(&self, light: usize, has_extent: bool) -> SoftShadowSettings {
        let hard = SoftShadowSettings {
            method: ShadowMethod::Hard,
            ..Default::default()
        };
        let settings = self.settings.get(light).or(self.settings.last());
        let mut settings = *settings.unwrap_or(&hard);
        if !has_extent || (settings.method == ShadowMethod::Rays && !self.has_triangles()) {
            settings.method = ShadowMethod::Hard;
        }
        if !self.has_triangles() {
            settings.test = OccluderTest::ShadowMaps;
        }
        settings
    }

    #[cfg(feature = "bvh")]
    fn has_triangles(&self) -> bool {
        self.bvh.is_some()
    }

    #[cfg(not(feature = "bvh"))]
    fn has_triangles(&self) -> bool {
        false
    }
}

impl SoftShadow {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        Self {
            device: device.clone(),
            gather: Gather::new(device),
            filter: OnceLock::new(),
            #[cfg(feature = "bvh")]
            trace: OnceLock::new(),
        }
    }

    fn filter(&self) -> OverPixels {
        let shader = (wgsl::SOFT_SHADOW_FILTER, "filter_pixels");
        OverPixels::new(&self.device, "lightfall::SoftShadow::filter", shader, &MAP_SLOTS)
    }

    #[cfg(feature = "bvh")]
    fn trace(&self) -> OverPixels {
        let shader = (wgsl::SOFT_SHADOW_TRACE, "trace_pixels");
        OverPixels::new(&self.device, "lightfall::SoftShadow::trace", shader, &BVH_SLOTS)
    }

    /// Records the layer of every light: the hard test alone for those without extent.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut SoftShadowResources,
        inputs: &SoftShadowInputs<'_>,
    ) {
        encoder.push_debug_group("lightfall::SoftShadow");
        let layers = (0..resources.params.len() as u32).map_while(|light| inputs.target.layers().layer_view(light));
        for ((index, layer), has_extent) in (0..).zip(layers).zip(inputs.lights.have_extent()) {
            let mut settings = inputs.settings_of(index, has_extent);
            if inputs.gathered(&settings) == Gathered::BySteps && !resources.gather.has_steps() {
                settings.method = ShadowMethod::Hard;
            }
            let gathered = inputs.gathered(&settings);
            resources.write_params(index, inputs, &settings);
            let light = OneLight {
                layer,
                params: &resources.params[index],
                settings,
                gathered,
            };
            match settings.method {
                ShadowMethod::Hard | ShadowMethod::Cross | ShadowMethod::Disc => {
                    self.gather
                        .record(&self.device, encoder, &mut resources.gather, inputs, &light);
                }
                ShadowMethod::Pcf | ShadowMethod::Pcss => {
                    let filter = self.filter.get_or_init(|| self.filter());
                    let occluders = [inputs.shadow_maps.view().into()];
                    let read = (inputs.nearest.buffer(), &occluders[..]);
                    filter.record(&self.device, encoder, &mut resources.filter, (inputs, &light), read);
                }
                ShadowMethod::Rays =>
                {
                    #[cfg(feature = "bvh")]
                    if let Some(bvh) = inputs.bvh {
                        let trace = self.trace.get_or_init(|| self.trace());
                        let read = (inputs.lights.polygons(), &bvh.bound()[..]);
                        trace.record(&self.device, encoder, &mut resources.trace, (inputs, &light), read);
                    }
                }
            }
        }
        encoder.pop_debug_group();
    }
}

impl SoftShadowResources {
    /// For a view of `size` pixels and this many lights.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, size: [u32; 2], lights: u32) -> Result<Self, Error> {
        Self::with_gather(device, lights, GatherBuffers::new(device, size, size, lights as usize)?)
    }

    /// The same without the textures, 12 bytes a pixel, that penumbrae are gathered by in image space: for other methods, and for
    /// [`ShadowTarget::Pending`]. What would be gathered with them is hard.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn without_gathering(device: &wgpu::Device, size: [u32; 2], lights: u32) -> Result<Self, Error> {
        Self::with_gather(
            device,
            lights,
            GatherBuffers::new(device, size, [1, 1], lights as usize)?,
        )
    }

    fn with_gather(device: &wgpu::Device, lights: u32, gather: GatherBuffers) -> Result<Self, Error> {
        let params = (0..lights)
            .map(|_| device::uniform_buffer::<PenumbraParams>(device, "lightfall::SoftShadow::params"))
            .collect::<Result<Vec<_>, _>>()?;
        let uses = params.len();
        Ok(Self {
            written: vec![None; uses],
            params,
            gather,
            filter: OverPixelsGroups::new(uses),
            #[cfg(feature = "bvh")]
            trace: OverPixelsGroups::new(uses),
        })
    }

    fn write_params(&mut self, light: usize, inputs: &SoftShadowInputs<'_>, settings: &SoftShadowSettings) {
        let params = PenumbraParams {
            light: light as u32,
            shadow_map_size: inputs.shadow_maps.size(),
            layer_count: inputs.nearest.layers(),
            search: settings.searches().into(),
            search_taps: settings.search_taps.min(MAX_TAPS),
            blur_taps: settings.blur_taps.clamp(1, MAX_TAPS),
            disc_taps: settings.disc_taps.clamp(1, MAX_POINTS),
            rays: settings.rays.clamp(1, MAX_POINTS),
            sample_offset: match settings.method {
                ShadowMethod::Rays => inputs.sample_offset,
                _ => 0,
            },
            gathered: inputs.gathered(settings) as u32,
            max_radius: settings.max_radius,
            range_scale: settings.range_scale,
        };
        let bytes = bytemuck::bytes_of(&params);
        if let ShadowTarget::Pending(pending) = inputs.target {
            inputs
                .queue
                .write_buffer(pending.params(), (light * bytes.len()) as u64, bytes);
        }
        if self.written[light] != Some(params) {
            inputs.queue.write_buffer(&self.params[light], 0, bytes);
            self.written[light] = Some(params);
        }
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.gather.memory_use() + self.params.iter().map(wgpu::Buffer::size).sum::<u64>()
    }
}
