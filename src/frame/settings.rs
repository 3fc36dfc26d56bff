//! How much to spend on what: every knob of every stage, three presets, and access by name.

use crate::Error;
use crate::pass::{
    Bandwidth, BoundaryCorrection, CausticFilterSettings, CoverageMeasure, EnvMapSelectorResources,
    EnvMapSelectorSettings, FirstHits, ImageSpaceTracerSettings, IndirectShadows, Kernel, LARGEST_RADIUS, LightForm,
    LightShape, MAX_POINTS, MAX_SELECTED, MAX_TAPS, MOST_FILTER_RADIUS, OccluderTest, PenumbraSearch,
    PhotonSplatterConfig, PhotonSplatterSettings, SelectiveEmitterSettings, ShadowMethod, SoftShadowSettings,
    SplatShape, SurfaceLightShadingSettings, TexelGatherSettings, TraceMethod, UpsamplerSettings,
};
use crate::resource::{GatherShape, Lights, MAX_LIGHTS, Subsampling};

/// Most scatterings of a path.
const MAX_BOUNCES: u32 = 64;

/// Most suns that stand for an environment: lights and lamps want room too.
const MOST_SUNS: u32 = 48;

/// Most candidates for environment maps.
const MAX_CANDIDATES: u32 = EnvMapSelectorResources::MAX_CANDIDATES;

/// What photons are traced through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum TracerKind {
    /// Environment maps. Whatever can be drawn takes part; what no map sees loses light.
    #[default]
    ImageSpace,
    /// The triangles of a `BvhGeometry`, which the host brings. No ray is lost, and photons need no environment map; geometry
    /// that is not in the trees does not take part. Feature `bvh`.
    Bvh,
    /// Environment maps, and triangles for the rays that these lose or are not sure of. Feature `bvh`.
    Hybrid,
}

impl TracerKind {
    /// Whether photons are traced through environment maps.
    pub fn uses_env_maps(self) -> bool {
        self != Self::Bvh
    }

    /// Whether they meet the triangles of a `BvhGeometry`.
    pub fn uses_triangles(self) -> bool {
        self != Self::ImageSpace
    }
}

/// How indirect light comes to the pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum IndirectMethod {
    /// From the photons around what a pixel sees.
    #[default]
    Splatting,
    /// By rays from there, which bring back the light of lit environment maps. No kernel lies over an edge; noise is that of
    /// few rays. It takes environment maps, whatever the tracer; rays meet what photons do. Light has one bounce more.
    FinalGather,
    /// From virtual surface lights: points on surfaces that stand for the light of a pool of photons around them. Their number
    /// is that of lights, and kernels are those of the few photons near by. It takes places,
    /// [`GiRenderer::set_surface_places`](super::GiRenderer::set_surface_places), or stands them where photons arrive.
    SurfaceLights,
    /// From irradiance kept at texels of surfaces, which is gathered again only where photons say that it has changed; photons
    /// stay until their way changes ([`Settings::selective`], whatever it says, unless they are guided). Cheapest while little
    /// moves; light follows within some frames. It takes places for texels,
    /// [`GiRenderer::set_surface_places`](super::GiRenderer::set_surface_places).
    IlluminationMaps,
}

impl IndirectMethod {
    /// Whether it takes places on surfaces.
    pub(super) fn has_places(self) -> bool {
        matches!(self, Self::SurfaceLights | Self::IlluminationMaps)
    }
}

/// Where surface lights stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum LightPlacement {
    /// At places that were chosen beforehand and move with their instances.
    #[default]
    OnSurfaces,
    /// Where this frame's photons arrive, as points: instant radiosity, the baseline. They jump when anything moves.
    AtImpacts,
}

/// Surface lights, and the photons that they are made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceLightSettings {
    /// Places to choose, 1 to 16384: what a host gives to [`SurfacePoint::place`](crate::scene::SurfacePoint::place). More
    /// resolve more, and cost in proportion: 50, 200, 800 have 0.77 and 0.63 of the error before.
    pub places: u32,
    /// Paths in the pool, 1 to 16777216, rounded up to a multiple of `stream`. More have less noise, and take longer to follow
    /// a change: 25 000, 100 000, 400 000 have 0.97 and 0.93 of the error before.
    pub pool: u32,
    /// Photons traced a frame, 1 or more: as many of the pool are replaced. More follow changes faster, and cost in proportion.
    pub stream: u32,
    /// Where they stand.
    pub placement: LightPlacement,
    /// How they come to pixels.
    pub shading: SurfaceLightShadingSettings,
    /// Whether photons that came a short way are splatted beside them, for what discs ([`LightShape::Disc`]) lose near by, and
    /// all that came by way of metal and glass. Other shapes, and lights at impacts, have none. On: 1.6 times the time, 0.8 of
    /// the error, and 12 % of the light that is missing otherwise.
    pub near_photons: bool,
    /// Photons under a kernel of these, above 0: among as many as the pool has paths, and all else as the splatter's settings
    /// say. Fewer keep corners sharper and are noisier: 100, 300, 900 differ by a hundredth.
    pub near_kernel: f32,
    /// Estimated pixels to each side that the noise of [`IndirectShadows::Some`] is evened out over, 0 to 16.
    pub filter_radius: u32,
}

impl Default for SurfaceLightSettings {
    fn default() -> Self {
        Self {
            places: 200,
            pool: 100_000,
            stream: 5000,
            placement: LightPlacement::default(),
            shading: SurfaceLightShadingSettings {
                shape: LightShape::Disc,
                ..Default::default()
            },
            near_photons: true,
            near_kernel: 300.0,
            filter_radius: 1,
        }
    }
}

/// Photons that stay where they are until something changes on their way: of each group of similar directions one is traced a
/// frame, and the others where it went elsewhere. Not for surface lights, which have a pool instead; not where photons are
/// guided; and not in frames that are accumulated, each of which has photons of its own. What [`TracerKind::Hybrid`] traces,
/// triangles alone then do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SelectiveSettings {
    /// Whether they do.
    pub is_on: bool,
    /// Photons of a group, 1 or more: about so many. Fewer find small changes sooner, and cost more while nothing changes.
    pub group: u32,
    /// How many are traced anew, and when.
    pub emitter: SelectiveEmitterSettings,
}

impl Default for SelectiveSettings {
    fn default() -> Self {
        Self {
            is_on: false,
            group: 40,
            emitter: SelectiveEmitterSettings::default(),
        }
    }
}

/// What gathers the light of a texel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum TexelGatherMethod {
    /// Rays, which meet what photons do.
    #[default]
    Rays,
    /// The host's draws onto a square above the texel, which stands for all of its hemisphere.
    Plane,
    /// The host's draws onto the upper half of a cube.
    Cube,
}

