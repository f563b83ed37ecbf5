//! Robots without a start pose that stand and sweep: in empty rooms of a family, each trial with the bound of its pings, or in furnished
//! floor plans.

use std::path::Path;

use rayon::prelude::*;
use serde::Serialize;
use sonarfix_map::Scenario;
use sonarfix_plan::trial::{SetDown, Trial, TrialError, trial};
use sonarfix_sim::progress::Progress;

use crate::rooms::{Cell, Family, Objects, Robot, Sensor};
use crate::search_bound::{Bounded, bounded};
use crate::search_study::Plans;

/// Trials in empty rooms of a family, with an HC-SR04: each robot stands anywhere on the path of its room.
///
/// # Errors
/// [`TrialError`] of the first room that cannot be used.
pub fn rooms(
    family: Family,
    first: u64,
    trials: u32,
    seconds: f64,
    progress: &impl Progress,
) -> Result<Vec<Bounded>, TrialError> {
    let cell =
        Cell { family, objects: Objects::Nothing, sensor: Sensor::HcSr04, robot: Robot::NOMINAL };
    let seeds = (0..u64::from(trials)).into_par_iter().map(|n| first.wrapping_add(n));
    let one = |seed| {
        let scenario = Scenario::parse(&cell.toml(seed), "room.toml", Path::new(""))?;
        let trial = bounded(scenario, seed, SetDown::Standing, seconds);
        progress.finished();
        trial
    };
    seeds.filter(|_| !progress.is_interrupted()).map(one).collect()
}

/// Trials in furnished floor plans, which the map does not show.
///
/// # Errors
/// [`TrialError`] of the first plan that cannot be used.
pub fn floor_plans(
    plans: &Plans,
    seconds: f64,
    progress: &impl Progress,
) -> Result<Vec<Trial>, TrialError> {
    plans.each(progress, |scenario, seed| trial(scenario, seed, SetDown::Standing, seconds))
}

/// The time of a standing fix, seconds: two sweeps.
const SOON: f64 = 3.0;

/// Shares over many trials.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Summary {
    /// Trials.
    pub trials: usize,
    /// Share with a right pose within three seconds.
    pub right_within_3: f64,
    /// Share with a right pose.
    pub right: f64,
    /// Share with a wrong pose.
    pub wrong: f64,
    /// Share whose best hypothesis is right at the end, unique or not.
    pub best_is_right: f64,
    /// Share of which the pings of three seconds allow the right pose with odds of 1,000 to 1; `None` without a bound.
    pub possible_within_3: Option<f64>,
    /// Share of which the pings give a wrong pose with these odds.
    pub possible_wrong: Option<f64>,
}

impl Summary {
    /// The summary of some trials.
    #[must_use]
    pub fn new(trials: &[Trial]) -> Self {
        Self {
            trials: trials.len(),
            right_within_3: share(trials, |it| it.is_right && is_soon(it.unique_after)),
            right: share(trials, |it| it.is_right),
            wrong: share(trials, |it| it.unique_after.is_some() && !it.is_right),
            best_is_right: share(trials, |it| it.rank == Some(0)),
            possible_within_3: None,
            possible_wrong: None,
        }
    }

    /// The summary of some trials with their bound.
    #[must_use]
    pub fn bounded(trials: &[Bounded]) -> Self {
        let possible = share(trials, |it| it.exact.is_right && is_soon(it.exact.after));
        let wrong = share(trials, |it| it.exact.after.is_some() && !it.exact.is_right);
        let searches: Vec<Trial> = trials.iter().map(|bounded| bounded.trial).collect();
        let [possible_within_3, possible_wrong] = [possible, wrong].map(Some);
        Self { possible_within_3, possible_wrong, ..Self::new(&searches) }
    }
}

fn is_soon(after: Option<f64>) -> bool {
    after.is_some_and(|after| after <= SOON)
}

#[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 trials")]
fn share<T>(trials: &[T], is: impl Fn(&&T) -> bool) -> f64 {
    trials.iter().filter(is).count() as f64 / trials.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two sweeps of a room whose walls are at odd angles tell where the robot is; a square looks the same from four places.
    #[test]
    fn standing_robots_are_found_where_no_wall_looks_like_another() {
        let slanted = rooms(Family::Slanted, 31_000, 12, 4.0, &|| ()).unwrap();
        let summary = Summary::bounded(&slanted);
        assert!(summary.right >= 0.4 && summary.possible_within_3 >= Some(0.7), "{summary:?}");
        assert!(slanted.iter().all(|it| it.trial.metres < 1e-9), "{slanted:?}");
        let square = Summary::bounded(&rooms(Family::Symmetric, 31_000, 12, 4.0, &|| ()).unwrap());
        assert!(square.right + square.wrong < 1e-9, "{square:?}");
    }
}
