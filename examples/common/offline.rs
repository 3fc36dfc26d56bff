//! Renders a scene without a window: one device, one view, any number of frames accumulated.

use super::adapter::Gpu;
use lightfall::frame::{
    ErrorEstimate, GiRenderer, IndirectMethod, SceneInputs, Settings, TexelGatherMethod, ViewInputs, ViewResources,
};
use lightfall::pass::{
    Accumulator, AccumulatorInputs, AccumulatorResources, CompositeSettings, HopStatistics, TraceStatistics,
    TraceStatisticsInputs, TraceStatisticsResources,
};
use lightfall::resource::{BvhGeometry, BvhGeometryConfig, CameraView, Geometry, MarkedPixels, MeshGeometry, Radiance};
use lightfall::scene::{Scene, SceneSummary, SurfacePoint};
use lightfall::{Error, Timestamps, wgpu};

/// Which part of the light to keep.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(crate) enum Component {
    #[default]
    All,
    Direct,
    /// Caustics among it.
    Indirect,
    /// On diffuse surfaces, where they have photons of their own.
    Caustic,
    /// What is seen in metal and glass.
    Specular,
}

/// Frames before the first that is shown, where frames depend on those before.
const WARM_UP: u32 = 3;

/// A scene on the GPU, ready to render frames of one camera.
pub(crate) struct Offline<'a> {
    gpu: &'a Gpu,
    pub(crate) renderer: GiRenderer,
    pub(crate) geometry: MeshGeometry,
    /// While the settings trace triangles.
    bvh: Option<BvhGeometry>,
    pub(crate) view: ViewResources,
    accumulator: Option<(Accumulator, AccumulatorResources)>,
    /// Whether every frame is taken for one of a scene that changes; not while frames are accumulated.
    pub(crate) in_motion: bool,
    /// Whether no frame was rendered so far.
    is_first: bool,
    /// How many pictures' photons of the random sequence are left to others.
    pub(crate) pictures_before: u32,
    /// Where surface lights stand, if there are any.
    pub(crate) points: Vec<SurfacePoint>,
    scene: Scene,
    summary: SceneSummary,
    camera: usize,
    size: [u32; 2],
    composite: CompositeSettings,
}

impl<'a> Offline<'a> {
    /// Uploads the scene, places environment maps, allocates. `settings.frames` above one accumulates.
    pub(crate) fn new(
        gpu: &'a Gpu,
        scene: Scene,
        settings: &Settings,
        camera: usize,
        size: [u32; 2],
        component: Component,
    ) -> Result<Self, Error> {
        let summary = SceneSummary::of(&scene)?;
        Self::with_summary(gpu, (scene, summary), settings, camera, size, component)
    }

    /// The same of a scene that the renderer is told other things of than are true, until [`Offline::set_scene`].
    pub(crate) fn with_summary(
        gpu: &'a Gpu,
        (scene, summary): (Scene, SceneSummary),
        settings: &Settings,
        camera: usize,
        size: [u32; 2],
        component: Component,
    ) -> Result<Self, Error> {
        let renderer = GiRenderer::new(&gpu.device, settings)?;
        Self::with_renderer(gpu, (scene, summary), renderer, camera, size, component)
    }

    /// The same of another scene, with the pipelines that are there already, as far as settings share them.
    pub(crate) fn another(
        &self,
        scene: Scene,
        settings: &Settings,
        size: [u32; 2],
        component: Component,
    ) -> Result<Self, Error> {
        let summary = SceneSummary::of(&scene)?;
        let mut renderer = self.renderer.another()?;
        renderer.set_settings(settings)?;
        Self::with_renderer(self.gpu, (scene, summary), renderer, 0, size, component)
    }

    fn with_renderer(
        gpu: &'a Gpu,
        (scene, summary): (Scene, SceneSummary),
        mut renderer: GiRenderer,
        camera: usize,
        size: [u32; 2],
        component: Component,
    ) -> Result<Self, Error> {
        let (device, queue) = (&gpu.device, &gpu.queue);
        let settings = &renderer.settings().clone();
        let mut geometry = MeshGeometry::new(device, queue, &scene)?;
        let bvh = || BvhGeometry::new(device, queue, &scene, &BvhGeometryConfig::default());
        let bvh = settings.uses_triangles().then(bvh).transpose()?;
        renderer.set_environment(queue, scene.environment_image())?;
        renderer.set_scene(queue, &summary, &scene.lights)?;
        renderer.place_env_maps_blocking(queue, &mut geometry)?;
        let points = match settings.indirect_method {
            IndirectMethod::SurfaceLights => SurfacePoint::place(&scene, settings.surface_lights.places as usize),
            IndirectMethod::IlluminationMaps => SurfacePoint::place(&scene, settings.illumination_maps.texels as usize),
            _ => Vec::new(),
        };
        let weight = |on: bool| if on { 1.0 } else { 0.0 };
        let is_one_of =
            |components: &[Component]| weight(component == Component::All || components.contains(&component));
        let composite = CompositeSettings {
            output_scale: 1.0,
            direct: is_one_of(&[Component::Direct, Component::Specular]),
            emission: is_one_of(&[Component::Direct]),
            indirect: is_one_of(&[Component::Indirect, Component::Specular]),
            caustic: is_one_of(&[Component::Indirect, Component::Caustic]),
            diffuse: weight(component != Component::Specular),
        };
        let accumulator = if settings.frames > 1 {
            Some((Accumulator::new(device), AccumulatorResources::new(device, size)?))
        } else {
            None
        };
        let mut offline = Self {
            gpu,
            view: renderer.new_view(size)?,
            renderer,
            geometry,
            bvh,
            in_motion: accumulator.is_none(),
            is_first: true,
            pictures_before: 0,
            points,
            accumulator,
            scene,
            summary,
            camera,
            size,
            composite,
        };
        // Where photons go depends on what was seen of those before: a frame in motion has others before it.
        if settings.guided_photons > 0.0 && offline.in_motion {
            for _ in 0..WARM_UP {
                offline.render_frame(None)?;
            }
        }
        Ok(offline)
    }

