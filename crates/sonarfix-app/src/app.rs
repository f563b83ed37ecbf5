//! The application: starts and stops the robot's loop, executes commands, sends telemetry and stores state.
//!
//! ```text
//!                Start, with map, configuration and pose
//!   Waiting ────────────────────────────────────────────▶ Running
//!     ▲  the devices are checked once a second     the robot's loop │
//!     └──────────────────────── Stop ───────────────────────────────┘
//! ```
//!
//! A robot that waits must not move; the configuration defines the other cases
//! ([`MotorPolicy`](sonarfix_hal::config::MotorPolicy)): the board enables
//! its motor driver by [`Polled::may_drive`].
//!
//! This file composes; `running` polls the loop; `command` executes commands; `flash` decides what is read from the store and
//! written to it; `search` has the search for the pose; `drive` has the motion for the motor code; `wire` reads the link and
//! schedules telemetry. The deadline check is [`Polled::is_on_time`].

mod clock;
mod command;
#[cfg_attr(not(feature = "drive"), path = "app/no_drive.rs")]
mod drive;
mod flash;
mod poll;
mod running;
#[cfg_attr(not(feature = "search"), path = "app/lone_search.rs")]
mod search;
#[cfg(feature = "search")]
mod searching;
mod wire;

use embedded_storage::nor_flash::NorFlash;
use sonarfix::geometry::units::{Duration, Instant};
use sonarfix::health::DEGRADED_WITHOUT_ODOMETRY;
use sonarfix::localizer::{Localizer, Mode};
use sonarfix::map::{Map, MapError};
use sonarfix_hal::config::{RobotConfig, Unsupported};
use sonarfix_hal::robot::{
    EVALUATIONS_PER_MILLISECOND, Faults, Hardware, PROMPT, Report, Settings,
};
use sonarfix_link::baked::BakedError;
use sonarfix_link::message::{self, Hello, LoopStatus, ResetCause};
use sonarfix_link::{Frame, SessionCommand, Telemetry};

use crate::boots;
use crate::check::Check;
use crate::flash_contents::{self, FlashContents};
use crate::store::{Resumed, Saved, Store};
use crate::time::{NEVER, after, before, since};

use clock::{Clock, Reading};
use drive::Drive;
use poll::Poll;
pub use poll::Polled;
use running::Running;
use search::PoseSearch;
pub use wire::Link;
use wire::Wire;

/// The search works up to this time after a poll has begun. Its longest slice takes 0.1 ms (`docs/search.md`), so that it
/// has ended before the next poll is due.
const SEARCH_UNTIL: Duration = Duration::from_ticks(800);

/// The facts of a board that are not in the configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Board {
    /// Version of the firmware.
    pub firmware: [u8; 3],
    /// The cause of the last reset.
    pub reset: ResetCause,
    /// Resets in a row before this start ([`boots`](crate::boots)).
    pub resets: u8,
}

/// The application.
#[expect(clippy::struct_excessive_bools, reason = "independent facts, each with a name")]
pub struct App<'m, F: NorFlash> {
    board: Board,
    map: Result<(Map<'m>, u32), MapError>,
    /// The checksum of the baked configuration.
    baked: Result<u32, BakedError>,
    /// The present configuration with its checksum: the baked one, or one that was sent later.
    config: Option<(RobotConfig, u32)>,
    store: Store<F>,
    /// The record in the store, if it has been read or written.
    stored: Option<Saved>,
    /// When the app began.
    started: Instant,
    /// Whether the record in the store is not the newest state.
    owes_record: bool,
    /// Whether the configuration in use is to be written.
    owes_config: bool,
    run: u32,
    /// The state from which the loop would start.
    known: Option<Resumed>,
    state: State<'m>,
    /// The search for the pose. It is not part of the state, because it is large and must not be moved.
    search: PoseSearch<'m>,
    drive: Drive,
    wire: Wire,
    /// When the last frame was received, or the app began.
    heard: Instant,
    /// Faults before the present run of the loop.
    faults: Faults,
    worst_poll: Duration,
    clock: Clock,
    time: Instant,
    /// Why the board cannot be the robot that the configuration in use describes.
    unsupported: Option<Unsupported>,
    /// Before this instant a poll has nothing to do, except for the loop and the link.
    rests_until: Instant,
    /// When the devices of a waiting robot are to be polled next: a later poll does not feed the watchdog.
    expected: Instant,
    /// What such a poll returns.
    at_rest: Polled,
    /// Whether the latest poll handled a command in place of the loop.
    has_answered: bool,
    /// Whether the store has been read. The first poll does it, because during construction the stack holds copies of
    /// the application.
    is_store_loaded: bool,
}

