//! The execution of commands. A refused command changes nothing.
//!
//! [`App::startable`], of which [`App::check_start`] is the check, alone decides with what a robot can start. It refuses before anything is changed in memory or in
//! flash, and whatever it accepts can start.

use embedded_storage::nor_flash::NorFlash;
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::localizer::{Localizer, Mode, Start, StartError};
use sonarfix::map::Map;
use sonarfix::map::image::checksum as crc32;
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix_hal::config::{Feature, NotLinked, RobotConfig, Unsupported};
use sonarfix_hal::encoder::Wheels;
use sonarfix_hal::robot::{Hardware, Report, Robot, Settings};
use sonarfix_link::baked::BakedError;
use sonarfix_link::message::{CommandError, CommandResult};
use sonarfix_link::{Command, Frame, Motion, Reporter, SessionCommand, Telemetry, baked};

use super::running::PoseSet;
use super::{App, Link, Poll, Polled, Running, State};
use crate::check::Check;
use crate::flash_contents;
use crate::store::{MAX_HEADING_DEVIATION, MAX_POSITION_DEVIATION, Resumed, SavePolicy, Saved};

/// What follows a command that was executed.
enum Next {
    Nothing,
    /// Begin the loop, or begin it again, from here; after the stack frame of the command has been released.
    Begin(Resumed),
}

/// A localizer with the parameters of its loop.
struct Startable<'m> {
    localizer: Localizer<'m>,
    wheels: Wheels,
    settings: Settings,
}

impl<'m, F: NorFlash> App<'m, F> {
    /// Executes a command, if it is admitted, and sends the acknowledgement. It is not inlined, because the
    /// loop's stack frame would be twice as large.
    #[inline(never)]
    pub(super) fn answer(
        &mut self,
        poll: &mut Poll<impl Hardware, impl Link>,
        frame: &Frame<SessionCommand>,
    ) {
        let mut began = None;
        let mut session = self.wire.session;
        let answer = session.answer(frame, self.next_session(poll.now), |command| {
            self.execute(poll, command, &mut began)
        });
        self.wire.session = session;
        if let Telemetry::Ack(ack) = answer {
            poll.polled.answered = Some(ack.result);
        }
        self.wire.send(&answer, poll.link);
        if let Some(began) = began {
            self.wire.send(&began, poll.link);
        }
    }

    /// Executes a command of the program around the application, without a session: its result is not sent, but what it reports
    /// is. The application must have been polled before.
    #[inline(never)]
    pub fn command(
        &mut self,
        now: Instant,
        hardware: &mut impl Hardware,
        link: &mut impl Link,
        command: &Command,
    ) -> CommandResult {
        // Before the command changes what it describes.
        self.send_telemetry(link);
        let mut poll = Poll { now, hardware, link, polled: Polled::default() };
        let mut began = None;
        let result = self.execute(&mut poll, command, &mut began);
        if let Some(began) = began {
            self.wire.send(&began, poll.link);
        }
        self.rests_until = now;
        result
    }

    /// Executes a command; returns its result. The telemetry of a loop that starts goes to `began`, without a copy on the stack.
    fn execute(
        &mut self,
        poll: &mut Poll<impl Hardware, impl Link>,
        command: &Command,
        began: &mut Option<Telemetry>,
    ) -> CommandResult {
        let done = match &self.act(poll, command) {
            Ok(Next::Begin(known)) => {
                self.begin(poll.now, known).map(|message| *began = Some(message))
            }
            Ok(Next::Nothing) => Ok(()),
            Err(error) => Err(*error),
        };
        match (done, command) {
            (Err(error), _) => CommandResult::Refused(error),
            (Ok(()), Command::MapChecksum) => {
                CommandResult::Map(flash_contents::map_status(&self.map))
            }
            (Ok(()), _) => CommandResult::Done,
        }
    }

    /// The number of the next session: a checksum of the number of this run and the time. It differs from that of any
    /// session of an earlier run, because a run in which a command has changed anything leaves a record with its number.
    fn next_session(&self, now: Instant) -> u32 {
        let [r0, r1, r2, r3] = self.run.to_le_bytes();
        let [t0, t1, t2, t3, t4, t5, t6, t7] = now.ticks().to_le_bytes();
        crc32(&[r0, r1, r2, r3, t0, t1, t2, t3, t4, t5, t6, t7])
    }

