//! What a map leads to when a robot starts anywhere on it without a pose: how long the search takes, where its answer is not
//! unique, and which boards would change that.
//!
//! Each start is a trial of [`crate::trial`] from a random place: the robot drives to random places, on the shortest way that
//! keeps off the walls, among random furniture that the map does not have.
//!
//! | module | what |
//! |---|---|
//! | `free_space` | where a robot may be |
//! | `route`, `wander` | ways between places, and a drive over random ones |
//! | `furniture` | what stands beside a drive |
//! | `start` | one start |
//! | `confusion` | the poses that are confused |
//! | `separation`, `candidates` | what a sweep tells between two poses, and the boards that tell most |
//! | `landmark` | the best of them by simulation |

mod candidates;
mod confusion;
mod free_space;
mod furniture;
mod landmark;
mod route;
mod separation;
mod start;
mod wander;

use rayon::prelude::*;
use serde::Serialize;
use sonarfix_map::{PathError, PathPlan, Scenario, symmetries};
use sonarfix_sim::progress::Progress;

pub use confusion::Confusion;
pub use landmark::Landmarks;
pub use start::{Outcome, Start};

use crate::trial::TrialError;
use start::Place;

/// Why there is no forecast.
#[derive(Debug, thiserror::Error)]
pub enum AnywhereError {
    /// A trial failed.
    #[error(transparent)]
    Trial(#[from] TrialError),
    /// The robot's speed or turn rate is invalid.
    #[error(transparent)]
    Path(#[from] PathError),
    /// The robot has no place.
    #[error(
        "no place between the walls is {0:.2} m away from all of them, half the width of the robot: check the unit of the \
         map and the robot's track_width"
    )]
    NoPlace(f64),
}

/// Which starts are simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// How many.
    pub starts: u32,
    /// Longest time of driving, seconds.
    pub seconds: f64,
    /// The seed of the first one; the others count up from it.
    pub seed: u64,
    /// Pieces of furniture that the map does not have, on 10 m², before those are left out that do not fit.
    pub furniture: f64,
}

impl Settings {
    /// The runs that a forecast with boards takes at most.
    #[must_use]
    pub fn runs(&self) -> u32 {
        // Each board is chosen from three by half of the starts, and confirmed by as many as there are.
        let each = self.starts.saturating_add(self.starts.div_ceil(2).saturating_mul(3));
        self.starts.saturating_add(each.saturating_mul(landmark::MOST_BOARDS))
    }

    /// The time that a start costs: until the right answer, or all of it.
    fn lost(&self, start: &Start) -> f64 {
        let is_right = start.outcome == Outcome::Right;
        start.after.filter(|_| is_right).unwrap_or(self.seconds)
    }

    fn lost_by(&self, starts: &[Start]) -> f64 {
        starts.iter().map(|start| self.lost(start)).sum()
    }
}

/// The furniture of the usual forecast, pieces on 10 m².
pub const FURNITURE: f64 = 1.8;

/// Share of the starts without a right answer from which on a board is looked for.
const TOLERATED: f64 = 0.05;

/// Times and shares of many starts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Times {
    /// Longest time of driving, seconds.
    pub seconds: f64,
    /// Starts.
    pub starts: usize,
    /// Share with a unique and right answer.
    pub right: f64,
    /// Share with a unique and wrong answer.
    pub wrong: f64,
    /// Seconds within which half of the starts had the right answer; `None` if fewer had.
    pub median_seconds: Option<f64>,
    /// The same for nine in ten.
    pub most_seconds: Option<f64>,
}

impl Times {
    /// Those of starts; `None` without one.
    #[must_use]
    pub fn new(starts: &[Start], seconds: f64) -> Option<Self> {
        let right = starts.iter().filter(|start| start.outcome == Outcome::Right);
        let wrong = starts.iter().filter(|start| start.outcome == Outcome::Wrong).count();
        Self::of(right.filter_map(|start| start.after).collect(), wrong, starts.len(), seconds)
    }

    /// Those of so many starts, of which these were right after as many seconds.
    #[must_use]
    pub fn of(mut right: Vec<f64>, wrong: usize, starts: usize, seconds: f64) -> Option<Self> {
        if starts == 0 {
            return None;
        }
        right.sort_by(f64::total_cmp);
        let within = |tenths: usize| right.get((tenths * starts).div_ceil(10) - 1).copied();
        #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^53 starts")]
        let share = |part: usize| part as f64 / starts as f64;
        Some(Self {
            seconds,
            starts,
            right: share(right.len()),
            wrong: share(wrong),
            median_seconds: within(5),
            most_seconds: within(9),
        })
    }

    /// Whether so many starts have the right answer that no board is looked for.
    #[must_use]
    pub fn suffices(&self) -> bool {
        self.right >= 1.0 - TOLERATED
    }

    /// Share without a unique answer.
    #[must_use]
    pub fn unanswered(&self) -> f64 {
        1.0 - self.right - self.wrong
    }
}

/// The forecast for starts anywhere.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Anywhere {
    /// Times and shares.
    #[serde(flatten)]
    pub times: Times,
    /// Which poses the starts without a right answer confused.
    pub confused: Vec<Confusion>,
    /// Boards that help, if they were looked for and found.
    pub landmarks: Option<Landmarks>,
    /// The starts.
    pub places: Vec<Start>,
}

impl Anywhere {
    /// Simulates starts of a scenario's robot anywhere on its map; path and obstacles of the scenario are not used. `None` if it was
    /// interrupted before the first start was finished.
    ///
    /// # Errors
    /// [`AnywhereError`], if the map cannot be used.
    pub fn new(
        scenario: &Scenario,
        settings: &Settings,
        progress: &impl Progress,
    ) -> Result<Option<Self>, AnywhereError> {
        let place = Place::new(scenario, scenario.floor.clone())?;
        let seeds: Vec<u64> = (settings.seed..).take(settings.starts as usize).collect();
        let places = simulate(&place, &seeds, settings, progress)?;
        let times = Times::new(&places, settings.seconds);
        let symmetries = symmetries(&scenario.floor).map_err(TrialError::Bake)?;
        let confused = confusion::all(&places, &symmetries);
        Ok(times.map(|times| Self { times, confused, landmarks: None, places }))
    }

    /// Looks for boards that help, clear of a path, if more than 5 % of the starts have no right answer; `scenario` and `settings`
    /// are those of the starts.
    ///
    /// # Errors
    /// As of [`Anywhere::new`].
    pub fn with_landmarks(
        self,
        scenario: &Scenario,
        path: Option<&PathPlan>,
        settings: &Settings,
        progress: &impl Progress,
    ) -> Result<Self, AnywhereError> {
        if self.times.suffices() {
            return Ok(self);
        }
        let place = Place::new(scenario, scenario.floor.clone())?;
        let landmarks = landmark::fewest(&place, &self.places, path, settings, progress)?;
        Ok(Self { landmarks, ..self })
    }
}

/// The starts of these seeds, in their order; fewer if it was interrupted.
fn simulate(
    place: &Place<'_>,
    seeds: &[u64],
    settings: &Settings,
    progress: &impl Progress,
) -> Result<Vec<Start>, AnywhereError> {
    let seeds = seeds.par_iter().filter(|_| !progress.is_interrupted());
    let one = |seed: &u64| {
        let start = place.start(*seed, settings)?;
        progress.finished();
        Ok(start)
    };
    seeds.map(one).collect()
}
