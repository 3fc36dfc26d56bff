//! Indirect light at texels of surfaces, gathered by the host's draws: neither triangles nor environment maps are needed.
//!
//! Inputs: [`Hemispheres`], the host's [`Geometry`], [`SurfaceLights`], [`IlluminationMap`]. Output: the irradiance of these
//! texels in the map, and that they are not due. The scene is drawn as a point of a surface sees it, onto a plane or half a
//! cube, many points in one render pass; the light of what a pixel shows is that of the texel nearest to it,
//! [`IlluminationMap::radiosity`], so that the host draws surfaces and knows nothing of light. E = Σ B F / Σ F with the exact
//! form factor F of each pixel. Source: Larsen 2004, chapter 11, with changes: form factors of pixels are integrals, the sum is
//! taken in `f32`, and by π more.
//!
//! Order: [`TexelGather::record_rays`](super::TexelGather::record_rays), [`HemisphereGather::record`],
//! [`TexelGather::record`](super::TexelGather::record). Cost: points × draws of the scene (1 or 5 each, what the host does not
//! cull), and points × pixels. Limits: what is smaller than a pixel is seen or not by chance.

use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot, Step};
use crate::resource::{CaptureView, GatherShape, Geometry, Hemispheres, IlluminationMap, SurfaceLights};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/hemisphere_gather.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) size: u32,
        pub(crate) pixel_count: u32,
        pub(crate) half_side: f32,
    }
}

/// Bindings of `shaders/pass/hemisphere_gather.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 10] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::UintTexture,
    Slot::StorageMut,
    Slot::StorageMut,
];

/// The pass.
#[derive(Debug)]
pub struct HemisphereGather {
    device: wgpu::Device,
    gather: Step,
}

/// Uniforms and bind groups.
#[derive(Debug)]
pub struct HemisphereGatherResources {
    params: wgpu::Buffer,
    groups: BindGroupCache,
}

/// What a frame gives it.
#[derive(Clone, Copy)]
#[allow(missing_debug_implementations, reason = "holds a trait object of the host's")]
pub struct HemisphereGatherInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// Where light is gathered, set for this frame. Their texels are those of the map.
    pub hemispheres: &'a Hemispheres,
    /// The host's draws, prepared for a list of views that holds `views`.
    pub geometry: &'a dyn Geometry,
    /// [`Hemispheres::views`], with their indices in the frame's list set.
    pub views: &'a [CaptureView],
    /// Where texels stand.
    pub lights: &'a SurfaceLights,
    /// Their light, read and written.
    pub map: &'a IlluminationMap,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl HemisphereGather {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let spec = ComputeSpec {
            label: "lightfall::HemisphereGather",
            source: wgsl::HEMISPHERE_GATHER,
            entry_point: "gather_hemispheres",
            layouts: &[],
            constants: &[],
        };
        Self {
            gather: Step::new(device, &SLOTS, &spec),
            device: device.clone(),
        }
    }

    /// Records the draws, and what they show.
    ///
    /// # Errors
    /// [`Error::CountMismatch`] for another number of views than the hemispheres have; nothing is recorded then.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut HemisphereGatherResources,
        inputs: &HemisphereGatherInputs<'_>,
    ) -> Result<(), Error> {
        let hemispheres = inputs.hemispheres;
        let count = hemispheres.places().len() as u32;
        let shape = hemispheres.shape();
        let wanted = (count * shape.views()) as usize;
        if inputs.views.len() != wanted {
            return Err(Error::CountMismatch {
                what: "views of hemispheres",
                expected: wanted,
                found: inputs.views.len(),
            });
        }
        if count == 0 {
            return Ok(());
        }
        record_draws(encoder, inputs);
        let size = hemispheres.size();
        let params = gpu::Params {
            size,
            pixel_count: (hemispheres.weights().size() / 4) as u32,
            half_side: match shape {
                GatherShape::Plane { half_side } => half_side,
                GatherShape::Cube => 1.0,
            },
        };
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let bound = [
            (&resources.params).into(),
            inputs.lights.grid().into(),
            inputs.lights.records().into(),
            inputs.lights.cells().into(),
            inputs.map.radiosity().into(),
            hemispheres.records().into(),
            hemispheres.weights().into(),
            hemispheres.image().into(),
            inputs.map.gathered().into(),
            inputs.map.due().into(),
        ];
        let label = "lightfall::HemisphereGather::sum";
        let group = resources.groups.get(&self.device, label, &self.gather.layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.gather.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(count, 1, 1);
        Ok(())
    }
}

/// All views, each in its part of the image.
fn record_draws(encoder: &mut wgpu::CommandEncoder, inputs: &HemisphereGatherInputs<'_>) {
    let hemispheres = inputs.hemispheres;
    let colors = [hemispheres.image()];
    let label = "lightfall::HemisphereGather";
    let mut pass = device::render_pass(encoder, label, &colors, Some(hemispheres.depth()), inputs.timestamps);
    for (index, view) in (0..).zip(inputs.views) {
        let [left, top, width, height] = hemispheres.viewport(index);
        let [x, y, w, h] = [left, top, width, height].map(|v| v as f32);
        pass.set_viewport(x, y, w, h, 0.0, 1.0);
        pass.set_scissor_rect(left, top, width, height);
        inputs.geometry.draw(&mut pass, view);
    }
}

impl HemisphereGatherResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::HemisphereGather::params")?,
            groups: BindGroupCache::default(),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.params.size()
    }
}
