//! Model only what the scene requires: which stages run, and why.

use super::{GlossyMethod, IlluminationMapSettings, IndirectMethod, LightPlacement, Settings, TracerKind, Upsampling};
use crate::pass::{FirstHits, IndirectShadows};
use crate::resource::MAX_DIRECT_POLYGONS;
use crate::scene::SceneSummary;
use std::fmt;

/// A stage of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stage {
    /// What the eye sees.
    GBufferCapture,
    /// What the lights see.
    ShadowMapCapture,
    /// How wide penumbrae may be.
    NearestOccluder,
    /// Penumbrae.
    SoftShadow,
    /// Direct irradiance.
    DirectLight,
    /// Where environment maps are taken from.
    EnvMapSelector,
    /// What is around a few points.
    EnvMapCapture,
    /// How deep the surfaces in it lie, coarsely.
    DepthHierarchyBuild,
    /// Which photons count for the picture.
    PhotonGuiding,
    /// Photons from lights.
    PhotonEmitter,
    /// Which photons are traced anew.
    SelectiveEmitter,
    /// Photons from surface to surface, as environment maps see them.
    ImageSpaceTracer,
    /// Photons from triangle to triangle.
    BvhTracer,
    /// Photons by way of metal and glass alone: aimed, traced and splatted by themselves.
    CausticMap,
    /// Photons to surface lights, or to texels.
    PhotonStream,
    /// Light at texels, gathered again where it has changed.
    TexelGather,
    /// Light on what environment maps show.
    EnvMapLighting,
    /// Photons to irradiance.
    PhotonSplatter,
    /// Surface lights to irradiance.
    SurfaceLightShading,
    /// Texels to irradiance.
    TexelShading,
    /// What rays bring back from lit environment maps.
    FinalGather,
    /// Noise evened out along surfaces.
    IrradianceFilter,
    /// Irradiance of some pixels to all of them.
    Upsampler,
    /// Photons sorted, for light at points that no pixel shows.
    PhotonGrid,
    /// What is seen in mirrors and through glass.
    SpecularPaths,
    /// What rough metal sends to the eye, from photons.
    GlossyLight,
    /// Penumbrae, the last step of up-sampling, direct light and the sum, all at once.
    FusedComposite,
    /// The sum.
    Composite,
}

impl Stage {
    /// Name as in [`pass`](crate::pass); of a caustic map the passes are those of other photons.
    pub fn name(&self) -> String {
        format!("{self:?}")
    }
}

/// One stage, whether it runs, and the reason.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedStage {
    /// The stage.
    pub stage: Stage,
    /// Whether it allocates and records anything.
    pub on: bool,
    /// Why.
    pub reason: String,
}

/// Every stage with its reason, and what of the scene is simplified. Its `Display` reads like a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// All stages in the order of a frame.
    pub stages: Vec<PlannedStage>,
    /// What the host keeps from light, and what the scene has that is not modelled yet, with what is done instead.
    pub simplifications: Vec<String>,
}

/// Why a stage does not run whose work is done.
const IN_ONE_PASS: &str = "within FusedComposite";

