//! Soft shadows of lamps with an extent, gathered in image space.
//!
//! Inputs: [`GBuffer`], [`Lights`], [`ShadowMaps`], [`NearestOccluders`]. Output: [`Visibility`], one layer a light. A light
//! without extent gets the hard test of [`DirectLight`](super::DirectLight) and nothing else. For one with an extent, three
//! steps follow each other:
//!
//! 1. `test`: whether the lamp's centre is seen, and the distance d from receiver to occluder where it is not.
//! 2. `search`: the mean d over the shadowed surface around each receiver, on the arms of a cross that every pixel turns
//!    differently. It gives the penumbra's radius, R d / (D − d) for a lamp of radius R at distance D.
//! 3. `blur`: the mean visibility over the ellipse that this radius covers on the receiver's plane, one axis after the
//!    other.
//!
//! Cost: pixels × lights with an extent × (4 `search_taps` + 4 `blur_taps` + 2) taps of two fetches. Source: Yao
//! et al., soft shadows and image-space photon mapping, section 3.4, Eq. 3 to 5, with three changes. Eq. 2's constant
//! search is bounded by the nearest occluder. A tap counts only where its own penumbra reaches the receiver. Both run on
//! the receiver's plane instead of the screen's, weighted as a disc-shaped lamp is, so that the straight edge of an
//! occluder parallel to the lamp has the exact profile V(x) = 1/2 + (x √(1 − x²) + asin x) / π, x in radii, if it lies
//! along an axis, and its second moment anyhow.
//!
//! Limits: what is hidden from the eye or off the screen neither shades nor is shaded; one mean distance stands for
//! occluders behind each other; the blur of an edge that slants between the axes reaches up to √2 radii; a spot's disc is
//! taken to face the receiver; penumbrae wider than `max_radius` are cut to it; receivers tilted beyond 83° count as
//! tilted so far.

use crate::gpu::{self as device, BindGroupCache, Bound, ComputeSpec, Slot};
use crate::resource::{GBuffer, Lights, NearestOccluders, ShadowMaps, Visibility};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/soft_shadow/receiver.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) light: u32,
        pub(crate) shadow_map_size: u32,
        pub(crate) layer_count: u32,
        pub(crate) search: u32,
        pub(crate) search_taps: u32,
        pub(crate) blur_taps: u32,
        pub(crate) max_radius: f32,
        pub(crate) range_scale: f32,
    }
}

const R32_FLOAT: Slot = Slot::StorageTexture(wgpu::TextureFormat::R32Float);

/// Bindings of `shaders/pass/soft_shadow/test_light.wgsl`, in order.
pub(crate) const TEST_SLOTS: [Slot; 9] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::Storage,
    Slot::UintArray,
    R32_FLOAT,
    R32_FLOAT,
];

/// Bindings of `shaders/pass/soft_shadow/search_occluders.wgsl`, in order.
pub(crate) const SEARCH_SLOTS: [Slot; 8] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Storage,
    Slot::Storage,
    Slot::Texture,
    R32_FLOAT,
];

/// Bindings of `shaders/pass/soft_shadow/blur_axis.wgsl`, in order.
pub(crate) const BLUR_SLOTS: [Slot; 8] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Storage,
    Slot::Texture,
    Slot::Texture,
    R32_FLOAT,
];

/// Most taps to each side. More are not refused but not taken: at two hundred fetches a pixel the dither is long gone.
pub(crate) const MAX_TAPS: u32 = 64;

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
    /// Where the width of penumbrae comes from. Off saves the search and gets widths wrong.
    pub search: PenumbraSearch,
    /// Taps on each of the four arms of the search, up to 64. More find smaller occluders and steadier widths, at a cost in
    /// proportion.
    pub search_taps: u32,
    /// Taps of the blur to each side of each axis, up to 64. More have less grain in wide penumbrae, at a cost in
    /// proportion.
    pub blur_taps: u32,
    /// Widest radius of a penumbra, pixels. Higher lets large lamps cast penumbrae as wide as they are, with more grain and
    /// fetches further apart; lower cuts them.
    pub max_radius: f32,
    /// How far from the receiver's plane another surface may lie and still count, as a share of the penumbra's radius (c of
    /// σ = (c R)², where the paper has a fixed σ). Higher blurs across steps and around curves; lower leaves taps out and
    /// grain in.
    pub range_scale: f32,
}

impl Default for SoftShadowSettings {
    /// "4 + 5" of the paper's Table 1. Grain goes by the number of taps and not by how far apart they are, so that the
    /// widest radius only bounds how scattered fetches are; a quarter of a 512-pixel image leaves common penumbrae alone.
    /// The error is the same for any range scale from 0.05 to 2 (`docs/accuracy.md`); one in the middle.
    fn default() -> Self {
        Self {
            search: PenumbraSearch::On,
            search_taps: 4,
            blur_taps: 5,
            max_radius: 128.0,
            range_scale: 0.5,
        }
    }
}

