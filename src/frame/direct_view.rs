//! What a view has of direct light: shadows, and irradiance, unless that is left to the sum.

use super::direct_scene::DirectScene;
use super::{Settings, ViewInputs};
use crate::Error;
use crate::pass::{
    DirectLight, DirectLightInputs, DirectLightResources, FusedComposite, FusedCompositeResources, ShadowMethod,
    ShadowTarget, SoftShadow, SoftShadowInputs, SoftShadowResources,
};
use crate::resource::{GBuffer, Irradiance, NearestOccluders, PendingPenumbrae, Visibility};

/// From what the lights see to the pixels of a view.
#[derive(Debug)]
pub(super) struct DirectPasses {
    soft_shadow: SoftShadow,
    direct_light: DirectLight,
    /// If the settings fuse.
    pub(super) fused: Option<FusedComposite>,
}

/// Allocated while anything shines.
#[derive(Debug)]
pub(super) struct DirectView {
    /// While penumbrae are looked for.
    shadows: Option<(Shadows, SoftShadowResources)>,
    shading: Shading,
}

/// Of each light.
#[derive(Debug)]
enum Shadows {
    Found(Visibility),
    Pending(PendingPenumbrae),
}

/// What is made of them.
#[derive(Debug)]
enum Shading {
    Irradiance(Irradiance, DirectLightResources),
    WithTheSum(FusedCompositeResources),
}

/// What recording needs beside a host's inputs.
#[derive(Clone, Copy)]
pub(super) struct DirectViewInputs<'a> {
    pub(super) view: &'a ViewInputs<'a>,
    pub(super) settings: &'a Settings,
    pub(super) passes: &'a DirectPasses,
    pub(super) scene: &'a DirectScene,
    pub(super) g_buffer: &'a GBuffer,
    /// Of the photons.
    pub(super) sample_offset: u32,
}

impl DirectPasses {
    pub(super) fn new(device: &wgpu::Device, settings: &Settings) -> Self {
        let fused = || FusedComposite::new(device, wgpu::TextureFormat::Rgba32Float);
        Self {
            soft_shadow: SoftShadow::new(device),
            direct_light: DirectLight::new(device),
            fused: settings.fuses_composite.then(fused),
        }
    }
}

impl DirectView {
    pub(super) fn new(device: &wgpu::Device, settings: &Settings, size: [u32; 2]) -> Result<Self, Error> {
        let shading = if settings.fuses_composite {
            Shading::WithTheSum(FusedCompositeResources::new(device)?)
        } else {
            let irradiance = Irradiance::new(device, size, wgpu::TextureFormat::Rgba32Float)?;
            Shading::Irradiance(irradiance, DirectLightResources::new(device)?)
        };
        Ok(Self { shadows: None, shading })
    }

    /// Makes or drops what penumbrae need: as many layers as lights; the same shadow maps may serve other numbers of them.
    pub(super) fn follow(
        &mut self,
        device: &wgpu::Device,
        settings: &Settings,
        size: [u32; 2],
        scene: &DirectScene,
    ) -> Result<(), Error> {
        let lights = scene.lights.count();
        if scene.nearest().is_none() {
            self.shadows = None;
        } else if self.shadows.as_ref().is_none_or(|s| s.0.lights() != lights) {
            let shadows = Shadows::new(device, settings, size, lights)?;
            let gathers = matches!(settings.soft_shadow.method, ShadowMethod::Cross | ShadowMethod::Disc);
            let own = match shadows {
                Shadows::Found(_) if gathers => SoftShadowResources::new(device, size, lights)?,
                _ => SoftShadowResources::without_gathering(device, size, lights)?,
            };
            self.shadows = Some((shadows, own));
        }
        Ok(())
    }

