//! Which settings are measured.

use crate::Arguments;
use crate::common::offline::Component;
use lightfall::frame::Settings;

/// The knob that is a preset.
pub(crate) const PRESET: &str = "preset";

pub(crate) const PRESETS: [&str; 3] = ["fast", "balanced", "accurate"];

/// What a knob has an effect on.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Concern {
    /// Indirect light, whatever traces photons.
    Any,
    /// Indirect light of photons that are traced through environment maps.
    EnvMaps,
    /// The same, where triangles take over.
    Hybrid,
    /// Indirect light of photons that are traced against triangles alone.
    Triangles,
    /// Direct light of lights with an extent.
    Shadows,
    /// All light where there is metal or glass.
    Specular,
    /// All light of an environment.
    Environment,
}

impl Concern {
    pub(crate) fn component(self) -> Component {
        match self {
            Self::Shadows => Component::Direct,
            Self::Specular | Self::Environment => Component::All,
            Self::Any | Self::EnvMaps | Self::Hybrid | Self::Triangles => Component::Indirect,
        }
    }

    /// Whether it is one by this tracer, which may be the first of those that are wanted.
    fn is_of(self, tracer: &str, is_first: bool) -> bool {
        match self {
            Self::Any | Self::Specular => true,
            Self::EnvMaps => tracer != "bvh",
            Self::Hybrid => tracer == "hybrid",
            Self::Triangles => tracer == "bvh",
            // They are the same whatever traces, or nearly.
            Self::Shadows | Self::Environment => is_first,
        }
    }
}