impl SoftShadowSettings {
    /// Four times the taps: single pixels in a penumbra are off by 0.013 instead of 0.018 (`docs/accuracy.md`).
    pub fn accurate() -> Self {
        Self {
            search_taps: 16,
            blur_taps: 20,
            max_radius: 256.0,
            ..Self::default()
        }
    }
}

/// The pass.
#[derive(Debug)]
pub struct SoftShadow {
    device: wgpu::Device,
    test: Step,
    search: Step,
    /// Across the tilt of the receiver, and along it.
    blurs: [wgpu::ComputePipeline; 2],
    blur_layout: wgpu::BindGroupLayout,
}

/// One entry point and its layout.
#[derive(Debug)]
struct Step {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

/// Uniforms, bind groups and two textures that all lights share, for one view.
#[derive(Debug)]
pub struct SoftShadowResources {
    /// One a light: all lights of a frame are in one submission.
    params: Vec<wgpu::Buffer>,
    written: Vec<Option<gpu::Params>>,
    /// Distances to occluders, later visibility blurred along the first axis.
    distances: wgpu::TextureView,
    /// Radii of penumbrae.
    radii: wgpu::TextureView,
    test_groups: BindGroupCache,
    search_groups: BindGroupCache,
    blur_groups: BindGroupCache,
    bytes: u64,
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
    /// Written, of the G-buffer's size. Lights beyond those that it, or the resources, have room for are left out.
    pub visibility: &'a Visibility,
    /// How to gather.
    pub settings: &'a SoftShadowSettings,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl SoftShadow {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let layout = |label, slots| device::layout(device, label, wgpu::ShaderStages::COMPUTE, slots);
        let pipeline = |label, source, entry_point, layout: &wgpu::BindGroupLayout, constants: &[(&str, f64)]| {
            device::compute_pipeline(
                device,
                &ComputeSpec {
                    label,
                    source,
                    entry_point,
                    layouts: &[layout],
                    constants,
                },
            )
        };
        let step = |label, source, entry_point, slots| {
            let layout = layout(label, slots);
            let pipeline = pipeline(label, source, entry_point, &layout, &[]);
            Step { layout, pipeline }
        };
        let blur_layout = layout("lightfall::SoftShadow::blur", &BLUR_SLOTS);
        let blur = |label, axis| {
            pipeline(
                label,
                wgsl::SOFT_SHADOW_BLUR,
                "blur_pixels",
                &blur_layout,
                &[("AXIS", axis)],
            )
        };
        Self {
            device: device.clone(),
            test: step(
                "lightfall::SoftShadow::test",
                wgsl::SOFT_SHADOW_TEST,
                "test_pixels",
                &TEST_SLOTS,
            ),
            search: step(
                "lightfall::SoftShadow::search",
                wgsl::SOFT_SHADOW_SEARCH,
                "search_pixels",
                &SEARCH_SLOTS,
            ),
            blurs: [
                blur("lightfall::SoftShadow::blur_across", 0.0),
                blur("lightfall::SoftShadow::blur_along", 1.0),
            ],
            blur_layout,
        }
    }

