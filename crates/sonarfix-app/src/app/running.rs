//! The loop while it runs: its polls, its telemetry, and the state after it has stopped.

use sonarfix::geometry::units::{Instant, Metres};
use sonarfix::localizer::Mode;
use sonarfix_hal::robot::{Hardware, Report, Robot, Step};
use sonarfix_link::Reporter;
use sonarfix_link::reporter::Outlet;

use super::poll::Poll;
use super::search::PoseSearch;
use super::wire::{Link, Wire};
use crate::store::{Resumed, SavePolicy};

/// The running loop.
#[expect(clippy::struct_excessive_bools, reason = "independent facts, each with a name")]
pub(super) struct Running<'m> {
    pub robot: Robot<'m>,
    pub reporter: Reporter,
    pub save_policy: SavePolicy,
    /// The state from which it started.
    pub origin: Resumed,
    /// Whether it searches for its pose if it does not have one.
    pub searches: bool,
    /// Whether a wheel has rolled since.
    pub has_rolled: bool,
    /// Whether the wheels could not be observed at a time since, when they may have rolled.
    pub has_been_blind: bool,
    /// The replacement of the pose by a command, whose messages are to be sent.
    pub pose_set: Option<PoseSet>,
    /// The report of the last poll. It is stored here and not returned, because it is half a kilobyte.
    pub report: Report,
    /// Whether it is known to be empty.
    pub is_report_empty: bool,
}

/// The replacement of the pose of a running loop.
pub(super) struct PoseSet {
    /// The step before it.
    pub step: Option<Step>,
}

impl<'m> Running<'m> {
    /// Whether the loop has nothing to do at `now`; then its report is empty.
    #[inline]
    pub fn rest(&mut self, now: Instant, hardware: &mut impl Hardware) -> bool {
        let rests = self.robot.rest(now, hardware);
        if rests {
            self.clear_report();
        }
        rests
    }

    /// Empties the report, in a poll in which the loop does nothing.
    #[inline]
    pub fn clear_report(&mut self) {
        if !self.is_report_empty {
            (self.report, self.is_report_empty) = (Report::default(), true);
        }
    }

    /// Reports the mode, which a command has changed.
    pub fn report_mode(&mut self) {
        (self.report.mode, self.is_report_empty) = (Some(self.robot.mode()), false);
    }

    /// Polls the loop; returns whether a record is due. The next poll sends the telemetry of one that has worked, so that none takes as
    /// long as both.
    #[inline(never)]
    pub fn poll(
        &mut self,
        poll: &mut Poll<impl Hardware, impl Link>,
        search: &mut PoseSearch<'m>,
    ) -> bool {
        let Poll { now, hardware, polled, .. } = poll;
        let now = *now;
        if self.rest(now, *hardware) {
            return false;
        }
        self.is_report_empty = false;
        let before = self.robot.localizer().health().verdict;
        self.robot.poll_into(now, *hardware, search.used(self.searches), &mut self.report);
        let report = &self.report;
        let localizer = self.robot.localizer();
        let verdict = localizer.health().verdict;
        polled.verdict = (verdict != before).then_some(verdict);
        let mode = self.robot.mode();
        if has_rolled(report) {
            self.save_policy.rolled(now);
            self.has_rolled = true;
        }
        self.has_been_blind |= localizer.is_odometry_missing();
        let is_tracking = mode == Mode::Tracking;
        polled.is_on_time = report.tick.is_some() && report.faults.deadlines == 0;
        report.tick.is_some() && is_tracking && self.save_policy.is_due(now, localizer)
    }

    /// Whether telemetry of the last poll is to be sent.
    #[inline]
    pub fn is_unsent(&self) -> bool {
        self.pose_set.is_some() || (!self.is_report_empty && Reporter::has_messages(&self.report))
    }

    /// Sends the telemetry of the last poll, whose report is empty afterwards.
    #[inline(never)]
    pub fn send(&mut self, search: &PoseSearch<'m>, wire: &mut Wire, link: &mut impl Link) {
        let report = &self.report;
        if let Some(PoseSet { step }) = self.pose_set.take() {
            self.reporter.step(step.as_ref(), &mut wire.outlet(link));
            wire.outlet(link).send_built(|| self.reporter.pose_set(self.robot.localizer()));
        }
        self.reporter.report(report, self.robot.localizer(), &mut wire.outlet(link));
        let mode = self.robot.mode();
        if report.tick.is_some() && mode != Mode::Tracking {
            search.report(mode, &mut self.reporter, &mut wire.outlet(link));
        }
        self.clear_report();
    }

    /// Notes that a record of the present state is written.
    pub fn wrote(&mut self, now: Instant) {
        self.save_policy.wrote(now, self.robot.localizer().filter().standard_deviations());
    }

    /// Continues at `now` after the clock was set back.
    pub fn set_clock(&mut self, now: Instant) {
        self.robot.set_clock(now);
        self.save_policy.set_clock(now);
    }

    /// The state after it has stopped.
    pub fn known(&self) -> Resumed {
        let is_searching = self.robot.mode() == Mode::Searching;
        let is_calibrated = self.has_rolled || is_searching || !self.origin.has_pose;
        let origin = self.origin.interrupted_again();
        if !is_calibrated && !self.has_been_blind {
            return origin;
        }
        let filter = self.robot.localizer().filter();
        let known = Resumed::interrupted(filter.state(), filter.standard_deviations());
        let known = if is_calibrated { known } else { known.calibrated_as(&origin) };
        if is_searching { known.without_pose() } else { known }
    }
}

fn has_rolled(report: &Report) -> bool {
    // By reference: a step is large.
    let rolled = |step: Option<&Step>| {
        step.is_some_and(|Step { travel, .. }| {
            travel.right.abs() > Metres(0.0) || travel.left.abs() > Metres(0.0)
        })
    };
    rolled(report.tick.as_ref().and_then(|tick| tick.step.as_ref()))
        || rolled(report.reached.as_ref())
}
