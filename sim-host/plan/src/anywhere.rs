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
//! | `settings` | which starts |
//! | `start` | one start |
//! | `times` | many starts, their times and shares |
//! | `confusion` | the poses that are confused |
//! | `separation`, `candidates` | the log odds of a sweep between two poses, and the boards that add most to them |
//! | `landmark` | the best of them by simulation |

mod candidates;
mod confusion;
mod free_space;
mod furniture;
mod landmark;
mod route;
mod separation;
mod settings;
mod start;
mod times;
mod wander;

use serde::Serialize;
use sonarfix_map::{PathPlan, Scenario, symmetries};
use sonarfix_sim::progress::Progress;

pub use confusion::Confusion;
pub use landmark::Landmarks;
pub use settings::{AnywhereError, FURNITURE, Settings};
pub use start::{Outcome, Start};
pub use times::Times;

use crate::trial::TrialError;
use start::Place;
use times::simulate;

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
