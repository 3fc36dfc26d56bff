//! Settings that keep to a budget: along a ladder of settings, each rung slower than the one before and nearer to the truth,
//! by what frames take, or by how far off they are.
//!
//! Between two rungs the number of photons goes from that of the one to that of the other, everything else is as on the lower
//! one. What a place on the ladder takes is known but for the scene: readings are taken to be what the ladder says, each step
//! from rung to rung to a power of its own, times the scene's load. A reading outside of the dead band moves the place by what
//! that says; two readings in a row at different places say what the powers between them are. Where no place keeps to the
//! budget without falling far short of it, as across a rung that takes more at once, the last place within the budget is kept,
//! and the other one tried again after ever longer times.

use super::{Settings, TracerKind, Upsampling};
use crate::Error;

/// What to keep to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Budget {
    /// Time of a frame, in milliseconds, or whatever unit readings have.
    Time(f64),
    /// relMSE of a frame, as in `reference::metrics` and as [`ErrorEstimate`](super::ErrorEstimate) tells it.
    Error(f64),
}

/// Settings, and what they take and gain over those of other rungs.
#[derive(Debug, Clone, PartialEq)]
pub struct Rung {
    /// What to render with.
    pub settings: Settings,
    /// Of a frame, above 0, in any unit, for only ratios count. Rises from rung to rung.
    pub time: f64,
    /// relMSE of a frame, above 0; only ratios count. Falls from rung to rung.
    pub error: f64,
}

/// Chooses settings by readings.
#[derive(Debug, Clone)]
pub struct BudgetController {
    budget: Budget,
    ladder: Vec<Rung>,
    /// On the ladder, from 0 up to its last rung.
    place: f64,
    settings: Settings,
    /// Of the place where it is.
    readings: Vec<f64>,
    /// Logarithm of the first median of them: of another one the load is another one.
    first: Option<f64>,
    /// Whether the place is kept.
    is_near: bool,
    /// The highest place that was too low, and the lowest that was too high, at this load.
    bounds: [Option<f64>; 2],
    /// Readings for which the place beside is left alone, and how many of them there have been.
    patience: [usize; 2],
    /// The place before, and the logarithm of the reading there.
    last: Option<[f64; 2]>,
    /// From each rung to the next: power of what the ladder says that readings are.
    gains: Vec<f64>,
}

/// Readings that a place is left by the median of.
const WINDOW: usize = 3;

/// Readings after a change that do not count: buffers are made, and readings are of frames before.
const SETTLING: usize = 1;

/// Share of a budget that is aimed at.
const AIM: f64 = 0.93;

/// How far readings may be from what is aimed at, as a factor, for a place to be kept.
const NEAR: f64 = 1.06;

/// How far they may go from there once it is kept: readings are noisy.
const DEAD_BAND: f64 = 1.115;

/// Part of the way between two rungs that is no longer halved.
const LEAST_GAP: f64 = 0.05;

/// Readings after which the place beside one that is not near is tried again at first, and at most; twice as many each time.
const PATIENCE: [usize; 2] = [10, 640];

/// Bounds of gains: a load that changes while the place does is taken for one.
const GAINS: [f64; 2] = [0.25, 3.0];

/// Part of a step between rungs that says anything of its gain.
const LEAST_SHARE: f64 = 0.1;

/// Least way along the ladder, as a logarithm, that says anything of gains.
const LEAST_STEP: f64 = 0.1;

impl Rung {
    /// The measured front of splatting by this tracer, from the fastest on: times and errors over those of `fast`, of
    /// `docs/tradeoff.md`.
    pub fn ladder(tracer: TracerKind) -> Vec<Self> {
        let rung = |preset: &dyn Fn() -> Settings, photons: u32, [time, error]: [f64; 2]| Self {
            settings: Settings {
                tracer_kind: tracer,
                photons,
                ..preset()
            },
            time,
            error,
        };
        let (fast, balanced) = (Settings::fast, Settings::balanced);
        let coarse = || Settings {
            upsampling: Upsampling::AtOnce,
            ..balanced()
        };
        match tracer {
            // More photons alone gain nothing where coarse maps err.
            TracerKind::ImageSpace => vec![
                rung(&fast, 15_000, [0.51, 2.0]),
                rung(&fast, 60_000, [1.0, 1.0]),
                rung(&coarse, 120_000, [2.05, 0.7]),
                rung(&coarse, 240_000, [3.5, 0.52]),
                rung(&balanced, 500_000, [7.6, 0.32]),
            ],
            TracerKind::Hybrid => vec![
                rung(&fast, 15_000, [0.53, 2.0]),
                rung(&fast, 60_000, [1.0, 1.0]),
                rung(&coarse, 120_000, [1.8, 0.67]),
                rung(&coarse, 240_000, [3.0, 0.5]),
                rung(&balanced, 500_000, [6.2, 0.27]),
            ],
            TracerKind::Bvh => vec![
                rung(&fast, 15_000, [0.55, 1.7]),
                rung(&fast, 60_000, [1.0, 1.0]),
                rung(&fast, 240_000, [2.6, 0.69]),
                rung(&fast, 400_000, [3.85, 0.63]),
                rung(&balanced, 240_000, [3.9, 0.5]),
                rung(&balanced, 500_000, [6.1, 0.31]),
            ],
        }
    }
}

