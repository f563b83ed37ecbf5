//! Starts without a pose at places along a path: from where the search finds the pose, and after how many metres.

use rayon::prelude::*;
use serde::Serialize;
use sonarfix_map::{Movement, Path, PathError, PathPlan, PathPose, Scenario};
use sonarfix_sim::progress::Progress;

use crate::trial::{SetDown, Trial, TrialError, trial};

/// The starts on one leg of the path, or on all of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Share {
    /// Starts.
    pub starts: usize,
    /// Share that became unique at the right pose.
    pub right: f64,
    /// Share that became unique at a wrong pose.
    pub wrong: f64,
    /// Median of the metres driven until the right answer; `None` if more than half of the starts had none.
    pub median_metres: Option<f64>,
    /// The metres after which nine in ten of the starts were right; `None` if fewer were.
    pub most_metres: Option<f64>,
}

/// The starts on a leg.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LegShare {
    /// Start of the leg, metres.
    pub from: [f64; 2],
    /// End of the leg, metres.
    pub to: [f64; 2],
    /// Its starts.
    #[serde(flatten)]
    pub share: Share,
}

/// What starts without a pose lead to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Starts {
    /// Longest time of driving, seconds.
    pub seconds: f64,
    /// All starts.
    #[serde(flatten)]
    pub all: Share,
    /// Those on each straight leg, and in the turn before it.
    pub legs: Vec<LegShare>,
}

/// A start at a time of the path, and what it led to.
struct Start {
    time: f64,
    trial: Trial,
}

impl Starts {
    /// Makes so many starts at equal intervals along the path of a scenario, each with wheels of its own errors. A robot
    /// drives on along the path, and at its end back and forth. `None` if it was interrupted before the first was finished.
    ///
    /// # Errors
    /// [`TrialError`], if the map cannot be used.
    pub fn new(
        scenario: &Scenario,
        starts: u32,
        seconds: f64,
        progress: &impl Progress,
    ) -> Result<Option<Self>, TrialError> {
        let lap = Path::new(PathPlan { laps: 1, ..scenario.path.plan().clone() })?;
        let interval = lap.duration() / f64::from(starts);
        let mut scenario = scenario.clone();
        scenario.path = back_and_forth(&lap, lap.duration() + seconds)?;
        let made = (0..starts).into_par_iter().filter(|_| !progress.is_interrupted()).map(|n| {
            let time = interval * (f64::from(n) + 0.5);
            let trial = trial(scenario.clone(), n.into(), SetDown::At(time), seconds)?;
            progress.finished();
            Ok(Start { time, trial })
        });
        let made: Vec<Start> = made.collect::<Result<_, TrialError>>()?;
        let Some(all) = Share::of(&made, |_| true) else { return Ok(None) };
        let mut since = 0.0;
        let straight =
            lap.legs().iter().filter(|leg| matches!(leg.movement, Movement::Straight(_)));
        let legs = straight.filter_map(|leg| {
            let times = since..leg.end_time();
            since = leg.end_time();
            let share = Share::of(&made, |start| times.contains(&start.time))?;
            let place = |pose: &PathPose| [pose.x, pose.y];
            Some(LegShare { from: place(&leg.from), to: place(&leg.to), share })
        });
        Ok(Some(Self { seconds, all, legs: legs.collect() }))
    }
}

impl Share {
    fn of(starts: &[Start], is: impl Fn(&Start) -> bool) -> Option<Self> {
        let trials: Vec<&Trial> =
            starts.iter().filter(|start| is(start)).map(|start| &start.trial).collect();
        let count = trials.len();
        if count == 0 {
            return None;
        }
        let mut metres: Vec<f64> =
            trials.iter().filter(|trial| trial.is_right).map(|trial| trial.metres).collect();
        metres.sort_by(f64::total_cmp);
        let wrong = trials.iter().filter(|t| t.unique_after.is_some() && !t.is_right).count();
        // The smallest number of metres within which so many tenths of all starts were right.
        let within = |tenths: usize| metres.get((tenths * count).div_ceil(10) - 1).copied();
        #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 starts")]
        let share = |part: usize| part as f64 / count as f64;
        Some(Self {
            starts: count,
            right: share(metres.len()),
            wrong: share(wrong),
            median_metres: within(5),
            most_metres: within(9),
        })
    }
}

/// A lap, back along it, and again, for at least so many seconds.
fn back_and_forth(path: &Path, seconds: f64) -> Result<Path, PathError> {
    let plan = path.plan();
    let once = &plan.corners;
    let mut back: Vec<[f64; 2]> = once.iter().rev().skip(1).copied().collect();
    back.push(plan.start);
    let mut corners = once.clone();
    loop {
        let longer = Path::new(PathPlan { corners: corners.clone(), ..plan.clone() })?;
        if longer.duration() >= seconds {
            return Ok(longer);
        }
        corners.extend(&back);
        corners.extend(once);
    }
}