impl Plan {
    /// Decides from what is in the scene and what the settings allow.
    pub fn for_scene(summary: &SceneSummary, settings: &Settings) -> Self {
        let lit = match is_lit(summary, settings) {
            false => (false, no_light(summary).to_owned()),
            true => (
                true,
                sources(summary.lights - summary.environment_lights, summary, settings),
            ),
        };
        let indirect = indirect(summary, settings);
        let specular: Vec<_> = summary.metals.iter().chain(&summary.dielectrics).cloned().collect();
        let specular = match (indirect.0, specular.is_empty()) {
            (_, true) => (false, "no specular surface".to_owned()),
            (false, _) => indirect.clone(),
            (true, false) => (true, format!("seen in or through {}", specular.join(", "))),
        };
        let caustics = caustics(&specular, summary, settings);
        let glossy = match (specular.0, summary.metals.is_empty(), settings.glossy_method) {
            (false, ..) => specular.clone(),
            (true, true, _) => (false, "no metal".to_owned()),
            (true, false, GlossyMethod::Paths) => (false, "settings follow paths from rough metal".to_owned()),
            (true, false, GlossyMethod::Photons) => (true, format!("{}, where rough", summary.metals.join(", "))),
        };
        let shines_from_all_over = suns(summary, settings) > 0 || !summary.emissive_triangles.is_empty();
        let has_extent = summary.lights_with_extent > 0 || shines_from_all_over;
        let soft = match has_extent {
            false => "no light has an extent".to_owned(),
            true => format!(
                "{} with an extent",
                sources(summary.lights_with_extent, summary, settings)
            ),
        };
        let soft = match (lit.0 && has_extent, settings.finds_penumbrae()) {
            (true, false) => (false, "settings want hard shadows".to_owned()),
            (is_on, _) => (is_on, soft),
        };
        let stage = |stage, (on, reason): (bool, String)| PlannedStage { stage, on, reason };
        let always = |reason: &str| (true, reason.to_owned());
        let nearest = match settings.soft_shadow.searches() {
            true => soft.clone(),
            false => (false, "settings search no occluders".to_owned()),
        };
        let [selection, maps, hierarchies] = map_stages(&indirect, settings);
        let [image_space, bvh] = tracers(&indirect, settings);
        let upsampling = upsampling(&indirect, settings);
        let [direct, fused, sum] = sums(&lit, settings);
        let estimates = estimates(&indirect, settings);
        Self {
            stages: vec![
                stage(Stage::GBufferCapture, always("every view")),
                stage(Stage::ShadowMapCapture, lit),
                stage(Stage::NearestOccluder, nearest),
                stage(Stage::SoftShadow, soft),
                stage(Stage::DirectLight, direct),
                stage(Stage::EnvMapSelector, selection),
                stage(Stage::EnvMapCapture, maps),
                stage(Stage::DepthHierarchyBuild, hierarchies),
                stage(Stage::PhotonGuiding, guiding(&indirect, settings)),
                stage(Stage::PhotonEmitter, indirect.clone()),
                stage(Stage::SelectiveEmitter, selection_of_photons(&indirect, settings)),
                stage(Stage::ImageSpaceTracer, image_space),
                stage(Stage::BvhTracer, bvh),
                stage(Stage::CausticMap, caustics),
                stage(Stage::PhotonStream, estimates.streaming),
                stage(Stage::TexelGather, estimates.texels.clone()),
                stage(Stage::EnvMapLighting, estimates.gathering.clone()),
                stage(Stage::PhotonSplatter, estimates.splatting),
                stage(Stage::SurfaceLightShading, estimates.shading),
                stage(Stage::TexelShading, estimates.texels),
                stage(Stage::FinalGather, estimates.gathering),
                stage(Stage::IrradianceFilter, estimates.filtering),
                stage(Stage::Upsampler, upsampling),
                stage(Stage::PhotonGrid, specular.clone()),
                stage(Stage::SpecularPaths, specular),
                stage(Stage::GlossyLight, glossy),
                stage(Stage::FusedComposite, fused),
                stage(Stage::Composite, sum),
            ],
            simplifications: simplifications(summary, settings),
        }
    }

    /// Whether a stage runs.
    pub fn is_on(&self, stage: Stage) -> bool {
        self.stages.iter().any(|s| s.stage == stage && s.on)
    }
}

/// Whether anything shines on surfaces.
fn is_lit(summary: &SceneSummary, settings: &Settings) -> bool {
    let has_lights = summary.lights > summary.environment_lights || suns(summary, settings) > 0;
    has_lights || !summary.emissive_triangles.is_empty()
}

/// What gathers the light of a texel.
fn gathered_by(settings: &IlluminationMapSettings) -> String {
    match settings.gather_shape() {
        None => format!("{} rays", settings.gather.rays),
        Some(shape) => format!("{} draws of the scene", shape.views()),
    }
}

/// How many suns stand for the environment, at most.
fn suns(summary: &SceneSummary, settings: &Settings) -> u32 {
    if summary.environment_lights > 0 {
        settings.environment_suns
    } else {
        0
    }
}