    /// Records the layer of every light: `test` for each, then `search` and `blur` for those with an extent.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut SoftShadowResources,
        inputs: &SoftShadowInputs<'_>,
    ) {
        encoder.push_debug_group("lightfall::SoftShadow");
        let layers = (0..resources.params.len() as u32).map_while(|light| inputs.visibility.layer_view(light));
        for ((light, layer), has_extent) in (0..).zip(layers).zip(inputs.lights.have_extent()) {
            resources.write_params(light, inputs);
            self.record_test(encoder, resources, inputs, light, layer);
            if has_extent {
                if inputs.settings.search == PenumbraSearch::On {
                    self.record_search(encoder, resources, inputs, light);
                }
                self.record_blur(encoder, resources, inputs, light, layer);
            }
        }
        encoder.pop_debug_group();
    }

    fn record_test(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut SoftShadowResources,
        inputs: &SoftShadowInputs<'_>,
        light: usize,
        layer: &wgpu::TextureView,
    ) {
        let views = inputs.g_buffer.views();
        // Without a search, what would be searched for is known at once.
        let occlusion = match inputs.settings.search {
            PenumbraSearch::On => &resources.distances,
            PenumbraSearch::Off => &resources.radii,
        };
        let bound = [
            (&resources.params[light]).into(),
            inputs.g_buffer.view_buffer().into(),
            (&views.depth).into(),
            (&views.normal).into(),
            (&views.base_color).into(),
            inputs.lights.buffer().into(),
            inputs.shadow_maps.view().into(),
            layer.into(),
            occlusion.into(),
        ];
        let label = "lightfall::SoftShadow::test";
        let group = resources
            .test_groups
            .get(&self.device, label, &self.test.layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        dispatch(&mut pass, &self.test.pipeline, &group, inputs.g_buffer.size());
    }

    fn record_search(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut SoftShadowResources,
        inputs: &SoftShadowInputs<'_>,
        light: usize,
    ) {
        let views = inputs.g_buffer.views();
        let bound = [
            (&resources.params[light]).into(),
            inputs.g_buffer.view_buffer().into(),
            (&views.depth).into(),
            (&views.normal).into(),
            inputs.lights.buffer().into(),
            inputs.nearest.buffer().into(),
            (&resources.distances).into(),
            (&resources.radii).into(),
        ];
        let label = "lightfall::SoftShadow::search";
        let (groups, layout) = (&mut resources.search_groups, &self.search.layout);
        let group = groups.get(&self.device, label, layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        dispatch(&mut pass, &self.search.pipeline, &group, inputs.g_buffer.size());
    }

    fn record_blur(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut SoftShadowResources,
        inputs: &SoftShadowInputs<'_>,
        light: usize,
        layer: &wgpu::TextureView,
    ) {
        let views = inputs.g_buffer.views();
        let label = "lightfall::SoftShadow::blur";
        // There and back again: once the search is done, the texture of distances is free.
        let groups = [[layer, &resources.distances], [&resources.distances, layer]].map(|[source, target]| {
            let bound: [Bound; 8] = [
                (&resources.params[light]).into(),
                inputs.g_buffer.view_buffer().into(),
                (&views.depth).into(),
                (&views.normal).into(),
                inputs.lights.buffer().into(),
                (&resources.radii).into(),
                source.into(),
                target.into(),
            ];
            resources
                .blur_groups
                .get(&self.device, label, &self.blur_layout, &bound)
        });
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        for (blur, group) in self.blurs.iter().zip(&groups) {
            dispatch(&mut pass, blur, group, inputs.g_buffer.size());
        }
    }
}

fn dispatch(
    pass: &mut wgpu::ComputePass<'_>,
    pipeline: &wgpu::ComputePipeline,
    group: &wgpu::BindGroup,
    [width, height]: [u32; 2],
) {
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, group, &[]);
    pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
}

impl SoftShadowResources {
    /// For a view of `size` pixels and this many lights.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, size: [u32; 2], lights: u32) -> Result<Self, Error> {
        use wgpu::TextureUsages as U;
        let spec = |label| device::TextureSpec {
            label,
            size,
            layers: 1,
            format: wgpu::TextureFormat::R32Float,
            usage: U::TEXTURE_BINDING | U::STORAGE_BINDING,
        };
        let (distances, radii) = (
            spec("lightfall::SoftShadow::distances"),
            spec("lightfall::SoftShadow::radii"),
        );
        let view = |spec| device::texture(device, spec).map(|texture| texture.create_view(&Default::default()));
        let params = (0..lights)
            .map(|_| device::uniform_buffer::<gpu::Params>(device, "lightfall::SoftShadow::params"))
            .collect::<Result<Vec<_>, _>>()?;
        let uses = params.len();
        Ok(Self {
            distances: view(&distances)?,
            radii: view(&radii)?,
            written: vec![None; uses],
            test_groups: BindGroupCache::for_uses(uses),
            search_groups: BindGroupCache::for_uses(uses),
            blur_groups: BindGroupCache::for_uses(2 * uses),
            bytes: distances.bytes() + radii.bytes() + params.iter().map(wgpu::Buffer::size).sum::<u64>(),
            params,
        })
    }

    fn write_params(&mut self, light: usize, inputs: &SoftShadowInputs<'_>) {
        let settings = inputs.settings;
        let params = gpu::Params {
            light: light as u32,
            shadow_map_size: inputs.shadow_maps.size(),
            layer_count: inputs.nearest.layers(),
            search: (settings.search == PenumbraSearch::On).into(),
            search_taps: settings.search_taps.min(MAX_TAPS),
            blur_taps: settings.blur_taps.min(MAX_TAPS),
            max_radius: settings.max_radius,
            range_scale: settings.range_scale,
        };
        if self.written[light] != Some(params) {
            let bytes = bytemuck::bytes_of(&params);
            inputs.queue.write_buffer(&self.params[light], 0, bytes);
            self.written[light] = Some(params);
        }
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}
