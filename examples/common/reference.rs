//! Renders a scene by path tracing: the same camera and components as `offline`, without its approximations.

use super::adapter::Gpu;
use lightfall::reference::metrics::Truth;
use lightfall::reference::{
    Emitters, PathEstimate, PathTracer, PathTracerInputs, PathTracerResources, PathTracerSettings,
};
use lightfall::resource::{BvhGeometry, BvhGeometryConfig, Radiance};
use lightfall::scene::{Camera, Scene, SceneSummary, UnitFrame};
use lightfall::{Error, Timestamps};

/// The preset that is no `Settings`.
pub(crate) const PRESET: &str = "reference";
/// Samples a pixel that it takes unless told otherwise.
pub(crate) const SAMPLES: u32 = 256;

/// A scene on the GPU and what its paths have brought so far.
pub(crate) struct Reference<'a> {
    gpu: &'a Gpu,
    tracer: PathTracer,
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
        let (device, queue) = (&gpu.device, &gpu.queue);
        let summary = SceneSummary::of(&scene)?;
        let frame = UnitFrame::new(&summary.bounds, summary.total_flux)?;
        let mut geometry = BvhGeometry::new(device, queue, &scene, &BvhGeometryConfig::default())?;
        geometry.prepare(queue, &frame)?;
        Ok(Self {
            gpu,
            tracer: PathTracer::new(device),
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
    pub(crate) fn look(&mut self, camera: Camera) {
        self.scene.cameras[self.camera] = camera;
        self.resources.restart();
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