    /// Executes a command; returns the telemetry of a loop that starts. The functions below are not inlined, because
    /// the stack frame of each would be part of every other one's.
    fn act(
        &mut self,
        poll: &mut Poll<impl Hardware, impl Link>,
        command: &Command,
    ) -> Result<Next, CommandError> {
        let now = poll.now;
        match *command {
            Command::SetPose(ref start) => self.set_pose(poll, start),
            Command::SetConfiguration(ref config) => self.set_configuration(poll, config),
            Command::SetUnusable(reason) => Err(refused(reason)),
            Command::Start => self.start(poll),
            Command::Stop => {
                self.stop(now);
                Ok(Next::Nothing)
            }
            Command::ResetCalibration => self.reset_calibration(poll),
            Command::Search => self.begin_search(poll),
            Command::ShowDevices => self.show_devices(now, None),
            Command::Point(bearing) => self.show_devices(now, Some(bearing)),
            Command::Absolute { age, ref measurement } => {
                let at = Instant::from_ticks(now.ticks().saturating_sub(age.ticks()));
                self.absolute(at, measurement).map(|()| Next::Nothing)
            }
            Command::Drive(motion) => self.drive(now, motion).map(|()| Next::Nothing),
            Command::MapChecksum | Command::OpenSession => Ok(Next::Nothing),
        }
    }

    /// Whether the loop can start from here with the present configuration.
    ///
    /// # Errors
    /// [`CommandError`], by what prevents the start; a map and a pose may be missing.
    pub(super) fn check_start(&self, now: Instant, known: &Resumed) -> Result<(), CommandError> {
        let (config, _) = self.config.as_ref().ok_or(CommandError::NoConfiguration)?;
        self.check_start_with(now, config, known)
    }

    /// Not inlined, and the localizer is dropped, because it is large and the callers that write to flash need little stack.
    #[inline(never)]
    pub(super) fn check_start_with(
        &self,
        now: Instant,
        config: &RobotConfig,
        known: &Resumed,
    ) -> Result<(), CommandError> {
        config.check_linked().map_err(refused)?;
        config.check().map_err(|_| CommandError::Configuration)?;
        self.startable(now, config, known).map(drop)
    }