impl BudgetController {
    /// Begins in the middle of the ladder.
    ///
    /// # Errors
    /// [`Error::InvalidSetting`] for a budget that is not above 0, settings that are not valid, and a ladder without rungs, or
    /// whose times do not rise or errors do not fall from each rung to the next.
    pub fn new(budget: Budget, ladder: Vec<Rung>) -> Result<Self, Error> {
        let invalid = |key: &str, value: String, expected: &str| Error::InvalidSetting {
            key: key.into(),
            value,
            expected: expected.into(),
        };
        let (Budget::Time(most) | Budget::Error(most)) = budget;
        if !(most > 0.0 && most.is_finite()) {
            return Err(invalid("budget", most.to_string(), "above 0"));
        }
        let Some(first) = ladder.first() else {
            return Err(invalid("ladder", "no rung".into(), "one or more"));
        };
        let settings = first.settings.clone();
        for (index, rung) in ladder.iter().enumerate() {
            rung.settings.validate()?;
            let is_positive = [rung.time, rung.error].iter().all(|&v| v > 0.0 && v.is_finite());
            let follows = index == 0 || {
                let last = &ladder[index - 1];
                rung.time > last.time && rung.error < last.error
            };
            if !(is_positive && follows) {
                let expected = "times above 0 that rise, and errors above 0 that fall, from rung to rung";
                return Err(invalid("ladder", format!("rung {index}"), expected));
            }
        }
        let mut controller = Self {
            budget,
            place: 0.5 * (ladder.len() - 1) as f64,
            gains: vec![1.0; ladder.len() - 1],
            ladder,
            settings,
            readings: Vec::new(),
            first: None,
            is_near: false,
            bounds: [None; 2],
            patience: [PATIENCE[0], 0],
            last: None,
        };
        controller.settings = controller.settings_here();
        Ok(controller)
    }

    /// What to render the next frame with.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Where on the ladder that is: 0 for its first rung, 1 for the next, and so on, and between two of them.
    pub fn place(&self) -> f64 {
        self.place
    }

    /// Takes what a frame took, or how far off it is, in the unit of the budget; one call a frame. Returns other settings once
    /// there is reason to change them ([`GiRenderer::set_settings`](super::GiRenderer::set_settings)). A reading that is not a
    /// number above 0 is left out.
    pub fn observe(&mut self, reading: f64) -> Option<&Settings> {
        if !(reading > 0.0 && reading.is_finite()) {
            return None;
        }
        self.readings.push(reading);
        if self.readings.len() < SETTLING + WINDOW {
            return None;
        }
        let mut window = self.readings[self.readings.len() - WINDOW..].to_vec();
        self.readings = window.clone();
        window.sort_by(f64::total_cmp);
        let now = window[WINDOW / 2].ln();
        match self.first {
            None => self.learn(now),
            Some(first) if (now - first).abs() > DEAD_BAND.ln() => {
                self.first = Some(now);
                self.bounds = [None; 2];
                self.patience = [PATIENCE[0], 0];
            }
            Some(_) => {}
        }
        let (Budget::Time(most) | Budget::Error(most)) = self.budget;
        let missing = (AIM * most).ln() - now;
        let band = if self.is_near { DEAD_BAND } else { NEAR };
        self.is_near = missing.abs() <= band.ln();
        if self.is_near {
            self.patience = [PATIENCE[0], 0];
            return None;
        }
        let wanted = self.place_of(self.log_at(self.place) + missing);
        let place = self.next_place(wanted, self.sign() * missing > 0.0);
        if place == self.place {
            return None;
        }
        self.last = Some([self.place, now]);
        self.place = place;
        self.readings.clear();
        self.first = None;
        let settings = self.settings_here();
        let is_other = settings != self.settings;
        self.settings = settings;
        is_other.then_some(&self.settings)
    }

    /// From the first readings after a change: what powers of the ladder they are.
    fn learn(&mut self, now: f64) {
        self.first = Some(now);
        let Some([place, read]) = self.last.take() else { return };
        let expected = self.log_at(self.place) - self.log_at(place);
        if expected.abs() < LEAST_STEP {
            return;
        }
        let [low, high] = [place.min(self.place), place.max(self.place)];
        let ratio = (now - read) / expected;
        for (step, gain) in self.gains.iter_mut().enumerate() {
            // Of the step.
            let share = (high.min(step as f64 + 1.0) - low.max(step as f64)).max(0.0);
            if share >= LEAST_SHARE {
                *gain = (*gain * ratio).clamp(GAINS[0], GAINS[1]);
            }
        }
    }