/// Irradiance kept at texels of surfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IlluminationMapSettings {
    /// Places to choose, 1 to 16384: what a host gives to [`SurfacePoint::place`](crate::scene::SurfacePoint::place), with a
    /// texel on either side. More resolve more; what follows a change costs in proportion. 1000 instead of 500 in a box: 0.39 of
    /// the error; 2000 instead of 1000 among pillars: 0.81.
    pub texels: u32,
    /// How and when they are gathered.
    pub gather: TexelGatherSettings,
    /// By what. What a host keeps out of environment maps is not drawn. Draws begin some frames after a change, for which
    /// texels these are for comes back from the GPU, and want fewer texels a frame.
    pub method: TexelGatherMethod,
    /// Pixels that draws are wide, even, 2 to 128.
    pub hemisphere_size: u32,
    /// Half the side of a plane, in distances from the texel, above 0 and up to 16. Wider covers more, and more coarsely.
    pub half_side: f32,
    /// How far from a pixel texels count, in times that they lie apart, above 0 and up to 8. More is smoother and blurrier: 1,
    /// 1.5 and 2.5 have 0.99 and 1.2 of the error before.
    pub reach: f32,
}

impl Default for IlluminationMapSettings {
    fn default() -> Self {
        Self {
            texels: 1000,
            gather: TexelGatherSettings::default(),
            method: TexelGatherMethod::default(),
            hemisphere_size: 32,
            half_side: 2.0,
            reach: 1.5,
        }
    }
}

impl IlluminationMapSettings {
    /// What draws go onto, if they gather.
    pub(super) fn gather_shape(&self) -> Option<GatherShape> {
        match self.method {
            TexelGatherMethod::Rays => None,
            TexelGatherMethod::Plane => Some(GatherShape::Plane {
                half_side: self.half_side,
            }),
            TexelGatherMethod::Cube => Some(GatherShape::Cube),
        }
    }
}

/// Rays that gather, and what they gather from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FinalGatherSettings {
    /// Rays of a pixel that is estimated, 1 to 4096. Cost grows in proportion; noise falls faster than as the root. 64, 256,
    /// 1024: 1.1 and 1.3 times the time; from 64 to 256 0.97 of the error.
    pub rays: u32,
    /// Texels of light along a face of an environment map, 4 to 8192. Finer resolves shadows, and costs as the square. 16, 32,
    /// 64: 1.6 and 2.3 times the time, 0.97 and 0.99 of the error.
    pub map_size: u32,
    /// Photons under a kernel there, above 0: kernels are all of one width. Fewer are faster and keep more detail; their noise
    /// is evened out over the rays. 20, 50, 200: 1.1 and 1.7 times the time for the same error.
    pub photons: f32,
    /// Estimated pixels to each side that the noise of rays is evened out over, 0 to 16. Pays with few rays: 64 want 1; with
    /// 256 and one pixel in 4 × 4 estimated, 1 and 2 have 1.9 and 2.9 times the error of 0.
    pub filter_radius: u32,
}

impl Default for FinalGatherSettings {
    fn default() -> Self {
        Self {
            rays: 256,
            map_size: 32,
            photons: 50.0,
            filter_radius: 0,
        }
    }
}

/// How caustic photons come to pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum CausticMethod {
    /// Under kernels as wide as they lie apart on the screen.
    #[default]
    Splatting,
    /// As points that a filter of the screen evens out: faster where they are many, and as wide everywhere.
    Filter,
}

/// Photons of caustics alone: of light that comes to a diffuse surface by way of metal and glass and nothing else. They are
/// aimed at what [`SceneSummary::specular_bounds`](crate::scene::SceneSummary::specular_bounds) holds, drawn at every pixel,
/// and are as wide as they lie apart on the screen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CausticSettings {
    /// Photons in all, beside those of other light. 0: caustics are as blurred as other indirect light.
    pub photons: u32,
    /// Frames, 1 or more, over which all of them are traced anew, a part in each (Larsen 2004, chapter 12: 8). 1: all in every
    /// frame. More cost less in proportion, and light follows a change within so many. All are traced at once where there are
    /// none yet, where the unit frame or the number of lights is another one, where environment maps that they are traced
    /// through have other places, and in frames that are accumulated.
    pub rounds: u32,
    /// Photons under a kernel, above 0. Fewer are sharper and noisier.
    pub kernel_photons: f32,
    /// How they come to pixels.
    pub method: CausticMethod,
    /// Of the filter.
    pub filter: CausticFilterSettings,
    /// Narrowest kernel, its radius in pixels, 0 or more: narrower ones fall between pixels, and are noise.
    pub min_radius: f32,
}

impl Default for CausticSettings {
    fn default() -> Self {
        Self {
            photons: 100_000,
            rounds: 1,
            kernel_photons: 40.0,
            method: CausticMethod::default(),
            filter: CausticFilterSettings::default(),
            min_radius: 0.75,
        }
    }
}

/// How irradiance that was estimated at a part of the pixels comes to all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Upsampling {
    /// Interpolated at once.
    AtOnce,
    /// Level by level, each of twice the pixels along an axis, and estimated anew where the samples around a pixel leave in
    /// doubt what it shows. That takes [`SplatShape::Tiled`]; with the other shapes pixels are interpolated only.
    #[default]
    ByLevels,
}

/// How rough metal that the eye sees is lit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum GlossyMethod {
    /// By paths from the eye, as mirrors are: noise of few paths, sharp where the lobe is.
    #[default]
    Paths,
    /// From the photons that arrive there, each by the BRDF: no ray, and blur of their kernels. For lobes that are wide.
    Photons,
}