#[expect(clippy::large_enum_variant, reason = "there is one of it, and no heap")]
enum State<'m> {
    Waiting(Check),
    Running(Running<'m>),
}

impl<'m, F: NorFlash> App<'m, F> {
    /// A waiting application at the time `now`, with the contents of the flash.
    #[must_use]
    pub fn new(board: Board, flash: FlashContents<'m>, mut store: Store<F>, now: Instant) -> Self {
        store.limit().set_clock(now);
        Self {
            board,
            map: flash.map,
            baked: flash.config.map(|(_, checksum)| checksum),
            config: flash.config.ok(),
            store,
            stored: None,
            started: now,
            owes_record: false,
            owes_config: false,
            run: 1,
            known: None,
            state: State::Waiting(Check::new(now)),
            search: PoseSearch::default(),
            drive: Drive::default(),
            wire: Wire::default(),
            heard: now,
            faults: Faults::default(),
            worst_poll: Duration::from_ticks(0),
            clock: Clock::new(now),
            time: now,
            rests_until: now,
            expected: now,
            at_rest: Polled::default(),
            has_answered: false,
            is_store_loaded: false,
            unsupported: None,
        }
    }

    /// Handles what is due at `now`: a command, or one poll of the loop, or the telemetry of the last poll, so that none takes as
    /// long as all of them; after a command, the loop is polled before the next one. It never waits, except for the flash when a record is written.
    ///
    /// A `now` that leaps ahead or back is counted as a fault of the clock and has no other effect, unless the next poll
    /// confirms it: then the loop continues at the new time. The motors are off while each poll has another time.
    ///
    /// # Panics
    /// Never.
    pub fn poll(
        &mut self,
        now: Instant,
        hardware: &mut impl Hardware,
        link: &mut impl Link,
    ) -> Polled {
        match self.clock.read(now) {
            Reading::Usual => {}
            reading @ (Reading::Unconfirmed | Reading::Erratic) => {
                self.faults.clock = self.faults.clock.saturating_add(1);
                let is_trusted = reading == Reading::Unconfirmed;
                return Polled { may_drive: self.at_rest.may_drive && is_trusted, ..self.at_rest };
            }
            Reading::SetBack => {
                hardware.set_clock(now);
                self.set_clock(now);
            }
        }
        // An executor that polls less often than asked for must not lose every second poll.
        if self.send_telemetry(link) && since(now, self.time) <= PROMPT {
            self.time = now;
            return self.at_rest;
        }
        let has_answered = core::mem::take(&mut self.has_answered);
        let frame = if has_answered { None } else { self.wire.next(link) };
        if let State::Running(running) = &mut self.state
            && frame.is_none()
            && now >= self.time
            && now < self.rests_until
            && running.rest(now, hardware)
        {
            self.time = now;
            return self.at_rest;
        }
        self.poll_awake(now, frame.as_ref(), hardware, link)
    }

