//! The steps of a measurement cycle.

use sonarfix::aim::{Aim, NoAim};
use sonarfix::config::{MAX_RANGERS, PingSchedule, RangerId};
use sonarfix::geometry::units::Instant;
use sonarfix::localizer::Mode;

use super::cycle::{Cycle, Target};
use super::odometer::Reading;
use super::poll::Poll;
use super::rangers::{self, can_ping_at};
use super::{Hardware, PingResult, Report, Robot, Stamp, Step};
use crate::ranger::{Echo, NoEcho, Outcome, Ranger, TriggerError};
use crate::time::{AT_ONCE, since};

impl<'m> Robot<'m> {
    /// Reads the outcome of the ping in flight.
    pub(super) fn finish_ping(
        &mut self,
        poll: &mut Poll<'_, 'm, impl Hardware>,
        report: &mut Report,
    ) {
        let now = poll.now;
        let Cycle::Listening { target, from, polled } = &mut self.cycle else {
            return;
        };
        let (target, from, polled) = (*target, *from, *polled.get_or_insert(now));
        let end = match self.ping_end.take() {
            Some(end) => end,
            None => match poll.hardware.ranger_of(target.ranger()).poll(now) {
                Ok(None) if since(now, polled) < self.settings.patience => return,
                Ok(None) => Some(Err(NoEcho::NoResponse)),
                Ok(outcome) => outcome,
                Err(_) => None,
            },
        };
        let outcome = end.unwrap_or(Err(NoEcho::Failed));
        let outcome = outcome.and_then(|echo| in_time(echo, from.at, now));
        poll.faults.ranger += u32::from(outcome.err().is_some_and(NoEcho::is_fault));
        match target {
            Target::Wall(aim) => self.fuse(poll, &aim, &from, outcome, &mut report.ping_result),
            Target::Sweep(sweep) => {
                self.take_sweep(poll, sweep, &from, outcome, &mut report.swept);
            }
        }
        self.end_cycle(now, true);
    }

    /// Passes the travel up to the instant of the echo to the localizer, then the range.
    #[inline(never)]
    fn fuse(
        &mut self,
        poll: &mut Poll<'_, 'm, impl Hardware>,
        aim: &Aim,
        from: &Reading,
        outcome: Outcome,
        result: &mut Option<PingResult>,
    ) {
        let result = result.insert(PingResult { aim: *aim, outcome, step: None, fix: None });
        if let Ok(echo) = outcome
            && !self.reach(poll, from, &echo, &mut result.step)
        {
            self.tracker.localizer_mut().skip();
            return;
        }
        let range = outcome.ok().map(|echo| echo.range);
        result.fix = Some(self.tracker.fix(aim, range, poll.search.as_deref_mut()));
    }

    /// Passes the travel up to the instant of the echo to the localizer. Returns whether the counters could be read.
    pub(super) fn reach(
        &mut self,
        poll: &mut Poll<'_, 'm, impl Hardware>,
        from: &Reading,
        echo: &Echo,
        step: &mut Option<Step>,
    ) -> bool {
        let Some(reading) = self.read(poll) else { return false };
        let reading = match self.settings.stamp {
            Stamp::Reflection => from.between(&reading, echo.reflected()),
            Stamp::Arrival => reading,
        };
        self.advance(poll, &reading, step);
        true
    }

    /// Chooses a wall, or the next bearing of the sweep, if a ping is due, and turns the servo.
    #[inline(never)]
    pub(super) fn choose_bearing(
        &mut self,
        poll: &mut Poll<'_, 'm, impl Hardware>,
        report: &mut Report,
    ) {
        let now = poll.now;
        let is_due = matches!(self.cycle, Cycle::Idle { until } if now >= until);
        // The choice is the longest step, and waits for a poll of its own: reading a gyro on a software bus takes half as long.
        let is_busy = report.has_ended_ping() || report.tick.is_some() || poll.has_read_gyro;
        if !is_due || is_busy {
            return;
        }
        if let (Mode::Searching, Some(search)) = (self.mode(), poll.search.as_deref()) {
            let (bearing, sweep) = Self::next_of_sweep(search);
            let turned = poll.hardware.servo().point(now, bearing);
            poll.faults.servo += u32::from(turned.is_err());
            let target = Target::Sweep(sweep);
            self.cycle = Cycle::Turning { ranger: RangerId::FIRST, target };
            return;
        }
        if self.localizer().is_odometry_missing() {
            // The next encoder sample ends the period, or the health records that it lasts.
            self.cycle = Cycle::Idle { until: self.ticks.next() };
            return;
        }
        let aimed = if self.localizer().config().rangers.are_several() {
            self.choose_among(poll)
        } else {
            self.tracker.aim().inspect(|aim| {
                let turned = poll.hardware.servo().point(now, aim.bearing);
                // If it does not turn, the wall at its last bearing is measured.
                poll.faults.servo += u32::from(turned.is_err());
            })
        };
        if let Ok(aim) = aimed {
            self.cycle = Cycle::Turning { ranger: aim.ranger, target: Target::Wall(aim.why) };
        } else {
            self.tracker.localizer_mut().skip();
            self.end_cycle(now, false);
        }
        report.aimed = Some(aimed);
    }