    /// Records shadows, and irradiance unless that is left to the sum.
    pub(super) fn record(&mut self, encoder: &mut wgpu::CommandEncoder, inputs: &DirectViewInputs<'_>) {
        let (scene, view) = (inputs.scene, inputs.view);
        if let (Some((shadows, own)), Some(nearest)) = (&mut self.shadows, scene.nearest()) {
            let soft_inputs = SoftShadowInputs {
                queue: view.queue,
                g_buffer: inputs.g_buffer,
                lights: &scene.lights,
                shadow_maps: &scene.shadow_maps,
                nearest,
                #[cfg(feature = "bvh")]
                bvh: view.bvh,
                target: shadows.target(),
                settings: &inputs.settings.soft_shadows(&scene.lights),
                sample_offset: inputs.sample_offset,
                timestamps: view.timestamps,
            };
            inputs.passes.soft_shadow.record(encoder, own, &soft_inputs);
        }
        let visibility = match &self.shadows {
            Some((Shadows::Found(visibility), _)) => Some(visibility),
            _ => None,
        };
        if let Shading::Irradiance(irradiance, own) = &mut self.shading {
            let direct_inputs = DirectLightInputs {
                queue: view.queue,
                g_buffer: inputs.g_buffer,
                lights: &scene.lights,
                shadow_maps: &scene.shadow_maps,
                visibility,
                irradiance,
                timestamps: view.timestamps,
            };
            inputs.passes.direct_light.record(encoder, own, &direct_inputs);
        }
    }

    /// Unless it is left to the sum.
    pub(super) fn irradiance(&self) -> Option<&Irradiance> {
        match &self.shading {
            Shading::Irradiance(irradiance, _) => Some(irradiance),
            Shading::WithTheSum(_) => None,
        }
    }

    /// How much of each light is seen, while penumbrae are looked for and that is not left to the sum.
    pub(super) fn visibility(&self) -> Option<&Visibility> {
        match &self.shadows {
            Some((Shadows::Found(visibility), _)) => Some(visibility),
            _ => None,
        }
    }

    /// What the sum needs, if all else is left to it.
    pub(super) fn fused<'a>(&'a mut self, scene: &'a DirectScene) -> Option<FusedParts<'a>> {
        let Shading::WithTheSum(own) = &mut self.shading else {
            return None;
        };
        let penumbrae = match (&self.shadows, scene.nearest()) {
            (Some((Shadows::Pending(pending), _)), Some(nearest)) => Some((pending, nearest)),
            _ => None,
        };
        Some(FusedParts { own, penumbrae })
    }

    /// Bytes by resource.
    pub(super) fn memory_by_resource(&self) -> Vec<(&'static str, u64)> {
        let mut list = vec![match &self.shading {
            Shading::Irradiance(irradiance, own) => ("direct_irradiance", irradiance.memory_use() + own.memory_use()),
            Shading::WithTheSum(own) => ("fused_composite", own.memory_use()),
        }];
        if let Some((shadows, own)) = &self.shadows {
            list.push(("visibility", shadows.memory_use()));
            list.push(("soft_shadow", own.memory_use()));
        }
        list
    }
}

/// What [`FusedComposite`] needs of direct light.
pub(super) struct FusedParts<'a> {
    pub(super) own: &'a mut FusedCompositeResources,
    pub(super) penumbrae: Option<(&'a PendingPenumbrae, &'a NearestOccluders)>,
}

impl Shadows {
    fn new(device: &wgpu::Device, settings: &Settings, size: [u32; 2], lights: u32) -> Result<Self, Error> {
        Ok(match settings.fuses_composite {
            true => Self::Pending(PendingPenumbrae::new(device, size, lights)?),
            false => Self::Found(Visibility::new(device, size, lights)?),
        })
    }

    fn target(&self) -> ShadowTarget<'_> {
        match self {
            Self::Found(visibility) => ShadowTarget::Visibility(visibility),
            Self::Pending(pending) => ShadowTarget::Pending(pending),
        }
    }

    fn lights(&self) -> u32 {
        match self {
            Self::Found(visibility) => visibility.lights(),
            Self::Pending(pending) => pending.lights(),
        }
    }

    fn memory_use(&self) -> u64 {
        match self {
            Self::Found(visibility) => visibility.memory_use(),
            Self::Pending(pending) => pending.memory_use(),
        }
    }
}