/// Name of a knob, what it has an effect on, and its values, each of which costs more than the one before, or has no order.
type Knob = (&'static str, Concern, &'static [&'static str]);

#[rustfmt::skip]
const KNOBS: [Knob; 69] = {
    use Concern::{Any, EnvMaps, Environment, Hybrid, Shadows, Specular, Triangles};
    [
        ("photons", Any, &["15000", "30000", "60000", "120000", "240000", "480000"]),
        ("photons.guided", Any, &["0", "0.5"]),
        ("bounces", Any, &["1", "2", "3"]),
        ("tracer.roulette_from", Any, &["1", "2", "4"]),
        ("emission.first_hits", Any, &["shadow-maps", "traced"]),
        ("splatter.photons", Any, &["50", "100", "200", "400", "800"]),
        ("splatter.density", Any, &["hop", "screen"]),
        ("splatter.lowest_density", Any, &["1", "0.5", "0.25", "0.1"]),
        ("splatter.highest_density", Any, &["4", "2", "1"]),
        ("splatter.min_radius", Any, &["0", "1", "2"]),
        ("splatter.max_radius", Any, &["6", "12", "23"]),
        ("splatter.subsampling", Any, &["8", "4", "2", "1"]),
        ("splatter.shape", Any, &["tiled", "quads", "volumes"]),
        ("splatter.kernel", Any, &["constant", "cone", "epanechnikov"]),
        ("splatter.boundary", Any, &["off", "kernel-area"]),
        ("splatter.keeps_to_surfaces", Any, &["false", "true"]),
        ("upsampler.levels", Any, &["at-once", "by-levels"]),
        ("upsampler.disagreement", Any, &["0.4", "0.2", "0.1", "0.05"]),
        ("upsampler.normal_agreement", Any, &["0.25", "0.5", "0.75"]),
        ("upsampler.plane_distance", Any, &["0.05", "0.1", "0.2", "0.4"]),
        ("composite.fused", Any, &["off", "on"]),
        ("env_maps.count", EnvMaps, &["1", "2", "4", "8", "12", "16"]),
        ("env_maps.size", EnvMaps, &["32", "64", "128", "256"]),
        ("env_maps.at_lights", EnvMaps, &["0", "1"]),
        ("selector.candidates", EnvMaps, &["10", "20", "40", "100"]),
        ("selector.measure", EnvMaps, &["area", "photons"]),
        ("selector.coverage_target", EnvMaps, &["0.9", "0.98", "1"]),
        ("selector.interval", EnvMaps, &["20", "5", "1"]),
        (
            "tracer.method",
            EnvMaps,
            &["paper", "plane", "nearest-march", "ordered-march", "nearest-walk", "ordered-walk", "verified-walk"],
        ),
        ("tracer.iterations", EnvMaps, &["2", "3", "5", "8"]),
        ("tracer.most_fetches", Hybrid, &["100", "400", "1600"]),
        ("tracer.doubts_normals", Hybrid, &["false", "true"]),
        ("indirect.method", Triangles, &["splatting", "final-gather", "surface-lights", "illumination-maps"]),
        ("final_gather.rays", Triangles, &["64", "256", "1024"]),
        ("final_gather.map_size", Triangles, &["16", "32", "64"]),
        ("final_gather.photons", Triangles, &["20", "50", "200"]),
        ("final_gather.filter_radius", Triangles, &["0", "1", "2"]),
        ("surface_lights.places", Triangles, &["50", "200", "800"]),
        ("surface_lights.pool", Triangles, &["25000", "100000", "400000"]),
        ("surface_lights.shape", Triangles, &["point", "disc", "square"]),
        ("surface_lights.form", Triangles, &["loop", "drawn", "tiles"]),
        ("surface_lights.shadows", Triangles, &["off", "ambient-occlusion", "some", "all"]),
        ("surface_lights.rays", Triangles, &["8", "32"]),
        ("surface_lights.near_photons", Triangles, &["off", "on"]),
        ("surface_lights.near_kernel", Triangles, &["100", "300", "900"]),
        ("surface_lights.threshold", Triangles, &["0.05", "0.01", "0"]),
        ("illumination_maps.texels", Triangles, &["500", "1000", "2000"]),
        ("illumination_maps.rays", Triangles, &["64", "256", "1024"]),
        ("illumination_maps.reach", Triangles, &["1", "1.5", "2.5"]),
        ("illumination_maps.guided", Triangles, &["0", "0.5"]),
        ("illumination_maps.least_photons", Triangles, &["0", "30", "100"]),
        ("soft_shadow.method", Shadows, &["hard", "pcf", "pcss", "cross", "disc"]),
        ("soft_shadow.test", Shadows, &["shadow-maps", "triangles"]),
        ("soft_shadow.search", Shadows, &["off", "on"]),
        ("soft_shadow.search_taps", Shadows, &["1", "2", "4", "8"]),
        ("soft_shadow.blur_taps", Shadows, &["3", "5", "7", "11"]),
        ("soft_shadow.disc_taps", Shadows, &["16", "32", "128"]),
        ("soft_shadow.rays", Shadows, &["4", "16", "64"]),
        ("soft_shadow.max_radius", Shadows, &["8", "32", "128"]),
        ("soft_shadow.range_scale", Shadows, &["0.5", "1", "2"]),
        ("shadow_maps.size", Shadows, &["128", "256", "512", "1024"]),
        ("caustic.photons", Specular, &["7500", "30000", "120000"]),
        ("caustic.rounds", Specular, &["8", "2", "1"]),
        ("caustic.kernel_photons", Specular, &["10", "40", "160"]),
        ("caustic.min_radius", Specular, &["0", "0.75", "1.5"]),
        ("caustic.method", Specular, &["filter", "splatting"]),
        ("specular.paths", Specular, &["1", "4", "16"]),
        ("specular.surfaces", Specular, &["1", "2", "4"]),
        ("environment.suns", Environment, &["0", "4", "8", "24", "48"]),
    ]
};

/// Settings that a knob has no effect without.
fn implied(knob: &str) -> &'static [(&'static str, &'static str)] {
    match knob {
        "upsampler.disagreement" => &[("upsampler.levels", "by-levels")],
        // Only methods of false position count them.
        "tracer.iterations" => &[("tracer.method", "plane")],
        "soft_shadow.disc_taps" => &[("soft_shadow.method", "disc")],
        "soft_shadow.rays" => &[("soft_shadow.method", "rays")],
        _ if knob.starts_with("final_gather.") => &[("indirect.method", "final-gather")],
        "surface_lights.rays" => &[
            ("indirect.method", "surface-lights"),
            ("surface_lights.shadows", "some"),
        ],
        // Of lights without shadows alone.
        "surface_lights.form" | "surface_lights.threshold" => {
            &[("indirect.method", "surface-lights"), ("surface_lights.shadows", "off")]
        }
        // Marches know neither.
        "tracer.most_fetches" | "tracer.doubts_normals" => &[("tracer.method", "ordered-walk")],
        _ if knob.starts_with("surface_lights.") => &[("indirect.method", "surface-lights")],
        _ if knob.starts_with("illumination_maps.") => &[("indirect.method", "illumination-maps")],
        _ => &[],
    }
}

/// What is measured.
pub(crate) struct Point {
    pub(crate) settings: Settings,
    pub(crate) base: String,
    pub(crate) tracer: String,
    pub(crate) knob: String,
    pub(crate) value: String,
    pub(crate) concern: Concern,
}

impl Point {
    pub(crate) fn name(&self) -> String {
        format!("{}, {} {}", self.tracer, self.knob, self.value)
    }
}

/// Presets with each of the tracers, then the values of all knobs of a preset.
pub(crate) fn points(arguments: &Arguments) -> Result<Vec<Point>, String> {
    let Arguments {
        base, tracers, knobs, ..
    } = arguments;
    let is_wanted = |name: &str| knobs.is_empty() || knobs.iter().any(|k| k == name);
    let known = || KNOBS.iter().map(|k| k.0).chain([PRESET]);
    if let Some(unknown) = knobs.iter().find(|k| known().all(|name| name != k.as_str())) {
        let known: Vec<_> = known().collect();
        return Err(format!("--knobs {unknown:?}: there are {}", known.join(", ")));
    }
    let mut points = Vec::new();
    for tracer in tracers {
        if is_wanted(PRESET) {
            for preset in &arguments.presets {
                points.push(point((preset, tracer), (PRESET, preset), Concern::Any)?);
            }
        }
        for (knob, concern, values) in KNOBS.iter().filter(|k| is_wanted(k.0)) {
            let takes_part = concern.is_of(tracer, tracer == &tracers[0]);
            for value in values.iter().filter(|_| takes_part) {
                points.push(point((base, tracer), (knob, value), *concern)?);
            }
        }
    }
    Ok(points)
}

fn point((base, tracer): (&str, &str), (knob, value): (&str, &str), concern: Concern) -> Result<Point, String> {
    let text = |e: lightfall::Error| e.to_string();
    let mut settings =
        Settings::preset(base).ok_or_else(|| format!("preset {base:?}: expected {}", PRESETS.join(", ")))?;
    settings
        .set("tracer.kind", tracer)
        .map_err(|e| format!("--tracers: {e}"))?;
    for (key, value) in implied(knob) {
        settings.set(key, value).map_err(text)?;
    }
    if knob != PRESET {
        settings.set(knob, value).map_err(text)?;
    }
    Ok(Point {
        settings,
        base: base.into(),
        tracer: tracer.into(),
        knob: knob.into(),
        value: value.into(),
        concern,
    })
}
