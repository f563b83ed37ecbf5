//! The steps that serve a search, in the loop of a program without the feature `search`: none of them is reached.

use sonarfix::geometry::units::Radians;

use super::odometer::Reading;
use super::poll::Poll;
use super::tracker::Sweep;
use super::{Hardware, Report, Robot, Search, SweepResult};
use crate::ranger::Outcome;

impl<'m> Robot<'m> {
    pub(super) fn next_of_sweep(search: &Search<'m>) -> (Radians, Sweep) {
        search.never()
    }

    #[expect(clippy::unused_self, reason = "that of a robot that searches depends on it")]
    pub(super) fn take_sweep(
        &mut self,
        _: &mut Poll<'_, 'm, impl Hardware>,
        sweep: Sweep,
        _: &Reading,
        _: Outcome,
        _: &mut Option<SweepResult>,
    ) {
        sweep.never()
    }

    #[expect(clippy::unused_self, reason = "that of a robot that searches depends on it")]
    pub(super) fn work_on(&mut self, search: &mut Search<'m>, _: &mut Report) {
        search.never()
    }
}
