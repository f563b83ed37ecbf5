//! Robots that lose their pose, or start without one, in floor plans at the fidelity of pins: whether the loop's search
//! brings them back.
//!
//! The robot is carried along its path while its wheels do not roll, either at the start, whose pose it does not have, or
//! while it tracks its pose. Drivers, loop, wheels and furniture are those of the simulated floor plan.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use sonarfix::health::Verdict;
use sonarfix::localizer::{Fix, Localizer};
use sonarfix_hal::config::StartPose;
use sonarfix_hal::robot::Report;
use sonarfix_map::{FileError, Path};
use sonarfix_search::navigator::Mode;
use sonarfix_sim::angle;
use sonarfix_sim::progress::Progress;
use sonarfix_sim::simulate::{Simulation, SimulationError};
use sonarfix_sim::trace::{FixRecord, Recorder, Tick};

use crate::floor_plan::FloorPlan;

/// A pose within these errors is right, metres and radians.
const RIGHT: (f64, f64) = (0.3, 0.175);
/// When a robot is kidnapped or slips, seconds.
const UPSET_AT: f64 = 30.0;
/// Pings after a hand-over when the pose must be right.
const SETTLED: u32 = 20;

/// What happens to the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Upset {
    /// It starts anywhere on its path without a pose.
    UnknownStart,
    /// It is carried so far along its path while it tracks its pose, metres.
    Kidnapped(f64),
    /// One of its wheels slips while it tracks its pose, which turns the odometry by this angle, radians.
    Slipped(f64),
}

/// Why a trial cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum RelocalizationError {
    /// The floor plan cannot be read.
    #[error(transparent)]
    Plan(#[from] FileError),
    /// The run failed.
    #[error(transparent)]
    Run(#[from] SimulationError),
}

/// A hand-over of the search's answer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct HandOver {
    /// Seconds since the upset.
    pub after: f64,
    /// Position error, metres.
    pub position_error: f64,
    /// Heading error, radians.
    pub heading_error: f64,
    /// Whether the pose was right.
    pub is_right: bool,
    /// Whether it was right and `Tracking` 20 pings later; `None` if the run ended before.
    pub is_right_later: Option<bool>,
}

/// The outcome of one trial.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trial {
    /// Seed of the trial.
    pub seed: u64,
    /// Walls of the map.
    pub walls: usize,
    /// Seconds from the upset to the first search; `None` if the loss was not noticed.
    pub searched_after: Option<f64>,
    /// Whether the pose was right and `Tracking` when the robot was kidnapped; `None` of a start without a pose.
    pub was_tracking: Option<bool>,
    /// Every hand-over.
    pub hand_overs: Vec<HandOver>,
    /// Whether a provisional pose was confirmed that was wrong then.
    pub confirmed_wrong: bool,
    /// Whether at the end the pose is right and the verdict not `Lost`.
    pub is_back: bool,
    /// Whether at the end the pose is wrong and the verdict `Tracking`.
    pub is_wrong_and_tracking: bool,
}

/// Makes one trial, in the floor plan of its seed; `seconds` are those after the upset. `None` if the path of the plan is
/// too short for it.
///
/// # Errors
/// [`RelocalizationError`], if the plan cannot be run.
pub fn trial(seed: u64, upset: Upset, seconds: f64) -> Result<Option<Trial>, RelocalizationError> {
    let mut scenario = FloorPlan::new(seed).scenario()?;
    scenario.robot.start = StartPose::Unknown { region: None };
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(110);
    let spare = scenario.path.duration() - seconds;
    scenario.start.is_unknown = upset == Upset::UnknownStart;
    let at = if scenario.start.is_unknown { 0.0 } else { UPSET_AT };
    let walls = scenario.floor.named_walls().len();
    let carried_by = match upset {
        Upset::UnknownStart if spare > 1.0 => Some(rng.random_range(0.0..spare)),
        Upset::UnknownStart => Some(0.0),
        Upset::Kidnapped(metres) => carried_by(&scenario.path, metres, spare),
        Upset::Slipped(_) => None,
    };
    let simulation = Simulation::new(scenario);
    let simulation = match (upset, carried_by) {
        (_, Some(by)) => simulation.carried(at, by),
        (Upset::Slipped(turn), None) if spare > at => {
            simulation.slipped(at, usize::from(rng.random::<bool>()), turn)
        }
        // The path is too short.
        (_, None) => return Ok(None),
    };
    let simulation = simulation.shortened(at + seconds);
    let mut watch = Watch::new(at, upset == Upset::UnknownStart);
    simulation.run(seed, &mut watch)?;
    Ok(Some(watch.trial(seed, walls)))
}

