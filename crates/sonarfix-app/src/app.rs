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
//! This file composes; `command` executes commands; `wire` reads the link and schedules telemetry. The deadline check
//! is [`Polled::is_on_time`].

mod clock;
mod command;
mod wire;

use embedded_storage::nor_flash::NorFlash;
use sonarfix::geometry::units::{Duration, Instant, Metres};
use sonarfix::health::{DEGRADED_WITHOUT_ODOMETRY, Verdict};
use sonarfix::localizer::Localizer;
use sonarfix::map::{Map, MapError};
use sonarfix_hal::config::{RobotConfig, Unsupported};
use sonarfix_hal::robot::{
    EVALUATIONS_PER_MILLISECOND, Faults, Hardware, Report, Robot, Settings, Step,
};
use sonarfix_link::baked::{self, BakedError};
use sonarfix_link::message::{self, CommandResult, Hello, LoopStatus, ResetCause};
use sonarfix_link::{Frame, Reporter, SessionCommand, Telemetry};
use sonarfix_search::navigator;
use sonarfix_search::search::Search;

use crate::boots;
use crate::check::Check;
use crate::flash_contents::{self, FlashContents};
use crate::store::{Resumed, SavePolicy, Saved, Store, StoreError};
use crate::time::{NEVER, after, since};

use clock::{Clock, Reading};
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

/// The result of one poll, without the loop's, which is [`App::report`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
#[expect(clippy::struct_excessive_bools, reason = "independent facts, each with a name")]
pub struct Polled {
    /// Faults that the device check has found, while the loop does not run.
    pub missing: Faults,
    /// The result of the command that was executed.
    pub answered: Option<CommandResult>,
    /// At the start: why the board cannot be the robot that its configuration describes.
    pub unsupported: Option<Unsupported>,
    /// The new health verdict, if it has changed.
    pub verdict: Option<Verdict>,
    /// The result of a write to the store.
    pub saved: Option<Result<(), StoreError>>,
    /// Whether this start counts as a success: a reason to set the register of [`boots`] to zero.
    pub is_settled: bool,
    /// Whether the loop runs.
    pub is_running: bool,
    /// Whether the motors may be enabled: while the loop runs, by the
    /// [`MotorPolicy`](sonarfix_hal::config::MotorPolicy) of the configuration.
    pub may_drive: bool,
    /// Whether the loop has been started or stopped in this poll.
    pub has_changed: bool,
    /// Whether a deadline was met: the only condition for feeding the watchdog.
    pub is_on_time: bool,
}

/// The application.
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
    mode: Mode<'m>,
    /// The search for the pose. It is not part of the mode, because it is large and must not be moved.
    search: Search<'m>,
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
    /// Whether the store has been read. The first poll does it, because during construction the stack holds copies of
    /// the application.
    is_store_loaded: bool,
}

#[expect(clippy::large_enum_variant, reason = "there is one of it, and no heap")]
enum Mode<'m> {
    Waiting(Check),
    Running(Running<'m>),
}

#[expect(clippy::struct_excessive_bools, reason = "independent facts, each with a name")]
struct Running<'m> {
    robot: Robot<'m>,
    reporter: Reporter,
    save_policy: SavePolicy,
    /// The state from which it started.
    origin: Resumed,
    /// Whether it searches for its pose if it does not have one.
    searches: bool,
    /// Whether a wheel has rolled since.
    has_rolled: bool,
    /// Whether the wheels could not be observed at a time since, when they may have rolled.
    has_been_blind: bool,
    /// The report of the last poll. It is stored here and not returned, because it is half a kilobyte.
    report: Report,
    /// Whether it is known to be empty.
    is_report_empty: bool,
}

impl<'m> Running<'m> {
    /// Whether the loop has nothing to do at `now`; then its report is empty.
    #[inline]
    fn rest(&mut self, now: Instant, hardware: &mut impl Hardware) -> bool {
        let rests = self.robot.rest(now, hardware);
        if rests && !self.is_report_empty {
            (self.report, self.is_report_empty) = (Report::default(), true);
        }
        rests
    }