    /// A poll that has something to do.
    #[inline(never)]
    fn poll_awake(
        &mut self,
        now: Instant,
        frame: Option<&Frame<SessionCommand>>,
        hardware: &mut impl Hardware,
        link: &mut impl Link,
    ) -> Polled {
        let was_running = self.is_running();
        let mut poll = Poll { now, hardware, link, polled: Polled::default() };
        if !self.is_store_loaded {
            self.is_store_loaded = true;
            poll.polled.saved = self.load_store(now, poll.hardware).err().map(Err);
            poll.polled.unsupported = self.unsupported;
        }
        self.has_answered = frame.is_some_and(|frame| self.take_command(&mut poll, frame));
        if !self.has_answered {
            self.poll_state(&mut poll);
        }
        let Poll { link, mut polled, .. } = poll;
        self.write_pending(now, &mut polled);
        self.send_periodic(now, link);
        self.time = now;
        polled.is_settled = since(now, self.started) >= boots::SETTLED_AFTER;
        polled.is_running = self.is_running();
        polled.may_drive = self.may_drive(now);
        polled.has_changed = polled.is_running != was_running;
        self.at_rest = Polled {
            is_settled: polled.is_settled,
            is_running: polled.is_running,
            may_drive: polled.may_drive,
            ..Polled::default()
        };
        self.rests_until = self.next_deadline(now);
        polled
    }

    /// Executes a command; returns whether it takes the place of the loop in this poll.
    fn take_command(
        &mut self,
        poll: &mut Poll<impl Hardware, impl Link>,
        frame: &Frame<SessionCommand>,
    ) -> bool {
        self.heard = poll.now;
        let was_running = self.is_running();
        if let State::Running(running) = &mut self.state {
            running.clear_report();
        }
        self.answer(poll, frame);
        let is_prompt = matches!(&self.state, State::Running(running) if running.robot.is_prompt());
        if was_running && is_prompt {
            return true;
        }
        // Before the loop changes what it describes.
        self.send_telemetry(poll.link);
        false
    }

    /// Sends the telemetry of the last poll, if there is some; returns whether there was.
    #[inline]
    fn send_telemetry(&mut self, link: &mut impl Link) -> bool {
        let State::Running(running) = &mut self.state else { return false };
        let is_unsent = running.is_unsent();
        if is_unsent {
            running.send(&self.search, &mut self.wire, link);
        }
        is_unsent
    }

    /// Polls the loop, or the devices of a waiting robot.
    #[inline]
    fn poll_state(&mut self, poll: &mut Poll<impl Hardware, impl Link>) {
        let now = poll.now;
        match &mut self.state {
            State::Waiting(check) => {
                let config = self.config.as_ref().map(|(config, _)| config);
                poll.polled.missing = check.poll(now, config, poll.hardware);
                self.faults = self.faults.plus(poll.polled.missing);
                if let Some(readings) = check.readings(now, config, poll.hardware) {
                    self.wire.send(&Telemetry::Devices(readings), poll.link);
                }
                if let Some(ping) = check.take_ping() {
                    self.wire.send(&Telemetry::Sweep(ping), poll.link);
                }
                let tolerance = Settings::default().tolerance;
                poll.polled.is_on_time = since(now, self.expected) <= tolerance;
                self.expected = check.next_poll(now, poll.hardware);
            }
            State::Running(running) => {
                if running.poll(poll, &mut self.search) {
                    running.wrote(now);
                    self.owes_record = true;
                }
                if let Some((config, _)) = &self.config {
                    self.drive.observe(&running.report, running.robot.mode(), config);
                }
            }
        }
    }

    /// Continues at `now` after the clock was set back. What was due at a later time is due at once.
    #[inline(never)]
    fn set_clock(&mut self, now: Instant) {
        self.store.limit().set_clock(now);
        self.drive.stop();
        // A link that was silent stays silent: the motors of a robot that depends on it must not run longer.
        self.heard = before(now, since(self.time, self.heard));
        (self.started, self.time) = (now, now);
        (self.rests_until, self.expected) = (now, now);
        self.wire.set_clock();
        match &mut self.state {
            State::Waiting(check) => *check = Check::new(now),
            State::Running(running) => running.set_clock(now),
        }
    }

