//! What all views share of direct light: the lights, what they see, and how near to them anything stands.

use super::{Plan, SceneInputs, Settings, Stage};
use crate::Error;
use crate::pass::{
    NearestOccluder, NearestOccluderInputs, NearestOccluderResources, ShadowMapCapture, ShadowMapCaptureInputs,
    ShadowMapCaptureResources,
};
use crate::resource::{CaptureView, Lights, NearestOccluders, ShadowMaps};
use crate::scene::{Light, LightKind, UnitFrame};
use glam::DVec3;

/// From geometry to what shadows are found by.
#[derive(Debug)]
pub(super) struct ShadowPasses {
    shadow_map_capture: ShadowMapCapture,
    nearest_occluder: NearestOccluder,
}

/// What the maps of lights show, as far as it is not geometry.
#[derive(Debug, PartialEq)]
struct Shown {
    frame: UnitFrame,
    /// Of each light, and whether it shines.
    lights: Vec<(LightKind, bool)>,
    has_nearest: bool,
}

/// Allocated while anything shines.
#[derive(Debug)]
pub(super) struct DirectScene {
    pub(super) lights: Lights,
    pub(super) shadow_maps: ShadowMaps,
    layers: u32,
    /// What was recorded last; `None`: nothing that lasts.
    shown: Option<Shown>,
    /// What is to be recorded; `None`: what is there stays.
    planned: Option<Shown>,
    capture: ShadowMapCaptureResources,
    /// While penumbrae are looked for.
    nearest: Option<(NearestOccluders, NearestOccluderResources)>,
}

impl ShadowPasses {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        Self {
            shadow_map_capture: ShadowMapCapture::new(),
            nearest_occluder: NearestOccluder::new(device),
        }
    }
}

impl DirectScene {
    pub(super) fn new(device: &wgpu::Device, settings: &Settings, lights: &[Light]) -> Result<Self, Error> {
        let mut own = Lights::new(device)?;
        if settings.selects_photons() {
            own.keep_division();
        }
        Ok(Self {
            lights: own,
            shadow_maps: ShadowMaps::new(device, lights, settings.shadow_map_size)?,
            layers: ShadowMaps::layers(lights),
            shown: None,
            planned: None,
            capture: ShadowMapCaptureResources::new(device, settings.shadow_map_size)?,
            nearest: None,
        })
    }

    /// Whether the shadow maps serve these lights.
    pub(super) fn fits(&self, lights: &[Light]) -> bool {
        self.layers == ShadowMaps::layers(lights)
    }

    /// Makes or drops what penumbrae need.
    pub(super) fn follow(&mut self, device: &wgpu::Device, plan: &Plan) -> Result<(), Error> {
        if !plan.is_on(Stage::SoftShadow) {
            self.nearest = None;
        } else if self.nearest.is_none() {
            self.forget();
            let nearest = NearestOccluders::new(device, self.layers)?;
            self.nearest = Some((nearest, NearestOccluderResources::new(device)?));
        }
        Ok(())
    }

    /// While penumbrae are looked for.
    pub(super) fn nearest(&self) -> Option<&NearestOccluders> {
        self.nearest.as_ref().map(|n| &n.0)
    }

    /// Says that geometry is other than it was recorded.
    pub(super) fn forget(&mut self) {
        self.shown = None;
    }

    /// The views that this frame records: none while what is there is of the same lights and, as the host says, geometry.
    pub(super) fn plan(&mut self, (frame, lights): (&UnitFrame, &[Light]), plan: &Plan) -> Vec<CaptureView> {
        let wanted = Shown {
            frame: *frame,
            lights: lights.iter().map(|l| (l.kind, l.strength() != DVec3::ZERO)).collect(),
            has_nearest: plan.is_on(Stage::NearestOccluder),
        };
        if self.shown.as_ref() == Some(&wanted) {
            self.planned = None;
            return Vec::new();
        }
        self.shown = None;
        self.planned = Some(wanted);
        self.shadow_maps.views(frame, lights)
    }

    /// Notes that all that was recorded is going to be submitted.
    pub(super) fn recorded(&mut self) {
        if let Some(planned) = self.planned.take() {
            self.shown = Some(planned);
        }
    }

    /// Records what the lights see, through the views that were planned.
    pub(super) fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        passes: &ShadowPasses,
        (inputs, plan, views): (&SceneInputs<'_>, &Plan, &[CaptureView]),
    ) {
        if self.planned.is_none() {
            return;
        }
        let shadow_inputs = ShadowMapCaptureInputs {
            shadow_maps: &self.shadow_maps,
            geometry: inputs.geometry,
            views,
            timestamps: inputs.timestamps,
        };
        passes
            .shadow_map_capture
            .record(encoder, &mut self.capture, &shadow_inputs);
        if let Some((nearest, own)) = &mut self.nearest
            && plan.is_on(Stage::NearestOccluder)
        {
            let nearest_inputs = NearestOccluderInputs {
                queue: inputs.queue,
                lights: &self.lights,
                shadow_maps: &self.shadow_maps,
                nearest,
                timestamps: inputs.timestamps,
            };
            passes.nearest_occluder.record(encoder, own, &nearest_inputs);
        }
    }

    /// Bytes by resource.
    pub(super) fn memory_by_resource(&self) -> Vec<(&'static str, u64)> {
        let maps = self.shadow_maps.memory_use() + self.capture.memory_use();
        let mut list = vec![("lights", self.lights.memory_use()), ("shadow_maps", maps)];
        if let Some((nearest, own)) = &self.nearest {
            list.push(("nearest_occluders", nearest.memory_use() + own.memory_use()));
        }
        list
    }
}
