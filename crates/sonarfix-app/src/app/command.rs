//! What commands do. One that is refused changes nothing.

use embedded_storage::nor_flash::NorFlash;
use sonarfix::config::Config;
use sonarfix::localizer::{Localizer, Start};
use sonarfix::units::{Instant, Metres, Radians};
use sonarfix_hal::robot::{Report, Robot};
use sonarfix_link::message::{Outcome, Refused};
use sonarfix_link::{Command, Frame, Reporter, Telemetry, baked};

use super::{App, Habit, Link, Mode, Polled, Running};
use crate::check::Check;
use crate::store::{Kept, Resumed, Saved};

/// What is done for a command: nothing more to do, or to begin (anew) from here.
enum Done {
    With(Outcome),
    BeginFrom(Resumed),
}

impl<F: NorFlash> App<'_, F> {
    /// Does what a command says, unless it is a repeat, and answers it. Not part of the loop's own
    /// frame on the stack, which would be twice as large.
    #[inline(never)]
    pub(super) fn answer(
        &mut self,
        now: Instant,
        frame: &Frame<Command>,
        link: &mut impl Link,
        polled: &mut Polled,
    ) {
        let mut began = None;
        let mut answered = self.wire.answered;
        let answer = answered.answer(frame, |command| {
            let done = self.act(now, command, polled).and_then(|done| match done {
                Done::With(outcome) => Ok(outcome),
                Done::BeginFrom(known) => {
                    began = Some(self.begin(now, &known)?);
                    Ok(Outcome::Done)
                }
            });
            done.unwrap_or_else(Outcome::Refused)
        });
        self.wire.answered = answered;
        if let Telemetry::Ack(ack) = answer {
            polled.answered = Some(ack.outcome);
        }
        self.wire.send(&answer, link);
        if let Some(began) = began {
            self.wire.send(&began, link);
        }
    }

    fn act(
        &mut self,
        now: Instant,
        command: &Command,
        polled: &mut Polled,
    ) -> Result<Done, Refused> {
        match *command {
            Command::SetPose(ref start) => self.set_pose(now, start, polled),
            Command::SetConfiguration(ref config) => self.set_configuration(now, config),
            Command::Start => self.start(now, polled),
            Command::Stop => {
                self.stop(now, polled);
                Ok(Done::With(Outcome::Done))
            }
            Command::ResetCalibration => self.reset_calibration(now, polled),
            Command::MapChecksum => Ok(Done::With(Outcome::Map(self.flashed.map_state()))),
        }
    }

    fn set_pose(
        &mut self,
        now: Instant,
        start: &Start,
        polled: &mut Polled,
    ) -> Result<Done, Refused> {
        let known = self.known_now(now).ok_or(Refused::NoConfiguration)?;
        let is_deviation = |d: f32| d >= 0.0 && d.is_finite();
        let Start { pose, position_deviation: Metres(position), heading_deviation } = *start;
        let Radians(heading) = heading_deviation;
        if !(pose.is_finite() && is_deviation(position) && is_deviation(heading)) {
            return Err(Refused::Pose);
        }
        self.go_on_from(now, known.at(start), polled)
    }

    /// Not part of the frame that lies below every other command's.
    #[inline(never)]
    fn set_configuration(&mut self, now: Instant, config: &Config) -> Result<Done, Refused> {
        config.check().map_err(|_| Refused::Configuration)?;
        let kept = Kept { replaces: self.baked(), config: *config };
        let known = self.known_now(now);
        self.store.save_config(&kept).map_err(|_| Refused::Storage)?;
        self.config = Some((*config, baked::checksum(config)));
        let afresh = Resumed::afresh(config);
        let known = known.map_or(afresh, |known| known.calibrated_as(&afresh));
        if self.is_running() {
            return Ok(Done::BeginFrom(known));
        }
        self.known = Some(known);
        Ok(Done::With(Outcome::Done))
    }

    fn reset_calibration(&mut self, now: Instant, polled: &mut Polled) -> Result<Done, Refused> {
        let (config, _) = self.config.ok_or(Refused::NoConfiguration)?;
        let known = self.known_now(now).ok_or(Refused::NoConfiguration)?;
        self.go_on_from(now, known.calibrated_as(&Resumed::afresh(&config)), polled)
    }

    fn start(&mut self, now: Instant, polled: &mut Polled) -> Result<Done, Refused> {
        if self.is_running() {
            return Ok(Done::With(Outcome::Done));
        }
        self.flashed.map.map_err(|_| Refused::NoMap)?;
        let known = self.known.ok_or(Refused::NoConfiguration)?;
        if !known.has_pose {
            return Err(Refused::NoPose);
        }
        // From now on nobody knows where it will stand when the power goes.
        let saved = self.record(now, false).ok_or(Refused::NoConfiguration)?;
        self.replace(now, &saved, polled)?;
        Ok(Done::BeginFrom(known))
    }

    fn stop(&mut self, now: Instant, polled: &mut Polled) {
        if !self.is_running() {
            return;
        }
        self.known = self.known_now(now);
        polled.saved = self.record(now, true).map(|saved| self.write(now, &saved));
        self.faults = self.faults();
        self.mode = Mode::Waiting(Check::new(now));
    }

    /// Writes down what is known now, and goes on from there.
    fn go_on_from(
        &mut self,
        now: Instant,
        known: Resumed,
        polled: &mut Polled,
    ) -> Result<Done, Refused> {
        let is_running = self.is_running();
        let record = self.record(now, !is_running).ok_or(Refused::NoConfiguration)?;
        let Resumed { state, deviation, has_pose, .. } = known;
        let is_parked = !is_running && has_pose;
        self.replace(now, &Saved { is_parked, state, deviation, ..record }, polled)?;
        if is_running {
            return Ok(Done::BeginFrom(known));
        }
        self.known = Some(known);
        Ok(Done::With(Outcome::Done))
    }

    /// Writes a record over one that is no longer true, which must not stay; where there is none,
    /// a flash that fails costs the memory and no more.
    fn replace(&mut self, now: Instant, saved: &Saved, polled: &mut Polled) -> Result<(), Refused> {
        let written = self.write(now, saved);
        polled.saved = Some(written);
        let has_old = self.stored.is_some();
        written.or(if has_old { Err(Refused::Storage) } else { Ok(()) })
    }

    /// What would be known of a robot that was stopped now; `None` without a configuration.
    fn known_now(&self, now: Instant) -> Option<Resumed> {
        let (config, checksum) = self.config?;
        match &self.mode {
            Mode::Waiting(_) => self.known,
            Mode::Running(_) => {
                let saved = self.record(now, true)?;
                Some(Resumed::from(&saved, &config, checksum))
            }
        }
    }

    /// Begins the loop; gives what to tell of it.
    #[inline(never)]
    fn begin(&mut self, now: Instant, known: &Resumed) -> Result<Telemetry, Refused> {
        let (map, _) = self.flashed.map.map_err(|_| Refused::NoMap)?;
        let (config, _) = self.config.ok_or(Refused::NoConfiguration)?;
        let Resumed { state, deviation, .. } = *known;
        let localizer = Localizer::resume(config, map, state, deviation, now);
        let localizer = localizer.map_err(|_| Refused::Pose)?;
        let (reporter, began) = Reporter::resume(now, state, deviation);
        let robot = Robot::new(localizer, self.body.wheels, self.body.settings);
        let robot = robot.map_err(|_| Refused::Configuration)?;
        self.faults = self.faults();
        let written = self.stored.map_or(deviation, |stored| stored.deviation);
        let habit = Habit::new(now, written);
        self.mode = Mode::Running(Running { robot, reporter, habit, report: Report::default() });
        Ok(began)
    }
}