/// So many lights, the suns of an environment, and the surfaces that shine.
fn sources(lights: usize, summary: &SceneSummary, settings: &Settings) -> String {
    let counted = [
        (lights, "light(s)"),
        (suns(summary, settings) as usize, "sun(s) of the environment"),
        (summary.emissive_triangles.len(), "emissive triangle(s)"),
    ];
    let named = counted.iter().filter(|(n, _)| *n > 0);
    let named: Vec<_> = named.map(|(n, what)| format!("{n} {what}")).collect();
    named.join(", ")
}

/// Why nothing is lit.
fn no_light(summary: &SceneSummary) -> &'static str {
    match summary.lights {
        0 => "no light",
        _ => "no light but an environment, and settings give it no suns",
    }
}

fn indirect(summary: &SceneSummary, settings: &Settings) -> (bool, String) {
    let off = |reason: &str| (false, reason.to_owned());
    if !is_lit(summary, settings) {
        off(no_light(summary))
    } else if !summary.has_reflecting_surfaces {
        off("every surface is black")
    } else if settings.bounces == 0 {
        off("settings allow no bounces")
    } else if settings.photons == 0 {
        off("settings allow no photons")
    } else {
        let reason = format!("{} photons, {} bounce(s)", settings.traced_photons(), settings.bounces);
        (true, reason)
    }
}

/// The selection of places for environment maps, their capture, and their depth hierarchies.
fn map_stages(indirect: &(bool, String), settings: &Settings) -> [(bool, String); 3] {
    if !indirect.0 {
        return [(); 3].map(|()| indirect.clone());
    }
    if !settings.needs_env_maps() {
        return ["rays meet triangles"; 3].map(|reason| (false, reason.to_owned()));
    }
    let (most, size) = (settings.env_map_count, settings.env_map_size);
    let candidates = settings.selector.candidates.max(most);
    let all = match settings.env_maps_at_lights {
        0 => format!("at most {most} maps of 6 × {size}²"),
        extra => format!("at most {most} maps of 6 × {size}², and {extra} at lights"),
    };
    let hierarchies = match settings.needs_hierarchy() {
        true => (true, "rays step over empty space".to_owned()),
        false => (false, "settings walk over none".to_owned()),
    };
    [
        (true, format!("of {candidates} candidates, and while geometry changes")),
        (true, all),
        hierarchies,
    ]
}

fn guiding(indirect: &(bool, String), settings: &Settings) -> (bool, String) {
    match (indirect.0, settings.guided_photons > 0.0) {
        (false, _) => indirect.clone(),
        (true, false) => (false, "settings spread photons evenly".to_owned()),
        (true, true) => (true, "more photons go where paths were seen".to_owned()),
    }
}

/// From photons to pixels: the photons around, rays to lit environment maps and a filter of their noise, surface lights
/// made of a stream of photons, or texels that are gathered at where light changes.
struct Estimates {
    splatting: (bool, String),
    gathering: (bool, String),
    filtering: (bool, String),
    streaming: (bool, String),
    shading: (bool, String),
    texels: (bool, String),
}