    /// Chooses ranger and wall of the next ping of a robot with several rangers. The servos of the others turn to their
    /// walls meanwhile.
    #[inline(never)]
    fn choose_among(&mut self, poll: &mut Poll<'_, 'm, impl Hardware>) -> Result<Aim, NoAim> {
        let config = self.localizer().config();
        let mut aims = [None; MAX_RANGERS];
        for ((ranger, _), aim) in config.rangers.iter().zip(&mut aims) {
            let standing = rangers::standing(config, ranger, poll.now, poll.hardware);
            *aim = self.tracker.aim_of(ranger, &standing).ok();
        }
        let chosen = rangers::first_of(config, &aims).ok_or(NoAim::NoWall)?;
        for aim in aims.iter().flatten() {
            let turned = poll.hardware.servo_of(aim.ranger).point(poll.now, aim.bearing);
            poll.faults.servo += u32::from(turned.is_err());
        }
        Ok(chosen)
    }

    /// Starts a ping once the servo has settled, or is there in a sweep, and the ranger is ready ([`can_ping_at`]), if a wall is square to
    /// the sonar (the robot may have turned in the meantime) or the sonar sweeps.
    pub(super) fn start_ping(
        &mut self,
        poll: &mut Poll<'_, 'm, impl Hardware>,
        report: &mut Report,
    ) {
        let Cycle::Turning { ranger, target } = self.cycle else {
            return;
        };
        let now = poll.now;
        let Some(bearing) = poll.hardware.servo_of(ranger).target() else {
            self.tracker.localizer_mut().ranger_failed(ranger);
            self.abort_cycle(now);
            return;
        };
        let ready_at = can_ping_at(self.localizer().config(), ranger, &target, poll.hardware);
        if now < ready_at {
            return;
        }
        let target = match target {
            Target::Sweep(sweep) => Target::Sweep(sweep.along(bearing)),
            Target::Wall(why) => {
                let Ok(aim) = self.localizer().aim_along(ranger, bearing) else {
                    self.end_cycle(now, false);
                    return;
                };
                Target::Wall(Aim { why, ..aim })
            }
        };
        let Some(from) = self.read(poll) else {
            self.abort_cycle(now);
            return;
        };
        match poll.hardware.ranger_of(ranger).trigger(now) {
            Ok(()) => {
                self.cycle = Cycle::Listening { target, from, polled: None };
                if let Target::Wall(aim) = target {
                    report.pinged = Some(aim);
                }
            }
            Err(TriggerError::TooSoon) if since(now, ready_at) < self.settings.patience => {}
            Err(_) => {
                poll.faults.ranger += 1;
                self.tracker.localizer_mut().ranger_failed(ranger);
                self.abort_cycle(now);
            }
        }
    }

    /// Ends a measurement cycle in which a device has prevented the ping.
    fn abort_cycle(&mut self, now: Instant) {
        if self.mode() != Mode::Searching {
            self.tracker.localizer_mut().skip();
        }
        self.end_cycle(now, false);
    }

    /// Ends the measurement cycle. If there was no ping, nothing changes before the next tick.
    pub(super) fn end_cycle(&mut self, now: Instant, pinged: bool) {
        let is_sweeping = self.mode() == Mode::Searching;
        let until = match self.localizer().config().rangers.first.timing.schedule {
            PingSchedule::Every(_) if !is_sweeping => {
                self.pings.take(now);
                self.pings.next()
            }
            _ if pinged => now,
            _ => self.ticks.next(),
        };
        self.cycle = Cycle::Idle { until };
        (self.rests_until, self.ping_end) = (AT_ONCE, None);
    }
}

/// The echo, if its times are between the trigger and now.
fn in_time(echo: Echo, triggered: Instant, now: Instant) -> Result<Echo, NoEcho> {
    let fits = triggered <= echo.sent && echo.sent <= echo.heard && echo.heard <= now;
    if fits { Ok(echo) } else { Err(NoEcho::Mistimed) }
}