    /// Renders the next frame and waits for it.
    pub(crate) fn render_frame(&mut self, timestamps: Option<&Timestamps>) -> Result<(), Error> {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let place = |p: &SurfacePoint| p.in_world(&self.scene.instances[p.instance].transform);
        let places: Vec<_> = self.points.iter().map(place).collect();
        self.renderer.set_surface_places(&places);
        let frame = self.renderer.set_scene(queue, &self.summary, &self.scene.lights)?;
        if self.in_motion {
            self.renderer.geometry_changed();
        }
        if let Some(bvh) = &mut self.bvh {
            bvh.prepare(queue, &frame)?;
        }
        self.composite.output_scale = frame.output_scale(1.0)?;
        let camera = &self.scene.cameras[self.camera];
        let subject = self.renderer.subject(camera);
        let accumulated = self
            .accumulator
            .as_mut()
            .map(|(_, resources)| resources.follow(subject));
        let jitter = accumulated.map_or([0.0; 2], CameraView::jitter);
        let accumulated = accumulated.unwrap_or(0);
        let mut cameras = [CameraView::new(&frame, camera, self.size, jitter)];
        self.renderer.prepare(queue, &mut self.geometry, &mut cameras)?;
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let geometry: &dyn Geometry = &self.geometry;
        let settings = self.renderer.settings();
        let frames_before = self
            .pictures_before
            .wrapping_mul(settings.frames)
            .wrapping_add(accumulated);
        let sample_offset = frames_before.wrapping_mul(settings.photons.max(1));
        let scene_inputs = SceneInputs {
            queue,
            geometry,
            bvh: self.bvh.as_ref(),
            sample_offset,
            timestamps,
        };
        if self.renderer.photon_pool().is_some_and(|pool| pool.is_filling()) {
            self.renderer.fill_photon_pool(&scene_inputs)?;
        }
        if self.is_first {
            self.renderer.fill_illumination_map(&scene_inputs)?;
            self.is_first = false;
            if self.renderer.settings().illumination_maps.method != TexelGatherMethod::Rays {
                self.renderer
                    .gather_illumination_map_blocking(queue, &mut self.geometry)?;
                return self.render_frame(timestamps);
            }
        }
        self.renderer.record_scene(&mut encoder, &scene_inputs)?;
        let view_inputs = ViewInputs {
            queue,
            geometry,
            bvh: self.bvh.as_ref(),
            view: &cameras[0],
            accumulated,
            composite: &self.composite,
            timestamps,
        };
        self.renderer.record_view(&mut encoder, &mut self.view, &view_inputs)?;
        if let Some((pass, resources)) = &mut self.accumulator {
            let inputs = AccumulatorInputs {
                queue,
                radiance: self.view.radiance(),
                timestamps,
            };
            pass.record(&mut encoder, resources, &inputs);
        }
        if let Some(timestamps) = timestamps {
            timestamps.resolve(&mut encoder);
        }
        queue.submit([encoder.finish()]);
        wait(device)
    }

    /// Says that nothing of the scene will move: surface that is hidden in it keeps no light.
    pub(crate) fn stand_still(&mut self) {
        if !self.points.is_empty() {
            self.points = SurfacePoint::place_in_still_scene(&self.scene, self.points.len());
        }
    }

    /// Has the next frame gather all of an illumination map anew.
    pub(crate) fn refill(&mut self) {
        self.is_first = true;
    }

    /// Replaces the scene by the same one at another time: instances and lights may have moved.
    pub(crate) fn set_scene(&mut self, scene: Scene) -> Result<(), Error> {
        for (index, instance) in scene.instances.iter().enumerate() {
            self.geometry.set_transform(index, instance.transform)?;
            if let Some(bvh) = &mut self.bvh {
                bvh.set_transform(index, instance.transform)?;
            }
        }
        self.summary = SceneSummary::of(&scene)?;
        if scene.environment_image() != self.scene.environment_image() {
            self.renderer
                .set_environment(&self.gpu.queue, scene.environment_image())?;
        }
        self.scene = scene;
        self.renderer.geometry_changed();
        Ok(())
    }

