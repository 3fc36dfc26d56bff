//! A scene on the GPU as far as its shadows need it, seen once; and how long each way to them takes.

use super::common::adapter::Gpu;
use super::common::clock::median;
use lightfall::pass::{
    GBufferCapture, GBufferCaptureInputs, NearestOccluder, NearestOccluderInputs, NearestOccluderResources,
    ShadowMapCapture, ShadowMapCaptureInputs, ShadowMapCaptureResources, ShadowMethod, ShadowTarget, SoftShadow,
    SoftShadowInputs, SoftShadowResources, SoftShadowSettings,
};
use lightfall::resource::{
    BvhGeometry, BvhGeometryConfig, CameraView, GBuffer, Geometry as _, Lights, MeshGeometry, NearestOccluders,
    PrepareContext, ShadowMaps, Visibility,
};
use lightfall::scene::{LightSources, Scene, SceneSummary, UnitFrame};
use lightfall::{Error, read_buffer_blocking, wgpu};
use std::time::Instant;

/// Rays of the truth.
const TRUTH_RAYS: u32 = 64;
/// Frames of them, each with other rays.
const TRUTH_FRAMES: u32 = 8;

/// What is read is copied in rows of so many pixels, or a multiple.
const ROW: u32 = 64;

pub(crate) struct Bench<'a> {
    pub(super) gpu: &'a Gpu,
    pub(super) size: u32,
    pub(super) g_buffer: GBuffer,
    pub(super) lights: Lights,
    pub(super) shadow_maps: ShadowMaps,
    pub(super) nearest: NearestOccluders,
    pub(super) bvh: BvhGeometry,
    pub(super) visibility: Visibility,
    pub(super) pass: SoftShadow,
    pub(super) own: SoftShadowResources,
}

impl<'a> Bench<'a> {
    /// The scene through its first camera at `size`² pixels, with shadow maps of `map_size`² texels.
    pub(crate) fn new(gpu: &'a Gpu, scene: &Scene, size: u32, map_size: u32) -> Result<Self, Error> {
        assert_eq!(size % ROW, 0, "rows are read without padding");
        let (device, queue) = (&gpu.device, &gpu.queue);
        let summary = SceneSummary::of(scene)?;
        let frame = UnitFrame::new(&summary.bounds, summary.total_flux)?;
        let mut geometry = MeshGeometry::new(device, queue, scene)?;
        let mut bvh = BvhGeometry::new(device, queue, scene, &BvhGeometryConfig::default())?;
        bvh.prepare(queue, &frame)?;
        let shadow_maps = ShadowMaps::new(device, &scene.lights, map_size)?;
        let mut lights = Lights::new(device)?;
        let sources = LightSources {
            lights: &scene.lights,
            ..Default::default()
        };
        lights.write(queue, &frame, &sources, 0)?;
        let mut camera = CameraView::new(&frame, &scene.cameras[0], [size; 2], [0.0; 2]);
        let mut views = vec![camera.capture];
        views.extend(shadow_maps.views(&frame, &scene.lights));
        (0..).zip(&mut views).for_each(|(index, view)| view.index = index);
        camera.capture = views[0];
        let frame = &frame;
        geometry.prepare(&PrepareContext { device, queue, frame }, &views)?;
        let mut g_buffer = GBuffer::new(device, [size; 2])?;
        let nearest = NearestOccluders::new(device, ShadowMaps::layers(&scene.lights))?;
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let shadow_inputs = ShadowMapCaptureInputs {
            shadow_maps: &shadow_maps,
            geometry: &geometry,
            views: &views[1..],
            timestamps: None,
        };
        let mut capture = ShadowMapCaptureResources::new(device, map_size)?;
        ShadowMapCapture::new().record(&mut encoder, &mut capture, &shadow_inputs);
        let nearest_inputs = NearestOccluderInputs {
            queue,
            lights: &lights,
            shadow_maps: &shadow_maps,
            nearest: &nearest,
            timestamps: None,
        };
        let mut nearest_own = NearestOccluderResources::new(device)?;
        NearestOccluder::new(device).record(&mut encoder, &mut nearest_own, &nearest_inputs);
        let g_buffer_inputs = GBufferCaptureInputs {
            queue,
            geometry: &geometry,
            view: &camera,
            timestamps: None,
        };
        GBufferCapture::new().record(&mut encoder, &mut g_buffer, &g_buffer_inputs);
        queue.submit([encoder.finish()]);
        let count = lights.count();
        Ok(Self {
            gpu,
            size,
            g_buffer,
            lights,
            shadow_maps,
            nearest,
            bvh,
            visibility: Visibility::new(device, [size; 2], count)?,
            pass: SoftShadow::new(device),
            own: SoftShadowResources::new(device, [size; 2], count)?,
        })
    }

