//! The blended shapes: a quad or a flattened icosahedron for each photon, added up by the raster units.

use super::splatted_slots;
use super::{Bandwidth, PhotonSplatterConfig, PhotonSplatterInputs, SplatShape, bin_total, gpu as shared};
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, RenderSpec, Slot, Step};
use crate::pass::dispatch_64;
use crate::resource::Subsampling;
use crate::{Error, wgsl};

pub(crate) mod gpu {
    use super::shared::Bandwidth;
    use bytemuck::{Pod, Zeroable};

    /// Twin of `RasterParams` in `shaders/pass/photon_splatter/raster.wgsl`, and with `first_slot` onwards of `BinParams` in
    /// `count_bins.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct RasterParams {
        pub(crate) bandwidth: Bandwidth,
        pub(crate) clip_scale: [f32; 2],
        pub(crate) clip_shift: [f32; 2],
        pub(crate) first_slot: u32,
        pub(crate) slot_count: u32,
        pub(crate) row: u32,
        pub(crate) _pad: u32,
    }
}

/// Bindings of `shaders/pass/photon_splatter/raster.wgsl`, in order.
pub(crate) const RASTER_SLOTS: [Slot; 5] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Storage,
    Slot::Storage,
    Slot::UintTexture,
];

/// Bindings of `shaders/pass/photon_splatter/count_bins.wgsl`, in order.
pub(crate) const BIN_SLOTS: [Slot; 4] = [Slot::Uniform, Slot::Uniform, Slot::Storage, Slot::StorageMut];

/// Its pipelines.
#[derive(Debug)]
pub(super) struct Raster {
    count_bins: Step,
    layout: wgpu::BindGroupLayout,
    draw: wgpu::RenderPipeline,
    /// Of one photon.
    vertices: u32,
}

/// Its working memory.
#[derive(Debug)]
pub(super) struct RasterBuffers {
    params: wgpu::Buffer,
    bins: wgpu::Buffer,
    size: [u32; 2],
    bin_groups: BindGroupCache,
    groups: BindGroupCache,
}