fn estimates(indirect: &(bool, String), settings: &Settings) -> Estimates {
    let off = |reason: &str| {
        (
            false,
            if indirect.0 {
                reason.to_owned()
            } else {
                indirect.1.clone()
            },
        )
    };
    let (gathers, lights) = (&settings.final_gather, &settings.surface_lights);
    let mut all = Estimates {
        splatting: off(match settings.indirect_method {
            IndirectMethod::FinalGather => "settings gather from lit environment maps",
            IndirectMethod::IlluminationMaps => "settings take illumination maps",
            _ => "settings take surface lights",
        }),
        gathering: off(match settings.indirect_method {
            IndirectMethod::Splatting => "settings take the photons around",
            IndirectMethod::IlluminationMaps => "settings take illumination maps",
            _ => "settings take surface lights",
        }),
        filtering: match settings.filter_radius() {
            _ if settings.indirect_method == IndirectMethod::Splatting => off("no noise of rays"),
            _ if settings.indirect_method == IndirectMethod::IlluminationMaps => off("texels even out noise"),
            0 if settings.keeps_near() && indirect.0 => (true, "adds the photons near by".to_owned()),
            0 => off("settings leave the noise of rays"),
            radius => (
                indirect.0,
                match indirect.0 {
                    true => format!("noise of rays over {radius} pixel(s) to each side"),
                    false => indirect.1.clone(),
                },
            ),
        },
        streaming: off("settings take no surface lights"),
        shading: off("settings take no surface lights"),
        texels: off("settings take no illumination maps"),
    };
    if !indirect.0 {
        return all;
    }
    match settings.indirect_method {
        IndirectMethod::Splatting => all.splatting = indirect.clone(),
        IndirectMethod::IlluminationMaps => {
            let own = &settings.illumination_maps;
            all.streaming = (true, format!("a pool of {} paths", settings.traced_photons()));
            all.texels = (
                true,
                format!(
                    "{} places, {} texels of {} a frame at most",
                    own.texels,
                    own.gather.a_frame,
                    gathered_by(own)
                ),
            );
        }
        IndirectMethod::FinalGather => {
            all.gathering = (true, format!("{} rays a pixel", gathers.rays));
        }
        IndirectMethod::SurfaceLights => {
            let pool = match lights.placement {
                LightPlacement::OnSurfaces => format!("a pool of {} paths", settings.pool_paths()),
                LightPlacement::AtImpacts => "a light at each impact".to_owned(),
            };
            let shadows = match lights.shading.shadows {
                IndirectShadows::Off => "without shadows".to_owned(),
                IndirectShadows::AmbientOcclusion => format!("ambient occlusion by {} rays", lights.shading.rays),
                IndirectShadows::Some => format!("shadows by {} rays", lights.shading.rays),
                IndirectShadows::All => "shadows by a ray to each".to_owned(),
            };
            all.streaming = (true, pool);
            if settings.keeps_near() {
                all.splatting = (true, "photons near by, beside surface lights".to_owned());
            }
            all.shading = (true, format!("{} places, {shadows}", lights.places));
        }
    }
    all
}

/// Whether photons stay until their way changes.
fn selection_of_photons(indirect: &(bool, String), settings: &Settings) -> (bool, String) {
    let own = &settings.selective;
    match (indirect.0, settings.selects_photons()) {
        (false, _) => indirect.clone(),
        (true, true) => (
            true,
            format!("groups of {}, {} photons anew a frame", own.group, own.emitter.budget),
        ),
        (true, false) if !own.is_on => (false, "settings trace all photons anew".to_owned()),
        (true, false) => (false, "photons are guided, or of surface lights".to_owned()),
    }
}

/// The tracer in image space, and that of triangles.
fn tracers(indirect: &(bool, String), settings: &Settings) -> [(bool, String); 2] {
    if !indirect.0 {
        return [indirect.clone(), indirect.clone()];
    }
    let all = indirect.1.as_str();
    let [image_space, bvh] = match settings.tracer_kind {
        TracerKind::ImageSpace => [(true, all), (false, "settings trace in image space")],
        TracerKind::Bvh => [(false, "settings trace triangles"), (true, all)],
        TracerKind::Hybrid => [(true, all), (true, "rays that ImageSpaceTracer is not sure of")],
    };
    [image_space, bvh].map(|(on, reason)| (on, reason.to_owned()))
}

fn caustics(specular: &(bool, String), summary: &SceneSummary, settings: &Settings) -> (bool, String) {
    match (specular.0, summary.specular_bounds.len(), settings.caustic.photons) {
        (false, _, _) => specular.clone(),
        (true, 0, _) => (false, "the summary bounds no specular surface".to_owned()),
        (true, _, 0) => (false, "settings give caustics no photons".to_owned()),
        (true, things, photons) => (true, format!("{photons} photons aimed at {things} thing(s)")),
    }
}