/// Settings of all stages. Start from a preset and change fields, or [`Settings::set`] them by name.
///
/// What fields say of a step from one value to another, time and error (relMSE) over those before, is of `docs/tradeoff.md`
/// unless it says otherwise: of `fast` against triangles, or through environment maps where it is about these, in software;
/// times near 1 are not told from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Frames to accumulate for one image: noise falls as their number grows. 1 in real time.
    pub frames: u32,
    /// Photons emitted a frame. Cost grows in proportion; noise falls as the square root. Twice as many: 1.2 to 1.8 times the
    /// time, 0.6 to 0.9 of the error, now and then none less; through maps of 64² texels nothing is gained from 60 000 on. Of
    /// surface lights [`SurfaceLightSettings::stream`] says how many.
    pub photons: u32,
    /// Share of the photons, from 0 and below 1, that go in those directions, from their light and from diffuse surfaces, whose
    /// paths were seen in the frames before; the others are spread evenly. Pays where much of the light never comes before the
    /// eye, as through a doorway or of a sun over a building; costs two looks at each photon, noise while things move, and,
    /// where frames are not accumulated, one to two hundredths of the light. 0.5 is a good start (`docs/density.md`): 0.88
    /// of the error in a hall of pillars.
    pub guided_photons: f32,
    /// Photons traced anew only where their way has changed.
    pub selective: SelectiveSettings,
    /// How photons find where they first land: 0.0156 of relMSE from shadow maps and 0.0162 traced in a box, in about the same
    /// time (`docs/accuracy.md`). Shadow maps flatten curved mirrors a little. Photons of
    /// caustics are traced wherever there are triangles, which then trace all of their hops.
    pub first_hits: FirstHits,
    /// Surfaces that light scatters at before the one the eye sees, 0 to 64. 0: direct light only. Each costs a trace;
    /// leaving out bounces darkens: of three, one alone has 57 % of the light of a box and two have 86 %, for 0.60 and 0.80 of
    /// the time.
    pub bounces: u32,
    /// Most environment maps, 1 to 31; fewer are used where fewer see enough. More find more of what rays hit and cost six
    /// captures each. 1, 2, 4, 8, 12 in a box with two blocks: 0.34, 0.67, 0.91, 0.74 of the error before, for 1.07, 1.25,
    /// 1.09, 1.03 times the time.
    pub env_map_count: u32,
    /// Further environment maps at the first so many point and spot lights, 0 to 8: what light from there meets next is seen
    /// from where it comes. Each costs as much as any other map. In a furnished room one makes nearly half of the unsure rays
    /// of the first hop sure; in plain rooms it takes a better map's place (`docs/tracing.md`).
    pub env_maps_at_lights: u32,
    /// Texels along a face of an environment map. Finer resolves thinner things and costs memory and capture time as the
    /// square. 32, 64, 128, 256: 0.74, 1.2, 0.78 of the error before with 60 000 photons, whose noise hides the rest; of rays
    /// `docs/tracing.md` says what more find.
    pub env_map_size: u32,
    /// Suns that stand for an environment, 0 to 48, as parallel lights with an extent. More are nearer to its true light; each
    /// costs a shadow map and a search for penumbrae. 0: it is seen, and lights no diffuse surface.
    pub environment_suns: u32,
    /// Texels along a layer of a shadow map. Finer sharpens shadow edges, direct and in first hits; costs as the square.
    pub shadow_map_size: u32,
    /// How penumbrae of lights with an extent are found.
    pub soft_shadow: SoftShadowSettings,
    /// Most lights whose penumbrae are found in a view, those of most flux; shadows of the others are hard. Fewer cost less in
    /// proportion.
    pub soft_lights: u32,
    /// Where environment maps are taken from.
    pub selector: EnvMapSelectorSettings,
    /// What photons are traced through.
    pub tracer_kind: TracerKind,
    /// How rays are searched for in environment maps.
    pub trace_method: TraceMethod,
    /// How far rays are followed. `roulette_from` counts for every kind of tracer; in a hybrid `most_fetches` of 0 stands for
    /// 400.
    pub tracer: ImageSpaceTracerSettings,
    /// How indirect light comes to the pixels. `docs/methods.md` says which when: while nothing moves illumination maps are the
    /// fastest, half to two thirds of splatting's time and error in boxes.
    pub indirect_method: IndirectMethod,
    /// Where it is gathered.
    pub final_gather: FinalGatherSettings,
    /// Where it comes from surface lights.
    pub surface_lights: SurfaceLightSettings,
    /// Where it is kept at texels.
    pub illumination_maps: IlluminationMapSettings,
    /// Light by way of metal and glass alone.
    pub caustic: CausticSettings,
    /// Most specular surfaces that the eye looks through or into one behind the other, 1 to 32: a ball of glass has two. What
    /// lies behind more is black.
    pub specular_surfaces: u32,
    /// Paths from each pixel whose surface is specular, 1 to 64: noise of rough surfaces and of glass, which reflects or
    /// transmits by chance, falls as their root.
    pub specular_paths: u32,
    /// How rough metal is lit that the eye sees.
    pub glossy_method: GlossyMethod,
    /// How photons are drawn: gathered in f32, or blended.
    pub splatter_config: PhotonSplatterConfig,
    /// How wide: more photons under a kernel are smoother and blurrier. And what is done at edges.
    pub splatter: PhotonSplatterSettings,
    /// How kernels narrow while frames are accumulated, above 0 and at most 1: their area falls as n^(α − 1), the variance of
    /// the mean as n^(−α), its squared bias as n^(−2(1 − α)). 2/3 is fastest; at 1 radii stay, and so does the bias.
    pub radius_alpha: f32,
    /// At which pixels irradiance is estimated; the others are interpolated. One in 8, 4, 2, 1 along an axis: 1.3, 1.5, 2.0
    /// times the time; from 8 to 4 the error is 0.4 to 0.9 of that before, from there on the same in boxes; in a colonnade
    /// noise rises from 2 to 1, 1.7 times, and bias falls.
    pub subsampling: Subsampling,
    /// Whether at once or level by level: 1.4 times the time, 0.97 of the error in a box; `docs/density.md` has corners.
    pub upsampling: Upsampling,
    /// Between which pixels, and where in doubt.
    pub upsampler: UpsamplerSettings,
    /// Whether penumbrae are gathered, indirect light is interpolated to all pixels and all light is summed in one pass
    /// ([`FusedComposite`](crate::pass::FusedComposite)) instead of one after the other. Saves memory and what passes write for
    /// each other; crosses become discs, pixels in doubt at the last level are not estimated anew, and there is no irradiance
    /// of a view to look at.
    pub fuses_composite: bool,
}

impl Default for Settings {
    /// [`Settings::balanced`].
    fn default() -> Self {
        Self::balanced()
    }
}

impl Settings {
    /// Smallest cost that still looks right.
    pub fn fast() -> Self {
        Self {
            photons: 60_000,
            caustic: CausticSettings {
                photons: 30_000,
                ..Default::default()
            },
            specular_surfaces: 4,
            specular_paths: 1,
            guided_photons: 0.0,
            selective: SelectiveSettings::default(),
            env_map_count: 12,
            env_map_size: 64,
            environment_suns: 8,
            shadow_map_size: 256,
            soft_shadow: SoftShadowSettings {
                search_taps: 2,
                blur_taps: 3,
                ..Default::default()
            },
            selector: EnvMapSelectorSettings {
                candidates: 40,
                ..Default::default()
            },
            trace_method: TraceMethod::OrderedMarch,
            upsampling: Upsampling::AtOnce,
            splatter: PhotonSplatterSettings {
                bandwidth: Bandwidth::Density {
                    photons: 200.0,
                    clamp: [0.25, 1.0],
                },
                ..Default::default()
            },
            tracer: ImageSpaceTracerSettings {
                iterations: 5,
                ..Default::default()
            },
            ..Self::balanced()
        }
    }

