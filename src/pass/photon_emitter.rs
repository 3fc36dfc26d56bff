//! Emits photons from every light and stores where they first land: hop 0 of [`Photons`].
//!
//! Inputs: [`Lights`], [`ShadowMaps`], and what says where photons start if they are not spread evenly ([`PhotonSpread`]).
//! Output: [`Photons`], hop 0. Cost: proportional to the number of photons, one texel fetch each; of photons that are aimed,
//! times the number of targets. Directions follow the Halton sequence; first hits are looked up in the light's reflective
//! shadow map (Yao et al. 2010, section 7), or left to the tracer, which traces hop 0 like any other ([`FirstHits`]); it always
//! is for flat lights, whose photons start anywhere on their surfaces. Limits: photons whose first hits are looked up set out
//! from the middle of their light, whatever its extent.

use super::dispatch_64;
use super::photon_guiding::Guiding;
use super::photon_walk::LIST_SLOTS;
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::resource::{Lights, PathList, PhotonTargets, Photons, ShadowMaps};
use crate::{Error, Timestamps, wgsl};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/photon_emitter/first_hit.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) photon_count: u32,
        pub(crate) light_count: u32,
        pub(crate) sample_offset: u32,
        pub(crate) shadow_map_size: u32,
        pub(crate) row: u32,
        pub(crate) traces_first: u32,
        pub(crate) guided: f32,
    }
}

/// Bindings of `shaders/pass/photon_emitter/first_hit.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 5] = [
    Slot::Uniform,
    Slot::Storage,
    Slot::UintArray,
    Slot::StorageMut,
    Slot::Storage,
];

/// Bindings of group 1 of `emit_guided_photons`, and of `emit_photons_at_targets`.
pub(crate) const SPREAD_SLOTS: [Slot; 1] = [Slot::Storage];

/// Where photons start and in which directions they leave.
#[derive(Debug, Clone, Copy)]
pub enum PhotonSpread<'a> {
    /// As the lights shine.
    Even,
    /// As the lights shine, but more or less densely. The tracers' inputs take the same.
    Guided(Guiding<'a>),
    /// Towards targets alone, evenly in the solid angles that these fill.
    Targets(&'a PhotonTargets),
}

impl<'a> PhotonSpread<'a> {
    /// What guides the walk as well.
    pub(crate) fn guiding(self) -> Option<Guiding<'a>> {
        match self {
            Self::Guided(guiding) => Some(guiding),
            Self::Even | Self::Targets(_) => None,
        }
    }
}

/// How photons of lights that are not flat find where they first land.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum FirstHits {
    /// In the light's reflective shadow map: a fetch each, exact to within its texels (Yao et al. 2010, section 7).
    #[default]
    ShadowMaps,
    /// Hop 0 is traced like any other, from anywhere on the sphere of a point light or the disc of a spot, and along any
    /// direction of a sun's disc.
    Traced,
}

/// The pass.
#[derive(Debug)]
pub struct PhotonEmitter {
    device: wgpu::Device,
    layout: wgpu::BindGroupLayout,
    /// Of what spreads them.
    spread_layout: wgpu::BindGroupLayout,
    emit: wgpu::ComputePipeline,
    emit_guided: wgpu::ComputePipeline,
    emit_at_targets: wgpu::ComputePipeline,
    /// Of the list of some photons.
    list_layout: wgpu::BindGroupLayout,
    emit_listed: wgpu::ComputePipeline,
    emit_listed_at_targets: wgpu::ComputePipeline,
}

/// Uniforms and bind groups.
#[derive(Debug)]
pub struct PhotonEmitterResources {
    params: wgpu::Buffer,
    groups: BindGroupCache,
    list_groups: BindGroupCache,
}