    /// Sends the messages that are due periodically.
    fn send_periodic(&mut self, now: Instant, link: &mut impl Link) {
        let has_worked =
            matches!(&self.state, State::Running(running) if running.report.has_worked());
        let is_busy = self.has_answered || has_worked;
        if self.wire.is_hello_due(now, is_busy) {
            let hello = self.hello();
            self.wire.send(&Telemetry::Hello(hello), link);
        }
        if self.wire.is_loop_due(now, is_busy) {
            let status = self.loop_status(now);
            self.wire.send(&Telemetry::LoopStatus(status), link);
        }
    }

    /// The next instant at which a poll has something to do besides the loop, the devices and the link.
    fn next_deadline(&self, now: Instant) -> Instant {
        let config = self.config.as_ref();
        let link_timeout =
            config.map_or(NEVER, |(config, _)| after(self.heard, config.motors.link_timeout));
        let odometry = self
            .localizer()
            .map_or(NEVER, |localizer| after(localizer.time(), DEGRADED_WITHOUT_ODOMETRY));
        // What these decide does not change once they have passed.
        let settled = after(self.started, boots::SETTLED_AFTER);
        let changes = [settled, link_timeout, odometry, self.drive.deadline()];
        let next = self.wire.next_deadline().min(self.next_write());
        changes.into_iter().filter(|&at| at >= now).fold(next, Instant::min)
    }

    /// When the application must be polled next, if no byte is received and no edge of the echo is stamped earlier; to be called
    /// after a poll. A board sleeps until then. An instant that has passed: at once.
    ///
    /// Polls at other times do nothing, so that the results do not depend on them.
    pub fn next_poll(&self, hardware: &mut impl Hardware) -> Instant {
        if self.is_unsent() || self.has_answered || self.wire.is_unread() {
            return self.time;
        }
        let next = match &self.state {
            State::Waiting(_) => self.expected,
            State::Running(running) => running.robot.next_poll(hardware),
        };
        next.min(self.rests_until)
    }

    /// Whether the next poll has to send the telemetry of the last one.
    fn is_unsent(&self) -> bool {
        matches!(&self.state, State::Running(running) if running.is_unsent())
    }

    /// As [`Self::next_poll`], but `None` while a ping is in flight ([`Robot::idle_until`](sonarfix_hal::robot::Robot::idle_until)): for a simulator.
    pub fn idle_until(&self, hardware: &mut impl Hardware) -> Option<Instant> {
        match &self.state {
            State::Waiting(_) => Some(self.next_poll(hardware)),
            State::Running(_) if self.is_unsent() || self.has_answered => Some(self.time),
            State::Running(running) => {
                running.robot.idle_until(hardware).map(|until| until.min(self.rests_until))
            }
        }
    }

    /// Records the duration of a poll, which the board measures.
    pub fn took(&mut self, poll: Duration) {
        self.worst_poll = self.worst_poll.max(poll);
    }

    /// Whether the loop runs.
    #[must_use]
    pub fn is_running(&self) -> bool {
        matches!(self.state, State::Running(_))
    }

    /// Whether the motors may be enabled.
    fn may_drive(&self, now: Instant) -> bool {
        let (Some(localizer), Some((config, _))) = (self.localizer(), &self.config) else {
            return false;
        };
        self.can_see_wheels(config) && config.motors.permits(localizer, now, self.heard)
    }

