//! Lights that stand for what shines without being one: suns for an environment, lamps for surfaces.

use super::Settings;
use crate::Error;
use crate::resource::{MAX_LIGHTS, ShadowMaps};
use crate::scene::{EmissiveTriangle, EnvironmentImage, Lamp, Light, LightKind, SceneSummary, Sun};

/// Most lamps that triangles are grouped into: each has six layers of shadow maps.
const MOST_LAMPS: usize = 16;

/// Both kinds, kept while what they stand for stays.
#[derive(Debug, Default)]
pub(super) struct StandIns {
    suns: Option<SunCache>,
    lamps: Option<LampCache>,
}

/// What lamps were last made of.
#[derive(Debug)]
struct LampCache {
    triangles: Vec<EmissiveTriangle>,
    most: usize,
    lamps: Vec<Lamp>,
}

/// The environment in parts, and what they were last made of.
#[derive(Debug)]
struct SunCache {
    has_image: bool,
    most: usize,
    suns: Vec<Sun>,
}

impl StandIns {
    /// Another image than before.
    pub(super) fn environment_changed(&mut self) {
        self.suns = None;
    }

    /// What stands for the environment: as many suns as the settings want and there is room for beside the lights and one lamp.
    pub(super) fn suns(
        &mut self,
        device: &wgpu::Device,
        settings: &Settings,
        image: Option<&EnvironmentImage>,
        (summary, lights): (&SceneSummary, &[Light]),
    ) -> Result<Vec<Light>, Error> {
        let environment = lights.iter().find_map(|light| match light.kind {
            LightKind::Environment { image, rotation } => Some((light, image, rotation)),
            _ => None,
        });
        let Some((light, index, rotation)) = environment else {
            return Ok(Vec::new());
        };
        if index.is_some() && image.is_none() {
            return Err(Error::MissingInput {
                stage: "DirectLight",
                input: "an environment's image",
                remedy: "hand it to GiRenderer::set_environment, or take LightKind::Environment { image: None, .. }",
            });
        }
        let image = image.filter(|_| index.is_some());
        let lamps = usize::from(!summary.emissive_triangles.is_empty());
        let others = lights.iter().filter(|l| !l.is_environment()).count() + lamps;
        let layers = ShadowMaps::layers(lights) as usize + 6 * lamps + 1;
        let most = (settings.environment_suns as usize)
            .min(MAX_LIGHTS.saturating_sub(others))
            .min((device.limits().max_texture_array_layers as usize).saturating_sub(layers));
        let has_image = image.is_some();
        let is_known = |c: &&SunCache| c.most == most && c.has_image == has_image;
        if self.suns.as_ref().filter(is_known).is_none() {
            let suns = Sun::divide(image, most);
            self.suns = Some(SunCache { has_image, most, suns });
        }
        let suns = self.suns.iter().flat_map(|c| &c.suns);
        Ok(suns.map(|s| s.light(light.strength(), rotation)).collect())
    }

    /// As many as there is room for beside the other lights, grouped anew where their triangles have changed.
    pub(super) fn lamps(
        &mut self,
        device: &wgpu::Device,
        summary: &SceneSummary,
        (lights, suns): (&[Light], &[Light]),
    ) -> Result<Vec<Lamp>, Error> {
        if summary.emissive_triangles.is_empty() {
            self.lamps = None;
            return Ok(Vec::new());
        }
        let others = lights.iter().filter(|l| !l.is_environment()).count() + suns.len();
        let layers = device.limits().max_texture_array_layers;
        let free_layers = layers.saturating_sub(1 + ShadowMaps::layers(lights) + ShadowMaps::layers(suns));
        let most = MOST_LAMPS
            .min(free_layers as usize / 6)
            .min(MAX_LIGHTS.saturating_sub(others));
        if most == 0 {
            return Err(Error::CountMismatch {
                what: "lights beside surfaces that shine (most a scene may have)",
                expected: MAX_LIGHTS - 1,
                found: others,
            });
        }
        let is_known = |c: &LampCache| c.most == most && c.triangles == summary.emissive_triangles;
        if let Some(cache) = self.lamps.as_ref().filter(|c| is_known(c)) {
            return Ok(cache.lamps.clone());
        }
        let lamps = Lamp::group(&summary.emissive_triangles, most);
        self.lamps = Some(LampCache {
            triangles: summary.emissive_triangles.clone(),
            most,
            lamps: lamps.clone(),
        });
        Ok(lamps)
    }
}
