//! Time and error of a row.

use crate::Arguments;
use crate::common::adapter::Gpu;
use crate::common::clock::Clock;
use crate::common::named_scene;
use crate::common::offline::{Component, Offline};
use crate::common::reference::{Reference, own_noise};
use crate::tables::{Row, Substitute};
use lightfall::frame::Settings;
use lightfall::reference::metrics::{self, Image, Truth};
use lightfall::reference::{PathComponent, PathTracerSettings};
use lightfall::scene::{LightKind, Scene, SceneSummary};
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// Extent of a light that is given one, over the scene's radius; of a sun in radians.
const EXTENT: f64 = 0.02;

pub(crate) struct Measured {
    /// What stood in.
    pub(crate) scene: &'static str,
    pub(crate) triangles: usize,
    pub(crate) size: [u32; 2],
    pub(crate) ms: f64,
    pub(crate) error: Option<Error>,
}

pub(crate) struct Error {
    pub(crate) relmse: f64,
    /// Without its largest hundredth.
    pub(crate) trimmed: f64,
    pub(crate) bias: f64,
    /// What relMSE of the truth would be, against itself.
    pub(crate) noise: f64,
}

impl Error {
    /// Whether it stands out of the truth's noise.
    pub(crate) fn is_seen(&self) -> bool {
        self.relmse > 0.5 * self.noise
    }
}

/// Of a scene, this size, so many bounces, and whether lights were widened.
type Key = (&'static str, [u32; 2], u32, bool);

/// Those traced so far.
#[derive(Default)]
pub(crate) struct Truths(HashMap<Key, (Truth, f64)>);

/// The inner error says why a row was left out.
///
/// # Errors
/// One line that says what failed.
pub(crate) fn measure(
    gpu: &Gpu,
    arguments: &Arguments,
    row: &Row,
    truths: &mut Truths,
) -> Result<Result<Measured, String>, String> {
    let Some((name, scene)) = scene(arguments, row)? else {
        return Ok(Err("no scene for it in --scenes".into()));
    };
    let settings = settings(arguments, row)?;
    let side = |side: u32| f64::from(side) * arguments.scale;
    // Pixels of a square.
    let step = (side(row.size[1]) / f64::from(arguments.means)).round().max(1.0);
    let means = row.size.map(|all| (side(all) / step).round().max(2.0) as u32);
    let step = step as u32;
    let size = means.map(|count| count * step);
    let summary = SceneSummary::of(&scene).map_err(text)?;
    let is_diffuse = summary.metals.is_empty() && summary.dielectrics.is_empty();
    let mut offline = Offline::new(gpu, scene.clone(), &settings, 0, size, Component::Indirect).map_err(text)?;
    let mut clock = Clock::new(gpu);
    clock.settle(gpu, &mut offline)?;
    let own = offline.read().map_err(text)?;
    let mut measured = Measured {
        scene: name,
        triangles: scene.triangle_count(),
        size,
        ms: clock.frame_ms()[0],
        error: None,
    };
    drop(offline);
    if arguments.samples > 0 && is_diffuse {
        let [width, height] = size;
        let own = Truth::new(Image {
            width,
            height,
            rgb: own,
        });
        let own = own.downsampled(step).map_err(text)?.image;
        let key = (name, means, settings.bounces, row.widens_lights);
        let (truth, noise) = match truths.0.entry(key) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => entry.insert(truth(gpu, arguments, scene, key)?),
        };
        let comparison = metrics::compare(&own, truth).map_err(text)?;
        measured.error = Some(Error {
            relmse: comparison.relmse,
            trimmed: comparison.relmse_trimmed,
            bias: comparison.bias,
            noise: *noise,
        });
    }
    gpu.check()?;
    Ok(Ok(measured))
}

fn text(error: lightfall::Error) -> String {
    error.to_string()
}

/// The best stand-in that is there.
fn scene(arguments: &Arguments, row: &Row) -> Result<Option<(&'static str, Scene)>, String> {
    for substitute in row.scenes {
        let (name, path) = match (*substitute, &arguments.scenes) {
            (Substitute::Sample(name), _) => (name, format!("sample:{name}")),
            (Substitute::File(name), Some(folder)) => {
                let path = folder.join(format!("{name}.glb"));
                if !path.exists() {
                    continue;
                }
                (name, path.to_string_lossy().into_owned())
            }
            (Substitute::File(_), None) => continue,
        };
        let mut scene = named_scene::load(&path, 0.0)?;
        if row.widens_lights {
            widen_lights(&mut scene)?;
        }
        return Ok(Some((name, scene)));
    }
    Ok(None)
}

fn widen_lights(scene: &mut Scene) -> Result<(), String> {
    let extent = EXTENT * SceneSummary::of(scene).map_err(text)?.bounds.radius();
    for light in &mut scene.lights {
        match &mut light.kind {
            LightKind::Point { radius, .. } | LightKind::Spot { radius, .. } => *radius = radius.max(extent),
            LightKind::Directional { angle, .. } => *angle = angle.max(EXTENT),
            _ => {}
        }
    }
    Ok(())
}

fn settings(arguments: &Arguments, row: &Row) -> Result<Settings, String> {
    let mut settings = Settings::preset(&arguments.preset)
        .ok_or_else(|| format!("--preset {:?}: expected fast, balanced or accurate", arguments.preset))?;
    settings.frames = 1;
    settings.set("tracer.kind", row.tracer).map_err(text)?;
    for (key, value) in &row.set {
        settings.set(key, value).map_err(text)?;
    }
    Ok(settings)
}

/// With what its relMSE against itself would be.
fn truth(gpu: &Gpu, arguments: &Arguments, scene: Scene, (_, size, bounces, _): Key) -> Result<(Truth, f64), String> {
    let paths = PathTracerSettings {
        component: PathComponent::Indirect,
        bounces,
        ..Default::default()
    };
    let mut reference = Reference::new(gpu, scene, &paths, 0, size).map_err(text)?;
    let estimate = reference.trace(arguments.samples).map_err(text)?;
    let image = Image {
        width: size[0],
        height: size[1],
        rgb: estimate.mean.clone(),
    };
    let truth = Truth {
        standard_error: Some(estimate.standard_error.clone()),
        ..Truth::new(image)
    };
    let noise = own_noise(&estimate, &truth).relative_variance;
    Ok((truth, noise))
}
