//! The steps of a measurement cycle.

use sonarfix::aim::{Aim, Choice, NoAim};
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
    /// Reads the outcome of the ping in flight, or takes the range of which the travel was taken in the last poll.
    pub(super) fn finish_ping(
        &mut self,
        poll: &mut Poll<'_, 'm, impl Hardware>,
        report: &mut Report,
    ) {
        match self.cycle {
            Cycle::Reached { aim, echo } => self.fuse(poll, &aim, Ok(echo), report),
            Cycle::Listening { .. } => self.listen(poll, report),
            _ => {}
        }
    }

    fn listen(&mut self, poll: &mut Poll<'_, 'm, impl Hardware>, report: &mut Report) {
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
            Target::Wall(aim) => self.hear(poll, &aim, &from, outcome, report),
            Target::Sweep(sweep) => {
                self.take_sweep(poll, sweep, &from, outcome, &mut report.swept);
                self.end_cycle(now, true);
            }
        }
    }

    /// Passes the travel up to the reflection at a wall to the localizer, and the range in the next poll, so that none takes as long as
    /// both; in the same one, if the loop is polled rarely.
    #[inline(never)]
    fn hear(
        &mut self,
        poll: &mut Poll<'_, 'm, impl Hardware>,
        aim: &Aim,
        from: &Reading,
        outcome: Outcome,
        report: &mut Report,
    ) {
        if let Ok(echo) = outcome {
            if !self.reach(poll, from, &echo, &mut report.reached) {
                self.tracker.localizer_mut().skip();
                report.ping_result = Some(PingResult { aim: *aim, outcome, fix: None });
                self.end_cycle(poll.now, true);
                return;
            }
            if self.is_prompt {
                self.cycle = Cycle::Reached { aim: *aim, echo };
                return;
            }
        }
        self.fuse(poll, aim, outcome, report);
    }

    /// Passes the range to the localizer, which ends the measurement cycle.
    #[inline(never)]
    fn fuse(
        &mut self,
        poll: &mut Poll<'_, 'm, impl Hardware>,
        aim: &Aim,
        outcome: Outcome,
        report: &mut Report,
    ) {
        let range = outcome.ok().map(|echo| echo.range);
        let fix = self.tracker.fix(aim, range, poll.search.as_deref_mut());
        report.ping_result = Some(PingResult { aim: *aim, outcome, fix: Some(fix) });
        self.end_cycle(poll.now, true);
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

    /// Makes a slice of the choice of a wall, or takes the next bearing of the sweep, if a ping is due; then turns the servo.
    #[inline(never)]
    pub(super) fn choose_bearing(
        &mut self,
        poll: &mut Poll<'_, 'm, impl Hardware>,
        report: &mut Report,
    ) {
        let now = poll.now;
        let is_choosing = matches!(self.cycle, Cycle::Choosing { .. });
        let is_due = matches!(self.cycle, Cycle::Idle { until } if now >= until) || is_choosing;
        if !is_due || is_busy(poll, report) {
            return;
        }
        if let (Mode::Searching, Some(search)) = (self.mode(), poll.search.as_deref()) {
            let (bearing, sweep) = Self::next_of_sweep(search);
            let turned = poll.hardware.servo().point(now, bearing);
            poll.faults.servo += u32::from(turned.is_err());
            let target = Target::Sweep(sweep);
            self.cycle = Cycle::Turning { ranger: RangerId::FIRST, target, along: None };
            return;
        }
        if self.localizer().is_odometry_missing() {
            // The next encoder sample ends the period, or the health records that it lasts.
            self.cycle = Cycle::Idle { until: self.ticks.next() };
            return;
        }
        if !is_choosing {
            let choice = self.choice_of(RangerId::FIRST, poll);
            self.cycle = Cycle::Choosing { choice, aims: [None; MAX_RANGERS] };
        }
        let Some(aimed) = self.choose(poll) else {
            report.is_choosing = true;
            return;
        };
        if let Ok(aim) = aimed {
            let target = Target::Wall(aim.why);
            self.cycle = Cycle::Turning { ranger: aim.ranger, target, along: None };
        } else {
            self.tracker.localizer_mut().skip();
            self.end_cycle(now, false);
        }
        report.aimed = Some(aimed);
    }

    /// The choice of a ranger before its first slice. A loop with several knows where their servos stand.
    fn choice_of(&self, ranger: RangerId, poll: &mut Poll<'_, 'm, impl Hardware>) -> Choice {
        let config = self.localizer().config();
        if config.rangers.are_several() {
            let standing = rangers::standing(config, ranger, poll.now, poll.hardware);
            return Choice::standing(ranger, standing);
        }
        Choice::new(ranger)
    }

    /// Makes a slice of the choice; after the last one of the last ranger returns ranger and wall of the next ping. The servos of the
    /// others turn to their walls meanwhile.
    #[inline(never)]
    fn choose(&mut self, poll: &mut Poll<'_, 'm, impl Hardware>) -> Option<Result<Aim, NoAim>> {
        let Cycle::Choosing { choice, aims } = &mut self.cycle else { return None };
        let aim = self.tracker.choose(choice)?.ok();
        let ranger = choice.ranger();
        if let Some(slot) = aims.get_mut(ranger.index()) {
            *slot = aim;
        }
        let aims = *aims;
        let is_later = |other: &RangerId| other.index() > ranger.index();
        let next =
            self.localizer().config().rangers.iter().map(|(ranger, _)| ranger).find(is_later);
        if let Some(next) = next {
            self.cycle = Cycle::Choosing { choice: self.choice_of(next, poll), aims };
            return None;
        }
        let chosen = rangers::first_of(self.localizer().config(), &aims);
        for aim in aims.iter().flatten() {
            // If it does not turn, the wall at its last bearing is measured.
            let turned = poll.hardware.servo_of(aim.ranger).point(poll.now, aim.bearing);
            poll.faults.servo += u32::from(turned.is_err());
        }
        Some(chosen.ok_or(NoAim::NoWall))
    }

    /// Starts a ping once the servo has settled, or is there in a sweep, and the ranger is ready ([`can_ping_at`]), if a wall is square to
    /// the sonar (the robot may have turned in the meantime) or the sonar sweeps.
    pub(super) fn start_ping(
        &mut self,
        poll: &mut Poll<'_, 'm, impl Hardware>,
        report: &mut Report,
    ) {
        let Cycle::Turning { ranger, target, along } = &mut self.cycle else {
            return;
        };
        let (ranger, target, now) = (*ranger, *target, poll.now);
        let Some(bearing) = poll.hardware.servo_of(ranger).target() else {
            self.tracker.localizer_mut().ranger_failed(ranger);
            self.abort_cycle(now);
            return;
        };
        let config = self.tracker.localizer().config();
        let ready_at = can_ping_at(config, ranger, &target, poll.hardware);
        if now < ready_at {
            return;
        }
        let target = match target {
            Target::Sweep(sweep) => Target::Sweep(sweep.along(bearing)),
            Target::Wall(why) => {
                if report.aimed.is_some() || is_busy(poll, report) {
                    return;
                }
                let choice = along.get_or_insert(Choice::along(ranger, bearing));
                let Some(end) = self.tracker.choose(choice) else {
                    report.is_choosing = true;
                    return;
                };
                *along = None;
                let Ok(aim) = end else {
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

/// Whether a poll leaves the slice of a choice, its longest step, to the next one: reading a gyro on a software bus takes half as long.
fn is_busy<H>(poll: &Poll<'_, '_, H>, report: &Report) -> bool {
    report.has_ended_ping() || report.tick.is_some() || poll.has_read_gyro
}

/// The echo, if its times are between the trigger and now.
fn in_time(echo: Echo, triggered: Instant, now: Instant) -> Result<Echo, NoEcho> {
    let fits = triggered <= echo.sent && echo.sent <= echo.heard && echo.heard <= now;
    if fits { Ok(echo) } else { Err(NoEcho::Mistimed) }
}
