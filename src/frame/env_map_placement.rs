//! Where environment maps stand, and when the selection of their places is brought up to date.
//!
//! A selection starts with the first frame, by area, and arrives a frame or two later; until then maps stand at the first
//! candidates, those at invalid ones switched off. Once a frame has traced photons, places are selected anew by what these
//! reach. After geometry has changed, a part of the candidates is captured anew
//! each frame, and each full round ends with a maintenance step, until nothing changes any more.

use crate::pass::{
    CoverageMeasure, EnvMapSelector, EnvMapSelectorInputs, EnvMapSelectorResources, EnvMapSelectorSettings,
    SelectBlockingInputs, Selection, SelectionStep,
};
use crate::resource::{CaptureView, EnvMaps, Geometry, Photons};
use crate::scene::{SceneBounds, UnitFrame};
use crate::{Error, Timestamps};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// The region's corners may move by this share of its diagonal before candidates are spread anew: a moving object at the
/// border must not restart the selection every frame.
const REGION_SLACK: f64 = 0.1;

/// How often places are selected by photons before they are maintained: first by photons that were traced through maps in
/// places chosen by area, then through better ones.
pub(super) const PHOTON_ROUNDS: u32 = 2;

/// Frames in which photons may arrive nowhere before places are left as they are.
const MOST_FAILURES: u32 = 4;

/// Rounds of maintenance after the last change if the selection does not come to rest; two to five suffice (Yao et al.
/// 2010, section 4.1).
const MOST_ROUNDS: u32 = 8;

/// Centres of the maps, and the selection that finds them.
#[derive(Debug, Default)]
pub(super) struct EnvMapPlacement {
    /// World space; they outlive the maps. `None`: no result has arrived yet.
    centers: Option<Vec<DVec3>>,
    /// Of the last selection.
    coverage: Option<f32>,
    /// Placed by the host: nothing is selected.
    by_hand: bool,
    /// Allocated while there is indirect light.
    ongoing: Option<OngoingSelection>,
}

#[derive(Debug)]
struct OngoingSelection {
    resources: EnvMapSelectorResources,
    /// What the candidates were spread in.
    region: SceneBounds,
    frame: UnitFrame,
    /// The region as of the last frame.
    last_region: SceneBounds,
    /// Whether the next frame selects anew.
    is_pending: bool,
    /// Selections still to be made by photons.
    photon_rounds: u32,
    /// Frames until the next of them, so that its photons were traced through the maps of the one before; `None`: that has
    /// not arrived yet.
    photons_in: Option<u32>,
    /// Selections by photons that found none so far.
    failures: u32,
    /// The last step that selected anew; what arrives of earlier ones says nothing of it.
    awaited: u32,
    /// Whether there is anything to maintain.
    is_started: bool,
    /// Rounds of maintenance still to go; 0: at rest.
    rounds: u32,
    /// Parts of this round captured so far.
    part: u32,
    /// Number of the next step.
    tag: u32,
    /// The first step that sees the geometry as it is now.
    settles_from: u32,
}

/// One frame's share of a selection.
#[derive(Debug, Clone)]
pub(super) struct Work {
    candidates: Range<usize>,
    step: SelectionStep,
}

/// What a selection needs to know of the frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct SelectionContext<'a> {
    pub(super) device: &'a wgpu::Device,
    pub(super) queue: &'a wgpu::Queue,
    pub(super) frame: &'a UnitFrame,
    pub(super) region: &'a SceneBounds,
    pub(super) settings: &'a EnvMapSelectorSettings,
    /// Most maps.
    pub(super) limit: u32,
}

impl SelectionContext<'_> {
    fn candidates(&self) -> Vec<Vec3> {
        let (min, max) = (self.frame.point(self.region.min), self.frame.point(self.region.max));
        EnvMapSelector::candidates(min, max, self.candidate_count())
    }

    fn goes_by_photons(&self) -> bool {
        self.settings.measure == CoverageMeasure::Photons
    }

    /// As the settings say, and at least as many as there may be maps.
    fn candidate_count(&self) -> u32 {
        self.settings.candidates.max(self.limit)
    }
}

impl EnvMapPlacement {
    /// Follows the scene: allocates while there is indirect light, and starts over when the region has left the one that
    /// candidates were spread in, or the unit frame has changed.
    pub(super) fn follow(&mut self, context: &SelectionContext<'_>, is_needed: bool) -> Result<(), Error> {
        if !is_needed || self.by_hand {
            self.ongoing = None;
            return Ok(());
        }
        let Some(ongoing) = &mut self.ongoing else {
            // Anything may have changed meanwhile: selected anew, and the old places stay in use until that arrives.
            self.ongoing = Some(OngoingSelection::new(context)?);
            return Ok(());
        };
        if !ongoing.fits(context) {
            ongoing.spread_candidates(context)?;
        } else if ongoing.last_region != *context.region {
            ongoing.geometry_changed();
        }
        ongoing.last_region = *context.region;
        Ok(())
    }

