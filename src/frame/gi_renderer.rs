//! Everything composed: a frame of global illumination from public passes.
//!
//! Each frame: [`GiRenderer::set_scene`] (what there is), [`GiRenderer::prepare`] (the host's geometry and every view),
//! [`GiRenderer::record_scene`] once, [`GiRenderer::record_view`] for each view; then the host submits. Nothing is waited
//! for, submitted or, once settled, allocated on the way. One small result comes back by itself: where environment maps
//! should stand.

#[cfg(all(feature = "bvh", not(target_arch = "wasm32")))]
use super::PhotonFeeder;
use super::caustic_view::CausticView;
use super::direct_scene::{DirectScene, ShadowPasses};
use super::direct_view::{DirectPasses, DirectView, DirectViewInputs, FusedParts};
use super::env_map_placement::{EnvMapPlacement, PlacementInputs, SelectionContext};
use super::guiding_schedule::GuidingSchedule;
use super::indirect_scene::{IndirectScene, PhotonInputs, PhotonPasses};
use super::indirect_view::{IndirectView, IndirectViewInputs, ViewPasses};
use super::recapture::Recapture;
use super::selection_schedule::{PHOTON_ROUNDS, Work};
use super::specular_view::SpecularView;
use super::stand_ins::StandIns;
use super::surface_light_scene::SurfaceLightScene;
use super::{IndirectMethod, LightPlacement, Plan, Settings, Stage};
use crate::pass::{
    Composite, CompositeInputs, CompositeResources, CompositeSettings, CoverageMeasure, EnvMapSelector,
    FusedCompositeInputs, GBufferCapture, GBufferCaptureInputs, PathShape, PhotonSplatter, PhotonSplatterResources,
};
#[cfg(feature = "bvh")]
use crate::resource::BvhGeometry;
use crate::resource::{
    CameraView, CapturePurpose, CaptureView, DepthHierarchy, EnvMapIrradiance, EnvMaps, Environment, GBuffer, Geometry,
    GuidingTables, IlluminationMap, Irradiance, MarkedPixels, PhotonGroups, PhotonPool, Photons, PrepareContext,
    Radiance, ShadowMaps, Subsampling, SurfaceLights, Visibility,
};
use crate::scene::{
    Camera, EnvironmentImage, Lamp, Light, LightKind, LightSources, Projection, SceneBounds, SceneSummary,
    SurfacePlace, UnitFrame,
};
use crate::{Error, Timestamps};
use glam::DVec3;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// All passes and the resources that views share.
#[derive(Debug)]
pub struct GiRenderer {
    device: wgpu::Device,
    settings: Settings,
    /// Of all renderers that share them.
    passes: Arc<Passes>,
    black: Irradiance,
    environment: Environment,
    environment_image: Option<EnvironmentImage>,
    direct: Option<DirectScene>,
    indirect: Option<IndirectScene>,
    state: Option<SceneState>,
    stand_ins: StandIns,
    placement: EnvMapPlacement,
    /// Photons traced a frame, caustic ones aside.
    streamed: u32,
    /// World space, as the host last gave them.
    surface_places: Vec<SurfacePlace>,
    #[cfg(all(feature = "bvh", not(target_arch = "wasm32")))]
    photon_feeder: Option<PhotonFeeder>,
    /// Changes whenever a resource that views bind is made anew; no two renderers share one.
    generation: u64,
    /// Counts changes of light and geometry.
    revision: u64,
    /// All views of the frame, indexed; the last `prepare` filled it.
    views: Vec<CaptureView>,
    light_views: std::ops::Range<usize>,
    env_map_views: std::ops::Range<usize>,
    recapture: Recapture,
    /// Layers of the environment maps that this frame captures.
    env_map_layers: Vec<u32>,
    /// Of texels that the host's draws gather.
    hemisphere_views: std::ops::Range<usize>,
    /// That photons were last traced in.
    photons_frame: Option<UnitFrame>,
    /// Of the photons, and of rays to lamps.
    sample_offset: u32,
    guiding: GuidingSchedule,
    /// This frame's share of the selection, and its views.
    selection: Option<(Work, std::ops::Range<usize>)>,
}

#[derive(Debug)]
struct Passes {
    g_buffer_capture: GBufferCapture,
    shadows: ShadowPasses,
    direct: DirectPasses,
    env_map_selector: EnvMapSelector,
    photons: PhotonPasses,
    view: ViewPasses,
    composite: Composite,
}

impl Passes {
    fn new(device: &wgpu::Device, settings: &Settings) -> Result<Self, Error> {
        Ok(Self {
            g_buffer_capture: GBufferCapture::new(),
            shadows: ShadowPasses::new(device),
            direct: DirectPasses::new(device, settings),
            env_map_selector: EnvMapSelector::new(device),
            photons: PhotonPasses::new(device, settings),
            view: ViewPasses::new(device, settings)?,
            composite: Composite::new(device, wgpu::TextureFormat::Rgba32Float),
        })
    }
}

/// What the scene is, as of the last `set_scene`.
#[derive(Debug)]
struct SceneState {
    frame: UnitFrame,
    plan: Plan,
    /// Those given, and behind them those that stand for the environment, and for lamps.
    lights: Vec<Light>,
    suns: Vec<Light>,
    lamps: Vec<Lamp>,
    region: SceneBounds,
    /// Of all surfaces, unit frame.
    area: f32,
}

/// What to do where there are no triangles for rays, or for shadows.
#[cfg(feature = "bvh")]
const NO_RAYS: &str = "prepare a BvhGeometry each frame, or choose tracer.kind = image-space";
#[cfg(feature = "bvh")]
const NO_SHADOW_RAYS: &str =
    "prepare a BvhGeometry each frame, or choose another soft_shadow.method and soft_shadow.test = shadow-maps";

/// Resources of one view.
#[derive(Debug)]
pub struct ViewResources {
    g_buffer: GBuffer,
    radiance: Radiance,
    composite: CompositeResources,
    direct: Option<DirectView>,
    indirect: Option<IndirectView>,
    caustic: Option<CausticView>,
    specular: Option<SpecularView>,
    size: [u32; 2],
    /// Of the renderer that `direct` and `indirect` were made for.
    generation: u64,
}

/// What [`GiRenderer::record_scene`] needs.
#[derive(Clone, Copy)]
#[allow(missing_debug_implementations, reason = "holds a trait object of the host's")]
pub struct SceneInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// The geometry that was prepared.
    pub geometry: &'a dyn Geometry,
    /// The same geometry as triangles, prepared for this frame: what [`Stage::BvhTracer`] needs while it is on.
    #[cfg(feature = "bvh")]
    pub bvh: Option<&'a BvhGeometry>,
    /// First index into the random sequence: constant in real time; advanced by the number of photons per frame, or by 1 if
    /// there are none, when accumulating.
    pub sample_offset: u32,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