    /// Where to go from a place that is too low, or too high: to the wanted one, within what is known of this load.
    fn next_place(&mut self, wanted: f64, is_low: bool) -> f64 {
        let [low, high] = self.bounds;
        // What is known of other places and does not agree is of another load.
        self.bounds = if is_low {
            let low = low.map_or(self.place, |low| low.max(self.place));
            [Some(low), high.filter(|&high| high > low)]
        } else {
            let high = high.map_or(self.place, |high| high.min(self.place));
            [low.filter(|&low| low < high), Some(high)]
        };
        let [Some(low), Some(high)] = self.bounds else {
            return wanted;
        };
        if low < wanted && wanted < high {
            wanted
        } else if high - low > LEAST_GAP {
            0.5 * (low + high)
        } else {
            // Within the budget: of times below, of errors above.
            let [within, beside] = match self.budget {
                Budget::Time(_) => [low, high],
                Budget::Error(_) => [high, low],
            };
            self.patience[1] += usize::from(self.place == within);
            if self.patience[1] < self.patience[0] {
                return within;
            }
            self.patience = [(2 * self.patience[0]).min(PATIENCE[1]), 0];
            beside
        }
    }

    /// 1 where readings rise along the ladder, -1 where they fall.
    fn sign(&self) -> f64 {
        match self.budget {
            Budget::Time(_) => 1.0,
            Budget::Error(_) => -1.0,
        }
    }

    /// Logarithm of what each rung takes, as far as the ladder and gains say.
    fn logs(&self) -> Vec<f64> {
        let of = |rung: &Rung| match self.budget {
            Budget::Time(_) => rung.time.ln(),
            Budget::Error(_) => rung.error.ln(),
        };
        let mut logs = vec![of(&self.ladder[0])];
        for (pair, gain) in self.ladder.windows(2).zip(&self.gains) {
            logs.push(logs[logs.len() - 1] + gain * (of(&pair[1]) - of(&pair[0])));
        }
        logs
    }

    /// The rungs below and above a place, and how far it is from the one to the other.
    fn between(&self, place: f64) -> ([usize; 2], f64) {
        let last = self.ladder.len() - 1;
        let below = (place as usize).min(last);
        ([below, (below + 1).min(last)], place - below as f64)
    }

    fn log_at(&self, place: f64) -> f64 {
        let (rungs, part) = self.between(place);
        let logs = self.logs();
        let [below, above] = rungs.map(|rung| logs[rung]);
        below + part * (above - below)
    }

    /// Where that much is taken; an end of the ladder where nothing takes it.
    fn place_of(&self, log: f64) -> f64 {
        let sign = self.sign();
        let logs: Vec<f64> = self.logs().into_iter().map(|log| sign * log).collect();
        let log = sign * log;
        let above = logs.partition_point(|&l| l <= log);
        match above {
            0 => 0.0,
            _ if above == logs.len() => (above - 1) as f64,
            _ => (above - 1) as f64 + (log - logs[above - 1]) / (logs[above] - logs[above - 1]),
        }
    }

