//! What all views share of direct light: the lights, what they see, and how near to them anything stands.

use super::{Plan, SceneInputs, Settings, Stage};
use crate::Error;
use crate::pass::{
    NearestOccluder, NearestOccluderInputs, NearestOccluderResources, ShadowMapCapture, ShadowMapCaptureInputs,
    ShadowMapCaptureResources,
};
use crate::resource::{CaptureView, Lights, NearestOccluders, ShadowMaps};
use crate::scene::{Light, UnitFrame};

/// From geometry to what shadows are found by.
#[derive(Debug)]
pub(super) struct ShadowPasses {
    shadow_map_capture: ShadowMapCapture,
    nearest_occluder: NearestOccluder,
}

/// Allocated while anything shines.
#[derive(Debug)]
pub(super) struct DirectScene {
    pub(super) lights: Lights,
    pub(super) shadow_maps: ShadowMaps,
    layers: u32,
    /// What the shadow maps show, as far as lights go; `None`: nothing that lasts.
    captured: Option<(UnitFrame, Vec<Light>)>,
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
            captured: None,
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
            self.captured = None;
            let nearest = NearestOccluders::new(device, self.layers)?;
            self.nearest = Some((nearest, NearestOccluderResources::new(device)?));
        }
        Ok(())
    }

    /// While penumbrae are looked for.
    pub(super) fn nearest(&self) -> Option<&NearestOccluders> {
        self.nearest.as_ref().map(|n| &n.0)
    }

    /// Whether what the lights see was captured of lights like these. Otherwise what there is is void, until it is captured.
    pub(super) fn holds(&mut self, frame: &UnitFrame, lights: &[Light]) -> bool {
        let is_like = |(own, seen): &(UnitFrame, Vec<Light>)| own.maps_like(frame) && seen == lights;
        self.captured = self.captured.take().filter(is_like);
        self.captured.is_some()
    }

    /// Says that geometry is other than it was captured.
    pub(super) fn forget(&mut self) {
        self.captured = None;
    }

    /// Notes that what these lights see was recorded.
    pub(super) fn recorded(&mut self, frame: &UnitFrame, lights: &[Light]) {
        self.captured = Some((*frame, lights.to_vec()));
    }

    /// Records what the lights see, through these views.
    pub(super) fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        passes: &ShadowPasses,
        (inputs, plan, views): (&SceneInputs<'_>, &Plan, &[CaptureView]),
    ) {
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