/// What [`GiRenderer::record_view`] needs.
#[derive(Clone, Copy)]
#[allow(missing_debug_implementations, reason = "holds a trait object of the host's")]
pub struct ViewInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// The geometry that was prepared.
    pub geometry: &'a dyn Geometry,
    /// The same geometry as triangles, prepared for this frame: what rays of [`Stage::FinalGather`],
    /// [`Stage::SurfaceLightShading`] and [`Stage::SpecularPaths`] meet where the settings trace triangles, and those of
    /// [`Stage::SoftShadow`] where they say so.
    #[cfg(feature = "bvh")]
    pub bvh: Option<&'a BvhGeometry>,
    /// One of the views that were prepared.
    pub view: &'a CameraView,
    /// Frames of this view that are in the mean already, where frames are accumulated: kernels narrow with them
    /// ([`Settings::radius_alpha`]). 0 in real time; else what
    /// [`AccumulatorResources::follow`](crate::pass::AccumulatorResources::follow) says.
    pub accumulated: u32,
    /// What to show; `output_scale` is taken as given, see [`UnitFrame::output_scale`].
    pub composite: &'a CompositeSettings,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl GiRenderer {
    /// Features that these settings need: none, unless they ask for quads blended in f32.
    pub fn required_features(settings: &Settings) -> wgpu::Features {
        PhotonSplatter::required_features(&settings.splatter_config)
    }

    /// Limits that suffice for any settings: the defaults. Large photon counts, and images of more than 33 million pixels, may
    /// ask for larger storage buffers.
    pub fn required_limits() -> wgpu::Limits {
        wgpu::Limits::default()
    }

    /// All passes, for [`Radiance`] of `rgba32float`.
    ///
    /// # Errors
    /// [`Error::InvalidSetting`], [`Error::MissingFeatures`].
    pub fn new(device: &wgpu::Device, settings: &Settings) -> Result<Self, Error> {
        settings.validate()?;
        Self::with_passes(device, settings, Arc::new(Passes::new(device, settings)?))
    }

    /// A renderer of another scene, or of the same one apart, with the settings and the pipelines of this one: they are most of
    /// what [`GiRenderer::new`] takes its time for. Nothing else is shared.
    ///
    /// # Errors
    /// None that [`GiRenderer::new`] did not have.
    pub fn another(&self) -> Result<Self, Error> {
        Self::with_passes(&self.device, &self.settings, Arc::clone(&self.passes))
    }

    fn with_passes(device: &wgpu::Device, settings: &Settings, passes: Arc<Passes>) -> Result<Self, Error> {
        Ok(Self {
            device: device.clone(),
            settings: settings.clone(),
            passes,
            black: Irradiance::new(device, [1, 1], wgpu::TextureFormat::Rgba32Float)?,
            environment: Environment::black(device)?,
            environment_image: None,
            direct: None,
            indirect: None,
            state: None,
            stand_ins: StandIns::default(),
            placement: EnvMapPlacement::default(),
            streamed: settings.traced_photons(),
            surface_places: Vec::new(),
            #[cfg(all(feature = "bvh", not(target_arch = "wasm32")))]
            photon_feeder: None,
            generation: next_generation(),
            revision: 0,
            views: Vec::new(),
            light_views: 0..0,
            env_map_views: 0..0,
            recapture: Recapture::default(),
            env_map_layers: Vec::new(),
            hemisphere_views: 0..0,
            photons_frame: None,
            sample_offset: 0,
            guiding: GuidingSchedule::default(),
            selection: None,
        })
    }

    /// Takes other settings. Call it right before `set_scene`, which allocates for them: what the old ones made and the new ones
    /// do not share is dropped at once, and what views hold is made anew when they are recorded. Pipelines stay unless the
    /// tracer, a method or the form of splats is another one; so do the places of environment maps, as many as there may be.
    /// Photons are forgotten, kept light too, and a `PhotonFeeder` of other photons. For a change now and then, as a
    /// [`BudgetController`](super::BudgetController) asks for, not for every frame.
    ///
    /// # Errors
    /// As [`GiRenderer::new`]; the old settings stay then. What does not fit the device's limits is an error of `set_scene`.
    pub fn set_settings(&mut self, settings: &Settings) -> Result<(), Error> {
        settings.validate()?;
        let old = &self.settings;
        if settings == old {
            return Ok(());
        }
        if !settings.share_pipelines(old) {
            self.passes = Arc::new(Passes::new(&self.device, settings)?);
        }
        let shadows = |s: &Settings| (s.shadow_map_size, s.selects_photons());
        if shadows(settings) != shadows(old) {
            self.direct = None;
        }
        self.indirect = None;
        self.selection = None;
        self.guiding = GuidingSchedule::default();
        if (settings.selector, settings.env_map_count) != (old.selector, old.env_map_count) {
            self.placement.start_over(settings.env_map_count as usize);
        }
        let streams = |s: &Settings| (s.indirect_method, s.traced_photons(), s.walked_bounces());
        if streams(settings) != streams(old) {
            self.streamed = settings.traced_photons();
            #[cfg(all(feature = "bvh", not(target_arch = "wasm32")))]
            {
                self.photon_feeder = None;
            }
        }
        self.settings = settings.clone();
        self.generation = next_generation();
        self.revision += 1;
        Ok(())
    }

    /// Gives the image that an environment light refers to, whatever the index in [`LightKind::Environment`]: of a `Scene` that
    /// of [`Scene::environment_image`](crate::scene::Scene::environment_image). `None` drops it. Uploads it, and divides it
    /// into suns with the next `set_scene`: call it before that, when the image changes, not every frame.
    ///
    /// # Errors As [`EnvironmentImage::validate`]; [`Error::LimitExceeded`] for one that is larger than a texture may be. The
    /// old one stays then.
    pub fn set_environment(&mut self, queue: &wgpu::Queue, image: Option<&EnvironmentImage>) -> Result<(), Error> {
        self.environment = match image {
            Some(image) => Environment::new(&self.device, queue, image)?,
            None => Environment::black(&self.device)?,
        };
        if let Some(state) = &self.state {
            let light = state.lights.iter().find(|l| l.is_environment());
            self.environment.write(queue, &state.frame, light);
        }
        self.environment_image = image.cloned();
        self.stand_ins.environment_changed();
        self.revision += 1;
        Ok(())
    }

    /// Says what the scene is this frame: plans the stages, keeps or renews the unit frame, uploads the lights, allocates
    /// what newly became necessary and drops what no longer is. Returns the frame for building views.
    ///
    /// # Errors
    /// [`Error::InvalidBounds`], [`Error::InvalidScene`] for a bad light, [`Error::CountMismatch`] for too many of them,
    /// [`Error::LimitExceeded`]; [`Error::MissingInput`] for an environment light that refers to an image while none is given.
    pub fn set_scene(
        &mut self,
        queue: &wgpu::Queue,
        summary: &SceneSummary,
        lights: &[Light],
    ) -> Result<UnitFrame, Error> {
        self.selection = None;
        for (index, light) in lights.iter().enumerate() {
            light.validate(index)?;
        }
        summary.validate(lights)?;
        let (device, image) = (&self.device, self.environment_image.as_ref());
        let suns = self.stand_ins.suns(device, &self.settings, image, (summary, lights))?;
        let lamps = self.stand_ins.lamps(device, summary, (lights, &suns))?;
        let sources = LightSources {
            lights,
            suns: &suns,
            lamps: &lamps,
        };
        let sources = sources.all();
        let frame = match &self.state {
            Some(state) => state.frame.follow(&summary.bounds, summary.total_flux)?,
            None => UnitFrame::new(&summary.bounds, summary.total_flux)?,
        };
        let plan = Plan::for_scene(summary, &self.settings);
        self.allocate(queue, &plan, &sources)?;
        let reach = |lights: &[Light]| {
            let shining = lights.iter().filter(|l| !l.is_environment());
            shining
                .map(|l| (l.kind, l.strength() == DVec3::ZERO))
                .collect::<Vec<_>>()
        };
        if self.state.as_ref().is_some_and(|s| reach(&s.lights) != reach(&sources)) {
            self.placement.lights_changed();
        }
        let is_same = |s: &SceneState| s.lights == sources && s.lamps == lamps && s.frame.maps_like(&frame);
        if !self.state.as_ref().is_some_and(is_same) {
            self.revision += 1;
        }
        self.state = Some(SceneState {
            frame,
            plan,
            lights: sources,
            suns,
            lamps,
            region: summary.bounds,
            area: frame.area(summary.area),
        });
        if let Some(state) = &self.state {
            let environment = lights.iter().find(|l| l.is_environment());
            self.environment.write(queue, &frame, environment);
            if let Some(direct) = &mut self.direct {
                let sources = LightSources {
                    lights,
                    suns: &state.suns,
                    lamps: &state.lamps,
                };
                direct.lights.write(queue, &frame, &sources, self.streamed)?;
            }
            if let (Some(direct), Some(indirect)) = (&self.direct, &mut self.indirect) {
                indirect.aim_caustics(queue, &frame, &direct.lights, &summary.specular_bounds);
            }
            let context = selection_context(&self.device, queue, &self.settings, state);
            let is_needed = state.plan.is_on(Stage::EnvMapSelector);
            self.placement.follow(&context, is_needed)?;
        }
        self.apply_centers(queue)?;
        Ok(frame)
    }

    fn allocate(&mut self, queue: &wgpu::Queue, plan: &Plan, lights: &[Light]) -> Result<(), Error> {
        let (device, settings) = (&self.device, &self.settings);
        if !plan.is_on(Stage::ShadowMapCapture) {
            self.direct = None;
        } else if !self.direct.as_ref().is_some_and(|d| d.fits(lights)) {
            self.generation = next_generation();
            if let Some(indirect) = &mut self.indirect {
                indirect.renew_emitter(device)?;
            }
            self.direct = Some(DirectScene::new(device, settings, lights)?);
        }
        if let Some(direct) = &mut self.direct {
            direct.follow(device, plan)?;
        }
        if !plan.is_on(Stage::PhotonEmitter) {
            self.indirect = None;
        } else if self.indirect.is_none() {
            let config = &settings.splatter_config;
            if settings.indirect_method == IndirectMethod::Splatting {
                PhotonSplatterResources::check(device, config, settings.photons, settings.bounces)?;
            }
            if settings.keeps_near() {
                PhotonSplatterResources::check(device, config, settings.pool_paths(), 1)?;
            }
            if plan.is_on(Stage::CausticMap) {
                PhotonSplatterResources::check(device, config, settings.caustic.photons, settings.bounces)?;
            }
            self.generation = next_generation();
            self.photons_frame = None;
            self.recapture.forget();
            self.indirect = Some(IndirectScene::new(device, queue, settings)?);
        }
        if let Some(indirect) = &mut self.indirect {
            let sorted = [Stage::PhotonGrid, Stage::GlossyLight].map(|stage| plan.is_on(stage));
            indirect.sort_photons(device, sorted)?;
            indirect.split_caustics((device, queue), settings, plan.is_on(Stage::CausticMap))?;
        }
        Ok(())
    }

    /// Writes the centres of the environment maps in the current frame.
    fn apply_centers(&mut self, queue: &wgpu::Queue) -> Result<(), Error> {
        let env_maps = self.indirect.as_mut().and_then(IndirectScene::env_maps_mut);
        let (Some(state), Some(env_maps)) = (&self.state, env_maps) else {
            return Ok(());
        };
        let context = selection_context(&self.device, queue, &self.settings, state);
        let mut centers = self.placement.centers(&context);
        let at_lights = state.lights.iter().filter_map(|light| match light.kind {
            LightKind::Point { position, .. } | LightKind::Spot { position, .. } => Some(state.frame.point(position)),
            _ => None,
        });
        centers.extend(at_lights.take(self.settings.env_maps_at_lights as usize));
        env_maps.set_centers(queue, &centers)
    }

    /// As `apply_centers`, for new places: maps there are switched on, and what was planned for the selection is void.
    fn renew_centers(&mut self, queue: &wgpu::Queue) -> Result<(), Error> {
        self.selection = None;
        if let Some(env_maps) = self.indirect.as_mut().and_then(IndirectScene::env_maps_mut) {
            // Without maps there was no light but the first hits'.
            self.revision += u64::from(env_maps.centers().is_empty());
            env_maps.forget_centers();
        }
        if let Some(lights) = self.indirect.as_mut().and_then(IndirectScene::surface_lights_mut) {
            lights.wake();
        }
        if let (Some(indirect), super::TracerKind::ImageSpace) = (&mut self.indirect, self.settings.tracer_kind) {
            indirect.retrace();
        }
        self.apply_centers(queue)
    }

    /// Selects places for the environment maps. Submits and waits: for headless use and loading screens. Without it the
    /// selection begins with the first frame and arrives some frames later. It prepares the geometry for views of its own:
    /// call it after `set_scene` and before `prepare`. Does nothing where the settings need no environment maps.
    ///
    /// Where places are chosen by what photons reach ([`CoverageMeasure::Photons`](crate::pass::CoverageMeasure)), photons are
    /// traced for it, through maps in places chosen by area, then through better ones. Triangles are not at hand here: where
    /// the settings trace them alone, the first hits of photons decide (of lamps there are none), and the frames that follow
    /// choose better by all of them.
    ///
    /// # Errors
    /// [`Error::ReadBack`], [`Error::LimitExceeded`], or what the geometry's `prepare` returns.
    pub fn place_env_maps_blocking(&mut self, queue: &wgpu::Queue, geometry: &mut dyn Geometry) -> Result<(), Error> {
        if !self.settings.needs_env_maps() {
            return Ok(());
        }
        self.select_blocking(queue, geometry, false)?;
        if self.settings.selector.measure == CoverageMeasure::Photons && self.indirect.is_some() {
            for _ in 0..PHOTON_ROUNDS {
                self.trace_for_selection(queue, geometry)?;
                self.select_blocking(queue, geometry, true)?;
            }
        }
        Ok(())
    }

    fn select_blocking(
        &mut self,
        queue: &wgpu::Queue,
        geometry: &mut dyn Geometry,
        by_photons: bool,
    ) -> Result<(), Error> {
        let Some(state) = &self.state else {
            return Ok(());
        };
        let context = selection_context(&self.device, queue, &self.settings, state);
        let photons = self
            .indirect
            .as_ref()
            .filter(|_| by_photons)
            .map(IndirectScene::photons);
        self.placement
            .select_blocking(&self.passes.env_map_selector, &context, photons, geometry)?;
        self.renew_centers(queue)
    }

    /// Submits a frame of photons, in image space alone: triangles are not at hand, and where maps lose a ray there is
    /// nothing for them to cover. Where only triangles are traced these are first hits, and none of lamps.
    fn trace_for_selection(&mut self, queue: &wgpu::Queue, geometry: &mut dyn Geometry) -> Result<(), Error> {
        self.prepare(queue, geometry, &mut [])?;
        self.selection = None;
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let inputs = SceneInputs {
            queue,
            geometry,
            #[cfg(feature = "bvh")]
            bvh: None,
            sample_offset: 0,
            timestamps: None,
        };
        self.record_shadow_maps(&mut encoder, &inputs);
        self.record_photons(&mut encoder, &inputs)?;
        queue.submit([encoder.finish()]);
        if let Some(indirect) = &mut self.indirect {
            indirect.retrace();
        }
        Ok(())
    }

    /// Places the environment maps by hand, world space; up to [`Settings::env_map_count`]. Nothing is selected any more,
    /// until `place_env_maps_blocking` is called.
    ///
    /// # Errors
    /// [`Error::CountMismatch`] for too many.
    pub fn set_env_map_centers(&mut self, queue: &wgpu::Queue, centers: &[DVec3]) -> Result<(), Error> {
        let most = self.settings.env_map_count as usize;
        if centers.len() > most {
            return Err(Error::CountMismatch {
                what: "environment-map centres (most that the settings allow)",
                expected: most,
                found: centers.len(),
            });
        }
        self.revision += 1;
        self.placement.set_centers(centers);
        self.renew_centers(queue)
    }

    /// Says where surface lights stand: places that were chosen once
    /// ([`SurfacePoint::place`](crate::scene::SurfacePoint::place), with
    /// [`SurfaceLightSettings::places`](super::SurfaceLightSettings::places)), where their instances are now. Once, and
    /// whenever an instance has moved. Of as many places as before each is taken for the same one, and keeps its light.
    pub fn set_surface_places(&mut self, places: &[SurfacePlace]) {
        if self.surface_places != places {
            self.surface_places = places.to_vec();
            self.revision += 1;
        }
    }

    /// Says how many photons surface lights take each frame from the next `set_scene` on, at most
    /// [`SurfaceLightSettings::stream`](super::SurfaceLightSettings::stream), with which it begins: more where light changes
    /// fast, fewer to save time, 0 to keep what there is. Lights at impacts take as many as they are.
    pub fn set_streamed_photons(&mut self, count: u32) {
        let (method, placement) = (self.settings.indirect_method, self.settings.surface_lights.placement);
        if (method, placement) == (IndirectMethod::SurfaceLights, LightPlacement::OnSurfaces) {
            self.streamed = count.min(self.settings.traced_photons());
        }
    }

    /// Says that geometry has moved, appeared or gone since the last frame: the selection of places for environment maps
    /// is then kept up to date until it comes to rest, and shadow maps are captured anew. Call it before `prepare`; a change of
    /// the region is noticed without it.
    pub fn geometry_changed(&mut self) {
        self.revision += 1;
        if let Some(direct) = &mut self.direct {
            direct.forget();
        }
        self.placement.geometry_changed();
    }

    /// Says where geometry, or what it looks like, has changed since the last frame, so that only those faces of
    /// environment maps are captured that may show it; `&[]`: nowhere, and shadow maps stay as well, as long as lights and the
    /// unit frame do. Of an object that moved both its old box and its new one are wanted. It counts for the next `prepare`,
    /// adds to what was said before it, and includes [`GiRenderer::geometry_changed`] where there is a change. In frames
    /// without a word of it everything is captured. A frame that was recorded has to be submitted, or its changes are missed.
    pub fn set_changes(&mut self, changes: &[SceneBounds]) {
        self.recapture.set_changes(changes);
        if !changes.is_empty() {
            self.geometry_changed();
        }
    }

    /// Collects every view of the frame, numbers them, and lets the geometry prepare for them.
    ///
    /// # Errors
    /// What the geometry's `prepare` returns.
    pub fn prepare(
        &mut self,
        queue: &wgpu::Queue,
        geometry: &mut dyn Geometry,
        cameras: &mut [CameraView],
    ) -> Result<(), Error> {
        let Some(frame) = self.state.as_ref().map(|s| s.frame) else {
            return Ok(());
        };
        if self.placement.take_selection(&frame) {
            self.renew_centers(queue)?;
        }
        let Some(state) = &self.state else {
            return Ok(());
        };
        self.views.clear();
        self.views.extend(cameras.iter().map(|c| c.capture));
        let lights_from = self.views.len();
        if let Some(direct) = &mut self.direct {
            if !self.recapture.is_still() {
                direct.forget();
            }
            self.views
                .extend(direct.plan((&state.frame, &state.lights), &state.plan));
        }
        let maps_from = self.views.len();
        let env_maps = self.indirect.as_ref().and_then(IndirectScene::env_maps);
        let centers = env_maps.map_or(&[][..], EnvMaps::centers);
        self.env_map_layers = self.recapture.layers(&state.frame, centers);
        if let Some(env_maps) = env_maps {
            let all: Vec<_> = env_maps.views(CapturePurpose::EnvMap).collect();
            self.views
                .extend(self.env_map_layers.iter().map(|&layer| all[layer as usize]));
        }
        let hemispheres_from = self.views.len();
        if let Some(hemispheres) = self.indirect.as_mut().and_then(IndirectScene::hemispheres_mut) {
            let planned = hemispheres.plan(queue, &state.frame, &self.surface_places)?;
            self.views.extend(planned);
        }
        let selection_from = self.views.len();
        let has_photons = traced_photons(&self.state, &self.photons_frame, &self.indirect).is_some();
        let work = self
            .placement
            .plan_frame(&self.settings.selector, has_photons, &mut self.views);
        self.selection = work.map(|w| (w, selection_from..self.views.len()));
        number(&mut self.views);
        self.guiding.follow(self.revision, cameras);
        for (camera, view) in cameras.iter_mut().zip(&self.views) {
            camera.capture = *view;
        }
        self.light_views = lights_from..maps_from;
        self.env_map_views = maps_from..hemispheres_from;
        self.hemisphere_views = hemispheres_from..selection_from;
        let context = PrepareContext {
            device: &self.device,
            queue,
            frame: &state.frame,
        };
        geometry.prepare(&context, &self.views)
    }

    /// Records what all views share: shadow maps, environment maps, photons.
    ///
    /// # Errors
    /// [`Error::MissingInput`] if [`Stage::BvhTracer`] is on and no triangles are given, or surface lights have no places;
    /// [`Error::InvalidScene`] for a place that is not finite. Nothing is recorded then.
    pub fn record_scene(&mut self, encoder: &mut wgpu::CommandEncoder, inputs: &SceneInputs<'_>) -> Result<(), Error> {
        #[cfg(feature = "bvh")]
        self.check_triangles(inputs)?;
        self.follow_places(inputs.queue)?;
        self.sample_offset = inputs.sample_offset;
        self.record_shadow_maps(encoder, inputs);
        self.record_selection(encoder, inputs);
        self.record_photons(encoder, inputs)
    }

    /// Takes the photons of surface lights from threads of the processor instead of tracers on the GPU; `None`: from tracers
    /// again. The host tells it of scenes ([`PhotonFeeder::set_scene`]). In frames that find no batch ready, the pool stays as
    /// it was. Of [`SurfaceLightSettings::stream`](super::SurfaceLightSettings::stream) paths of
    /// [`Settings::walked_bounces`]. Returns the one before.
    #[cfg(all(feature = "bvh", not(target_arch = "wasm32")))]
    pub fn set_photon_feeder(&mut self, feeder: Option<PhotonFeeder>) -> Option<PhotonFeeder> {
        self.revision += 1;
        std::mem::replace(&mut self.photon_feeder, feeder)
    }

    /// What brings photons instead of tracers.
    #[cfg(all(feature = "bvh", not(target_arch = "wasm32")))]
    pub fn photon_feeder(&self) -> Option<&PhotonFeeder> {
        self.photon_feeder.as_ref()
    }

    /// Traces all of the photons that surface lights are made of, at once instead of over many frames: at the start, after a
    /// cut. Submits what it records and does not wait; call it after `prepare`, before `record_scene`. Nothing where there is
    /// no pool, or threads of the processor fill it.
    ///
    /// # Errors
    /// As [`GiRenderer::record_scene`].
    pub fn fill_photon_pool(&mut self, inputs: &SceneInputs<'_>) -> Result<(), Error> {
        #[cfg(feature = "bvh")]
        self.check_triangles(inputs)?;
        self.follow_places(inputs.queue)?;
        #[cfg(all(feature = "bvh", not(target_arch = "wasm32")))]
        if self.photon_feeder.is_some() {
            return Ok(());
        }
        if self.streamed == 0 {
            return Ok(());
        }
        let per_round = self.streamed.max(1);
        let rounds = self.photon_pool().map_or(0, PhotonPool::paths).div_ceil(per_round);
        if let Some(lights) = self.indirect.as_mut().and_then(IndirectScene::surface_lights_mut) {
            lights.wake();
        }
        self.submit_rounds(rounds, inputs)
    }

    /// Forgets the illumination map, traces all photons and gathers all texels at once instead of over many frames, unless the
    /// host's draws gather them ([`GiRenderer::gather_illumination_map_blocking`]): at the start, after a cut. Submits what it
    /// records and does not wait; call it after `prepare`, before `record_scene`. Nothing where there is no such map.
    ///
    /// # Errors
    /// As [`GiRenderer::record_scene`].
    pub fn fill_illumination_map(&mut self, inputs: &SceneInputs<'_>) -> Result<(), Error> {
        if self.illumination_map().is_none() {
            return Ok(());
        }
        #[cfg(feature = "bvh")]
        self.check_triangles(inputs)?;
        self.follow_places(inputs.queue)?;
        if let Some(indirect) = &mut self.indirect {
            indirect.restart_illumination();
        }
        let a_frame = self.settings.illumination_maps.gather.a_frame.max(1);
        let rounds = match self.settings.gathers_by_draws() {
            true => 1,
            false => self.texel_count().div_ceil(a_frame),
        };
        self.submit_rounds(rounds, inputs)
    }

    /// Gathers all texels of the illumination map at once by the host's draws, where these gather, from the light of the last
    /// frame that was recorded or filled ([`GiRenderer::fill_illumination_map`]): at the start, after a cut. Submits and waits,
    /// for texels stand where photons arrived. It prepares the geometry for views of its own: call `prepare` again before
    /// `record_scene`.
    ///
    /// # Errors
    /// [`Error::ReadBack`], [`Error::LimitExceeded`], or what the geometry's `prepare` returns.
    pub fn gather_illumination_map_blocking(
        &mut self,
        queue: &wgpu::Queue,
        geometry: &mut dyn Geometry,
    ) -> Result<(), Error> {
        let texels = self.texel_count();
        let (Some(state), Some(indirect)) = (&self.state, &mut self.indirect) else {
            return Ok(());
        };
        let Some(at_once) = indirect.hemispheres_mut().map(|h| h.capacity()) else {
            return Ok(());
        };
        let shifts = match indirect.illumination() {
            Some(own) => own.lights().read_shifts_blocking(&self.device, queue)?,
            None => Vec::new(),
        };
        let context = PrepareContext {
            device: &self.device,
            queue,
            frame: &state.frame,
        };
        for first in (0..texels).step_by(at_once as usize) {
            let Some(hemispheres) = indirect.hemispheres_mut() else {
                break;
            };
            let next = texels.min(first + at_once);
            let Some(shifts) = shifts.get(first as usize..next as usize) else {
                break;
            };
            let mut views = hemispheres.plan_texels(queue, (&state.frame, &self.surface_places), (first, shifts))?;
            number(&mut views);
            geometry.prepare(&context, &views)?;
            let mut encoder = self.device.create_command_encoder(&Default::default());
            indirect.record_hemispheres(&mut encoder, &self.passes.photons, (queue, &*geometry, &views))?;
            queue.submit([encoder.finish()]);
        }
        Ok(())
    }

    /// Texels of the illumination map: two at each place.
    fn texel_count(&self) -> u32 {
        2 * self.surface_places.len() as u32
    }

    /// Submits photons, and what is made of them, so many times.
    fn submit_rounds(&mut self, rounds: u32, inputs: &SceneInputs<'_>) -> Result<(), Error> {
        for round in 0..rounds {
            let mut encoder = self.device.create_command_encoder(&Default::default());
            if round == 0 {
                self.record_shadow_maps(&mut encoder, inputs);
            }
            self.record_photons(&mut encoder, inputs)?;
            inputs.queue.submit([encoder.finish()]);
            // What environment maps and hemispheres show is captured by now.
            self.env_map_layers.clear();
            self.env_map_views.end = self.env_map_views.start;
            self.hemisphere_views.end = self.hemisphere_views.start;
        }
        Ok(())
    }

    /// Puts surface lights where they stand this frame.
    fn follow_places(&mut self, queue: &wgpu::Queue) -> Result<(), Error> {
        let (Some(indirect), Some(state)) = (&mut self.indirect, &self.state) else {
            return Ok(());
        };
        let at_impacts = self.settings.surface_lights.placement == LightPlacement::AtImpacts;
        let (stage, needs_places, remedy) = match self.settings.indirect_method {
            IndirectMethod::SurfaceLights => (
                "SurfaceLightShading",
                !at_impacts,
                "hand them to GiRenderer::set_surface_places, or choose surface_lights.placement = at-impacts",
            ),
            _ => (
                "TexelGather",
                self.settings.indirect_method.has_places(),
                "hand them to GiRenderer::set_surface_places",
            ),
        };
        if self.surface_places.is_empty() && needs_places {
            return Err(Error::MissingInput {
                stage,
                input: "places on surfaces",
                remedy,
            });
        }
        let gpu = (&self.device, queue);
        indirect.follow_places(gpu, (&state.frame, &self.settings), &self.surface_places)?;
        match self.settings.indirect_method {
            IndirectMethod::SurfaceLights => indirect.stream(self.streamed),
            _ => Ok(()),
        }
    }

    fn record_photons(&mut self, encoder: &mut wgpu::CommandEncoder, inputs: &SceneInputs<'_>) -> Result<(), Error> {
        if let (Some(direct), Some(indirect), Some(state)) = (&self.direct, &mut self.indirect, &self.state) {
            let photon_inputs = PhotonInputs {
                scene: inputs,
                settings: &self.settings,
                lights: &direct.lights,
                shadow_maps: &direct.shadow_maps,
                views: &self.views[self.env_map_views.clone()],
                layers: &self.env_map_layers,
                hemisphere_views: &self.views[self.hemisphere_views.clone()],
                updates_guiding: self.guiding.take_update(),
                revision: self.revision,
                #[cfg(all(feature = "bvh", not(target_arch = "wasm32")))]
                feeder: self.photon_feeder.as_ref(),
                frame: &state.frame,
                area: state.area,
                radius: state.frame.radius(),
            };
            indirect.record(encoder, &self.passes.photons, &photon_inputs)?;
            self.recapture.recorded();
            self.photons_frame = Some(state.frame);
        }
        if let Some(direct) = &mut self.direct {
            direct.recorded();
        }
        Ok(())
    }

    #[cfg(feature = "bvh")]
    fn check_triangles(&self, inputs: &SceneInputs<'_>) -> Result<(), Error> {
        if inputs.bvh.is_none() && self.plan().is_some_and(|p| p.is_on(Stage::BvhTracer)) {
            return Err(Error::MissingInput {
                stage: "BvhTracer",
                input: "SceneInputs::bvh",
                remedy: NO_RAYS,
            });
        }
        Ok(())
    }

    #[cfg(feature = "bvh")]
    fn check_view_triangles(&self, inputs: &ViewInputs<'_>) -> Result<(), Error> {
        let is_on = |stage| self.plan().is_some_and(|p| p.is_on(stage));
        let traces = self.settings.tracer_kind.uses_triangles();
        let shades = self.settings.soft_shadow.uses_triangles();
        let lights_throw_shadows = self.settings.surface_lights.shading.shadows != crate::pass::IndirectShadows::Off;
        let (stage, remedy) = match () {
            () if traces && is_on(Stage::FinalGather) => ("FinalGather", NO_RAYS),
            () if traces && lights_throw_shadows && is_on(Stage::SurfaceLightShading) => {
                ("SurfaceLightShading", NO_RAYS)
            }
            () if traces && is_on(Stage::SpecularPaths) => ("SpecularPaths", NO_RAYS),
            () if shades && is_on(Stage::SoftShadow) => ("SoftShadow", NO_SHADOW_RAYS),
            () => return Ok(()),
        };
        match inputs.bvh {
            Some(_) => Ok(()),
            None => Err(Error::MissingInput {
                stage,
                input: "ViewInputs::bvh",
                remedy,
            }),
        }
    }

    fn record_shadow_maps(&mut self, encoder: &mut wgpu::CommandEncoder, inputs: &SceneInputs<'_>) {
        if let (Some(direct), Some(state)) = (&mut self.direct, &self.state) {
            let views = &self.views[self.light_views.clone()];
            direct.record(encoder, &self.passes.shadows, (inputs, &state.plan, views));
        }
    }

    /// Records this frame's share of the selection of places for environment maps.
    fn record_selection(&mut self, encoder: &mut wgpu::CommandEncoder, inputs: &SceneInputs<'_>) {
        let Some((work, views)) = self.selection.take() else {
            return;
        };
        let env_maps = self.indirect.as_ref().and_then(IndirectScene::env_maps);
        let photons = traced_photons(&self.state, &self.photons_frame, &self.indirect);
        if let (Some(state), Some(env_maps)) = (&self.state, env_maps) {
            let placement_inputs = PlacementInputs {
                context: &selection_context(&self.device, inputs.queue, &self.settings, state),
                geometry: inputs.geometry,
                work: &work,
                views: &self.views[views],
                env_maps,
                photons,
                timestamps: inputs.timestamps,
            };
            self.placement
                .record(encoder, &self.passes.env_map_selector, &placement_inputs);
        }
    }

    /// Resources of a view of `size` pixels.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new_view(&self, size: [u32; 2]) -> Result<ViewResources, Error> {
        Ok(ViewResources {
            g_buffer: GBuffer::new(&self.device, size)?,
            radiance: Radiance::new(&self.device, size)?,
            composite: CompositeResources::new(&self.device)?,
            direct: None,
            indirect: None,
            caustic: None,
            specular: None,
            size,
            generation: self.generation,
        })
    }

    /// Gives a view another size, as when its window is resized; nothing is made anew where the size stays. On an error the
    /// view is as it was.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn resize_view(&self, view: &mut ViewResources, size: [u32; 2]) -> Result<(), Error> {
        if view.size != size {
            *view = self.new_view(size)?;
        }
        Ok(())
    }

    /// Records one view: its G-buffer, its irradiance, the sum. Two views of one submission need two [`ViewResources`].
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] when a stage that the view needs for the first time does not fit; [`Error::MissingInput`] if
    /// [`Stage::FinalGather`], [`Stage::SurfaceLightShading`], [`Stage::SpecularPaths`] or [`Stage::SoftShadow`] is on, the
    /// settings trace triangles there, and none are given. Nothing is recorded then.
    pub fn record_view(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut ViewResources,
        inputs: &ViewInputs<'_>,
    ) -> Result<(), Error> {
        #[cfg(feature = "bvh")]
        self.check_view_triangles(inputs)?;
        self.allocate_view(resources)?;
        let g_buffer_inputs = GBufferCaptureInputs {
            queue: inputs.queue,
            geometry: inputs.geometry,
            view: inputs.view,
            timestamps: inputs.timestamps,
        };
        self.passes
            .g_buffer_capture
            .record(encoder, &mut resources.g_buffer, &g_buffer_inputs);
        if let (Some(scene), Some(own)) = (&self.direct, &mut resources.direct) {
            let direct_inputs = DirectViewInputs {
                view: inputs,
                settings: &self.settings,
                passes: &self.passes.direct,
                scene,
                g_buffer: &resources.g_buffer,
                sample_offset: self.sample_offset,
            };
            own.record(encoder, &direct_inputs);
        }
        if let (Some(scene), Some(own), Some(state), Some(direct)) =
            (&self.indirect, &mut resources.indirect, &self.state, &self.direct)
        {
            let indirect_inputs = IndirectViewInputs {
                view: inputs,
                settings: &self.settings,
                passes: (&self.passes.view, &self.passes.photons),
                scene,
                lights: &direct.lights,
                g_buffer: &resources.g_buffer,
                area: state.area,
                radius: state.frame.radius(),
                sample_offset: self.sample_offset,
                counts_guiding: self.guiding.counts(),
            };
            own.record(encoder, &indirect_inputs)?;
            if let Some(caustic) = &mut resources.caustic {
                caustic.record(encoder, &indirect_inputs)?;
            }
            if let Some(specular) = &mut resources.specular {
                specular.record(encoder, &indirect_inputs, &direct.shadow_maps, &self.environment)?;
            }
        }
        self.record_sum(encoder, resources, inputs);
        Ok(())
    }

    /// Records what puts all of it together.
    fn record_sum(&self, encoder: &mut wgpu::CommandEncoder, resources: &mut ViewResources, inputs: &ViewInputs<'_>) {
        let caustic = resources.caustic.as_ref().map(CausticView::irradiance);
        let specular = resources.specular.as_ref().map(SpecularView::radiance);
        if let (Some(scene), Some(direct), Some(fused)) =
            (&self.direct, &mut resources.direct, &self.passes.direct.fused)
            && let Some(FusedParts { own, penumbrae }) = direct.fused(scene)
        {
            let indirect = resources.indirect.as_ref().map(IndirectView::samples);
            let (indirect, subsampling) = indirect.unwrap_or((&self.black, Subsampling::Full));
            let fused_inputs = FusedCompositeInputs {
                queue: inputs.queue,
                g_buffer: &resources.g_buffer,
                lights: &scene.lights,
                shadow_maps: &scene.shadow_maps,
                penumbrae,
                indirect,
                subsampling,
                upsampler: &self.settings.upsampler,
                caustic,
                specular,
                environment: &self.environment,
                radiance: &resources.radiance,
                settings: inputs.composite,
                timestamps: inputs.timestamps,
            };
            fused.record(encoder, own, &fused_inputs);
            return;
        }
        let direct = resources.direct.as_ref().and_then(DirectView::irradiance);
        let indirect = resources.indirect.as_ref().and_then(IndirectView::irradiance);
        let composite_inputs = CompositeInputs {
            queue: inputs.queue,
            g_buffer: &resources.g_buffer,
            direct: direct.unwrap_or(&self.black),
            indirect: indirect.unwrap_or(&self.black),
            caustic,
            specular,
            environment: &self.environment,
            radiance: &resources.radiance,
            settings: inputs.composite,
            timestamps: inputs.timestamps,
        };
        self.passes
            .composite
            .record(encoder, &mut resources.composite, &composite_inputs);
    }

    fn allocate_view(&self, view: &mut ViewResources) -> Result<(), Error> {
        let (device, size) = (&self.device, view.size);
        if view.generation != self.generation {
            // Another renderer's, or from before a resource was replaced: neither fits, and both would keep it alive.
            (view.direct, view.indirect) = (None, None);
            (view.caustic, view.specular) = (None, None);
            view.generation = self.generation;
        }
        view.direct = match (&self.direct, view.direct.take()) {
            (None, _) => None,
            (Some(scene), own) => {
                let mut own = own.map_or_else(|| DirectView::new(device, &self.settings, size), Ok)?;
                own.follow(device, &self.settings, size, scene)?;
                Some(own)
            }
        };
        match &self.indirect {
            None => view.indirect = None,
            Some(scene) => {
                let new = || IndirectView::new(device, &self.settings, scene.photons(), size);
                let mut own = view.indirect.take().map_or_else(new, Ok)?;
                own.follow(device, &self.settings, scene)?;
                view.indirect = Some(own);
            }
        }
        match self.indirect.as_ref().and_then(IndirectScene::caustic_photons) {
            None => view.caustic = None,
            Some(photons) if view.caustic.is_none() => {
                view.caustic = Some(CausticView::new(device, &self.settings, photons, size)?);
            }
            Some(_) => {}
        }
        if !self.plan().is_some_and(|p| p.is_on(Stage::SpecularPaths)) {
            view.specular = None;
        } else if view.specular.is_none() {
            let shape = PathShape {
                steps: self.settings.specular_surfaces,
                rounds: self.settings.specular_paths,
            };
            view.specular = Some(SpecularView::new(device, shape, size)?);
        }
        Ok(())
    }

    /// A number that stands for what a camera sees: another one when the camera, a light or geometry has changed, as far as
    /// `set_scene`, [`GiRenderer::geometry_changed`] and [`GiRenderer::set_changes`] were told, when the first environment maps
    /// have their places, and in another renderer; the same whatever the jitter, and while maps are moved to better places.
    /// For [`AccumulatorResources::follow`](crate::pass::AccumulatorResources::follow).
    pub fn subject(&self, camera: &Camera) -> u64 {
        let mut hasher = DefaultHasher::new();
        (self.generation, self.revision).hash(&mut hasher);
        let projection = match camera.projection {
            Projection::Perspective { fov_y } => (0, fov_y),
            Projection::Orthographic { half_height } => (1, half_height),
        };
        (projection.0, projection.1.to_bits()).hash(&mut hasher);
        camera.transform.to_cols_array().map(f64::to_bits).hash(&mut hasher);
        hasher.finish()
    }

    /// The settings it was made with, or was given last.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The plan of the last `set_scene`.
    pub fn plan(&self) -> Option<&Plan> {
        self.state.as_ref().map(|s| &s.plan)
    }

    /// The unit frame of the last `set_scene`.
    pub fn frame(&self) -> Option<&UnitFrame> {
        self.state.as_ref().map(|s| &s.frame)
    }

    /// Environment maps, while there is indirect light that is traced through them or gathered from them.
    pub fn env_maps(&self) -> Option<&EnvMaps> {
        self.indirect.as_ref().and_then(IndirectScene::env_maps)
    }

    /// Light on what they show, while it is gathered from there.
    pub fn env_map_irradiance(&self) -> Option<&EnvMapIrradiance> {
        self.indirect.as_ref().and_then(IndirectScene::env_map_irradiance)
    }

    /// Their depth hierarchies, if rays are searched for by walking over these.
    pub fn depth_hierarchy(&self) -> Option<&DepthHierarchy> {
        self.indirect.as_ref().and_then(IndirectScene::depth_hierarchy)
    }

    /// Share of what valid candidates for environment maps see that the maps in use see; `None` until a selection has
    /// arrived, and for maps placed by hand.
    pub fn env_map_coverage(&self) -> Option<f32> {
        self.placement.coverage()
    }

    /// Shadow maps, while anything shines.
    pub fn shadow_maps(&self) -> Option<&ShadowMaps> {
        self.direct.as_ref().map(|d| &d.shadow_maps)
    }

    /// Surface lights, while indirect light comes from them; or all light at the texels of an illumination map.
    pub fn surface_lights(&self) -> Option<&SurfaceLights> {
        let indirect = self.indirect.as_ref()?;
        let of_texels = || indirect.illumination().map(|i| i.lights());
        indirect
            .surface_lights()
            .map(SurfaceLightScene::lights)
            .or_else(of_texels)
    }

    /// The photons that they are made of, unless they stand at impacts.
    pub fn photon_pool(&self) -> Option<&PhotonPool> {
        self.indirect.as_ref()?.surface_lights()?.pool()
    }

    /// Indirect light at texels, while it is kept there.
    pub fn illumination_map(&self) -> Option<&IlluminationMap> {
        Some(self.indirect.as_ref()?.illumination()?.map())
    }

    /// Photons in groups, while [`Settings::selective`] has them stay until their way changes.
    pub fn photon_groups(&self) -> Option<&PhotonGroups> {
        self.indirect.as_ref()?.photon_groups()
    }

    /// Where photons go, while [`Settings::guided_photons`] is above 0 and there is indirect light.
    pub fn guiding_tables(&self) -> Option<&GuidingTables> {
        self.indirect.as_ref().and_then(IndirectScene::guiding_tables)
    }

    /// Photons, while there is indirect light.
    pub fn photons(&self) -> Option<&Photons> {
        self.indirect.as_ref().map(IndirectScene::photons)
    }

    /// Photons of caustics alone, while [`Stage::CausticMap`] is on.
    pub fn caustic_photons(&self) -> Option<&Photons> {
        self.indirect.as_ref().and_then(IndirectScene::caustic_photons)
    }

    /// Bytes that all views share, by resource.
    pub fn memory_by_resource(&self) -> Vec<(&'static str, u64)> {
        let mut list = vec![
            ("black", self.black.memory_use()),
            ("environment", self.environment.memory_use()),
        ];
        if let Some(direct) = &self.direct {
            list.extend(direct.memory_by_resource());
        }
        if let Some(indirect) = &self.indirect {
            list.extend(indirect.memory_by_resource());
            if indirect.env_maps().is_some() {
                list.push(("env_map_selector", self.placement.memory_use()));
            }
        }
        list
    }

    /// Bytes that all views share.
    pub fn memory_use(&self) -> u64 {
        self.memory_by_resource().iter().map(|r| r.1).sum()
    }
}