    fn settings_here(&self) -> Settings {
        let (rungs, part) = self.between(self.place);
        let [below, above] = rungs.map(|rung| &self.ladder[rung]);
        let photons = |rung: &Rung| f64::from(rung.settings.photons.max(1)).ln();
        // A rung above with fewer is nearer to the truth by other settings.
        let end = photons(below).max(photons(above));
        let between = photons(below) + part * (end - photons(below));
        let photons = match part {
            0.0 => below.settings.photons,
            _ => between.exp().round() as u32,
        };
        Settings {
            photons,
            ..below.settings.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KINDS: &[TracerKind] = if cfg!(feature = "bvh") {
        &[TracerKind::ImageSpace, TracerKind::Hybrid, TracerKind::Bvh]
    } else {
        &[TracerKind::ImageSpace]
    };

    /// A clock: some of a frame does not depend on photons, and no two frames are alike.
    fn frame_ms(settings: &Settings, load: f64, fixed: f64, frame: usize) -> f64 {
        let noise = 1.0 + 0.04 * ((frame * 7919 % 101) as f64 / 50.0 - 1.0);
        load * (fixed + f64::from(settings.photons) / 60_000.0) * noise
    }

    #[test]
    fn a_load_that_doubles_and_halves_is_followed_within_ten_frames_and_no_more() {
        for &kind in KINDS {
            for fixed in [0.05, 0.5, 1.0] {
                let ladder = Rung::ladder(kind);
                let mut controller = BudgetController::new(Budget::Time(10.0), ladder).unwrap();
                let (mut changes, mut since) = (0, 0);
                for frame in 0..400 {
                    let load = [4.0, 8.0, 4.0, 2.0, 4.0, 5.0, 3.0, 4.0][frame / 50];
                    if frame % 50 == 0 {
                        (changes, since) = (0, 0);
                    }
                    let ms = frame_ms(controller.settings(), load, fixed, frame);
                    since += 1;
                    if since > 10 {
                        assert!((8.0..=12.0).contains(&ms), "fixed {fixed}, frame {frame}: {ms}");
                    }
                    if controller.observe(ms).is_some() {
                        changes += 1;
                        assert!(
                            since <= 10 && changes <= 3,
                            "fixed {fixed}, frame {frame}: change {changes}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn a_load_that_changes_before_the_last_was_followed_is_followed_too() {
        for &kind in KINDS {
            for apart in 1..12 {
                let mut controller = BudgetController::new(Budget::Time(10.0), Rung::ladder(kind)).unwrap();
                let loads = [4.0, 12.0, 3.0, 9.0, 2.5, 8.0, 4.0, 6.0, 3.0];
                for frame in 0..80 + apart * loads.len() {
                    let load = loads[(frame / apart).min(loads.len() - 1)];
                    let ms = frame_ms(controller.settings(), load, 0.5, frame);
                    controller.observe(ms);
                    if frame >= 40 + apart * loads.len() {
                        assert!((8.0..=12.0).contains(&ms), "{apart} frames apart, frame {frame}: {ms}");
                    }
                }
            }
        }
    }

    #[test]
    fn what_cannot_be_kept_ends_at_an_end() {
        let ladder = Rung::ladder(KINDS[0]);
        let top = (ladder.len() - 1) as f64;
        for (budget, place) in [(1e-3, 0.0), (1e6, top)] {
            let mut controller = BudgetController::new(Budget::Time(budget), ladder.clone()).unwrap();
            for frame in 0..100 {
                let ms = frame_ms(controller.settings(), 1.0, 0.1, frame);
                controller.observe(ms);
            }
            assert_eq!(controller.place(), place);
        }
    }

    #[test]
    fn a_rung_that_takes_more_at_once_is_left_alone() {
        // What the clock says of `balanced` is 1.4 times more than photons make of it: no place takes 7.2 ms.
        for most in [7.0, 7.4, 8.0, 8.5] {
            let mut controller = BudgetController::new(Budget::Time(most), Rung::ladder(KINDS[0])).unwrap();
            let top = Rung::ladder(KINDS[0]).len() - 1;
            let (mut changes, mut ms) = (0, 0.0);
            for frame in 0..500 {
                let jump = if controller.place() >= top as f64 { 1.4 } else { 1.0 };
                ms = jump * frame_ms(controller.settings(), 1.0, 0.1, frame) * 0.7;
                changes += usize::from(controller.observe(ms).is_some());
            }
            assert!(changes <= 24, "{most}: {changes} changes");
            assert!(ms <= 1.05 * most, "{most}: {ms}");
        }
    }

    #[test]
    fn an_error_is_kept_below_its_bound() {
        let error = |settings: &Settings| 0.01 * (60_000.0 / f64::from(settings.photons)).powf(0.6);
        for (most, rises) in [(0.005, true), (0.012, false)] {
            let mut controller = BudgetController::new(Budget::Error(most), Rung::ladder(KINDS[0])).unwrap();
            let before = controller.settings().photons;
            for _ in 0..40 {
                let error = error(controller.settings());
                controller.observe(error);
            }
            let after = error(controller.settings());
            assert_eq!(controller.settings().photons > before, rises);
            assert!(after <= most && after > 0.75 * most, "{after} of {most}");
        }
    }

    #[test]
    fn bad_budgets_and_ladders_are_named() {
        let ladder = Rung::ladder(KINDS[0]);
        for most in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(BudgetController::new(Budget::Time(most), ladder.clone()).is_err());
        }
        assert!(BudgetController::new(Budget::Time(1.0), Vec::new()).is_err());
        let upside_down: Vec<Rung> = ladder.iter().rev().cloned().collect();
        let error = BudgetController::new(Budget::Time(1.0), upside_down).unwrap_err();
        assert!(error.to_string().contains("rung 1"), "{error}");
        let mut controller = BudgetController::new(Budget::Time(1.0), ladder).unwrap();
        let before = controller.settings().clone();
        for _ in 0..10 {
            assert!(controller.observe(f64::NAN).is_none() && controller.observe(0.0).is_none());
        }
        assert_eq!(*controller.settings(), before);
    }
}