fn upsampling(indirect: &(bool, String), settings: &Settings) -> (bool, String) {
    let factor = settings.subsampling.factor();
    let has_one_step = settings.upsampling == Upsampling::AtOnce || factor == 2;
    let is_left_to_the_sum = settings.fuses_composite && has_one_step;
    match (indirect.0, factor) {
        (false, _) => indirect.clone(),
        (true, 1) => (false, "every pixel is estimated".to_owned()),
        (true, _) if is_left_to_the_sum => (false, IN_ONE_PASS.to_owned()),
        (true, _) => (true, format!("one pixel in {factor} × {factor} is estimated")),
    }
}

/// Direct light, and the sum with all that comes before it or by itself.
fn sums(lit: &(bool, String), settings: &Settings) -> [(bool, String); 3] {
    let sum = (true, "every view".to_owned());
    match (lit.0, settings.fuses_composite) {
        (false, true) => [lit.clone(), lit.clone(), sum],
        (_, false) => {
            let fused = (false, "settings take one pass after the other".to_owned());
            [lit.clone(), fused, sum]
        }
        (true, true) => {
            let within = (false, IN_ONE_PASS.to_owned());
            [within.clone(), lit.clone(), within]
        }
    }
}

fn simplifications(summary: &SceneSummary, settings: &Settings) -> Vec<String> {
    let specular: Vec<_> = summary.metals.iter().chain(&summary.dielectrics).cloned().collect();
    let list = |names: &[String]| names.join(", ");
    let mut notes = left_out(summary, settings);
    if !summary.emissive.is_empty() && summary.emissive_triangles.is_empty() {
        notes.push(format!(
            "shine for the eye alone, light nothing: {}",
            list(&summary.emissive)
        ));
    }
    if settings.tracer_kind == TracerKind::ImageSpace && !summary.dielectrics.is_empty() {
        notes.push(format!(
            "glass whose inside no environment map sees, traced by its outside: {}",
            list(&summary.dielectrics)
        ));
    }
    if !specular.is_empty() && !indirect(summary, settings).0 {
        notes.push(format!(
            "diffuse to the eye where there is no indirect light: {}",
            list(&specular)
        ));
    }
    if settings.indirect_method == IndirectMethod::SurfaceLights && !specular.is_empty() {
        notes.push(format!(
            "seen in {}: light of this frame's photons{}",
            list(&specular),
            if settings.keeps_near() {
                ""
            } else {
                ", with one bounce less"
            }
        ));
    }
    let gathers = matches!(
        settings.indirect_method,
        IndirectMethod::FinalGather | IndirectMethod::IlluminationMaps
    );
    if gathers && !specular.is_empty() {
        notes.push(format!("gathered light does not come by way of {}", list(&specular)));
    }
    if summary.emissive_triangles.len() > MAX_DIRECT_POLYGONS {
        notes.push(format!(
            "{} emissive triangles: a lamp of more than {MAX_DIRECT_POLYGONS} gives the direct light of a rectangle",
            summary.emissive_triangles.len()
        ));
    }
    match (summary.environment_lights, settings.environment_suns) {
        (0, _) => {}
        (_, 0) => notes.push("the environment lights no diffuse surface".to_owned()),
        (_, suns) => notes.push(format!(
            "the environment lights diffuse surfaces as at most {suns} suns{}",
            match settings.first_hits {
                FirstHits::ShadowMaps => ", whose photons start at their middles",
                FirstHits::Traced => "",
            }
        )),
    }
    if summary.lights_with_extent > 0 {
        let photons = match settings.first_hits {
            FirstHits::ShadowMaps => "photons start at the centre, ",
            FirstHits::Traced => "",
        };
        notes.push(format!(
            "{} light(s) with an extent: {photons}irradiance of bulbs and spots is a point's",
            summary.lights_with_extent
        ));
    }
    notes
}