/// The time of driving after which the robot is this far from where it is at [`UPSET_AT`], in a straight line.
fn carried_by(path: &Path, metres: f64, spare: f64) -> Option<f64> {
    const STEP: f64 = 0.25;
    let from = path.pose_at(UPSET_AT);
    let mut by = STEP;
    while by < spare - UPSET_AT {
        let to = path.pose_at(UPSET_AT + by);
        if (to.x - from.x).hypot(to.y - from.y) >= metres {
            return Some(by);
        }
        by += STEP;
    }
    None
}

/// Watches a run.
struct Watch {
    /// Time of the upset.
    at: f64,
    mode: Mode,
    verdict: Verdict,
    /// Changes of the mode since the last tick, whose error is not known yet.
    changed: Option<(Mode, Mode)>,
    searched_after: Option<f64>,
    was_tracking: Option<bool>,
    hand_overs: Vec<HandOver>,
    /// Pings since the last hand-over.
    pings: u32,
    confirmed_wrong: bool,
    is_right: bool,
}

impl Watch {
    fn new(at: f64, searches: bool) -> Self {
        Self {
            at,
            mode: if searches { Mode::Searching } else { Mode::Tracking },
            verdict: Verdict::Tracking,
            changed: None,
            searched_after: searches.then_some(0.0),
            was_tracking: None,
            hand_overs: Vec::new(),
            pings: 0,
            confirmed_wrong: false,
            is_right: false,
        }
    }

    fn trial(self, seed: u64, walls: usize) -> Trial {
        let has_pose = self.mode != Mode::Searching;
        Trial {
            seed,
            walls,
            searched_after: self.searched_after,
            was_tracking: self.was_tracking,
            hand_overs: self.hand_overs,
            confirmed_wrong: self.confirmed_wrong,
            is_back: self.is_right && has_pose && self.verdict != Verdict::Lost,
            is_wrong_and_tracking: !self.is_right && has_pose && self.verdict == Verdict::Tracking,
        }
    }
}

impl Recorder for Watch {
    fn tick(&mut self, make: impl FnOnce() -> Tick) {
        let Tick { time, truth: Some(truth), estimate, .. } = make() else { return };
        let (truth, found) = (truth.pose, estimate.pose);
        let position_error = (found.x - truth.x).hypot(found.y - truth.y);
        let heading_error = angle::wrap(found.heading - truth.heading).abs();
        self.is_right = position_error < RIGHT.0 && heading_error < RIGHT.1;
        let (after, is_right) = (time - self.at, self.is_right);
        match self.changed.take() {
            Some((_, Mode::Searching)) if after >= 0.0 => {
                self.searched_after.get_or_insert(after);
            }
            Some((_, Mode::Provisional)) => {
                let is_right_later = None;
                self.pings = 0;
                self.hand_overs.push(HandOver {
                    after,
                    position_error,
                    heading_error,
                    is_right,
                    is_right_later,
                });
            }
            Some((Mode::Provisional, Mode::Tracking)) => self.confirmed_wrong |= !is_right,
            _ => {}
        }
        let is_tracking = self.mode != Mode::Searching && self.verdict == Verdict::Tracking;
        if time < self.at {
            self.was_tracking = Some(is_right && is_tracking);
        }
        if let Some(last) = self.hand_overs.last_mut()
            && last.is_right_later.is_none()
            && (self.pings >= SETTLED || self.mode == Mode::Searching)
        {
            last.is_right_later = Some(is_right && is_tracking);
        }
    }

    fn fix(&mut self, _: impl FnOnce() -> FixRecord) {}

    fn polled(&mut self, report: &Report, localizer: &Localizer) {
        self.verdict = localizer.health().verdict;
        let fix = report.ping_result.and_then(|heard| heard.fix);
        self.pings += u32::from(fix.is_some_and(|fix| !matches!(fix, Fix::Refused(_))));
        if let Some(mode) = report.mode {
            self.changed = Some((self.mode, mode));
            self.mode = mode;
        }
    }
}