    /// Polls the loop and sends its telemetry; returns whether a record is due.
    #[inline(never)]
    fn poll(
        &mut self,
        now: Instant,
        hardware: &mut impl Hardware,
        search: &mut Search<'m>,
        wire: &mut Wire,
        link: &mut impl Link,
        polled: &mut Polled,
    ) -> bool {
        if self.rest(now, hardware) {
            return false;
        }
        self.is_report_empty = false;
        let before = self.robot.localizer().health().verdict;
        let search_if_used = self.searches.then_some(&mut *search);
        self.robot.poll_into(now, hardware, search_if_used, &mut self.report);
        let report = &self.report;
        let localizer = self.robot.localizer();
        let verdict = localizer.health().verdict;
        polled.verdict = (verdict != before).then_some(verdict);
        self.reporter.report(report, localizer, &mut wire.outlet(link));
        let mode = self.robot.mode();
        if report.tick.is_some() && mode != navigator::Mode::Tracking {
            self.reporter.search(mode, search, &mut wire.outlet(link));
        }
        if has_rolled(report) {
            self.save_policy.rolled(now);
            self.has_rolled = true;
        }
        self.has_been_blind |= localizer.is_odometry_missing();
        let is_tracking = mode == navigator::Mode::Tracking;
        polled.is_on_time = report.tick.is_some() && report.faults.deadlines == 0;
        report.tick.is_some() && is_tracking && self.save_policy.is_due(now, localizer)
    }

    /// Continues at `now` after the clock was set back.
    fn set_clock(&mut self, now: Instant) {
        self.robot.set_clock(now);
        self.save_policy.set_clock(now);
    }

