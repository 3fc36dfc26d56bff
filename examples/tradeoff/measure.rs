//! Error and time of a point.

use crate::Arguments;
use crate::common::adapter::Gpu;
use crate::common::clock::Clock;
use crate::common::offline::{Component, Offline};
use crate::common::reference::Reference;
use crate::common::truth_file;
use crate::rows::Row;
use crate::sweep::{Concern, Point};
use lightfall::frame::{IndirectMethod, Settings};
use lightfall::pass::HopStatistics;
use lightfall::reference::metrics::{self, Image, Truth};
use lightfall::reference::{PathComponent, PathTracerSettings};
use lightfall::scene::{Scene, SceneSummary};

/// Errors below it are noise of the truth.
const LEAST_ERROR: f64 = 1e-6;

/// A scene, and its truths as they come to be needed.
pub(crate) struct Subject<'a> {
    gpu: &'a Gpu,
    arguments: &'a Arguments,
    name: &'a str,
    scene: Scene,
    truths: Vec<(TruthKind, Truth)>,
}

/// What a truth is of.
#[derive(Clone, Copy, PartialEq, Eq)]
struct TruthKind {
    component: Component,
    spans_pixel: bool,
    bounces: u32,
}

impl<'a> Subject<'a> {
    pub(crate) fn new(gpu: &'a Gpu, arguments: &'a Arguments, name: &'a str, scene: Scene) -> Self {
        Self {
            gpu,
            arguments,
            name,
            scene,
            truths: Vec::new(),
        }
    }

    /// Whether a point is of anything here: shadows are where lights have an extent. A truth from a file is of indirect light.
    pub(crate) fn concerns(&self, point: &Point) -> bool {
        let is_in_scene = |is: fn(&SceneSummary) -> bool| SceneSummary::of(&self.scene).is_ok_and(|s| is(&s));
        let is_there = match point.concern {
            Concern::Shadows => is_in_scene(|s| s.lights_with_extent > 0),
            Concern::Specular => is_in_scene(|s| !(s.metals.is_empty() && s.dielectrics.is_empty())),
            Concern::Environment => is_in_scene(|s| s.environment_lights > 0),
            Concern::Any | Concern::EnvMaps | Concern::Hybrid | Concern::Triangles => true,
        };
        is_there && (self.arguments.truth.is_none() || point.concern.component() == Component::Indirect)
    }

    /// A row without figures.
    pub(crate) fn unmeasured(&self, point: &Point) -> Row {
        let arguments = self.arguments;
        Row {
            adapter: self.gpu.info.name.clone(),
            scene: self.name.into(),
            size: arguments.size,
            truth: match &arguments.truth {
                Some(path) => path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
                None => format!("{} paths", arguments.samples),
            },
            component: format!("{:?}", point.concern.component()).to_lowercase(),
            base: point.base.clone(),
            tracer: point.tracer.clone(),
            knob: point.knob.clone(),
            value: point.value.clone(),
            ..Row::default()
        }
    }

    pub(crate) fn measure(&mut self, point: &Point) -> Result<Row, String> {
        let mut clock = Clock::new(self.gpu);
        let mut offline = self.offline(point)?;
        for _ in 0..point.settings.frames {
            clock.frame(self.gpu, &mut offline)?;
        }
        let own = offline.read().map_err(|e| e.to_string())?;
        if point.settings.frames == 1 {
            for _ in 0..frames_gathering(&point.settings) {
                offline.render_frame(None).map_err(|e| e.to_string())?;
            }
            for _ in 0..self.arguments.rounds {
                clock.frame(self.gpu, &mut offline)?;
            }
        }
        let statistics = offline.statistics().map_err(|e| e.to_string())?;
        let is_indirect = point.concern.component() == Component::Indirect;
        let estimate = match is_indirect {
            true => offline.estimate_error().map_err(|e| e.to_string())?,
            false => None,
        };
        drop(offline);
        self.gpu.check()?;
        let comparison = metrics::compare(&self.image(own), self.truth(point)?).map_err(|e| e.to_string())?;
        if !comparison.finite {
            return Err(format!("{}, {}: the picture is not finite", self.name, point.name()));
        }
        Ok(Row {
            ms: clock.frame_ms()[0] * f64::from(point.settings.frames),
            // The truth's own noise, taken out, may leave less than nothing.
            relmse: comparison.relmse.max(LEAST_ERROR),
            bias: comparison.bias,
            noise: estimate.map(|e| e.noise),
            blur: estimate.map(|e| e.blur),
            unconfirmed: is_indirect.then(|| unconfirmed(&statistics)),
            ..self.unmeasured(point)
        })
    }

    fn offline(&self, point: &Point) -> Result<Offline<'a>, String> {
        let component = point.concern.component();
        let size = [self.arguments.size; 2];
        let mut offline = Offline::new(self.gpu, self.scene.clone(), &point.settings, 0, size, component)
            .map_err(|e| e.to_string())?;
        offline.stand_still();
        Ok(offline)
    }

    fn image(&self, rgb: Vec<[f32; 3]>) -> Image {
        Image {
            width: self.arguments.size,
            height: self.arguments.size,
            rgb,
        }
    }

    fn truth(&mut self, point: &Point) -> Result<&Truth, String> {
        let kind = TruthKind {
            component: point.concern.component(),
            spans_pixel: point.settings.frames > 1,
            // Of a knob that is turned the base's.
            bounces: Settings::preset(&point.base).map_or(0, |base| base.bounces),
        };
        if let Some(index) = self.truths.iter().position(|(other, _)| *other == kind) {
            return Ok(&self.truths[index].1);
        }
        let truth = match &self.arguments.truth {
            Some(path) => {
                let truth = truth_file::read_truth(path)?;
                let factor = truth.image.width / self.arguments.size;
                truth
                    .downsampled(factor.max(1))
                    .map_err(|e| format!("{}: {e}", path.display()))?
            }
            None => self.traced(kind)?,
        };
        self.truths.push((kind, truth));
        Ok(&self.truths[self.truths.len() - 1].1)
    }

    fn traced(&self, kind: TruthKind) -> Result<Truth, String> {
        let paths = PathTracerSettings {
            component: match kind.component {
                Component::All => PathComponent::All,
                Component::Direct => PathComponent::Direct,
                Component::Indirect => PathComponent::Indirect,
                Component::Caustic => PathComponent::Caustic,
                Component::Specular => PathComponent::Specular,
            },
            bounces: kind.bounces,
            spans_pixel: kind.spans_pixel,
            ..Default::default()
        };
        let size = [self.arguments.size; 2];
        let mut reference = Reference::new(self.gpu, self.scene.clone(), &paths, 0, size).map_err(|e| e.to_string())?;
        reference.truth(self.arguments.samples).map_err(|e| e.to_string())
    }
}

/// Frames until an illumination map has gathered each texel, on both sides, three more times: until then it still gathers.
fn frames_gathering(settings: &Settings) -> u32 {
    let own = &settings.illumination_maps;
    match settings.indirect_method {
        IndirectMethod::IlluminationMaps => (6 * own.texels).div_ceil(own.gather.a_frame.max(1)),
        _ => 0,
    }
}

/// Share of the flux that surfaces sent out.
fn unconfirmed(hops: &[HopStatistics]) -> f64 {
    let sum = |of: fn(&HopStatistics) -> [f32; 3]| -> f64 { hops.iter().skip(1).flat_map(of).map(f64::from).sum() };
    let emitted = sum(|h| h.emitted);
    if emitted > 0.0 {
        (sum(|h| h.lost) + sum(|h| h.tentative)) / emitted
    } else {
        0.0
    }
}
