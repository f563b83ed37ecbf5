//! The application: when the loop runs, what commands do, what is told when.
//!
//! ```text
//!                Start, with map, configuration and pose
//!   Waiting ────────────────────────────────────────────▶ Running
//!     ▲  the devices are checked once a second     the robot's loop │
//!     └──────────────────────── Stop ───────────────────────────────┘
//! ```
//!
//! A robot that waits must stay still: [`Polled::is_running`] is what the board enables its motor
//! driver with.
//!
//! Responsibilities, one file each: this one joins; `command` does what the robot is told;
//! `wire` says what is told when, and reads the link.

mod command;
mod wire;

use embedded_storage::nor_flash::NorFlash;
use sonarfix::config::Config;
use sonarfix::health::Verdict;
use sonarfix::localizer::Localizer;
use sonarfix::units::{Duration, Instant, Metres};
use sonarfix_hal::encoder::Wheels;
use sonarfix_hal::robot::{Faults, Hardware, Report, Robot, Settings, SettingsError, Step};
use sonarfix_link::message::{self, Hello, Loop, Outcome, Reset};
use sonarfix_link::{Reporter, Telemetry, baked};

use crate::check::Check;
use crate::flashed::Flashed;
use crate::store::{Habit, Kept, Resumed, Saved, Store, StoreError};
use crate::time::since;

pub use wire::Link;
use wire::Wire;

/// What does not change while the robot is on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// The wheels.
    pub wheels: Wheels,
    /// Settings of the loop.
    pub settings: Settings,
    /// Version of the firmware.
    pub firmware: [u8; 3],
    /// Why it started.
    pub reset: Reset,
}

/// What one poll did, beside what [`App::report`] tells of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub struct Polled {
    /// What the check of the devices found wrong, while the loop does not run.
    pub missing: Faults,
    /// A command was answered so.
    pub answered: Option<Outcome>,
    /// The verdict on the estimate is another than before.
    pub verdict: Option<Verdict>,
    /// The record was written, or was to be.
    pub saved: Option<Result<(), StoreError>>,
    /// Whether the loop runs, so that the robot may drive.
    pub is_running: bool,
    /// Whether it has just begun or been stopped.
    pub has_changed: bool,
    /// A deadline was met: a reason to feed the watchdog, and the only one.
    pub is_on_time: bool,
}

/// The application.
pub struct App<'m, F: NorFlash> {
    body: Body,
    flashed: Flashed<'m>,
    /// The configuration in use, with its checksum: the baked one, or one that was sent since.
    config: Option<(Config, u32)>,
    store: Store<F>,
    /// What lies in the store, as far as it was read or written.
    stored: Option<Saved>,
    run: u32,
    /// Where the loop would begin from.
    known: Option<Resumed>,
    mode: Mode<'m>,
    wire: Wire,
    /// What went wrong before the loop that runs now began.
    faults: Faults,
    worst_poll: Duration,
    time: Instant,
    /// Whether the store has been read: by the first poll, not while the app is being made and
    /// the stack holds copies of it.
    has_remembered: bool,
}

#[expect(clippy::large_enum_variant, reason = "there is one of it, and no heap")]
enum Mode<'m> {
    Waiting(Check),
    Running(Running<'m>),
}

struct Running<'m> {
    robot: Robot<'m>,
    reporter: Reporter,
    habit: Habit,
    /// What the last poll did: here, and not handed on, for it is half a kilobyte.
    report: Report,
}

impl Running<'_> {
    /// Polls the loop and reports it; whether something is worth writing down.
    #[inline(never)]
    fn poll(
        &mut self,
        now: Instant,
        hardware: &mut impl Hardware,
        wire: &mut Wire,
        link: &mut impl Link,
        polled: &mut Polled,
    ) -> bool {
        let before = self.robot.localizer().health().verdict;
        self.report = self.robot.poll(now, hardware);
        let report = &self.report;
        let localizer = self.robot.localizer();
        let verdict = localizer.health().verdict;
        polled.verdict = (verdict != before).then_some(verdict);
        self.reporter.report(report, localizer, |said| wire.send(said, link));
        if has_rolled(report) {
            self.habit.rolled(now);
        }
        polled.is_on_time = report.tick.is_some() && report.faults.deadlines == 0;
        report.tick.is_some() && self.habit.is_due(now, localizer)
    }
}

impl<'m, F: NorFlash> App<'m, F> {
    /// An app that waits, at the time `now`, with what the flash holds.
    ///
    /// # Errors
    /// [`SettingsError`], by which setting of the loop breaks its rule.
    pub fn new(
        body: Body,
        flashed: Flashed<'m>,
        store: Store<F>,
        now: Instant,
    ) -> Result<Self, SettingsError> {
        body.settings.check()?;
        let app = Self {
            body,
            flashed,
            config: flashed.config.ok(),
            store,
            stored: None,
            run: 1,
            known: None,
            mode: Mode::Waiting(Check::new(now)),
            wire: Wire::default(),
            faults: Faults::default(),
            worst_poll: Duration::from_ticks(0),
            time: now,
            has_remembered: false,
        };
        Ok(app)
    }