impl Raster {
    pub(super) fn new(device: &wgpu::Device, config: &PhotonSplatterConfig, kernel: &[(&str, f64)]) -> Self {
        let stages = wgpu::ShaderStages::VERTEX_FRAGMENT;
        let layout = device::layout(device, "lightfall::PhotonSplatter", stages, &RASTER_SLOTS);
        let add = wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: wgpu::BlendFactor::One,
            operation: wgpu::BlendOperation::Add,
        };
        let is_volume = config.shape == SplatShape::Volumes;
        let draw = device::render_pipeline(
            device,
            &RenderSpec {
                label: "lightfall::PhotonSplatter::draw",
                source: if is_volume {
                    wgsl::PHOTON_SPLATTER_VOLUMES
                } else {
                    wgsl::PHOTON_SPLATTER_QUADS
                },
                fragment: "fragment",
                layouts: &[&layout],
                constants: kernel,
                buffers: &[],
                topology: if is_volume {
                    wgpu::PrimitiveTopology::TriangleList
                } else {
                    wgpu::PrimitiveTopology::TriangleStrip
                },
                // Of a volume the faces behind: they are there wherever the eye is.
                cull_mode: is_volume.then_some(wgpu::Face::Front),
                targets: &[Some(wgpu::ColorTargetState {
                    format: config.sum_format(),
                    blend: Some(wgpu::BlendState { color: add, alpha: add }),
                    write_mask: wgpu::ColorWrites::ALL,
                })],
                depth_stencil: None,
            },
        );
        let count_bins = ComputeSpec {
            label: "lightfall::PhotonSplatter::count_bins",
            source: wgsl::PHOTON_SPLATTER_BINS,
            entry_point: "count_bins",
            layouts: &[],
            constants: &[],
        };
        Self {
            count_bins: Step::new(device, &BIN_SLOTS, &count_bins),
            layout,
            draw,
            vertices: if is_volume { 60 } else { 4 },
        }
    }

    pub(super) fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        buffers: &mut RasterBuffers,
        inputs: &PhotonSplatterInputs<'_>,
        bandwidth: &shared::Bandwidth,
        (receivers, sums): (&wgpu::TextureView, &wgpu::TextureView),
    ) {
        let size = inputs.subsampling.size(inputs.g_buffer.size());
        if [0, 1].into_iter().any(|axis| size[axis] > buffers.size[axis]) {
            // Made for a smaller image.
            return;
        }
        let slots = splatted_slots(inputs.photons);
        let (groups, row) = dispatch_64(slots);
        let [x, y] = clip_maps(inputs.subsampling, inputs.g_buffer.size());
        let params = gpu::RasterParams {
            bandwidth: *bandwidth,
            clip_scale: [x[0], y[0]],
            // Clip space has +y up, pixels have it down.
            clip_shift: [x[1], -y[1]],
            first_slot: inputs.photons.first_indirect(),
            slot_count: slots,
            row,
            _pad: 0,
        };
        inputs
            .queue
            .write_buffer(&buffers.params, 0, bytemuck::bytes_of(&params));
        let shared = [
            (&buffers.params).into(),
            inputs.g_buffer.view_buffer().into(),
            inputs.photons.buffer().into(),
            (&buffers.bins).into(),
        ];
        if let Bandwidth::Screen { .. } = inputs.settings.bandwidth {
            encoder.clear_buffer(&buffers.bins, 0, None);
            let label = "lightfall::PhotonSplatter::count_bins";
            let group = buffers.bin_groups.get(device, label, &self.count_bins.layout, &shared);
            let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
            pass.set_pipeline(&self.count_bins.pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
        }
        let [params, view, photons, bins] = shared;
        let bound = [params, view, photons, bins, receivers.into()];
        let label = "lightfall::PhotonSplatter::draw";
        let group = buffers.groups.get(device, label, &self.layout, &bound);
        let mut pass = device::render_pass(encoder, label, &[sums], None, inputs.timestamps);
        pass.set_viewport(0.0, 0.0, size[0] as f32, size[1] as f32, 0.0, 1.0);
        pass.set_pipeline(&self.draw);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..self.vertices, 0..slots);
    }
}

impl RasterBuffers {
    /// Bytes for irradiance of this size.
    pub(super) fn size_in_bytes(size: [u32; 2]) -> u64 {
        size_of::<gpu::RasterParams>() as u64 + 4 * u64::from(bin_total(size))
    }

    pub(super) fn new(device: &wgpu::Device, size: [u32; 2]) -> Result<Self, Error> {
        use wgpu::BufferUsages as U;
        Ok(Self {
            params: device::uniform_buffer::<gpu::RasterParams>(device, "lightfall::PhotonSplatter::params")?,
            bins: device::buffer(
                device,
                "lightfall::PhotonSplatter::bins",
                4 * u64::from(bin_total(size)),
                U::STORAGE | U::COPY_DST,
            )?,
            size,
            bin_groups: BindGroupCache::default(),
            groups: BindGroupCache::default(),
        })
    }
}

/// Scale and shift, by axis, that take the clip space of an image to that of its samples: pixel i of them is pixel
/// f i + ⌊f/2⌋ of the image, so that a point x pixels from its left lies (x − s) / f from theirs, s = ⌊f/2⌋ + 1/2 − f/2.
fn clip_maps(subsampling: Subsampling, full: [u32; 2]) -> [[f32; 2]; 2] {
    let factor = subsampling.factor();
    let shift = f64::from(factor / 2) + 0.5 - 0.5 * f64::from(factor);
    let samples = subsampling.size(full);
    [0, 1].map(|axis| {
        let (full, span) = (f64::from(full[axis]), f64::from(factor * samples[axis]));
        [(full / span) as f32, ((full - 2.0 * shift) / span - 1.0) as f32]
    })
}
