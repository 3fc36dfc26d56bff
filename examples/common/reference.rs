//! Renders a scene by path tracing: the same camera and components as `offline`, without its approximations.

use super::adapter::Gpu;
use lightfall::glam::{DAffine3, DVec3};
use lightfall::reference::metrics::{Image, Truth};
use lightfall::reference::{
    Emitters, PathEstimate, PathTracer, PathTracerInputs, PathTracerResources, PathTracerSettings,
};
use lightfall::resource::{BvhGeometry, BvhGeometryConfig, Radiance};
use lightfall::scene::{Camera, Projection, Scene, SceneSummary, UnitFrame};
use lightfall::{Error, Timestamps};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// The preset that is no `Settings`.
pub(crate) const PRESET: &str = "reference";
/// Samples a pixel that it takes unless told otherwise.
pub(crate) const SAMPLES: u32 = 256;

/// A scene on the GPU and what its paths have brought so far.
pub(crate) struct Reference<'a> {
    gpu: &'a Gpu,
    tracer: Arc<PathTracer>,
    resources: PathTracerResources,
    geometry: BvhGeometry,
    emitters: Emitters,
    frame: UnitFrame,
    scene: Scene,
    camera: usize,
    settings: PathTracerSettings,
    size: [u32; 2],
}

impl<'a> Reference<'a> {
    /// Builds the trees and uploads the scene.
    pub(crate) fn new(
        gpu: &'a Gpu,
        scene: Scene,
        settings: &PathTracerSettings,
        camera: usize,
        size: [u32; 2],
    ) -> Result<Self, Error> {
        Self::with_tracer(
            gpu,
            Arc::new(PathTracer::new(&gpu.device)),
            scene,
            settings,
            (camera, size),
        )
    }

    /// The same of another scene, with the pipelines that are there already.
    pub(crate) fn another(&self, scene: Scene, settings: &PathTracerSettings, size: [u32; 2]) -> Result<Self, Error> {
        Self::with_tracer(self.gpu, Arc::clone(&self.tracer), scene, settings, (0, size))
    }

    fn with_tracer(
        gpu: &'a Gpu,
        tracer: Arc<PathTracer>,
        scene: Scene,
        settings: &PathTracerSettings,
        (camera, size): (usize, [u32; 2]),
    ) -> Result<Self, Error> {
        let (device, queue) = (&gpu.device, &gpu.queue);
        let summary = SceneSummary::of(&scene)?;
        let frame = UnitFrame::new(&summary.bounds, summary.total_flux)?;
        let mut geometry = BvhGeometry::new(device, queue, &scene, &BvhGeometryConfig::default())?;
        geometry.prepare(queue, &frame)?;
        Ok(Self {
            gpu,
            tracer,
            resources: PathTracerResources::new(device, size)?,
            geometry,
            emitters: Emitters::new(device, queue, &frame, &scene)?,
            frame,
            scene,
            camera,
            settings: *settings,
            size,
        })
    }

    /// Begins anew with another camera.
    fn look(&mut self, camera: Camera) {
        self.scene.cameras[self.camera] = camera;
        self.resources.restart();
    }

    /// Irradiance that surfaces around a point send to it, world units, the sum of its channels, and its standard error. The
    /// point looks around, above and, by the upper halves of four square pictures, to its sides, so that the directions of
    /// paths are spread evenly. The reference's component is `All`: nothing may shine that can be seen.
    pub(crate) fn irradiance(&mut self, (position, normal): (DVec3, DVec3), paths: u32) -> Result<[f64; 2], Error> {
        let helper = if normal.y.abs() < 0.9 { DVec3::Y } else { DVec3::X };
        let right = helper.cross(normal).normalize();
        let ahead = normal.cross(right);
        let eye = position + 1e-4 * f64::from(self.frame.radius()) * self.frame.length_scale() * normal;
        let faces = [
            (normal, ahead),
            (right, normal),
            (-right, normal),
            (ahead, normal),
            (-ahead, normal),
        ];
        let size = self.size[0];
        let samples = (paths / (faces.len() as u32 * size * size)).max(1);
        let mut sum = [0.0; 2];
        for (face, (forward, up)) in faces.into_iter().enumerate() {
            self.look(Camera {
                name: String::new(),
                transform: DAffine3::from_cols(forward.cross(up), up, -forward, eye),
                projection: Projection::Perspective { fov_y: FRAC_PI_2 },
            });
            let estimate = self.trace(samples)?;
            for (pixel, (mean, error)) in (0..).zip(estimate.mean.iter().zip(&estimate.standard_error)) {
                let weight = PI * form_factor(face == 0, [pixel % size, pixel / size], size);
                let of_rgb = |rgb: &[f32; 3]| rgb.iter().map(|&v| f64::from(v)).sum::<f64>();
                sum[0] += weight * of_rgb(mean);
                sum[1] += (weight * of_rgb(error)).powi(2);
            }
        }
        Ok([sum[0], sum[1].sqrt()])
    }