    /// The state after it has stopped.
    fn known(&self) -> Resumed {
        let is_searching = self.robot.mode() == navigator::Mode::Searching;
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
            mode: Mode::Waiting(Check::new(now)),
            search: Search::default(),
            wire: Wire::default(),
            heard: now,
            faults: Faults::default(),
            worst_poll: Duration::from_ticks(0),
            clock: Clock::new(now),
            time: now,
            rests_until: now,
            expected: now,
            at_rest: Polled::default(),
            is_store_loaded: false,
            unsupported: None,
        }
    }

    /// Handles what is due at `now`: at most one command, one poll of the loop, and telemetry. It never waits, except
    /// for the flash when a record is written.
    ///
    /// A `now` that leaps ahead or back is counted as a fault of the clock and has no other effect, unless the next poll
    /// confirms it: then the loop continues at the new time.
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
            Reading::Unconfirmed => {
                self.faults.clock = self.faults.clock.saturating_add(1);
                return self.at_rest;
            }
            Reading::SetBack => self.set_clock(now),
        }
        let frame = self.wire.next(link);
        if let Mode::Running(running) = &mut self.mode
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
        let mut polled = Polled::default();
        if !self.is_store_loaded {
            self.is_store_loaded = true;
            polled.saved = self.load_store(now, hardware).err().map(Err);
            polled.unsupported = self.unsupported;
        }
        if let Some(frame) = frame {
            self.heard = now;
            self.answer(now, frame, hardware, link, &mut polled);
        }
        match &mut self.mode {
            Mode::Waiting(check) => {
                let config = self.config.as_ref().map(|(config, _)| config);
                polled.missing = check.poll(now, config, hardware);
                self.faults = self.faults.plus(polled.missing);
                if let Some(readings) = check.readings(now, config, hardware) {
                    self.wire.send(&Telemetry::Devices(readings), link);
                }
                if let Some(ping) = check.take_ping() {
                    self.wire.send(&Telemetry::Sweep(ping), link);
                }
                polled.is_on_time = since(now, self.expected) <= Settings::default().tolerance;
                self.expected = check.next_poll(now, hardware);
            }
            Mode::Running(running) => {
                let (search, wire) = (&mut self.search, &mut self.wire);
                let is_due = running.poll(now, hardware, search, wire, link, &mut polled);
                if is_due {
                    running
                        .save_policy
                        .wrote(now, running.robot.localizer().filter().standard_deviations());
                    self.owes_record = true;
                }
            }
        }
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

    /// Continues at `now` after the clock was set back. What was due at a later time is due at once.
    #[inline(never)]
    fn set_clock(&mut self, now: Instant) {
        self.store.limit().set_clock(now);
        (self.started, self.heard, self.time) = (now, now, now);
        (self.rests_until, self.expected) = (now, now);
        self.wire.set_clock();
        match &mut self.mode {
            Mode::Waiting(check) => *check = Check::new(now),
            Mode::Running(running) => running.set_clock(now),
        }
    }

    /// Sends the messages that are due periodically.
    fn send_periodic(&mut self, now: Instant, link: &mut impl Link) {
        let is_busy = matches!(&self.mode, Mode::Running(running) if running.report.has_worked());
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
        let changes = [after(self.started, boots::SETTLED_AFTER), link_timeout, odometry];
        let next = self.wire.next_deadline().min(self.next_write());
        changes.into_iter().filter(|&at| at >= now).fold(next, Instant::min)
    }

    /// When a record that is owed can be written.
    fn next_write(&self) -> Instant {
        let owed = [(self.owes_record, u8::from(!self.is_running())), (self.owes_config, 1)];
        let owed = owed.into_iter().filter(|&(is_owed, _)| is_owed && !self.ignores_store());
        owed.fold(NEVER, |next, (_, reserve)| next.min(self.store.next_write(reserve)))
    }

    /// When the application must be polled next, if no byte is received and no edge of the echo is stamped earlier; to be called
    /// after a poll. A board sleeps until then. An instant that has passed: at once.
    ///
    /// Polls at other times do nothing, so that the results do not depend on them.
    pub fn next_poll(&self, hardware: &mut impl Hardware) -> Instant {
        if self.wire.is_unread() {
            return self.time;
        }
        let next = match &self.mode {
            Mode::Waiting(_) => self.expected,
            Mode::Running(running) => running.robot.next_poll(hardware),
        };
        next.min(self.rests_until)
    }

    /// As [`Self::next_poll`], but `None` while a ping is in flight ([`Robot::idle_until`]): for a simulator.
    pub fn idle_until(&self, hardware: &mut impl Hardware) -> Option<Instant> {
        match &self.mode {
            Mode::Waiting(_) => Some(self.next_poll(hardware)),
            Mode::Running(running) => {
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
        matches!(self.mode, Mode::Running(_))
    }

    /// Whether the motors may be enabled.
    fn may_drive(&self, now: Instant) -> bool {
        let (Some(localizer), Some((config, _))) = (self.localizer(), &self.config) else {
            return false;
        };
        config.motors.permits(localizer, now, self.heard)
    }

    /// The localizer, while the loop runs.
    #[must_use]
    pub fn localizer(&self) -> Option<&Localizer<'m>> {
        match &self.mode {
            Mode::Running(running) => Some(running.robot.localizer()),
            Mode::Waiting(_) => None,
        }
    }

    /// What determines the pose, while the loop runs.
    #[must_use]
    pub fn navigation_mode(&self) -> Option<navigator::Mode> {
        match &self.mode {
            Mode::Running(running) => Some(running.robot.mode()),
            Mode::Waiting(_) => None,
        }
    }

    /// The search for the pose; its state has a meaning while the mode is not `Tracking`.
    #[must_use]
    pub fn search(&self) -> &Search<'m> {
        &self.search
    }

    /// Makes evaluations of the search between two polls, for a board that polls every millisecond; the next poll acts on
    /// the answer.
    ///
    /// They end 0.8 ms after the poll at `start`, or when there are as many as the simulation grants with
    /// that of the poll ([`EVALUATIONS_PER_MILLISECOND`]). `now` reads the clock that polls are called with.
    pub fn work(&mut self, start: Instant, mut now: impl FnMut() -> Instant) {
        let is_searching = |mode| mode != navigator::Mode::Tracking;
        if !self.navigation_mode().is_some_and(is_searching) {
            return;
        }
        for _ in 1..EVALUATIONS_PER_MILLISECOND {
            if since(now(), start) > SEARCH_UNTIL {
                return;
            }
            self.search.poll(1);
        }
    }

    /// The report of the loop's last poll, while it runs.
    #[must_use]
    pub fn report(&self) -> Option<&Report> {
        match &self.mode {
            Mode::Running(running) => Some(&running.report),
            Mode::Waiting(_) => None,
        }
    }

    /// The faults since the start.
    #[must_use]
    pub fn faults(&self) -> Faults {
        match &self.mode {
            Mode::Running(running) => self.faults.plus(running.robot.faults()),
            Mode::Waiting(_) => self.faults,
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

    /// Configures the drivers for the present configuration, if there is one.
    fn configure_devices(&mut self, hardware: &mut impl Hardware) {
        self.unsupported = self.config.and_then(|(config, _)| hardware.configure(&config).err());
    }

    /// Reads the store, and configures the drivers. A stored configuration with which the robot could not start is not
    /// used.
    #[inline(never)]
    fn load_store(&mut self, now: Instant, hardware: &mut impl Hardware) -> Result<(), StoreError> {
        if self.ignores_store() {
            self.configure_devices(hardware);
            self.known = self.known_at_start();
            return Err(StoreError::Ignored);
        }
        let opened = self.store.open();
        // A store that cannot be repaired can still be read.
        let read = opened.and(self.load_record());
        let sent = self.load_config();
        let sent = match sent {
            Ok(Some(config)) => self.take_config(now, &config, hardware),
            Ok(None) => Ok(()),
            Err(error) => Err(error),
        };
        if self.known.is_none() {
            self.configure_devices(hardware);
            self.known = self.known_at_start();
        }
        match sent {
            Err(StoreError::Configuration) => sent,
            _ => read.and(sent),
        }
    }

    /// Uses a stored configuration, if the robot can start with it.
    fn take_config(
        &mut self,
        now: Instant,
        config: &RobotConfig,
        hardware: &mut impl Hardware,
    ) -> Result<(), StoreError> {
        let checksum = baked::checksum(config);
        let known = self.known_with(config, checksum);
        let can_start = self.check_start_with(now, config, &known).is_ok();
        if !can_start || hardware.configure(config).is_err() {
            return Err(StoreError::Configuration);
        }
        self.config = Some((*config, checksum));
        self.known = Some(known);
        Ok(())
    }

    fn load_record(&mut self) -> Result<(), StoreError> {
        let stored = self.store.load();
        self.stored = stored.ok().flatten();
        self.run = self.stored.map_or(1, |saved| saved.run.saturating_add(1));
        stored.map(drop)
    }

    /// The configuration that was sent and replaces the baked one, if there is one.
    fn load_config(&mut self) -> Result<Option<RobotConfig>, StoreError> {
        let replaced = self.baked();
        let kept = self.store.load_config()?.filter(|kept| kept.replaces == replaced);
        Ok(kept.map(|kept| kept.config))
    }

    fn known_at_start(&self) -> Option<Resumed> {
        let (config, checksum) = self.config.as_ref()?;
        Some(self.known_with(config, *checksum))
    }

    /// The state at the start with this configuration.
    fn known_with(&self, config: &RobotConfig, checksum: u32) -> Resumed {
        match &self.stored {
            Some(saved) => Resumed::from(saved, &config.localizer, checksum),
            None => Resumed::afresh(&config.localizer),
        }
    }

    /// Checksum of the baked configuration, zero for none.
    fn baked(&self) -> u32 {
        self.baked.unwrap_or(0)
    }

    /// The present state as a record; `None` without a configuration.
    fn record(&self, now: Instant) -> Option<Saved> {
        let known = self.known_now()?;
        let is_parked = known.has_pose && !self.is_running();
        Some(self.record_of(now, &known, is_parked))
    }

    fn record_of(&self, now: Instant, known: &Resumed, is_parked: bool) -> Saved {
        let configuration = self.config.map_or(0, |(_, checksum)| checksum);
        let seconds = u32::try_from(now.ticks() / 1_000_000).unwrap_or(u32::MAX);
        let Resumed { state, deviation, .. } = *known;
        Saved { run: self.run, seconds, configuration, is_parked, state, deviation }
    }

    /// The present state; while the loop runs, the state after it has stopped.
    fn known_now(&self) -> Option<Resumed> {
        match &self.mode {
            Mode::Waiting(_) => self.known,
            Mode::Running(running) => Some(running.known()),
        }
    }

    /// Whether the store is not used, because reading it may be what resets the robot.
    pub(super) fn ignores_store(&self) -> bool {
        self.board.resets >= boots::MAX_RESETS
    }

    /// Writes pending records to the flash, as far as the write limit permits.
    fn write_pending(&mut self, now: Instant, polled: &mut Polled) {
        if self.ignores_store() {
            return;
        }
        let reserve = u8::from(!self.is_running());
        if self.owes_record && self.store.limit().take(now, reserve) {
            if let Some(saved) = self.record(now) {
                polled.saved = Some(self.write(&saved));
            }
        } else if self.owes_config && self.store.limit().take(now, 1) {
            let replaces = self.baked();
            let config = self.config.as_ref();
            let written = config.map(|(config, _)| self.store.save_replacement(replaces, config));
            self.owes_config = matches!(written, Some(Err(_)));
            polled.saved = written;
        }
    }

    /// Writes a record; after a failure it remains pending.
    fn write(&mut self, saved: &Saved) -> Result<(), StoreError> {
        let written = self.store.save(saved);
        self.owes_record = written.is_err();
        if written.is_ok() {
            self.stored = Some(*saved);
        }
        written
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
        }
    }
}

fn has_rolled(report: &Report) -> bool {
    // By reference: a copy of a step takes 150 instructions.
    let rolled = |step: Option<&Step>| {
        step.is_some_and(|Step { travel, .. }| {
            travel.right.abs() > Metres(0.0) || travel.left.abs() > Metres(0.0)
        })
    };
    rolled(report.tick.as_ref().and_then(|tick| tick.step.as_ref()))
        || rolled(report.ping_result.as_ref().and_then(|heard| heard.step.as_ref()))
}
