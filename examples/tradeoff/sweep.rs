//! Which settings are measured.

use crate::Arguments;
use lightfall::frame::Settings;

/// The knob that is a preset.
pub(crate) const PRESET: &str = "preset";

pub(crate) const PRESETS: [&str; 3] = ["fast", "balanced", "accurate"];

/// What a knob has an effect on.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Concern {
    /// Indirect light, whatever traces photons.
    Any,
    /// Indirect light of photons that are traced through environment maps.
    EnvMaps,
    /// The same of photons that are traced against triangles alone.
    Triangles,
    /// Direct light of lights with an extent.
    Shadows,
}

/// Name of a knob, what it has an effect on, and its values, each of which costs more than the one before, or has no order.
const KNOBS: [(&str, Concern, &[&str]); 21] = [
    (
        "photons",
        Concern::Any,
        &["15000", "30000", "60000", "120000", "240000", "480000"],
    ),
    ("bounces", Concern::Any, &["1", "2", "3"]),
    ("splatter.photons", Concern::Any, &["50", "100", "200", "400", "800"]),
    ("splatter.subsampling", Concern::Any, &["8", "4", "2", "1"]),
    ("splatter.shape", Concern::Any, &["tiled", "quads", "volumes"]),
    ("splatter.kernel", Concern::Any, &["constant", "cone", "epanechnikov"]),
    ("splatter.boundary", Concern::Any, &["off", "kernel-area"]),
    ("upsampler.levels", Concern::Any, &["at-once", "by-levels"]),
    ("emission.first_hits", Concern::Any, &["shadow-maps", "traced"]),
    ("env_maps.count", Concern::EnvMaps, &["1", "2", "4", "8", "12", "16"]),
    ("env_maps.size", Concern::EnvMaps, &["32", "64", "128", "256"]),
    ("selector.candidates", Concern::EnvMaps, &["10", "20", "40", "100"]),
    (
        "tracer.method",
        Concern::EnvMaps,
        &[
            "paper",
            "plane",
            "nearest-march",
            "ordered-march",
            "nearest-walk",
            "ordered-walk",
            "verified-walk",
        ],
    ),
    ("tracer.iterations", Concern::EnvMaps, &["2", "3", "5", "8"]),
    (
        "indirect.method",
        Concern::Triangles,
        &["splatting", "final-gather", "surface-lights", "illumination-maps"],
    ),
    ("surface_lights.rays", Concern::Triangles, &["8", "32"]),
    ("illumination_maps.texels", Concern::Triangles, &["500", "1000", "2000"]),
    (
        "soft_shadow.method",
        Concern::Shadows,
        &["hard", "pcf", "pcss", "cross", "disc"],
    ),
    ("soft_shadow.search_taps", Concern::Shadows, &["1", "2", "4", "8"]),
    ("soft_shadow.blur_taps", Concern::Shadows, &["3", "5", "7", "11"]),
    ("shadow_maps.size", Concern::Shadows, &["128", "256", "512", "1024"]),
];

/// Settings that a knob has no effect without.
fn implied(knob: &str) -> &'static [(&'static str, &'static str)] {
    match knob {
        "surface_lights.rays" => &[("indirect.method", "surface-lights")],
        "illumination_maps.texels" => &[("indirect.method", "illumination-maps")],
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
    /// Of direct light; else of indirect light.
    pub(crate) is_direct: bool,
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
                points.push(point((preset, tracer), (PRESET, preset), false)?);
            }
        }
        for (knob, concern, values) in KNOBS.iter().filter(|k| is_wanted(k.0)) {
            let takes_part = match concern {
                Concern::Any => true,
                Concern::EnvMaps => tracer != "bvh",
                Concern::Triangles => tracer == "bvh",
                // They are the same whatever traces.
                Concern::Shadows => tracer == &tracers[0],
            };
            for value in values.iter().filter(|_| takes_part) {
                points.push(point((base, tracer), (knob, value), *concern == Concern::Shadows)?);
            }
        }
    }
    Ok(points)
}

fn point((base, tracer): (&str, &str), (knob, value): (&str, &str), is_direct: bool) -> Result<Point, String> {
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
        is_direct,
    })
}
