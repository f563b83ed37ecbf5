//! Which starts are simulated, and why there may be no forecast.

use sonarfix_map::PathError;

use crate::trial::TrialError;

/// Boards that are proposed at most.
pub(super) const MOST_BOARDS: u32 = 3;

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
        self.starts.saturating_add(each.saturating_mul(MOST_BOARDS))
    }
}

/// The furniture of the usual forecast, pieces on 10 m².
pub const FURNITURE: f64 = 1.8;