    /// Finds all lights' shadows once, and waits. Milliseconds.
    fn run(&mut self, settings: &SoftShadowSettings, sample_offset: u32) -> Result<f64, Error> {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let start = Instant::now();
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let inputs = SoftShadowInputs {
            queue,
            g_buffer: &self.g_buffer,
            lights: &self.lights,
            shadow_maps: &self.shadow_maps,
            nearest: &self.nearest,
            bvh: Some(&self.bvh),
            target: ShadowTarget::Visibility(&self.visibility),
            settings: std::slice::from_ref(settings),
            sample_offset,
            timestamps: None,
        };
        self.pass.record(&mut encoder, &mut self.own, &inputs);
        queue.submit([encoder.finish()]);
        super::common::offline::wait(device)?;
        Ok(start.elapsed().as_secs_f64() * 1e3)
    }

    /// Visibility of the first light, rows from the top.
    pub(crate) fn visibility(&mut self, settings: &SoftShadowSettings) -> Result<Vec<f32>, Error> {
        self.run(settings, 0)?;
        self.read()
    }

    fn read(&self) -> Result<Vec<f32>, Error> {
        let Gpu { device, queue, .. } = self.gpu;
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("visibility"),
            size: u64::from(self.size * self.size) * 4,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let target = wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(4 * self.size),
                rows_per_image: None,
            },
        };
        let extent = wgpu::Extent3d {
            width: self.size,
            height: self.size,
            depth_or_array_layers: 1,
        };
        let texture = self.visibility.view().texture();
        encoder.copy_texture_to_buffer(texture.as_image_copy(), target, extent);
        queue.submit([encoder.finish()]);
        read_buffer_blocking(device, queue, &buffer)
    }

    /// The same by 512 rays.
    pub(crate) fn truth(&mut self) -> Result<Vec<f32>, Error> {
        let settings = SoftShadowSettings {
            method: ShadowMethod::Rays,
            rays: TRUTH_RAYS,
            ..Default::default()
        };
        let mut sum = vec![0.0; (self.size * self.size) as usize];
        // Other rays than those of the first frame, which is one of the ways.
        for frame in 1..=TRUTH_FRAMES {
            self.run(&settings, frame)?;
            let part = self.read()?;
            sum.iter_mut()
                .zip(part)
                .for_each(|(s, v)| *s += v / TRUTH_FRAMES as f32);
        }
        Ok(sum)
    }

    /// Milliseconds each of these takes: the median of so many rounds, in each of which all have their turn.
    pub(crate) fn times(&mut self, all: &[SoftShadowSettings], rounds: usize) -> Result<Vec<f64>, Error> {
        let mut times = vec![Vec::new(); all.len()];
        // The first round makes pipelines.
        for round in 0..=rounds {
            for (settings, times) in all.iter().zip(&mut times) {
                // What runs after something long takes longer: the second one counts.
                self.run(settings, 0)?;
                let ms = self.run(settings, 0)?;
                if round > 0 {
                    times.push(ms);
                }
            }
        }
        Ok(times.iter().map(|t| median(t)).collect())
    }
}