    fn startable(
        &self,
        now: Instant,
        config: &RobotConfig,
        known: &Resumed,
    ) -> Result<Startable<'m>, CommandError> {
        let map = self.map.map_or(Map::new(&[]), |(map, _)| map);
        let deviation = known.deviation_at_start(&config.localizer);
        let localizer = Localizer::resume(config.localizer, map, known.state, deviation, now);
        let localizer = localizer.map_err(|error| match error {
            StartError::Start(_) => CommandError::Pose,
            _ => CommandError::Configuration,
        })?;
        let wheels = config.wheels().map_err(|_| CommandError::Configuration)?;
        let settings = Settings { encoder_period: config.encoder_period, ..Settings::default() };
        settings.check().map_err(|_| CommandError::Configuration)?;
        Ok(Startable { localizer, wheels, settings })
    }

    #[inline(never)]
    fn set_pose(
        &mut self,
        poll: &mut Poll<impl Hardware, impl Link>,
        start: &Start,
    ) -> Result<Next, CommandError> {
        let now = poll.now;
        let Start { position_deviation: Metres(position), heading_deviation, .. } = *start;
        // Neither comparison holds for NaN.
        let is_known = (0.0..=MAX_POSITION_DEVIATION).contains(&position)
            && (0.0..=MAX_HEADING_DEVIATION).contains(&heading_deviation.0);
        if !is_known {
            return Err(CommandError::Pose);
        }
        let State::Running(running) = &mut self.state else {
            let known = self.known.ok_or(CommandError::NoConfiguration)?.at(start);
            return self.replace(poll, known).map(|()| Next::Nothing);
        };
        let step =
            running.robot.set_pose(now, start, poll.hardware).map_err(|_| CommandError::Pose)?;
        running.origin = running.origin.at(start);
        running.pose_set = Some(PoseSet { step });
        Ok(Next::Nothing)
    }

    #[inline(never)]
    fn set_configuration(
        &mut self,
        poll: &mut Poll<impl Hardware, impl Link>,
        config: &RobotConfig,
    ) -> Result<Next, CommandError> {
        let now = poll.now;
        let afresh = Resumed::afresh(&config.localizer);
        let known = self.known_now().map_or(afresh, |known| known.calibrated_as(&afresh));
        let known = self.where_it_is(known);
        self.check_start_with(now, config, &known)?;
        configure(poll.hardware, config)?;
        self.owes_config = self.ignores_store() || !self.store.limit().take(now, 1);
        if !self.owes_config {
            let written = self.store.save_replacement(self.baked(), config);
            self.owes_config = written.is_err();
            poll.polled.saved = Some(written);
        }
        self.use_config(config);
        self.owes_record = true;
        if self.is_running() {
            return Ok(Next::Begin(known));
        }
        self.known = Some(known);
        Ok(Next::Nothing)
    }

    /// Replaces the present configuration, which the devices support.
    #[inline(never)]
    fn use_config(&mut self, config: &RobotConfig) {
        self.config = Some((*config, baked::checksum(config)));
        self.unsupported = None;
    }

    #[inline(never)]
    fn reset_calibration(
        &mut self,
        poll: &mut Poll<impl Hardware, impl Link>,
    ) -> Result<Next, CommandError> {
        let (config, _) = self.config.ok_or(CommandError::NoConfiguration)?;
        let known = self.known_now().ok_or(CommandError::NoConfiguration)?;
        let known = known.calibrated_as(&Resumed::afresh(&config.localizer));
        if !self.is_running() {
            return self.replace(poll, known).map(|()| Next::Nothing);
        }
        let known = self.where_it_is(known);
        self.check_start(poll.now, &known)?;
        self.owes_record = true;
        Ok(Next::Begin(known))
    }

    /// The same, at the pose of the localizer if the loop runs: nothing interrupts it.
    fn where_it_is(&self, known: Resumed) -> Resumed {
        let Some(localizer) = self.localizer() else { return known };
        let filter = localizer.filter();
        let here = Resumed::interrupted(filter.state(), filter.standard_deviations());
        let here = Resumed { is_pose_interrupted: false, ..here.calibrated_as(&known) };
        let has_pose = self.navigation_mode() != Some(Mode::Searching);
        if has_pose { here } else { here.without_pose() }
    }

    #[inline(never)]
    fn start(&mut self, poll: &mut Poll<impl Hardware, impl Link>) -> Result<Next, CommandError> {
        if self.is_running() {
            return Ok(Next::Nothing);
        }
        self.map.map_err(|_| CommandError::NoMap)?;
        let known = self.known.ok_or_else(|| self.why_no_configuration())?;
        if let Some(reason) = self.unsupported {
            return Err(CommandError::Unsupported(reason));
        }
        let searches = self.config.is_some_and(|(config, _)| config.start.is_unknown());
        if !known.has_pose && !searches {
            return Err(CommandError::NoPose);
        }
        self.check_start(poll.now, &known)?;
        let known = self.without_parked_record(poll, known);
        if !known.has_pose && !searches {
            return Err(CommandError::NoPose);
        }
        Ok(Next::Begin(known))
    }

    /// Why there is no configuration.
    fn why_no_configuration(&self) -> CommandError {
        match self.baked {
            Err(BakedError::NotLinked(reason)) => refused(reason),
            _ => CommandError::NoConfiguration,
        }
    }

    /// Replaces the record of a parked robot by one of a robot that drives, whose pose is unknown after a power loss. If that
    /// cannot be written, the record may have remained from an earlier run in which the robot drove: its pose is not used.
    #[inline(never)]
    fn without_parked_record(
        &mut self,
        poll: &mut Poll<impl Hardware, impl Link>,
        known: Resumed,
    ) -> Resumed {
        if self.stored.is_none_or(|stored| !stored.is_parked) {
            return known;
        }
        self.store.limit().take(poll.now, 0);
        let saved = self.record_of(poll.now, &known, false);
        let is_replaced = self.replace_stored(poll, &saved);
        if is_replaced || !known.is_pose_stored { known } else { known.without_pose() }
    }

    /// Declares the pose unknown. The search begins at once, or when the loop is started.
    #[inline(never)]
    fn begin_search(
        &mut self,
        poll: &mut Poll<impl Hardware, impl Link>,
    ) -> Result<Next, CommandError> {
        let (config, _) = self.config.as_ref().ok_or(CommandError::NoConfiguration)?;
        if !config.start.is_unknown() {
            return Err(CommandError::NoSearch);
        }
        let known = self.known_now().ok_or(CommandError::NoConfiguration)?.without_pose();
        let State::Running(running) = &mut self.state else {
            return self.replace(poll, known).map(|()| Next::Nothing);
        };
        self.search.begin(poll.now, &mut running.robot);
        running.report_mode();
        Ok(Next::Nothing)
    }

    /// Passes a heading, position or pose that was measured at the time `at` to a running loop ([`Robot::absolute`]).
    ///
    /// # Errors
    /// [`CommandError::Waiting`], [`CommandError::Occupied`], or [`Unsupported::NotLinked`] in a program without the feature
    /// `absolute`; nothing has changed.
    pub fn absolute(
        &mut self,
        at: Instant,
        measurement: &AbsoluteMeasurement,
    ) -> Result<(), CommandError> {
        if !Feature::Absolute.is_linked() {
            return Err(refused(NotLinked(Feature::Absolute)));
        }
        let State::Running(running) = &mut self.state else { return Err(CommandError::Waiting) };
        running.robot.absolute(at, measurement).map_err(|_| CommandError::Occupied)
    }

    /// Drives with this motion until it is renewed or has ended.
    fn drive(&mut self, now: Instant, motion: Motion) -> Result<(), CommandError> {
        if !self.is_running() {
            return Err(CommandError::Waiting);
        }
        let (config, _) = self.config.as_ref().ok_or(CommandError::NoConfiguration)?;
        self.drive.command(now, motion, config)
    }

    /// With the servo at `bearing`, or in turn ahead and at its limits.
    fn show_devices(
        &mut self,
        now: Instant,
        bearing: Option<Radians>,
    ) -> Result<Next, CommandError> {
        let State::Waiting(check) = &mut self.state else { return Err(CommandError::Running) };
        if let Some(bearing) = bearing {
            let (config, _) = self.config.as_ref().ok_or(CommandError::NoConfiguration)?;
            let (rightmost, leftmost) = config.localizer.rangers.first.servo;
            if !(bearing >= rightmost && bearing <= leftmost) {
                return Err(CommandError::OutOfReach);
            }
        }
        check.show(now, bearing);
        Ok(Next::Nothing)
    }

    fn stop(&mut self, now: Instant) {
        if !self.is_running() {
            return;
        }
        self.known = self.known_now();
        self.drive.stop();
        self.faults = self.faults();
        self.state = State::Waiting(Check::new(now));
        self.owes_record = true;
    }

    /// Replaces what is known while the loop does not run. A record of a parked robot is no longer true
    /// then, and must not stay.
    #[inline(never)]
    fn replace(
        &mut self,
        poll: &mut Poll<impl Hardware, impl Link>,
        known: Resumed,
    ) -> Result<(), CommandError> {
        let now = poll.now;
        self.check_start(now, &known)?;
        let mut is_owed = true;
        if self.stored.is_some_and(|stored| stored.is_parked) {
            is_owed = !self.store.limit().take(now, 1);
            if is_owed {
                self.store.limit().take(now, 0);
            }
            let saved = self.record_of(now, &known, known.has_pose && !is_owed);
            is_owed |= !self.replace_stored(poll, &saved);
        }
        self.known = Some(known);
        self.owes_record = is_owed;
        Ok(())
    }

    /// Writes a record over one that does not hold any more; returns whether it was written.
    fn replace_stored(&mut self, poll: &mut Poll<impl Hardware, impl Link>, saved: &Saved) -> bool {
        let owed = self.owes_record;
        let written = self.write(saved);
        poll.polled.saved = Some(written);
        self.owes_record = owed;
        written.is_ok()
    }

    /// Starts the loop, or restarts a running one; returns its telemetry. The localizer is built before the stack holds
    /// the loop.
    #[inline(never)]
    fn begin(&mut self, now: Instant, origin: &Resumed) -> Result<Telemetry, CommandError> {
        let (config, _) = self.config.as_ref().ok_or(CommandError::NoConfiguration)?;
        let start = config.start;
        let startable = self.startable(now, config, origin)?;
        let deviation = origin.deviation_at_start(startable.localizer.config());
        let (reporter, began) = Reporter::resume(now, origin.state, deviation);
        if self.is_running() {
            self.restart_loop(startable)?;
        } else {
            self.start_loop(now, startable, origin, reporter)?;
        }
        if let State::Running(running) = &mut self.state {
            running.reporter = reporter;
            running.origin = *origin;
            running.searches = start.is_unknown();
            if !origin.has_pose {
                self.search.begin_in(now, start.region(), &mut running.robot);
            }
        }
        Ok(began)
    }

    #[inline(never)]
    fn restart_loop(&mut self, startable: Startable<'m>) -> Result<(), CommandError> {
        let Startable { localizer, wheels, settings } = startable;
        let State::Running(running) = &mut self.state else { return Ok(()) };
        running.robot.restart(localizer, wheels, settings).map_err(|_| CommandError::Configuration)
    }

    #[inline(never)]
    fn start_loop(
        &mut self,
        now: Instant,
        startable: Startable<'m>,
        origin: &Resumed,
        reporter: Reporter,
    ) -> Result<(), CommandError> {
        let Startable { localizer, wheels, settings } = startable;
        let deviation = origin.deviation_at_start(localizer.config());
        let written = self.stored.map_or(deviation, |stored| stored.deviation);
        let robot = Robot::new(localizer, wheels, settings);
        let robot = robot.map_err(|_| CommandError::Configuration)?;
        self.faults = self.faults();
        self.state = State::Running(Running {
            robot,
            reporter,
            save_policy: SavePolicy::new(now, written),
            origin: *origin,
            searches: false,
            has_rolled: false,
            has_been_blind: false,
            pose_set: None,
            report: Report::default(),
            is_report_empty: true,
        });
        Ok(())
    }
}

/// The answer to a request for a part that is not linked.
pub(super) fn refused(reason: NotLinked) -> CommandError {
    CommandError::Unsupported(Unsupported::NotLinked(reason))
}

#[inline(never)]
fn configure(hardware: &mut impl Hardware, config: &RobotConfig) -> Result<(), CommandError> {
    hardware.configure(config).map_err(CommandError::Unsupported)
}