    /// The default.
    pub fn balanced() -> Self {
        Self {
            frames: 1,
            photons: 500_000,
            guided_photons: 0.0,
            selective: SelectiveSettings::default(),
            first_hits: FirstHits::default(),
            bounces: 3,
            env_map_count: 12,
            env_maps_at_lights: 0,
            env_map_size: 128,
            environment_suns: 24,
            shadow_map_size: 512,
            soft_shadow: SoftShadowSettings {
                blur_taps: 7,
                ..Default::default()
            },
            soft_lights: MAX_LIGHTS as u32,
            selector: EnvMapSelectorSettings::default(),
            tracer_kind: TracerKind::default(),
            trace_method: TraceMethod::default(),
            tracer: ImageSpaceTracerSettings::default(),
            indirect_method: IndirectMethod::default(),
            final_gather: FinalGatherSettings::default(),
            surface_lights: SurfaceLightSettings::default(),
            illumination_maps: IlluminationMapSettings::default(),
            caustic: CausticSettings::default(),
            specular_surfaces: 6,
            specular_paths: 4,
            glossy_method: GlossyMethod::default(),
            splatter_config: PhotonSplatterConfig::default(),
            splatter: PhotonSplatterSettings::default(),
            radius_alpha: 2.0 / 3.0,
            subsampling: Subsampling::Quarter,
            upsampling: Upsampling::default(),
            upsampler: UpsamplerSettings::default(),
            fuses_composite: false,
        }
    }

    /// Accumulates frames; narrower kernels, finer maps, and as many as there may be: what one map sees from afar another may
    /// see from nearer.
    pub fn accurate() -> Self {
        Self {
            frames: 64,
            photons: 200_000,
            caustic: CausticSettings {
                kernel_photons: 4.0,
                min_radius: 0.0,
                ..Default::default()
            },
            specular_surfaces: 12,
            specular_paths: 1,
            guided_photons: 0.0,
            selective: SelectiveSettings::default(),
            env_map_count: 16,
            env_map_size: 256,
            environment_suns: 48,
            shadow_map_size: 1024,
            selector: EnvMapSelectorSettings {
                coverage_target: 1.0,
                ..Default::default()
            },
            trace_method: TraceMethod::VerifiedWalk,
            soft_shadow: SoftShadowSettings::accurate(),
            subsampling: Subsampling::Full,
            splatter: PhotonSplatterSettings {
                bandwidth: Bandwidth::Density {
                    photons: 150.0,
                    clamp: [0.25, 1.0],
                },
                ..Default::default()
            },
            ..Self::balanced()
        }
    }

    /// A preset by name: "fast", "balanced", "accurate".
    pub fn preset(name: &str) -> Option<Self> {
        Some(match name {
            "fast" => Self::fast(),
            "balanced" => Self::balanced(),
            "accurate" => Self::accurate(),
            _ => return None,
        })
    }