/// What the host keeps from light.
fn left_out(summary: &SceneSummary, settings: &Settings) -> Vec<String> {
    let has_indirect = indirect(summary, settings).0;
    let mut notes = Vec::new();
    if summary.is_part && has_indirect {
        notes.push(
            "light fills a part of the scene: what lies outside gets no photons of suns and no environment maps".into(),
        );
    }
    if summary.out_of_env_maps > 0 && has_indirect {
        notes.push(format!(
            "{} instance(s) in no environment map: photons pass through them, but for first hits in shadow maps",
            summary.out_of_env_maps
        ));
    }
    if summary.without_shadow > 0 && is_lit(summary, settings) {
        notes.push(format!("{} instance(s) without a shadow", summary.without_shadow));
    }
    notes
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for stage in &self.stages {
            let on = if stage.on { "on" } else { "off" };
            writeln!(f, "{:<19} {on:<4} {}", stage.stage.name(), stage.reason)?;
        }
        for note in &self.simplifications {
            writeln!(f, "{:<19} {:<4} {note}", "simplified", "")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::resource::Subsampling;
    use crate::scene::{BoundingSphere, EmissiveTriangle, SceneBounds};
    use glam::DVec3;

    fn summary() -> SceneSummary {
        SceneSummary {
            bounds: SceneBounds::new(DVec3::ZERO, DVec3::ONE).unwrap(),
            area: 6.0,
            is_part: false,
            triangles: 12,
            out_of_env_maps: 0,
            without_shadow: 0,
            total_flux: 1.0,
            lights: 1,
            environment_lights: 0,
            lights_with_extent: 0,
            emissive_triangles: Vec::new(),
            has_reflecting_surfaces: true,
            emissive: Vec::new(),
            metals: Vec::new(),
            dielectrics: Vec::new(),
            specular_bounds: Vec::new(),
        }
    }

    #[test]
    fn indirect_light_needs_lights_reflection_bounces_and_photons() {
        let settings = Settings::balanced();
        let on = |summary: &SceneSummary, settings: &Settings| {
            Plan::for_scene(summary, settings).is_on(Stage::ImageSpaceTracer)
        };
        assert!(on(&summary(), &settings));
        assert!(!on(&SceneSummary { lights: 0, ..summary() }, &settings));
        let black = SceneSummary {
            has_reflecting_surfaces: false,
            ..summary()
        };
        assert!(!on(&black, &settings));
        assert!(!on(
            &summary(),
            &Settings {
                bounces: 0,
                ..settings.clone()
            }
        ));
        assert!(!on(
            &summary(),
            &Settings {
                photons: 0,
                ..settings.clone()
            }
        ));
    }

    #[test]
    fn only_what_the_chosen_tracer_reads_is_made() {
        let on = |tracer_kind, lights| {
            let settings = Settings {
                tracer_kind,
                ..Settings::balanced()
            };
            let plan = Plan::for_scene(&SceneSummary { lights, ..summary() }, &settings);
            let stages = [
                Stage::EnvMapSelector,
                Stage::EnvMapCapture,
                Stage::DepthHierarchyBuild,
                Stage::ImageSpaceTracer,
                Stage::BvhTracer,
            ];
            stages.map(|stage| plan.is_on(stage))
        };
        assert_eq!(on(TracerKind::ImageSpace, 1), [true, true, true, true, false]);
        assert_eq!(on(TracerKind::Bvh, 1), [false, false, false, false, true]);
        assert_eq!(on(TracerKind::Hybrid, 1), [true; 5]);
        assert_eq!(on(TracerKind::Hybrid, 0), [false; 5]);
    }

    #[test]
    fn upsampling_needs_indirect_light_and_pixels_that_are_left_out() {
        let on = |lights, subsampling| {
            let settings = Settings {
                subsampling,
                ..Settings::balanced()
            };
            Plan::for_scene(&SceneSummary { lights, ..summary() }, &settings).is_on(Stage::Upsampler)
        };
        assert!(on(1, Subsampling::Half));
        assert!(!on(0, Subsampling::Half));
        assert!(!on(1, Subsampling::Full));
    }

    #[test]
    fn environments_light_by_as_many_suns_as_settings_give_them() {
        let plan = |lights, environment_lights, environment_suns| {
            let settings = Settings {
                environment_suns,
                ..Settings::balanced()
            };
            let summary = SceneSummary {
                lights,
                environment_lights,
                ..summary()
            };
            Plan::for_scene(&summary, &settings)
        };
        let (dark, one) = (plan(0, 0, 9), plan(1, 0, 9));
        let on = |plan: &Plan| plan.stages.iter().map(|s| s.on).collect::<Vec<_>>();
        assert_eq!(on(&plan(1, 1, 0)), on(&dark));
        assert_eq!(plan(2, 1, 0).stages, one.stages);
        assert!(plan(1, 1, 0).to_string().contains("no light but an environment"));
        assert!(plan(2, 1, 0).to_string().contains("lights no diffuse surface"));
        let lit = plan(1, 1, 9);
        assert!(
            [Stage::DirectLight, Stage::SoftShadow, Stage::PhotonEmitter]
                .iter()
                .all(|&s| lit.is_on(s))
        );
        assert!(lit.to_string().contains("9 sun(s) of the environment"), "{lit}");
        assert!(lit.to_string().contains("at most 9 suns, whose photons"), "{lit}");
        assert!(one.simplifications.is_empty());
    }

    #[test]
    fn surfaces_that_shine_light_the_scene_where_their_triangles_are_known() {
        let lamp = EmissiveTriangle {
            corners: [DVec3::ZERO, DVec3::X, DVec3::Y],
            radiance: [1.0; 3],
        };
        let plan = |emissive_triangles| {
            let summary = SceneSummary {
                lights: 0,
                emissive: vec!["lamp".into()],
                emissive_triangles,
                ..summary()
            };
            Plan::for_scene(&summary, &Settings::balanced())
        };
        let (unknown, known) = (plan(Vec::new()), plan(vec![lamp]));
        let stages = [Stage::DirectLight, Stage::SoftShadow, Stage::PhotonEmitter];
        assert!(stages.iter().all(|&s| known.is_on(s) && !unknown.is_on(s)));
        assert!(known.simplifications.is_empty());
        assert!(
            unknown
                .to_string()
                .contains("shine for the eye alone, light nothing: lamp")
        );
    }

    #[test]
    fn caustics_get_photons_where_something_specular_can_be_aimed_at() {
        let ball = BoundingSphere {
            center: DVec3::ZERO,
            radius: 1.0,
        };
        let on = |metals: &[&str], specular_bounds: &[BoundingSphere], photons| {
            let summary = SceneSummary {
                metals: metals.iter().map(|&m| m.to_owned()).collect(),
                specular_bounds: specular_bounds.to_vec(),
                ..summary()
            };
            let mut settings = Settings::balanced();
            settings.caustic.photons = photons;
            Plan::for_scene(&summary, &settings).is_on(Stage::CausticMap)
        };
        assert!(on(&["chrome"], &[ball], 10));
        assert!(!on(&[], &[ball], 10));
        assert!(!on(&["chrome"], &[], 10));
        assert!(!on(&["chrome"], &[ball], 0));
    }

    #[test]
    fn what_the_host_leaves_out_is_named() {
        let summary = SceneSummary {
            is_part: true,
            out_of_env_maps: 3,
            without_shadow: 2,
            ..summary()
        };
        let count = |lights| {
            let summary = SceneSummary {
                lights,
                ..summary.clone()
            };
            let text = Plan::for_scene(&summary, &Settings::balanced()).to_string();
            let notes = [
                "a part of the scene",
                "3 instance(s) in no environment map",
                "2 instance(s) without",
            ];
            notes.iter().filter(|note| text.contains(*note)).count()
        };
        assert_eq!((count(1), count(0)), (3, 0));
    }

    #[test]
    fn what_is_not_modelled_is_named() {
        let summary = SceneSummary {
            emissive: vec!["ceiling lamp".into()],
            metals: vec!["chrome".into()],
            dielectrics: vec!["window".into()],
            lights_with_extent: 1,
            ..summary()
        };
        let text = Plan::for_scene(&summary, &Settings::balanced()).to_string();
        for name in ["ceiling lamp", "window", "irradiance of bulbs and spots is a point's"] {
            assert!(text.contains(name), "{name} in\n{text}");
        }
    }
}
