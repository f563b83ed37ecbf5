//! What determines the pose in the loop: the localizer and the search beside it.
//!
//! Without the feature `search` the same names stand for a localizer alone, and a search and its pings for types without a
//! value, so that the compiler removes what handles them.

use sonarfix_search::navigator::Navigator;
use sonarfix_search::search::Search as PoseSearch;

use sonarfix::geometry::units::Radians;

use super::Step;
use crate::ranger::Outcome;

/// What tracks the pose.
pub(super) type Tracker<'m> = Navigator<'m>;
/// The search for the pose.
pub type Search<'m> = PoseSearch<'m>;

/// A ping of the search's sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sweep {
    pub bearing: Radians,
}

impl Sweep {
    /// The same ping at the bearing that the servo has reached.
    pub fn along(mut self, bearing: Radians) -> Self {
        self.bearing = bearing;
        self
    }
}

/// The result of a ping of the search's sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SweepResult {
    /// The bearing of the servo.
    pub bearing: Radians,
    /// The echo, or why there is none.
    pub outcome: Outcome,
    /// The step of the wheels up to the reflection; `None` without an echo, or if a counter could not be
    /// read.
    pub step: Option<Step>,
    /// Whether the search took the ping as a novel one; `None` if it was not passed on, because of a fault.
    pub is_novel: Option<bool>,
}

impl SweepResult {
    /// The bearing of the servo, and the echo or why there is none.
    pub fn ping(&self) -> (Radians, Outcome) {
        (self.bearing, self.outcome)
    }

    /// The step of the wheels up to the reflection.
    #[must_use]
    pub fn step(&self) -> Option<&Step> {
        self.step.as_ref()
    }
}