    /// The mean of so many more paths for each pixel and those before, and its standard error.
    pub(crate) fn trace(&mut self, samples: u32) -> Result<PathEstimate, Error> {
        for _ in 0..samples {
            self.render_sample(None)?;
        }
        self.read()
    }

    /// The same, as what pictures are compared with.
    pub(crate) fn truth(&mut self, samples: u32) -> Result<Truth, Error> {
        let estimate = self.trace(samples)?;
        Ok(Truth {
            standard_error: Some(estimate.standard_error),
            ..Truth::new(Image {
                width: self.size[0],
                height: self.size[1],
                rgb: estimate.mean,
            })
        })
    }

    /// Traces one more path for each pixel and waits for them.
    pub(crate) fn render_sample(&mut self, timestamps: Option<&Timestamps>) -> Result<(), Error> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let inputs = PathTracerInputs {
            queue: &self.gpu.queue,
            frame: &self.frame,
            geometry: &self.geometry,
            emitters: &self.emitters,
            camera: &self.scene.cameras[self.camera],
            settings: &self.settings,
            timestamps,
        };
        self.tracer.record(&mut encoder, &mut self.resources, &inputs);
        if let Some(timestamps) = timestamps {
            timestamps.resolve(&mut encoder);
        }
        self.gpu.queue.submit([encoder.finish()]);
        super::offline::wait(&self.gpu.device)
    }

    /// The mean of all samples and its standard error.
    pub(crate) fn read(&self) -> Result<PathEstimate, Error> {
        self.resources
            .read_blocking(&self.gpu.device, &self.gpu.queue, &self.frame)
    }

    /// The mean as an image on the GPU.
    pub(crate) fn resolve(&mut self) -> Result<Radiance, Error> {
        let image = Radiance::new(&self.gpu.device, self.size)?;
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let target = (self.frame.output_scale(1.0)?, &image);
        self.tracer
            .record_resolve(&self.gpu.queue, &mut encoder, &mut self.resources, target);
        self.gpu.queue.submit([encoder.finish()]);
        Ok(image)
    }

    /// Pixels.
    pub(crate) fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Bytes by resource.
    pub(crate) fn memory_by_resource(&self) -> Vec<(&'static str, u64)> {
        vec![
            ("BvhGeometry", self.geometry.memory_use()),
            ("Emitters", self.emitters.memory_use()),
            ("PathTracer", self.resources.memory_use()),
        ]
    }
}

/// Share of the hemisphere, weighted by the cosine, that a pixel of the face above, or of one to the side, covers: from 16
/// points of it.
fn form_factor(is_above: bool, pixel: [u32; 2], size: u32) -> f64 {
    const PARTS: u32 = 4;
    let parts = (0..PARTS).flat_map(|y| (0..PARTS).map(move |x| [x, y]));
    let width = 2.0 / f64::from(PARTS * size);
    let of_part = |part: [u32; 2]| {
        let [x, y] = [0, 1].map(|i| (f64::from(PARTS * pixel[i] + part[i]) + 0.5) * width - 1.0);
        let cosine = if is_above { 1.0 } else { (-y).max(0.0) };
        cosine * width * width / (PI * (1.0 + x * x + y * y).powi(2))
    };
    parts.map(of_part).sum()
}

/// What of a difference from a reference image is noise.
pub(crate) struct Noise {
    /// What relMSE would be if all of the error were noise.
    pub(crate) relative_variance: f64,
    /// What the squared RMSE would be, the reference's own noise included.
    pub(crate) variance: f64,
    /// Standard error of the energy bias, the reference's own included.
    pub(crate) of_mean: f64,
}

/// What the path tracer expects its own noise to add, over the pixels that are compared.
pub(crate) fn own_noise(estimate: &PathEstimate, truth: &Truth) -> Noise {
    let compared: Vec<usize> = (0..truth.image.rgb.len()).filter(|&p| truth.is_compared(p)).collect();
    let count = 3.0 * compared.len() as f64;
    let values = || compared.iter().flat_map(|&p| truth.image.rgb[p]).map(f64::from);
    let mean = values().sum::<f64>() / count;
    let variances = || {
        compared
            .iter()
            .flat_map(|&p| estimate.standard_error[p])
            .map(|e| f64::from(e).powi(2))
    };
    let relative = values()
        .zip(variances())
        .map(|(r, v)| v / (r * r + (0.01 * mean).powi(2)));
    let of_truth: f64 = truth.standard_error.as_ref().map_or(0.0, |errors| {
        compared
            .iter()
            .flat_map(|&p| errors[p])
            .map(|e| f64::from(e).powi(2))
            .sum()
    });
    let sum = variances().sum::<f64>() + of_truth;
    // Channels of a pixel rise and fall together: their errors add up, not their squares.
    let of_sum = 3.0 * sum;
    Noise {
        variance: sum / count,
        relative_variance: relative.sum::<f64>() / count,
        of_mean: of_sum.sqrt() / (count * mean),
    }
}