    /// Sets one field by its dotted name, as listed by [`Settings::entries`].
    ///
    /// # Errors
    /// [`Error::UnknownSetting`] names all there are; [`Error::InvalidSetting`] says what would be accepted.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), Error> {
        let Some(knob) = KNOBS.iter().find(|k| k.name == key) else {
            return Err(Error::UnknownSetting {
                key: key.into(),
                known: KNOBS.iter().map(|k| k.name).collect::<Vec<_>>().join(", "),
            });
        };
        let mut changed = self.clone();
        if (knob.set)(&mut changed, value).is_none() || !(knob.is_valid)(&changed) {
            return Err(knob.error(value));
        }
        *self = changed;
        Ok(())
    }

    /// Every setting by name, with its value as text.
    pub fn entries(&self) -> Vec<(&'static str, String)> {
        KNOBS.iter().map(|k| (k.name, (k.get)(self))).collect()
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::InvalidSetting`] for the first that is out of range.
    pub fn validate(&self) -> Result<(), Error> {
        match KNOBS.iter().find(|k| !(k.is_valid)(self)) {
            Some(knob) => Err(knob.error(&(knob.get)(self))),
            None => Ok(()),
        }
    }

    /// Photons emitted a frame, caustic ones aside.
    pub(super) fn traced_photons(&self) -> u32 {
        let own = &self.surface_lights;
        match (self.indirect_method, own.placement) {
            (IndirectMethod::SurfaceLights, _) if self.photons == 0 => 0,
            (IndirectMethod::SurfaceLights, LightPlacement::OnSurfaces) => own.stream,
            // As many lights as places.
            (IndirectMethod::SurfaceLights, LightPlacement::AtImpacts) => {
                own.places.div_ceil(self.walked_bounces() + 1)
            }
            _ => self.photons,
        }
    }

    /// Surfaces that photons scatter at, for a [`PhotonFeeder`](super::PhotonFeeder): of surface lights the last one shines by
    /// itself, unless photons near by are kept.
    pub fn walked_bounces(&self) -> u32 {
        match self.indirect_method {
            IndirectMethod::SurfaceLights if !self.keeps_near() => self.bounces.saturating_sub(1),
            _ => self.bounces,
        }
    }

    /// Whether the passes of one serve the other: only what buffers and images are made by differs, and what shaders are told.
    pub(super) fn share_pipelines(&self, other: &Self) -> bool {
        let ways = |s: &Self| {
            (
                s.tracer_kind,
                s.trace_method,
                s.indirect_method,
                s.caustic.method,
                s.glossy_method,
                s.fuses_composite,
            )
        };
        let wants = |s: &Self| {
            let is_guided = s.guided_photons > 0.0;
            [s.selects_photons(), s.filters(), s.gathers_by_draws(), is_guided]
        };
        ways(self) == ways(other) && wants(self) == wants(other) && self.splatter_config == other.splatter_config
    }

    /// Whether photons stay that nothing has changed for.
    pub(super) fn selects_photons(&self) -> bool {
        let is_wanted = match self.indirect_method {
            IndirectMethod::IlluminationMaps => true,
            IndirectMethod::SurfaceLights => false,
            IndirectMethod::Splatting | IndirectMethod::FinalGather => self.selective.is_on,
        };
        is_wanted && self.guided_photons == 0.0 && self.photons > 0
    }

    /// Whether the host's draws gather light at texels.
    pub(super) fn gathers_by_draws(&self) -> bool {
        let own = &self.illumination_maps;
        self.indirect_method == IndirectMethod::IlluminationMaps && own.gather_shape().is_some()
    }

    /// Whether photons that came a short way stand in for what surface lights lose there.
    pub(super) fn keeps_near(&self) -> bool {
        let own = &self.surface_lights;
        self.indirect_method == IndirectMethod::SurfaceLights
            && own.placement == LightPlacement::OnSurfaces
            && own.shading.shape == LightShape::Disc
            && own.near_photons
            && self.bounces > 0
    }

    /// Whether the estimate of indirect light goes through a filter, if only to be added to.
    pub(super) fn filters(&self) -> bool {
        self.filter_radius() > 0 || self.keeps_near()
    }

    /// Estimated pixels to each side that noise is evened out over; 0: it stays.
    pub(super) fn filter_radius(&self) -> u32 {
        let lights = &self.surface_lights;
        match self.indirect_method {
            IndirectMethod::Splatting | IndirectMethod::IlluminationMaps => 0,
            IndirectMethod::FinalGather => self.final_gather.filter_radius,
            IndirectMethod::SurfaceLights if lights.shading.shadows == IndirectShadows::Some => lights.filter_radius,
            IndirectMethod::SurfaceLights => 0,
        }
    }

    /// Paths that the pool holds: whole frames of them.
    pub(super) fn pool_paths(&self) -> u32 {
        let own = &self.surface_lights;
        own.pool.div_ceil(own.stream.max(1)) * own.stream
    }

    /// First index into the random sequence of caustic photons, as many frames on as that of all photons is.
    pub(super) fn caustic_offset(&self, sample_offset: u32) -> u32 {
        (u64::from(sample_offset) * u64::from(self.caustic.photons) / u64::from(self.photons.max(1))) as u32
    }

    /// What traces caustic photons: triangles where there are any, for environment maps do not see into glass, and curved
    /// mirrors are a little flattened in them.
    pub(super) fn caustic_tracer(&self) -> TracerKind {
        match self.tracer_kind {
            TracerKind::Bvh | TracerKind::Hybrid => TracerKind::Bvh,
            TracerKind::ImageSpace => TracerKind::ImageSpace,
        }
    }

    /// Whether a host must bring a `BvhGeometry`: rays or shadows meet its triangles.
    pub fn uses_triangles(&self) -> bool {
        self.tracer_kind.uses_triangles() || self.soft_shadow.uses_triangles()
    }

    /// How the penumbra of each light is found: those of most flux as settings say, the others not at all.
    pub(super) fn soft_shadows(&self, lights: &Lights) -> Vec<SoftShadowSettings> {
        let mut all = vec![self.soft_shadow; lights.count() as usize];
        let has_extent: Vec<_> = lights.have_extent().collect();
        let soft = lights.by_flux().into_iter().filter(|&light| has_extent[light]);
        for light in soft.skip(self.soft_lights as usize) {
            all[light].method = ShadowMethod::Hard;
        }
        all
    }

    /// Whether shadows of lights with an extent are another's than those of points by shadow maps.
    pub(super) fn finds_penumbrae(&self) -> bool {
        let shadow = &self.soft_shadow;
        self.soft_lights > 0 && (shadow.method != ShadowMethod::Hard || shadow.uses_triangles())
    }

    /// Whether there are environment maps.
    pub(super) fn needs_env_maps(&self) -> bool {
        self.tracer_kind.uses_env_maps() || self.indirect_method == IndirectMethod::FinalGather
    }

    /// Whether rays step over depth hierarchies.
    pub(super) fn needs_hierarchy(&self) -> bool {
        self.tracer_kind.uses_env_maps() && self.trace_method.needs_hierarchy()
    }

    /// k and clamp of the density bandwidth, which a fixed one gives way to.
    fn density(&mut self) -> (&mut f32, &mut [f32; 2]) {
        if let Bandwidth::Fixed(_) = self.splatter.bandwidth {
            self.splatter.bandwidth = PhotonSplatterSettings::default().bandwidth;
        }
        match &mut self.splatter.bandwidth {
            Bandwidth::Density { photons, clamp } | Bandwidth::Screen { photons, clamp } => (photons, clamp),
            Bandwidth::Fixed(_) => unreachable!("replaced above"),
        }
    }

    /// The same; while the bandwidth is fixed, those that it would give way to.
    fn density_values(&self) -> (f32, [f32; 2]) {
        let mut own = self.clone();
        let (&mut photons, &mut clamp) = own.density();
        (photons, clamp)
    }
}

/// One setting by name.
struct Knob {
    name: &'static str,
    expected: &'static str,
    get: fn(&Settings) -> String,
    set: fn(&mut Settings, &str) -> Option<()>,
    is_valid: fn(&Settings) -> bool,
}

impl Knob {
    fn error(&self, value: &str) -> Error {
        Error::InvalidSetting {
            key: self.name.into(),
            value: value.into(),
            expected: self.expected.into(),
        }
    }
}

#[cfg(feature = "bvh")]
const TRACER_KINDS: &str = "image-space, bvh or hybrid";
#[cfg(not(feature = "bvh"))]
const TRACER_KINDS: &str = "image-space (bvh and hybrid need the cargo feature `bvh`)";

#[cfg(feature = "bvh")]
const SHADOW_METHODS: &str = "hard, pcf, pcss, cross, disc or rays";
#[cfg(not(feature = "bvh"))]
const SHADOW_METHODS: &str = "hard, pcf, pcss, cross or disc (rays need the cargo feature `bvh`)";

#[cfg(feature = "bvh")]
const OCCLUDER_TESTS: &str = "shadow-maps or triangles";
#[cfg(not(feature = "bvh"))]
const OCCLUDER_TESTS: &str = "shadow-maps (triangles need the cargo feature `bvh`)";

/// A knob over a plain field that parses from text.
macro_rules! field {
    ($name:literal, $expected:literal, $($path:ident).+, $valid:expr) => {
        Knob {
            name: $name,
            expected: $expected,
            get: |s| s.$($path).+.to_string(),
            set: |s, v| { s.$($path).+ = v.parse().ok()?; Some(()) },
            is_valid: |s| ($valid)(s.$($path).+),
        }
    };
}

/// A knob over a field that takes one of a few values, each with a name.
macro_rules! choice {
    ($name:literal, $expected:expr, $($path:ident).+, $([$text:literal, $value:expr]),+) => {
        Knob {
            name: $name,
            expected: $expected,
            get: |s| {
                let named = [$(($text, $value)),+].into_iter().find(|(_, value)| *value == s.$($path).+);
                named.map_or("unnamed", |(text, _)| text).to_string()
            },
            set: |s, v| {
                s.$($path).+ = [$(($text, $value)),+].into_iter().find(|(text, _)| *text == v)?.1;
                Some(())
            },
            is_valid: |_| true,
        }
    };
}

const KNOBS: &[Knob] = &[
    field!("frames", "1 or more", frames, |v| v >= 1),
    field!("photons", "0 to 100000000", photons, |v| v <= 100_000_000),
    field!("photons.guided", "0 or more, and below 1", guided_photons, |v| (0.0
        ..1.0)
        .contains(&v)),
    choice!("selective", "on or off", selective.is_on, ["on", true], ["off", false]),
    field!("selective.group", "1 or more: photons", selective.group, |v| v >= 1),
    field!(
        "selective.budget",
        "1 or more: photons a frame",
        selective.emitter.budget,
        |v| v >= 1
    ),
    field!(
        "selective.interval",
        "1 or more: frames",
        selective.emitter.interval,
        |v| v >= 1
    ),
    field!(
        "selective.position_tolerance",
        "0 or more: unit-frame length",
        selective.emitter.position_tolerance,
        |v: f32| v >= 0.0 && v.is_finite()
    ),
    field!(
        "selective.flux_tolerance",
        "0 to 1: share of the flux",
        selective.emitter.flux_tolerance,
        |v: f32| (0.0..=1.0).contains(&v)
    ),
    choice!(
        "emission.first_hits",
        "shadow-maps or traced",
        first_hits,
        ["shadow-maps", FirstHits::ShadowMaps],
        ["traced", FirstHits::Traced]
    ),
    field!("bounces", "0 to 64", bounces, |v| v <= MAX_BOUNCES),
    field!("env_maps.count", "1 to 31", env_map_count, |v| (1..=MAX_SELECTED)
        .contains(&v)),
    field!("env_maps.at_lights", "0 to 8", env_maps_at_lights, |v| v <= 8),
    field!("env_maps.size", "4 to 8192", env_map_size, |v| (4..=8192).contains(&v)),
    field!("environment.suns", "0 to 48", environment_suns, |v| v <= MOST_SUNS),
    field!("shadow_maps.size", "4 to 8192", shadow_map_size, |v| (4..=8192)
        .contains(&v)),
    Knob {
        is_valid: |s| cfg!(feature = "bvh") || s.soft_shadow.method != ShadowMethod::Rays,
        ..choice!(
            "soft_shadow.method",
            SHADOW_METHODS,
            soft_shadow.method,
            ["hard", ShadowMethod::Hard],
            ["pcf", ShadowMethod::Pcf],
            ["pcss", ShadowMethod::Pcss],
            ["cross", ShadowMethod::Cross],
            ["disc", ShadowMethod::Disc],
            ["rays", ShadowMethod::Rays]
        )
    },
    Knob {
        is_valid: |s| cfg!(feature = "bvh") || s.soft_shadow.test != OccluderTest::Triangles,
        ..choice!(
            "soft_shadow.test",
            OCCLUDER_TESTS,
            soft_shadow.test,
            ["shadow-maps", OccluderTest::ShadowMaps],
            ["triangles", OccluderTest::Triangles]
        )
    },
    field!("soft_shadow.lights", "0 to 64", soft_lights, |v| v <= MAX_LIGHTS as u32),
    choice!(
        "soft_shadow.search",
        "on or off",
        soft_shadow.search,
        ["on", PenumbraSearch::On],
        ["off", PenumbraSearch::Off]
    ),
    field!("soft_shadow.search_taps", "1 to 64", soft_shadow.search_taps, |v| (1
        ..=MAX_TAPS)
        .contains(&v)),
    field!("soft_shadow.blur_taps", "1 to 64", soft_shadow.blur_taps, |v| (1
        ..=MAX_TAPS)
        .contains(&v)),
    field!("soft_shadow.disc_taps", "1 to 4096", soft_shadow.disc_taps, |v| (1
        ..=MAX_POINTS)
        .contains(&v)),
    field!("soft_shadow.rays", "1 to 4096", soft_shadow.rays, |v| (1..=MAX_POINTS)
        .contains(&v)),
    field!(
        "soft_shadow.max_radius",
        "above 0: pixels",
        soft_shadow.max_radius,
        |v: f32| v > 0.0 && v.is_finite()
    ),
    field!(
        "soft_shadow.range_scale",
        "above 0: share of the penumbra's radius",
        soft_shadow.range_scale,
        |v: f32| v > 0.0 && v.is_finite()
    ),
    field!("selector.candidates", "1 to 512", selector.candidates, |v| (1
        ..=MAX_CANDIDATES)
        .contains(&v)),
    field!("selector.back_face_limit", "0 to 1", selector.back_face_limit, |v| (0.0
        ..=1.0)
        .contains(&v)),
    field!("selector.clearance", "0 to 1", selector.clearance, |v| (0.0..=1.0)
        .contains(&v)),
    choice!(
        "selector.measure",
        "photons or area",
        selector.measure,
        ["photons", CoverageMeasure::Photons],
        ["area", CoverageMeasure::Area]
    ),
    field!("selector.coverage_target", "0 to 1", selector.coverage_target, |v| (0.0
        ..=1.0)
        .contains(&v)),
    field!("selector.interval", "1 to 60 frames", selector.interval, |v| (1..=60)
        .contains(&v)),
    Knob {
        is_valid: |s| cfg!(feature = "bvh") || !s.tracer_kind.uses_triangles(),
        ..choice!(
            "tracer.kind",
            TRACER_KINDS,
            tracer_kind,
            ["image-space", TracerKind::ImageSpace],
            ["bvh", TracerKind::Bvh],
            ["hybrid", TracerKind::Hybrid]
        )
    },
    choice!(
        "tracer.method",
        "paper, plane, nearest-march, nearest-walk, ordered-march, ordered-walk or verified-walk",
        trace_method,
        ["paper", TraceMethod::Paper],
        ["plane", TraceMethod::Plane],
        ["nearest-march", TraceMethod::NearestMarch],
        ["nearest-walk", TraceMethod::NearestWalk],
        ["ordered-march", TraceMethod::OrderedMarch],
        ["ordered-walk", TraceMethod::OrderedWalk],
        ["verified-walk", TraceMethod::VerifiedWalk]
    ),
    field!("tracer.iterations", "1 to 32", tracer.iterations, |v| (1..=32)
        .contains(&v)),
    field!(
        "tracer.most_fetches",
        "0 or more; 0: 400 in a hybrid, else no limit",
        tracer.most_fetches,
        |_| { true }
    ),
    field!("tracer.doubts_normals", "true or false", tracer.doubts_normals, |_| {
        true
    }),
    field!("tracer.roulette_from", "1 or more", tracer.roulette_from, |v| v >= 1),
    choice!(
        "indirect.method",
        "splatting, final-gather, surface-lights or illumination-maps",
        indirect_method,
        ["splatting", IndirectMethod::Splatting],
        ["final-gather", IndirectMethod::FinalGather],
        ["surface-lights", IndirectMethod::SurfaceLights],
        ["illumination-maps", IndirectMethod::IlluminationMaps]
    ),
    field!("caustic.photons", "0 to 100000000", caustic.photons, |v| v
        <= 100_000_000),
    field!("caustic.rounds", "1 or more: frames", caustic.rounds, |v| v >= 1),
    field!(
        "caustic.kernel_photons",
        "above 0: photons under a kernel",
        caustic.kernel_photons,
        |v: f32| v > 0.0 && v.is_finite()
    ),
    choice!(
        "caustic.method",
        "splatting or filter",
        caustic.method,
        ["splatting", CausticMethod::Splatting],
        ["filter", CausticMethod::Filter]
    ),
    field!(
        "caustic.filter_radius",
        "above 0: share of the region's radius",
        caustic.filter.radius,
        |v: f32| v > 0.0 && v.is_finite()
    ),
    field!("caustic.min_radius", "0 to 23 pixels", caustic.min_radius, |v: f32| {
        (0.0..=LARGEST_RADIUS).contains(&v)
    }),
    field!("specular.paths", "1 to 64", specular_paths, |v| (1..=64).contains(&v)),
    choice!(
        "specular.glossy",
        "paths or photons",
        glossy_method,
        ["paths", GlossyMethod::Paths],
        ["photons", GlossyMethod::Photons]
    ),
    field!("specular.surfaces", "1 to 32", specular_surfaces, |v| (1..=32)
        .contains(&v)),
    field!("final_gather.rays", "1 to 4096", final_gather.rays, |v| (1..=4096)
        .contains(&v)),
    choice!(
        "surface_lights.placement",
        "on-surfaces or at-impacts",
        surface_lights.placement,
        ["on-surfaces", LightPlacement::OnSurfaces],
        ["at-impacts", LightPlacement::AtImpacts]
    ),
    field!("surface_lights.places", "1 to 16384", surface_lights.places, |v| (1
        ..=16384)
        .contains(&v)),
    field!("surface_lights.pool", "1 to 16777216", surface_lights.pool, |v| (1..=1
        << 24)
        .contains(&v)),
    field!("surface_lights.stream", "1 to 1000000", surface_lights.stream, |v| (1
        ..=1_000_000)
        .contains(&v)),
    choice!(
        "surface_lights.shape",
        "point, disc or square",
        surface_lights.shading.shape,
        ["point", LightShape::Point],
        ["disc", LightShape::Disc],
        ["square", LightShape::Square]
    ),
    field!(
        "illumination_maps.texels",
        "1 to 16384",
        illumination_maps.texels,
        |v| (1..=16384).contains(&v)
    ),
    field!(
        "illumination_maps.a_frame",
        "1 to 32768: texels",
        illumination_maps.gather.a_frame,
        |v| (1..=32768).contains(&v)
    ),
    field!(
        "illumination_maps.rays",
        "1 to 4096",
        illumination_maps.gather.rays,
        |v| (1..=4096).contains(&v)
    ),
    field!(
        "illumination_maps.threshold",
        "0 or more: share of the light",
        illumination_maps.gather.threshold,
        |v: f32| v >= 0.0 && v.is_finite()
    ),
    field!(
        "illumination_maps.blend",
        "above 0, at most 1",
        illumination_maps.gather.blend,
        |v: f32| v > 0.0 && v <= 1.0
    ),
    choice!(
        "illumination_maps.method",
        "rays, plane or cube",
        illumination_maps.method,
        ["rays", TexelGatherMethod::Rays],
        ["plane", TexelGatherMethod::Plane],
        ["cube", TexelGatherMethod::Cube]
    ),
    field!(
        "illumination_maps.hemisphere_size",
        "even, 2 to 128: pixels",
        illumination_maps.hemisphere_size,
        |v| (2..=128).contains(&v) && v % 2 == 0
    ),
    field!(
        "illumination_maps.half_side",
        "above 0, at most 16",
        illumination_maps.half_side,
        |v: f32| v > 0.0 && v <= 16.0
    ),
    field!(
        "illumination_maps.guided",
        "0 to 0.95: share of the rays",
        illumination_maps.gather.guided,
        |v: f32| (0.0..=0.95).contains(&v)
    ),
    field!(
        "illumination_maps.least_photons",
        "0 or more",
        illumination_maps.gather.least_photons,
        |_| true
    ),
    field!(
        "illumination_maps.reach",
        "above 0, at most 8: times that texels lie apart",
        illumination_maps.reach,
        |v: f32| v > 0.0 && v <= 8.0
    ),
    choice!(
        "surface_lights.near_photons",
        "on or off",
        surface_lights.near_photons,
        ["on", true],
        ["off", false]
    ),
    field!(
        "surface_lights.near_kernel",
        "above 0: photons under a kernel",
        surface_lights.near_kernel,
        |v: f32| v > 0.0 && v.is_finite()
    ),
    choice!(
        "surface_lights.form",
        "loop, drawn or tiles",
        surface_lights.shading.form,
        ["loop", LightForm::Loop],
        ["drawn", LightForm::Drawn],
        ["tiles", LightForm::Tiles]
    ),
    choice!(
        "surface_lights.shadows",
        "off, ambient-occlusion, some or all",
        surface_lights.shading.shadows,
        ["off", IndirectShadows::Off],
        ["ambient-occlusion", IndirectShadows::AmbientOcclusion],
        ["some", IndirectShadows::Some],
        ["all", IndirectShadows::All]
    ),
    field!("surface_lights.rays", "1 to 4096", surface_lights.shading.rays, |v| (1
        ..=4096)
        .contains(&v)),
    field!(
        "surface_lights.filter_radius",
        "0 to 16",
        surface_lights.filter_radius,
        |v| v <= MOST_FILTER_RADIUS
    ),
    field!(
        "surface_lights.reach",
        "above 0: share of the region's radius",
        surface_lights.shading.reach,
        |v: f32| v > 0.0 && v.is_finite()
    ),
    field!(
        "surface_lights.threshold",
        "0 to 1: share of the light",
        surface_lights.shading.threshold,
        |v: f32| (0.0..=1.0).contains(&v)
    ),
    field!("final_gather.map_size", "4 to 8192", final_gather.map_size, |v| (4
        ..=8192)
        .contains(&v)),
    field!(
        "final_gather.filter_radius",
        "0 to 16",
        final_gather.filter_radius,
        |v| v <= MOST_FILTER_RADIUS
    ),
    field!(
        "final_gather.photons",
        "above 0: photons under a kernel",
        final_gather.photons,
        |v: f32| v > 0.0 && v.is_finite()
    ),
    choice!(
        "splatter.shape",
        "tiled, quads or volumes",
        splatter_config.shape,
        ["tiled", SplatShape::Tiled],
        ["quads", SplatShape::Quads],
        ["volumes", SplatShape::Volumes]
    ),
    choice!(
        "splatter.blend_format",
        "default, rgba16float or rgba32float (quads and volumes only)",
        splatter_config.blend_format,
        ["default", None],
        ["rgba16float", Some(wgpu::TextureFormat::Rgba16Float)],
        ["rgba32float", Some(wgpu::TextureFormat::Rgba32Float)]
    ),
    choice!(
        "splatter.kernel",
        "constant, cone or epanechnikov",
        splatter_config.kernel,
        ["constant", Kernel::Constant],
        ["cone", Kernel::Cone],
        ["epanechnikov", Kernel::Epanechnikov]
    ),
    field!(
        "splatter.keeps_to_surfaces",
        "true or false",
        splatter_config.keeps_to_surfaces,
        |_| true
    ),
    Knob {
        name: "splatter.photons",
        expected: "above 0: photons under a kernel",
        get: |s| s.density_values().0.to_string(),
        set: |s, v| {
            *s.density().0 = v.parse().ok()?;
            Some(())
        },
        is_valid: |s| s.density_values().0 > 0.0 && s.density_values().0.is_finite(),
    },
    Knob {
        name: "splatter.lowest_density",
        expected: "above 0, at most splatter.highest_density",
        get: |s| s.density_values().1[0].to_string(),
        set: |s, v| {
            s.density().1[0] = v.parse().ok()?;
            Some(())
        },
        is_valid: |s| s.density_values().1[0] > 0.0 && s.density_values().1[0] <= s.density_values().1[1],
    },
    Knob {
        name: "splatter.highest_density",
        expected: "at least splatter.lowest_density",
        get: |s| s.density_values().1[1].to_string(),
        set: |s, v| {
            s.density().1[1] = v.parse().ok()?;
            Some(())
        },
        is_valid: |s| s.density_values().1[1].is_finite() && s.density_values().1[0] <= s.density_values().1[1],
    },
    Knob {
        name: "splatter.density",
        expected: "hop or screen",
        get: |s| match s.splatter.bandwidth {
            Bandwidth::Screen { .. } => "screen".into(),
            _ => "hop".into(),
        },
        set: |s, v| {
            let (&mut photons, &mut clamp) = s.density();
            s.splatter.bandwidth = match v {
                "hop" => Bandwidth::Density { photons, clamp },
                "screen" => Bandwidth::Screen { photons, clamp },
                _ => return None,
            };
            Some(())
        },
        is_valid: |_| true,
    },
    Knob {
        name: "splatter.fixed_radius",
        expected: "above 0: share of the region's radius (0: by density)",
        get: |s| match s.splatter.bandwidth {
            Bandwidth::Fixed(share) => share.to_string(),
            _ => "0".into(),
        },
        set: |s, v| {
            let share: f32 = v.parse().ok()?;
            if share == 0.0 {
                s.density();
            } else {
                s.splatter.bandwidth = Bandwidth::Fixed(share);
            }
            Some(())
        },
        is_valid: |s| match s.splatter.bandwidth {
            Bandwidth::Fixed(share) => share > 0.0 && share.is_finite(),
            _ => true,
        },
    },
    field!("splatter.min_radius", "0 to 23 pixels", splatter.min_radius, |v| (0.0
        ..=LARGEST_RADIUS)
        .contains(&v)),
    field!(
        "splatter.max_radius",
        "above 0, up to 23 pixels",
        splatter.max_radius,
        |v| v > 0.0 && v <= LARGEST_RADIUS
    ),
    field!("splatter.radius_alpha", "above 0, at most 1", radius_alpha, |v| v > 0.0
        && v <= 1.0),
    choice!(
        "splatter.boundary",
        "off or kernel-area",
        splatter.boundary,
        ["off", BoundaryCorrection::Off],
        ["kernel-area", BoundaryCorrection::KernelArea]
    ),
    choice!(
        "splatter.subsampling",
        "1, 2, 4 or 8 (pixels for each sample, along an axis)",
        subsampling,
        ["1", Subsampling::Full],
        ["2", Subsampling::Half],
        ["4", Subsampling::Quarter],
        ["8", Subsampling::Eighth]
    ),
    choice!(
        "upsampler.levels",
        "at-once or by-levels",
        upsampling,
        ["at-once", Upsampling::AtOnce],
        ["by-levels", Upsampling::ByLevels]
    ),
    field!(
        "upsampler.normal_agreement",
        "below 1: a cosine",
        upsampler.normal_agreement,
        |v: f32| v < 1.0 && v.is_finite()
    ),
    field!(
        "upsampler.plane_distance",
        "above 0",
        upsampler.plane_distance,
        |v: f32| v > 0.0 && v.is_finite()
    ),
    field!(
        "upsampler.disagreement",
        "0 or more: share of the mean",
        upsampler.disagreement,
        |v: f32| v >= 0.0
    ),
    choice!(
        "composite.fused",
        "on or off",
        fuses_composite,
        ["on", true],
        ["off", false]
    ),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_entry_can_be_read_back_into_its_preset() {
        for name in ["fast", "balanced", "accurate"] {
            let preset = Settings::preset(name).unwrap();
            preset.validate().unwrap();
            let mut copy = Settings::balanced();
            for (key, value) in preset.entries() {
                copy.set(key, &value).unwrap();
            }
            assert_eq!(copy, preset, "{name}");
        }
    }

    #[test]
    fn a_fixed_radius_replaces_density_and_gives_way_to_it() {
        let mut settings = Settings::balanced();
        settings.set("splatter.fixed_radius", "0.05").unwrap();
        assert_eq!(settings.splatter.bandwidth, Bandwidth::Fixed(0.05));
        settings.validate().unwrap();
        settings.set("splatter.photons", "30").unwrap();
        assert_eq!(settings.density_values().0, 30.0);
    }

    #[test]
    fn tracers_of_triangles_are_refused_where_the_crate_was_built_without_them() {
        for name in ["bvh", "hybrid"] {
            let mut settings = Settings::balanced();
            let answer = settings.set("tracer.kind", name);
            if cfg!(feature = "bvh") {
                answer.unwrap();
                settings.validate().unwrap();
            } else {
                let error = answer.unwrap_err().to_string();
                assert!(error.contains("feature `bvh`"), "{error}");
                settings.tracer_kind = TracerKind::Bvh;
                assert!(settings.validate().is_err());
            }
        }
    }

    #[test]
    fn unknown_names_and_bad_values_say_what_would_do() {
        let mut settings = Settings::balanced();
        let error = settings.set("photon", "1").unwrap_err().to_string();
        assert!(
            error.contains("photons") && error.contains("tracer.iterations"),
            "{error}"
        );
        let error = settings.set("bounces", "65").unwrap_err().to_string();
        assert!(error.contains("0 to 64"), "{error}");
        assert!(settings.set("splatter.kernel", "round").is_err());
        assert!(settings.set("photons", "many").is_err());
        assert_eq!(settings, Settings::balanced(), "a refused value changes nothing");
        settings.env_map_count = 32;
        assert!(matches!(settings.validate(), Err(Error::InvalidSetting { key, .. }) if key == "env_maps.count"));
    }
}
