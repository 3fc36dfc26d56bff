//! Where environment maps stand.
//!
//! A selection starts with the first frame, by area, and arrives a frame or two later; until then maps stand at the first
//! candidates, those at invalid ones switched off. Once a frame has traced photons, places are selected anew by what these
//! reach. After geometry has changed, a part of the candidates is captured anew each frame, and each full round ends with a
//! maintenance step, until nothing changes any more.

use super::selection_schedule::{SelectionSchedule, Work};
use crate::pass::{
    CoverageMeasure, EnvMapSelector, EnvMapSelectorInputs, EnvMapSelectorResources, EnvMapSelectorSettings,
    SelectBlockingInputs, Selection, SelectionStep,
};
use crate::resource::{CaptureView, EnvMaps, Geometry, Photons};
use crate::scene::{SceneBounds, UnitFrame};
use crate::{Error, Timestamps};
use glam::{DVec3, Vec3};

/// The region's corners may move by this share of its diagonal before candidates are spread anew: a moving object at the
/// border must not restart the selection every frame.
const REGION_SLACK: f64 = 0.1;

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
    schedule: SelectionSchedule,
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
            ongoing.schedule.geometry_changed();
        }
        ongoing.last_region = *context.region;
        Ok(())
    }

    /// Notes that geometry is not as it was in the frame before.
    pub(super) fn geometry_changed(&mut self) {
        if let Some(ongoing) = &mut self.ongoing {
            ongoing.schedule.geometry_changed();
        }
    }

    /// Notes that light reaches other places than in the frame before.
    pub(super) fn lights_changed(&mut self) {
        if let Some(ongoing) = &mut self.ongoing {
            ongoing.schedule.lights_changed();
        }
    }

    /// Selects anew, by other settings; so many of the old places stay in use until that arrives.
    pub(super) fn start_over(&mut self, limit: usize) {
        self.ongoing = None;
        if let Some(centers) = self.centers.as_mut().filter(|centers| centers.len() > limit) {
            centers.truncate(limit);
            self.coverage = None;
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
            ongoing.schedule.repeat();
        }
        let Some(selection) = ongoing.resources.take_selection() else {
            return false;
        };
        ongoing.schedule.settle(&selection);
        self.adopt(&selection, frame);
        true
    }

    fn adopt(&mut self, selection: &Selection, frame: &UnitFrame) {
        // Where nothing is seen from anywhere, the first candidates are as good as any.
        if !selection.centers.is_empty() {
            let centers = selection.centers.iter().map(|&c| frame.world_point(c)).collect();
            self.centers = Some(in_place(self.centers.as_deref().unwrap_or(&[]), centers));
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
        let count = ongoing.resources.candidates().len();
        let work = ongoing.schedule.next_work(count, settings.interval, has_photons)?;
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
            tag: ongoing.schedule.tag(),
            provisional: is_provisional.then_some(inputs.env_maps),
            photons: inputs.photons.filter(|_| context.goes_by_photons()),
            settings: context.settings,
            timestamps: inputs.timestamps,
        };
        selector.record(encoder, &mut ongoing.resources, &selector_inputs);
        ongoing
            .schedule
            .advance(inputs.work.step, context.goes_by_photons() && inputs.photons.is_none());
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
            tag: ongoing.schedule.tag(),
            photons,
            settings: context.settings,
        };
        let selection = selector.select_blocking(&mut ongoing.resources, &inputs, geometry)?;
        ongoing
            .schedule
            .advance(SelectionStep::Select, context.goes_by_photons() && photons.is_none());
        ongoing.schedule.settle(&selection);
        self.adopt(&selection, context.frame);
        Ok(())
    }

    /// Bytes allocated.
    pub(super) fn memory_use(&self) -> u64 {
        self.ongoing.as_ref().map_or(0, |o| o.resources.memory_use())
    }
}

/// The new centres in an order in which those that stay keep their places, and with these their maps' contents.
fn in_place(old: &[DVec3], new: Vec<DVec3>) -> Vec<DVec3> {
    let mut placed = vec![None; new.len()];
    let mut others = Vec::new();
    for center in new {
        match old.iter().position(|&o| o == center).and_then(|i| placed.get_mut(i)) {
            Some(place @ None) => *place = Some(center),
            _ => others.push(center),
        }
    }
    let mut others = others.into_iter();
    placed
        .into_iter()
        .filter_map(|place| place.or_else(|| others.next()))
        .collect()
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
            schedule: SelectionSchedule::new(),
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
        self.schedule.restart();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_that_stay_keep_their_places() {
        let [a, b, c, d, e] = [1.0, 2.0, 3.0, 4.0, 5.0].map(DVec3::splat);
        assert_eq!(in_place(&[], vec![a, b]), [a, b]);
        // One is dropped: the last takes its place.
        assert_eq!(in_place(&[a, b, c, d], vec![a, c, d]), [a, d, c]);
        // One is exchanged, one added.
        assert_eq!(in_place(&[a, b, c], vec![a, c, d, e]), [a, d, c, e]);
        assert_eq!(in_place(&[a, b], vec![]), []);
    }
}