    /// Does what is due at `now`: one command at most, one poll of the loop, and telemetry. It
    /// never waits, but for the flash when a record is written.
    ///
    /// # Panics
    /// Never.
    pub fn poll(
        &mut self,
        now: Instant,
        hardware: &mut impl Hardware,
        link: &mut impl Link,
    ) -> Polled {
        let was_running = self.is_running();
        let mut polled = Polled::default();
        if !self.has_remembered {
            self.has_remembered = true;
            polled.saved = self.remember().err().map(Err);
        }
        if let Some(frame) = self.wire.next(link) {
            self.answer(now, &frame, link, &mut polled);
        }
        match &mut self.mode {
            Mode::Waiting(check) => {
                polled.missing = check.poll(now, hardware);
                self.faults = self.faults.plus(polled.missing);
                polled.is_on_time = since(now, self.time) <= self.body.settings.tolerance;
            }
            Mode::Running(running) => {
                let is_due = running.poll(now, hardware, &mut self.wire, link, &mut polled);
                if is_due {
                    let saved = self.record(now, false);
                    polled.saved = saved.map(|saved| self.write(now, &saved));
                }
            }
        }
        if self.wire.is_hello_due(now) {
            let hello = self.hello();
            self.wire.send(&Telemetry::Hello(hello), link);
        }
        if self.wire.is_loop_due(now) {
            let told = self.told(now);
            self.wire.send(&Telemetry::Loop(told), link);
        }
        self.time = now;
        polled.is_running = self.is_running();
        polled.has_changed = polled.is_running != was_running;
        polled
    }

    /// Takes note of how long a poll has taken, which only the board's clock can tell.
    pub fn took(&mut self, poll: Duration) {
        self.worst_poll = self.worst_poll.max(poll);
    }

    /// Whether the loop runs.
    #[must_use]
    pub fn is_running(&self) -> bool {
        matches!(self.mode, Mode::Running(_))
    }

    /// The localizer, while the loop runs.
    #[must_use]
    pub fn localizer(&self) -> Option<&Localizer<'m>> {
        match &self.mode {
            Mode::Running(running) => Some(running.robot.localizer()),
            Mode::Waiting(_) => None,
        }
    }

    /// What the last poll of the loop did, while it runs.
    #[must_use]
    pub fn report(&self) -> Option<&Report> {
        match &self.mode {
            Mode::Running(running) => Some(&running.report),
            Mode::Waiting(_) => None,
        }
    }

    /// What went wrong since the start.
    #[must_use]
    pub fn faults(&self) -> Faults {
        match &self.mode {
            Mode::Running(running) => self.faults.plus(running.robot.faults()),
            Mode::Waiting(_) => self.faults,
        }
    }

    /// What the flash held at the start.
    #[must_use]
    pub fn flashed(&self) -> &Flashed<'m> {
        &self.flashed
    }

    /// What the robot knows of its pose and calibration while the loop does not run; `None`
    /// without a configuration.
    #[must_use]
    pub fn known(&self) -> Option<&Resumed> {
        self.known.as_ref()
    }

    /// Gives the store back.
    pub fn release(self) -> Store<F> {
        self.store
    }

    /// Reads the store; one that cannot be read is made anew, which is an error to tell.
    #[inline(never)]
    fn remember(&mut self) -> Result<(), StoreError> {
        let mut read = self.recall();
        if let Err(StoreError::Corrupt) = read {
            read = self.store.format().and(read);
        }
        self.run = self.stored.map_or(1, |saved| saved.run.saturating_add(1));
        let stored = self.stored;
        self.known = self.config.map(|(config, checksum)| match stored {
            Some(saved) => Resumed::from(&saved, &config, checksum),
            None => Resumed::afresh(&config),
        });
        read
    }

    fn recall(&mut self) -> Result<(), StoreError> {
        self.stored = self.store.load()?;
        let replaced = self.baked();
        let kept = self.store.load_config()?.filter(|kept| kept.replaces == replaced);
        if let Some(Kept { config, .. }) = kept.filter(|kept| kept.config.check().is_ok()) {
            self.config = Some((config, baked::checksum(&config)));
        }
        Ok(())
    }

    /// Checksum of the baked configuration, zero for none.
    fn baked(&self) -> u32 {
        self.flashed.config.map_or(0, |(_, checksum)| checksum)
    }

    /// What would be written down now; `None` without a configuration.
    fn record(&self, now: Instant, is_parked: bool) -> Option<Saved> {
        let (_, configuration) = self.config?;
        let (state, deviation, is_parked) = match &self.mode {
            Mode::Running(running) => {
                let filter = running.robot.localizer().filter();
                (filter.state(), filter.deviation(), is_parked)
            }
            Mode::Waiting(_) => {
                let known = self.known.as_ref()?;
                (known.state, known.deviation, is_parked && known.has_pose)
            }
        };
        let seconds = u32::try_from(now.ticks() / 1_000_000).unwrap_or(u32::MAX);
        Some(Saved { run: self.run, seconds, configuration, is_parked, state, deviation })
    }

    fn write(&mut self, now: Instant, saved: &Saved) -> Result<(), StoreError> {
        let written = self.store.save(saved);
        if written.is_ok() {
            self.stored = Some(*saved);
        }
        // Tried is done: a flash that fails is not tried again at every tick.
        if let Mode::Running(running) = &mut self.mode {
            running.habit.wrote(now, saved.deviation);
        }
        written
    }

    fn hello(&self) -> Hello {
        let configuration = match self.config {
            Some((_, checksum)) => message::Flashed::Valid(checksum),
            None => self.flashed.config_state(),
        };
        let Body { firmware, reset, .. } = self.body;
        Hello { firmware, map: self.flashed.map_state(), configuration, reset }
    }

    fn told(&self, now: Instant) -> Loop {
        Loop {
            at: now,
            running: self.is_running(),
            faults: self.faults(),
            worst_poll: self.worst_poll,
            commands: self.wire.counters(),
        }
    }
}

fn has_rolled(report: &Report) -> bool {
    let rolled = |step: Option<Step>| {
        step.is_some_and(|Step { travel, .. }| {
            travel.right.abs() > Metres(0.0) || travel.left.abs() > Metres(0.0)
        })
    };
    rolled(report.tick.and_then(|tick| tick.step)) || rolled(report.heard.and_then(|h| h.step))
}
