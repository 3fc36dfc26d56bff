//! When the selection of environment maps is brought up to date: anew at first and after photons have been traced, then by
//! maintenance while the scene changes, until nothing is left to change.

use crate::pass::{Selection, SelectionStep};
use std::ops::Range;

/// How often places are selected by photons before they are maintained: first by photons that were traced through maps in
/// places chosen by area, then through better ones.
pub(super) const PHOTON_ROUNDS: u32 = 2;

/// Frames in which photons may arrive nowhere before places are left as they are.
const MOST_FAILURES: u32 = 4;

/// Rounds of maintenance after the last change if the selection does not come to rest: by area a round exchanges one map.
const MOST_ROUNDS: u32 = 16;

#[derive(Debug)]
pub(super) struct SelectionSchedule {
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
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Work {
    pub(super) candidates: Range<usize>,
    pub(super) step: SelectionStep,
}

impl SelectionSchedule {
    pub(super) fn new() -> Self {
        Self {
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
        }
    }

    /// Number of the next step.
    pub(super) fn tag(&self) -> u32 {
        self.tag
    }

    /// All that is known is void.
    pub(super) fn restart(&mut self) {
        (self.is_pending, self.is_started, self.failures) = (true, false, 0);
    }

    /// A step was lost: the selection is made once more.
    pub(super) fn repeat(&mut self) {
        self.is_pending = true;
    }

    pub(super) fn geometry_changed(&mut self) {
        if !self.is_started {
            self.is_pending = true;
        } else if self.part == 0 {
            // The first round may be followed by the next change: it drops no map.
            (self.rounds, self.settles_from) = (MOST_ROUNDS, self.tag + 1);
        } else {
            // And part of this round was captured before the change.
            (self.rounds, self.settles_from) = (MOST_ROUNDS + 1, self.tag + 2);
        }
    }

    pub(super) fn lights_changed(&mut self) {
        self.failures = 0;
        self.geometry_changed();
    }

    /// What this frame does about `count` candidates, a round taking `interval` frames. Called once a frame.
    pub(super) fn next_work(&mut self, count: usize, interval: u32, has_photons: bool) -> Option<Work> {
        let is_due = has_photons && self.photon_rounds > 0 && self.photons_in == Some(0);
        self.photons_in = self.photons_in.map(|frames| frames.saturating_sub(1));
        if self.is_pending || is_due {
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
                true if self.tag < self.settles_from => SelectionStep::Maintain,
                true => SelectionStep::Settle,
            },
        })
    }

    /// Notes that a step was recorded, and whether it lacked photons to go by.
    pub(super) fn advance(&mut self, step: SelectionStep, lacked_photons: bool) {
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

    /// Takes note of a result: comes to rest once a step has found nothing to change in the geometry as it is now.
    pub(super) fn settle(&mut self, selection: &Selection) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    const INTERVAL: u32 = 5;

    /// Runs a frame whose steps find nothing to change, or always something; returns what it did.
    fn frame(schedule: &mut SelectionSchedule, is_stable: bool) -> Option<SelectionStep> {
        let work = schedule.next_work(100, INTERVAL, true)?;
        let tag = schedule.tag();
        schedule.advance(work.step, false);
        if work.step != SelectionStep::Capture {
            schedule.settle(&Selection {
                candidates: vec![0],
                centers: vec![Vec3::ZERO],
                coverage: 1.0,
                is_stable,
                swaps: 0,
                tag,
            });
        }
        Some(work.step)
    }

    /// The steps of so many frames, captures left out.
    fn steps(schedule: &mut SelectionSchedule, frames: u32, is_stable: bool) -> Vec<SelectionStep> {
        (0..frames)
            .filter_map(|_| frame(schedule, is_stable))
            .filter(|&step| step != SelectionStep::Capture)
            .collect()
    }

    #[test]
    fn a_stable_selection_of_a_static_scene_rests_at_once() {
        let mut schedule = SelectionSchedule::new();
        assert_eq!(steps(&mut schedule, 40, true), [SelectionStep::Select]);
    }

    #[test]
    fn an_unstable_one_of_a_static_scene_settles_and_rests_in_the_end() {
        let mut schedule = SelectionSchedule::new();
        let steps = steps(&mut schedule, 40 * INTERVAL, false);
        assert_eq!(steps[0], SelectionStep::Select);
        assert_eq!(steps[1..], [SelectionStep::Settle; MOST_ROUNDS as usize]);
    }

    #[test]
    fn maps_are_kept_in_motion_and_dropped_after_it() {
        let mut schedule = SelectionSchedule::new();
        frame(&mut schedule, true);
        for _ in 0..20 * INTERVAL {
            schedule.geometry_changed();
            let step = frame(&mut schedule, true).unwrap();
            assert!(matches!(step, SelectionStep::Capture | SelectionStep::Maintain));
        }
        // The round under way was captured in part before the last change.
        frame(&mut schedule, true);
        schedule.geometry_changed();
        let steps = steps(&mut schedule, 40, true);
        let (settling, moving) = steps.split_last().unwrap();
        assert_eq!(*settling, SelectionStep::Settle);
        assert_eq!(*moving, [SelectionStep::Maintain; 2]);
    }

    #[test]
    fn a_round_captures_every_candidate_once() {
        let mut schedule = SelectionSchedule::new();
        frame(&mut schedule, true);
        schedule.geometry_changed();
        let mut next = 0;
        for _ in 0..INTERVAL {
            let work = schedule.next_work(99, INTERVAL, true).unwrap();
            assert_eq!(work.candidates.start, next);
            next = work.candidates.end;
            schedule.advance(work.step, false);
        }
        assert_eq!(next, 99);
    }

    #[test]
    fn photons_are_gone_by_twice_and_each_time_by_those_of_the_maps_before() {
        let mut schedule = SelectionSchedule::new();
        let mut selects = 0;
        for i in 0..40 {
            let Some(work) = schedule.next_work(100, INTERVAL, i > 0) else {
                continue;
            };
            let tag = schedule.tag();
            schedule.advance(work.step, i == 0);
            selects += u32::from(work.step == SelectionStep::Select);
            schedule.settle(&Selection {
                candidates: vec![0],
                centers: vec![Vec3::ZERO],
                coverage: 1.0,
                is_stable: true,
                swaps: 0,
                tag,
            });
        }
        assert_eq!(selects, 1 + PHOTON_ROUNDS);
    }
}