    /// The image so far: the mean of all frames, or the last one.
    pub(crate) fn radiance(&self) -> &Radiance {
        match &self.accumulator {
            Some((_, resources)) => resources.mean(),
            None => self.view.radiance(),
        }
    }

    /// The image so far as linear RGB, row by row from the top.
    pub(crate) fn read(&self) -> Result<Vec<[f32; 3]>, Error> {
        let texture = self.radiance().view().texture();
        let texels = lightfall::read_rgba32float_blocking(&self.gpu.device, &self.gpu.queue, texture)?;
        Ok(texels.into_iter().map(|[r, g, b, _]| [r, g, b]).collect())
    }

    /// The energy audit of the last frame, if it traced photons.
    pub(crate) fn statistics(&self) -> Result<Vec<HopStatistics>, Error> {
        let Some(photons) = self.renderer.photons() else {
            return Ok(Vec::new());
        };
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let pass = TraceStatistics::new(device);
        let mut resources = TraceStatisticsResources::new(device, photons)?;
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let inputs = TraceStatisticsInputs {
            queue,
            photons,
            timestamps: None,
        };
        pass.record(&mut encoder, &mut resources, &inputs);
        queue.submit([encoder.finish()]);
        resources.read_blocking(device, queue)
    }

    /// Of each level of up-sampling, from coarse to fine, the share of its pixels that the last frame estimated anew.
    pub(crate) fn reestimated(&self) -> Result<Vec<f64>, Error> {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let share = |marked: &MarkedPixels| {
            let [width, height] = marked.size().map(f64::from);
            Ok(marked.read_blocking(device, queue)?.len() as f64 / (width * height))
        };
        self.view.marked_pixels().map(share).collect()
    }

    /// Other settings from the next frame on; the tracer and the method stay.
    pub(crate) fn set_settings(&mut self, settings: &Settings) -> Result<(), Error> {
        self.renderer.set_settings(settings)
    }

    /// How far off a picture of one frame is, told without a truth; `None` where no kernels are, frames are
    /// accumulated, or photons are guided, which depends on frames before.
    /// Renders two frames and a frame for each of two other pictures; the last frame's picture is another one then.
    pub(crate) fn estimate_error(&mut self) -> Result<Option<ErrorEstimate>, Error> {
        let settings = self.renderer.settings().clone();
        let has_kernels = settings.indirect_method == IndirectMethod::Splatting;
        if settings.frames > 1 || !has_kernels || settings.guided_photons > 0.0 {
            return Ok(None);
        }
        // Nothing but photons and kernels may change, environment maps stay where they are.
        let in_motion = std::mem::replace(&mut self.in_motion, false);
        let first = self.pictures_before;
        let mut pair = |settings: &Settings| {
            self.set_settings(settings)?;
            let mut picture = |number| {
                self.pictures_before = number;
                self.render_frame(None)?;
                self.read()
            };
            Ok::<_, Error>([picture(first)?, picture(first.wrapping_add(1))?])
        };
        let own = pair(&settings)?;
        let widened = pair(&ErrorEstimate::widened(&settings))?;
        self.pictures_before = first;
        self.in_motion = in_motion;
        self.set_settings(&settings)?;
        ErrorEstimate::of([&own[0], &own[1]], [&widened[0], &widened[1]]).map(Some)
    }

    /// Of accumulated frames, the noise left in their mean: relMSE.
    pub(crate) fn accumulated_noise(&self) -> Result<Option<f64>, Error> {
        let noise = |(_, sums): &(Accumulator, AccumulatorResources)| {
            sums.relative_variance_blocking(&self.gpu.device, &self.gpu.queue)
        };
        self.accumulator.as_ref().map(noise).transpose()
    }

    /// Bytes of GPU memory, by resource.
    pub(crate) fn memory_by_resource(&self) -> Vec<(&'static str, u64)> {
        let mut list = self.renderer.memory_by_resource();
        list.extend(self.view.memory_by_resource());
        list.push(("geometry", self.geometry.memory_use()));
        if let Some(bvh) = &self.bvh {
            list.push(("bvh", bvh.memory_use()));
        }
        if let Some((_, resources)) = &self.accumulator {
            list.push(("accumulator", resources.memory_use()));
        }
        list
    }
}

/// Renders `settings.frames` frames of a scene; the short way for tests.
pub(crate) fn render(
    gpu: &Gpu,
    scene: &Scene,
    settings: &Settings,
    size: [u32; 2],
    component: Component,
) -> Result<Vec<[f32; 3]>, Error> {
    let mut offline = Offline::new(gpu, scene.clone(), settings, 0, size, component)?;
    for _ in 0..settings.frames {
        offline.render_frame(None)?;
    }
    offline.read()
}

/// Waits for all that was submitted.
pub(crate) fn wait(device: &wgpu::Device) -> Result<(), Error> {
    device
        .poll(wgpu::PollType::wait_indefinitely())
        .map(drop)
        .map_err(|e| Error::ReadBack {
            what: "the frame",
            reason: e.to_string(),
        })
}