    /// Notes that geometry is not as it was in the frame before.
    pub(super) fn geometry_changed(&mut self) {
        if let Some(ongoing) = &mut self.ongoing {
            ongoing.geometry_changed();
        }
    }

    /// Notes that light reaches other places than in the frame before.
    pub(super) fn lights_changed(&mut self) {
        if let Some(ongoing) = &mut self.ongoing {
            ongoing.failures = 0;
            ongoing.geometry_changed();
        }
    }

    /// Places the maps by hand.
    pub(super) fn set_centers(&mut self, centers: &[DVec3]) {
        *self = Self {
            centers: Some(centers.to_vec()),
            by_hand: true,
            ..Self::default()
        };
    }

    /// The centres to use now, unit frame: those placed or selected; the first candidates until there are any.
    pub(super) fn centers(&self, context: &SelectionContext<'_>) -> Vec<Vec3> {
        match &self.centers {
            Some(world) => world.iter().map(|&c| context.frame.point(c)).collect(),
            None => {
                let ongoing = self.ongoing.as_ref();
                let mut candidates =
                    ongoing.map_or_else(|| context.candidates(), |o| o.resources.candidates().to_vec());
                candidates.truncate(context.limit as usize);
                candidates
            }
        }
    }

    /// Share of what valid candidates see that the maps see.
    pub(super) fn coverage(&self) -> Option<f32> {
        self.coverage
    }

    /// Takes over a selection that has arrived since; whether one has.
    pub(super) fn take_selection(&mut self, frame: &UnitFrame) -> bool {
        let Some(ongoing) = &mut self.ongoing else {
            return false;
        };
        if ongoing.resources.take_lost() {
            ongoing.is_pending = true;
        }
        let Some(selection) = ongoing.resources.take_selection() else {
            return false;
        };
        ongoing.settle(&selection);
        self.adopt(&selection, frame);
        true
    }

    fn adopt(&mut self, selection: &Selection, frame: &UnitFrame) {
        // Where nothing is seen from anywhere, the first candidates are as good as any.
        if !selection.centers.is_empty() {
            self.centers = Some(selection.centers.iter().map(|&c| frame.world_point(c)).collect());
            self.coverage = Some(selection.coverage);
        }
    }

    /// What this frame does for the selection, if anything, and whether there are photons for it to go by; adds the views
    /// that it draws.
    pub(super) fn plan_frame(
        &mut self,
        settings: &EnvMapSelectorSettings,
        has_photons: bool,
        views: &mut Vec<CaptureView>,
    ) -> Option<Work> {
        let ongoing = self.ongoing.as_mut()?;
        let work = ongoing.next_work(settings.interval, has_photons);
        ongoing.photons_in = ongoing.photons_in.map(|frames| frames.saturating_sub(1));
        let work = work?;
        views.extend(ongoing.resources.views(work.candidates.clone()));
        Some(work)
    }

    /// Records it. `views` are those that `plan_frame` added, numbered.
    pub(super) fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        selector: &EnvMapSelector,
        inputs: &PlacementInputs<'_>,
    ) {
        let is_provisional = self.centers.is_none();
        let Some(ongoing) = &mut self.ongoing else {
            return;
        };
        let context = inputs.context;
        let selector_inputs = EnvMapSelectorInputs {
            queue: context.queue,
            geometry: inputs.geometry,
            candidates: inputs.work.candidates.clone(),
            views: inputs.views,
            step: inputs.work.step,
            limit: context.limit,
            radius: context.frame.radius(),
            tag: ongoing.tag,
            provisional: is_provisional.then_some(inputs.env_maps),
            photons: inputs.photons.filter(|_| context.goes_by_photons()),
            settings: context.settings,
            timestamps: inputs.timestamps,
        };
        selector.record(encoder, &mut ongoing.resources, &selector_inputs);
        ongoing.advance(inputs.work.step, context.goes_by_photons() && inputs.photons.is_none());
    }

    /// Selects, by what photons of an earlier frame reach if there are any, and waits.
    pub(super) fn select_blocking(
        &mut self,
        selector: &EnvMapSelector,
        context: &SelectionContext<'_>,
        photons: Option<&Photons>,
        geometry: &mut dyn Geometry,
    ) -> Result<(), Error> {
        self.by_hand = false;
        let mut spare = None;
        let ongoing = match &mut self.ongoing {
            Some(ongoing) => ongoing,
            None => spare.insert(OngoingSelection::new(context)?),
        };
        ongoing.spread_candidates(context)?;
        let inputs = SelectBlockingInputs {
            queue: context.queue,
            frame: context.frame,
            limit: context.limit,
            tag: ongoing.tag,
            photons,
            settings: context.settings,
        };
        let selection = selector.select_blocking(&mut ongoing.resources, &inputs, geometry)?;
        ongoing.advance(SelectionStep::Select, context.goes_by_photons() && photons.is_none());
        ongoing.settle(&selection);
        self.adopt(&selection, context.frame);
        Ok(())
    }

    /// Bytes allocated.
    pub(super) fn memory_use(&self) -> u64 {
        self.ongoing.as_ref().map_or(0, |o| o.resources.memory_use())
    }
}

