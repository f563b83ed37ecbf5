//! The steps of the loop that serve the search for the pose: its beginning, the pings of its sweep, and its work.

use sonarfix::geometry::units::{Instant, Radians};
use sonarfix::map::Region;

use super::odometer::Reading;
use super::poll::Poll;
use super::tracker::Sweep;
use super::{Hardware, Report, Robot, Search, SweepResult};
use crate::ranger::Outcome;

impl<'m> Robot<'m> {
    /// Declares the pose unknown and begins the search, to which the present pose is proposed; a ping in flight is
    /// aborted.
    pub fn search(&mut self, now: Instant, search: &mut Search<'m>) {
        self.tracker.search(search);
        self.end_cycle(now, false);
    }

    /// Begins the search of a robot that has been started without a pose ([`Navigator::search_in`](sonarfix_search::navigator::Navigator::search_in)); a ping in flight
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
