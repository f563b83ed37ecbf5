//! The search for the pose of a running loop.

use sonarfix::geometry::units::Instant;
use sonarfix::localizer::Mode;
use sonarfix::map::Region;
use sonarfix_hal::robot::{Robot, Search};
use sonarfix_link::Reporter;
use sonarfix_link::reporter::Outlet;

/// The search, which is large and is never moved. Without the feature `search` the same name stands for nothing.
#[derive(Default)]
pub(super) struct PoseSearch<'m>(pub Search<'m>);

impl<'m> PoseSearch<'m> {
    /// The search for the loop, if the robot searches at all.
    pub fn used(&mut self, searches: bool) -> Option<&mut Search<'m>> {
        searches.then_some(&mut self.0)
    }

    /// Declares the pose of the robot unknown and begins.
    pub fn begin(&mut self, now: Instant, robot: &mut Robot<'m>) {
        robot.search(now, &mut self.0);
    }

    /// Begins for a robot that has been started without a pose.
    pub fn begin_in(&mut self, now: Instant, region: Option<Region>, robot: &mut Robot<'m>) {
        robot.search_in(now, region, &mut self.0);
    }

    /// Sends the next message.
    pub fn report(&self, mode: Mode, reporter: &mut Reporter, outlet: &mut impl Outlet) {
        reporter.search(mode, &self.0, outlet);
    }

    /// Makes one evaluation.
    pub fn work(&mut self) {
        self.0.poll(1);
    }
}