impl ViewResources {
    /// The finished image.
    pub fn radiance(&self) -> &Radiance {
        &self.radiance
    }

    /// What the eye sees.
    pub fn g_buffer(&self) -> &GBuffer {
        &self.g_buffer
    }

    /// Direct irradiance, if anything shines; none with [`Settings::fuses_composite`].
    pub fn direct(&self) -> Option<&Irradiance> {
        self.direct.as_ref().and_then(DirectView::irradiance)
    }

    /// How much of each light is seen, if one has an extent; none with [`Settings::fuses_composite`].
    pub fn visibility(&self) -> Option<&Visibility> {
        self.direct.as_ref().and_then(DirectView::visibility)
    }

    /// What was estimated anew at each level of up-sampling, from coarse to fine; nothing where pixels are interpolated only.
    pub fn marked_pixels(&self) -> impl Iterator<Item = &MarkedPixels> {
        self.indirect.iter().flat_map(IndirectView::marked_pixels)
    }

    /// Irradiance of caustics, where these are apart from other indirect light.
    pub fn caustic(&self) -> Option<&Irradiance> {
        self.caustic.as_ref().map(CausticView::irradiance)
    }

    /// Indirect irradiance at all pixels, if there is any; with [`Settings::fuses_composite`] none where it is interpolated.
    pub fn indirect(&self) -> Option<&Irradiance> {
        self.indirect.as_ref().and_then(IndirectView::irradiance)
    }