/// What recording one frame's share needs.
#[derive(Clone, Copy)]
pub(super) struct PlacementInputs<'a> {
    pub(super) context: &'a SelectionContext<'a>,
    pub(super) geometry: &'a dyn Geometry,
    pub(super) work: &'a Work,
    pub(super) views: &'a [CaptureView],
    pub(super) env_maps: &'a EnvMaps,
    /// Of an earlier frame.
    pub(super) photons: Option<&'a Photons>,
    pub(super) timestamps: Option<&'a Timestamps>,
}

impl OngoingSelection {
    fn new(context: &SelectionContext<'_>) -> Result<Self, Error> {
        let mut ongoing = Self {
            resources: EnvMapSelectorResources::new(context.device, context.candidate_count())?,
            region: *context.region,
            frame: *context.frame,
            last_region: *context.region,
            is_pending: true,
            photon_rounds: 0,
            photons_in: None,
            failures: 0,
            awaited: 0,
            is_started: false,
            rounds: 0,
            part: 0,
            tag: 1,
            settles_from: 1,
        };
        ongoing.spread_candidates(context)?;
        Ok(ongoing)
    }

    /// Whether the candidates are still well spread.
    fn fits(&self, context: &SelectionContext<'_>) -> bool {
        let slack = REGION_SLACK * 2.0 * self.region.radius();
        let is_near = |a: DVec3, b: DVec3| (a - b).length() <= slack;
        self.frame.maps_like(context.frame)
            && is_near(self.region.min, context.region.min)
            && is_near(self.region.max, context.region.max)
    }

    /// New candidates; what was known of the old ones is void.
    fn spread_candidates(&mut self, context: &SelectionContext<'_>) -> Result<(), Error> {
        self.resources.set_candidates(context.queue, &context.candidates())?;
        (self.region, self.frame) = (*context.region, *context.frame);
        (self.is_pending, self.is_started, self.failures) = (true, false, 0);
        Ok(())
    }

    fn geometry_changed(&mut self) {
        if !self.is_started {
            self.is_pending = true;
        } else if self.part == 0 {
            // The first round drops no map.
            (self.rounds, self.settles_from) = (MOST_ROUNDS, self.tag + 1);
        } else {
            // And part of this round was captured before the change.
            (self.rounds, self.settles_from) = (MOST_ROUNDS + 1, self.tag + 2);
        }
    }

    fn next_work(&self, interval: u32, has_photons: bool) -> Option<Work> {
        let count = self.resources.candidates().len();
        if self.is_pending || (has_photons && self.photon_rounds > 0 && self.photons_in == Some(0)) {
            return Some(Work {
                candidates: 0..count,
                step: SelectionStep::Select,
            });
        }
        if self.rounds == 0 {
            return None;
        }
        let border = |part: u32| count * part as usize / interval as usize;
        let is_last = self.part + 1 >= interval;
        Some(Work {
            candidates: border(self.part)..border(self.part + 1),
            step: match is_last {
                false => SelectionStep::Capture,
                true if self.rounds >= MOST_ROUNDS => SelectionStep::Maintain,
                true => SelectionStep::Settle,
            },
        })
    }

    /// Notes that a step was recorded, and whether it lacked photons to go by.
    fn advance(&mut self, step: SelectionStep, lacked_photons: bool) {
        match step {
            SelectionStep::Capture => {
                self.part += 1;
                return;
            }
            SelectionStep::Select => {
                (self.is_pending, self.is_started, self.awaited) = (false, true, self.tag);
                if lacked_photons {
                    (self.photon_rounds, self.photons_in) = (PHOTON_ROUNDS, None);
                } else {
                    (self.photon_rounds, self.photons_in) = (self.photon_rounds.saturating_sub(1), None);
                }
                (self.rounds, self.settles_from) = (MOST_ROUNDS, self.tag);
            }
            SelectionStep::Maintain | SelectionStep::Settle => self.rounds = self.rounds.saturating_sub(1),
        }
        self.part = 0;
        self.tag += 1;
    }

    /// Comes to rest once a step has found nothing to change in the geometry as it is now.
    fn settle(&mut self, selection: &Selection) {
        if selection.tag < self.awaited {
            return;
        }
        if selection.centers.is_empty() && self.failures < MOST_FAILURES {
            // No photon arrived anywhere, as when the frame that traced them was never submitted.
            self.failures += 1;
            (self.photon_rounds, self.photons_in) = (self.photon_rounds + 1, Some(1));
            return;
        }
        self.photons_in = self.photons_in.or(Some(1));
        if selection.is_stable && selection.tag >= self.settles_from {
            (self.rounds, self.part) = (0, 0);
        }
    }
}