    /// The motion that the PC commands ([`Command::Drive`](sonarfix_link::Command::Drive)), after each poll; else, while the robot
    /// searches for its pose, that of its configuration ([`StartPose::Exploring`](sonarfix_hal::config::StartPose)). `None`: there is
    /// neither, the command was not renewed in time, or the motors may not be enabled; then the motor code stops the
    /// robot, or drives it by its own rules.
    ///
    /// A board that enables its motors polls at least every 10 ms, and when [`Self::next_poll`] asks for it, which is also
    /// the end of a motion.
    #[cfg(feature = "drive")]
    #[must_use]
    pub fn motion(&self) -> Option<sonarfix_link::Motion> {
        self.drive.motion(self.time).filter(|_| self.at_rest.may_drive)
    }

    /// Whether the encoders have been read since the loop started, or need not be.
    fn can_see_wheels(&self, config: &RobotConfig) -> bool {
        let has_read =
            matches!(&self.state, State::Running(running) if running.robot.has_read_encoders());
        config.motors.dead_encoder || has_read
    }

    /// The configuration in use, if there is one.
    #[must_use]
    pub fn configuration(&self) -> Option<&RobotConfig> {
        self.config.as_ref().map(|(config, _)| config)
    }

    /// The localizer, while the loop runs.
    #[must_use]
    pub fn localizer(&self) -> Option<&Localizer<'m>> {
        match &self.state {
            State::Running(running) => Some(running.robot.localizer()),
            State::Waiting(_) => None,
        }
    }

    /// What determines the pose, while the loop runs.
    #[must_use]
    pub fn navigation_mode(&self) -> Option<Mode> {
        match &self.state {
            State::Running(running) => Some(running.robot.mode()),
            State::Waiting(_) => None,
        }
    }

    /// Makes evaluations of the search between two polls, for a board that polls every millisecond; the next poll acts on
    /// the answer.
    ///
    /// They end 0.8 ms after the poll at `start`, or when there are as many as the simulation grants with
    /// that of the poll ([`EVALUATIONS_PER_MILLISECOND`]). `now` reads the clock that polls are called with.
    pub fn work(&mut self, start: Instant, mut now: impl FnMut() -> Instant) {
        let is_searching = |mode| mode != Mode::Tracking;
        if !self.navigation_mode().is_some_and(is_searching) {
            return;
        }
        for _ in 1..EVALUATIONS_PER_MILLISECOND {
            if since(now(), start) > SEARCH_UNTIL {
                return;
            }
            self.search.work();
        }
    }

    /// The report of the loop's last poll, while it runs.
    #[must_use]
    pub fn report(&self) -> Option<&Report> {
        match &self.state {
            State::Running(running) => Some(&running.report),
            State::Waiting(_) => None,
        }
    }

    /// The faults since the start.
    #[must_use]
    pub fn faults(&self) -> Faults {
        match &self.state {
            State::Running(running) => self.faults.plus(running.robot.faults()),
            State::Waiting(_) => self.faults,
        }
    }

    /// Pose and calibration while the loop does not run; `None` without a configuration.
    #[must_use]
    pub fn known(&self) -> Option<&Resumed> {
        self.known.as_ref()
    }

    /// The store.
    #[must_use]
    pub fn store(&self) -> &Store<F> {
        &self.store
    }

    /// The store, for tests.
    pub fn store_mut(&mut self) -> &mut Store<F> {
        &mut self.store
    }

    /// Releases the store.
    pub fn release(self) -> Store<F> {
        self.store
    }

    fn hello(&self) -> Hello {
        let configuration = match self.config {
            Some((_, checksum)) => message::ImageStatus::Valid(checksum),
            None => flash_contents::status(self.baked),
        };
        let Board { firmware, reset, .. } = self.board;
        Hello { firmware, map: flash_contents::map_status(&self.map), configuration, reset }
    }

    fn loop_status(&self, now: Instant) -> LoopStatus {
        LoopStatus {
            at: now,
            running: self.is_running(),
            faults: self.faults(),
            worst_poll: self.worst_poll,
            commands: self.wire.counters(),
            flash: self.store.status(),
            noise_factor: self.localizer().map_or(1.0, Localizer::noise_factor),
        }
    }
}