    /// Bytes of this view, by resource.
    pub fn memory_by_resource(&self) -> Vec<(&'static str, u64)> {
        let mut list = vec![
            ("g_buffer", self.g_buffer.memory_use()),
            ("radiance", self.radiance.memory_use() + self.composite.memory_use()),
        ];
        if let Some(own) = &self.direct {
            list.extend(own.memory_by_resource());
        }
        if let Some(own) = &self.indirect {
            list.extend(own.memory_by_resource());
        }
        if let Some(own) = &self.caustic {
            list.push(("caustic_irradiance", own.memory_use()));
        }
        if let Some(own) = &self.specular {
            list.push(("specular_paths", own.memory_use()));
        }
        list
    }

    /// Bytes of this view.
    pub fn memory_use(&self) -> u64 {
        self.memory_by_resource().iter().map(|r| r.1).sum()
    }
}

/// What the selection of places for environment maps needs to know.
fn selection_context<'a>(
    device: &'a wgpu::Device,
    queue: &'a wgpu::Queue,
    settings: &'a Settings,
    state: &'a SceneState,
) -> SelectionContext<'a> {
    SelectionContext {
        device,
        queue,
        frame: &state.frame,
        region: &state.region,
        settings: &settings.selector,
        limit: settings.env_map_count,
    }
}

/// Photons of an earlier frame, if they are in the present unit frame.
fn traced_photons<'a>(
    state: &Option<SceneState>,
    traced_in: &Option<UnitFrame>,
    indirect: &'a Option<IndirectScene>,
) -> Option<&'a Photons> {
    let (state, frame, indirect) = (state.as_ref()?, traced_in.as_ref()?, indirect.as_ref()?);
    frame.maps_like(&state.frame).then_some(indirect.photons())
}

/// Gives every view its position in the list.
fn number(views: &mut [CaptureView]) {
    for (index, view) in (0..).zip(views) {
        view.index = index;
    }
}

/// A number that no renderer has had yet.
fn next_generation() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    NEXT.fetch_add(1, Ordering::Relaxed)
}