/// What a frame gives it.
#[derive(Debug, Clone, Copy)]
pub struct PhotonEmitterInputs<'a> {
    /// For the uniforms of this frame.
    pub queue: &'a wgpu::Queue,
    /// Where photons begin.
    pub lights: &'a Lights,
    /// Where they first land.
    pub shadow_maps: &'a ShadowMaps,
    /// Hop 0 is written.
    pub photons: &'a Photons,
    /// Where they start.
    pub spread: PhotonSpread<'a>,
    /// How they find where they land.
    pub first_hits: FirstHits,
    /// First index into the random sequence: constant in real time, so that nothing flickers; advanced by the number of
    /// photons per frame when accumulating.
    pub sample_offset: u32,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl PhotonEmitter {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let label = "lightfall::PhotonEmitter";
        let layout = device::layout(device, label, wgpu::ShaderStages::COMPUTE, &SLOTS);
        let spread_layout = device::layout(device, label, wgpu::ShaderStages::COMPUTE, &SPREAD_SLOTS);
        let list_layout = device::layout(device, label, wgpu::ShaderStages::COMPUTE, &LIST_SLOTS);
        let pipeline = |label, source, entry_point, layouts: &[&wgpu::BindGroupLayout]| {
            let spec = ComputeSpec {
                label,
                source,
                entry_point,
                layouts,
                constants: &[],
            };
            device::compute_pipeline(device, &spec)
        };
        Self {
            device: device.clone(),
            emit: pipeline(
                "lightfall::PhotonEmitter::emit",
                wgsl::PHOTON_EMITTER,
                "emit_photons",
                &[&layout],
            ),
            emit_guided: pipeline(
                "lightfall::PhotonEmitter::emit_guided",
                wgsl::PHOTON_EMITTER,
                "emit_guided_photons",
                &[&layout, &spread_layout],
            ),
            emit_at_targets: pipeline(
                "lightfall::PhotonEmitter::emit_at_targets",
                wgsl::PHOTON_EMITTER_AT_TARGETS,
                "emit_photons_at_targets",
                &[&layout, &spread_layout],
            ),
            emit_listed: pipeline(
                "lightfall::PhotonEmitter::emit_listed",
                wgsl::PHOTON_EMITTER_LISTED,
                "emit_listed_photons",
                &[&layout, &list_layout],
            ),
            emit_listed_at_targets: pipeline(
                "lightfall::PhotonEmitter::emit_listed_at_targets",
                wgsl::PHOTON_EMITTER_AT_TARGETS,
                "emit_listed_at_targets",
                &[&layout, &spread_layout, &list_layout],
            ),
            layout,
            spread_layout,
            list_layout,
        }
    }

    /// Records the emission.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut PhotonEmitterResources,
        inputs: &PhotonEmitterInputs<'_>,
    ) {
        let (group, groups) = self.prepare(resources, inputs);
        let (pipeline, spread) = match inputs.spread {
            PhotonSpread::Guided(guiding) if guiding.share() > 0.0 => {
                (&self.emit_guided, Some(guiding.tables.emission()))
            }
            PhotonSpread::Even | PhotonSpread::Guided(_) => (&self.emit, None),
            PhotonSpread::Targets(targets) => (&self.emit_at_targets, Some(targets.buffer())),
        };
        let spread_group = spread.map(|buffer| self.spread_group(resources, buffer));
        let mut pass = device::compute_pass(encoder, "lightfall::PhotonEmitter", inputs.timestamps);
        pass.set_pipeline(pipeline);
        if let Some(spread_group) = &spread_group {
            pass.set_bind_group(1, spread_group, &[]);
        }
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(groups[0], groups[1], 1);
    }

    /// Records the emission of some photons alone, over what is there: towards targets, or evenly spread where `inputs` say
    /// anything else.
    pub fn record_listed(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut PhotonEmitterResources,
        inputs: &PhotonEmitterInputs<'_>,
        list: &PathList,
    ) {
        let (group, _) = self.prepare(resources, inputs);
        let label = "lightfall::PhotonEmitter";
        let bound = [list.buffer().into()];
        let listed = resources
            .list_groups
            .get(&self.device, label, &self.list_layout, &bound);
        let targets = match inputs.spread {
            PhotonSpread::Targets(targets) => Some(self.spread_group(resources, targets.buffer())),
            PhotonSpread::Even | PhotonSpread::Guided(_) => None,
        };
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        match &targets {
            Some(targets) => {
                pass.set_pipeline(&self.emit_listed_at_targets);
                pass.set_bind_group(1, targets, &[]);
                pass.set_bind_group(2, &listed, &[]);
            }
            None => {
                pass.set_pipeline(&self.emit_listed);
                pass.set_bind_group(1, &listed, &[]);
            }
        }
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups_indirect(list.buffer(), 0);
    }

    /// What spreads them, bound.
    fn spread_group(&self, resources: &mut PhotonEmitterResources, buffer: &wgpu::Buffer) -> wgpu::BindGroup {
        let (label, layout) = ("lightfall::PhotonEmitter", &self.spread_layout);
        resources.groups.get(&self.device, label, layout, &[buffer.into()])
    }

    /// Uniform and bindings, and workgroups for all photons.
    fn prepare(
        &self,
        resources: &mut PhotonEmitterResources,
        inputs: &PhotonEmitterInputs<'_>,
    ) -> (wgpu::BindGroup, [u32; 2]) {
        let (groups, row) = dispatch_64(inputs.photons.count());
        let params = gpu::Params {
            photon_count: inputs.photons.count(),
            light_count: inputs.lights.count(),
            sample_offset: inputs.sample_offset,
            shadow_map_size: inputs.shadow_maps.size(),
            row,
            traces_first: u32::from(inputs.first_hits == FirstHits::Traced),
            guided: inputs.spread.guiding().map_or(0.0, |guiding| guiding.share()),
        };
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let bound = [
            (&resources.params).into(),
            inputs.lights.buffer().into(),
            inputs.shadow_maps.view().into(),
            inputs.photons.buffer().into(),
            inputs.lights.polygons().into(),
        ];
        let label = "lightfall::PhotonEmitter";
        let group = resources.groups.get(&self.device, label, &self.layout, &bound);
        (group, groups)
    }
}

impl PhotonEmitterResources {
    /// Resources on this device.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device grants next to nothing.
    pub fn new(device: &wgpu::Device) -> Result<Self, Error> {
        Ok(Self {
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::PhotonEmitter::params")?,
            groups: BindGroupCache::default(),
            // Of probes, and of what these say to trace anew.
            list_groups: BindGroupCache::for_uses(2),
        })
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.params.size()
    }
}