/// Makes the trials of the seeds from `first` on; after an interruption those that have begun.
///
/// # Errors
/// [`RelocalizationError`] of the first plan that cannot be run.
pub fn trials(
    first: u64,
    count: u32,
    upset: Upset,
    seconds: f64,
    progress: &impl Progress,
) -> Result<Vec<Trial>, RelocalizationError> {
    let seeds = (0..u64::from(count)).into_par_iter().map(|n| first.wrapping_add(n));
    let seeds = seeds.filter(|_| !progress.is_interrupted());
    let one = |seed| {
        let trial = trial(seed, upset, seconds);
        progress.finished();
        trial
    };
    let made: Result<Vec<_>, _> = seeds.map(one).collect();
    Ok(made?.into_iter().flatten().collect())
}

/// Shares over many trials.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Summary {
    /// Trials.
    pub trials: usize,
    /// Share in which the loss was noticed.
    pub searched: f64,
    /// Share with a hand-over of a right pose first.
    pub first_right: f64,
    /// Share with a hand-over of a wrong pose first.
    pub first_wrong: f64,
    /// Share that was right and `Tracking` when it was kidnapped, to compare with; `None` of starts without a pose.
    pub was_tracking: Option<f64>,
    /// Share of the right hand-overs after which the pose was right and `Tracking` 20 pings later.
    pub right_later: f64,
    /// Share in which a wrong pose was confirmed.
    pub confirmed_wrong: f64,
    /// Share with the right pose at the end.
    pub back: f64,
    /// Share with the right pose at the end without a search.
    pub kept: f64,
    /// Share that ends with a wrong pose and the verdict `Tracking`.
    pub wrong_and_tracking: f64,
    /// Mean time to the first hand-over, seconds.
    pub mean_seconds: f64,
    /// 95th percentile of the position error at right hand-overs, metres.
    pub position_error_95: f64,
    /// 95th percentile of their heading error, radians.
    pub heading_error_95: f64,
}

impl Summary {
    /// The summary of some trials.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 trials")]
    pub fn new(trials: &[Trial]) -> Self {
        let share = |is: &dyn Fn(&Trial) -> bool| {
            trials.iter().filter(|trial| is(trial)).count() as f64 / trials.len() as f64
        };
        let first = |trial: &Trial| trial.hand_overs.first().copied();
        let right: Vec<_> =
            trials.iter().flat_map(|t| &t.hand_overs).filter(|h| h.is_right).collect();
        let later: Vec<_> = right.iter().filter_map(|h| h.is_right_later).collect();
        let held = later.iter().filter(|held| **held).count();
        let firsts: Vec<f64> = trials.iter().filter_map(first).map(|h| h.after).collect();
        Self {
            trials: trials.len(),
            searched: share(&|trial| trial.searched_after.is_some()),
            first_right: share(&|trial| first(trial).is_some_and(|h| h.is_right)),
            first_wrong: share(&|trial| first(trial).is_some_and(|h| !h.is_right)),
            was_tracking: trials
                .iter()
                .any(|trial| trial.was_tracking.is_some())
                .then(|| share(&|trial| trial.was_tracking == Some(true))),
            right_later: held as f64 / later.len() as f64,
            confirmed_wrong: share(&|trial| trial.confirmed_wrong),
            back: share(&|trial| trial.is_back),
            kept: share(&|trial| trial.is_back && trial.searched_after.is_none()),
            wrong_and_tracking: share(&|trial| trial.is_wrong_and_tracking),
            mean_seconds: firsts.iter().sum::<f64>() / firsts.len() as f64,
            position_error_95: percentile_95(right.iter().map(|h| h.position_error).collect()),
            heading_error_95: percentile_95(right.iter().map(|h| h.heading_error).collect()),
        }
    }
}

fn percentile_95(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() * 95 / 100).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The short form of `sonarfix-studies relocalize --slipped`; docs/schedule.md has more trials.
    #[test]
    fn a_slip_is_corrected_or_leads_to_a_search() {
        let trials = |degrees: f64| {
            let upset = Upset::Slipped(degrees.to_radians());
            trials(0, 6, upset, 60.0, &|| {}).unwrap()
        };
        let small = trials(5.0);
        assert!(small.iter().all(|trial| trial.is_back && trial.searched_after.is_none()));
        // Beyond the cone the beams that should be square to a wall return no echo.
        let large = trials(25.0);
        assert!(large.iter().any(|trial| trial.searched_after.is_some()), "{large:?}");
        assert!(large.iter().filter(|trial| trial.is_back).count() >= 5, "{large:?}");
        assert!(large.iter().all(|trial| !trial.is_wrong_and_tracking), "{large:?}");
    }
}
