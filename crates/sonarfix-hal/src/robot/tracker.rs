//! What determines the pose in the loop: the localizer and the search beside it.
//!
//! Without the feature `search` the same names stand for a localizer alone, and a search and its pings for types without a
//! value, so that the compiler removes what handles them.

use sonarfix_search::navigator::Navigator;
use sonarfix_search::search::Search as PoseSearch;

use sonarfix::geometry::units::{Instant, Radians};
use sonarfix::map::Region;

use super::odometer::Reading;
use super::poll::Poll;
use super::{Hardware, Report, Robot, Step};
use crate::ranger::Outcome;

/// What tracks the pose.
pub(super) type Tracker<'m> = Navigator<'m>;
/// The search for the pose.
pub type Search<'m> = PoseSearch<'m>;

/// A ping of the search's sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sweep {
    bearing: Radians,
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

impl<'m> Robot<'m> {
    /// Declares the pose unknown and begins the search, to which the present pose is proposed; a ping in flight is
    /// aborted.
    pub fn search(&mut self, now: Instant, search: &mut Search<'m>) {
        self.tracker.search(search);
        self.end_cycle(now, false);
    }

    /// Begins the search of a robot that has been started without a pose ([`Navigator::search_in`]); a ping in flight
    /// is aborted.
    pub fn search_in(&mut self, now: Instant, region: Option<Region>, search: &mut Search<'m>) {
        self.tracker.search_in(region, search);
        self.end_cycle(now, false);
    }

    /// The next ping of the sweep.
    pub(super) fn next_of_sweep(search: &Search<'m>) -> (Radians, Sweep) {
        let bearing = search.aim();
        (bearing, Sweep { bearing })
    }

    /// Passes the travel up to the instant of the echo to the localizer, then the range to the search.
    #[inline(never)]
    pub(super) fn take_sweep(
        &mut self,
        poll: &mut Poll<'_, 'm, impl Hardware>,
        Sweep { bearing }: Sweep,
        from: &Reading,
        outcome: Outcome,
        result: &mut Option<SweepResult>,
    ) {
        let result = result.insert(SweepResult { bearing, outcome, step: None, is_novel: None });
        let range = match outcome {
            Ok(echo) => {
                let is_reached = self.reach(poll, from, &echo, &mut result.step);
                is_reached.then_some(Some(echo.range))
            }
            Err(reason) => (!reason.is_fault()).then_some(None),
        };
        result.is_novel = range.zip(poll.search.as_deref_mut()).map(|(range, search)| {
            // A range of a driver is finite, and so is the bearing.
            self.tracker.ping(bearing, range, search).unwrap_or(false)
        });
    }

    /// Works on the search if nothing else was done in this poll, and changes the mode when it is time.
    pub(super) fn work_on(&mut self, search: &mut Search<'m>, report: &mut Report) {
        let evaluations = if report.is_empty() { self.settings.evaluations } else { 0 };
        report.mode = self.tracker.work(evaluations, search);
    }
}
