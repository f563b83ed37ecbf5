//! A robot of the campaign: the shipped application on simulated parts, with a PC at its link, and the rules that hold in
//! every poll.

mod rules;
mod since;
mod wiring;

use std::collections::VecDeque;

use anyhow::{Context, ensure};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::health::{Health, Verdict};
use sonarfix::localizer::{Fix, Mode, Start};
use sonarfix::sensor::absolute::{AbsoluteMeasurement, PositionNoise};
use sonarfix_app::{App, Link, Polled};
use sonarfix_hal::robot::Hardware as _;
use sonarfix_link::message::CommandResult;
use sonarfix_link::{Command, Receiver, Sender, SessionCommand, Telemetry, frame};

use super::case::{Composition, Fault, Part};
use super::flash::Flash;
use super::parts::{Channel, SimRanger};
use super::room::Place;
use since::Since;
pub use wiring::Baked;
use wiring::{Hardware, MOUNTS, POLL, app, hardware, servo};

/// Metres.
const TRACK_WIDTH: f64 = 0.16;
/// m/s.
const SPEED: f64 = 0.15;
/// Radius of the circle that it drives, metres.
const RADIUS: f64 = 0.5;

/// The link.
#[derive(Default)]
struct Line {
    is_unplugged: bool,
    to_robot: VecDeque<u8>,
    from_robot: Vec<u8>,
}

impl Link for Line {
    fn receive(&mut self) -> Option<u8> {
        let byte = self.to_robot.pop_front();
        byte.filter(|_| !self.is_unplugged)
    }

    fn send(&mut self, frame: &[u8]) {
        if !self.is_unplugged {
            self.from_robot.extend(frame);
        }
    }
}

/// A robot that is switched on.
pub struct Robot<'m> {
    baked: &'m Baked,
    composition: Composition,
    app: App<'m, Flash>,
    hardware: Hardware,
    channels: [Channel; 3],
    /// Faults of right, left, gyro, source of positions.
    faults: [Fault; 4],
    line: Line,
    /// µs.
    real: u64,
    /// Time of the robot's clock at the real time `real`, µs.
    clock: u64,
    pub place: Place,
    /// Whether it drives while its motors are enabled.
    pub drives: bool,
    may_drive: bool,
    /// The true bearings of the servos.
    bearings: [f64; 3],
    receiver: Receiver<Telemetry>,
    sender: Sender<SessionCommand>,
    session: u32,
    /// Frames that were sent.
    sent: VecDeque<Vec<u8>>,
    noise: ChaCha8Rng,
    since: Since,
    /// When the next position from outside is due.
    absolute_at: u64,
    /// Whether the PC asks for the checksum of the map once a second, so that the link does not count as lost.
    pub keeps_link: bool,
    /// When it asks next.
    asks_at: u64,
    /// Accepted ranges.
    pub accepted: u32,
}

impl<'m> Robot<'m> {
    /// Switches a robot on.
    ///
    /// # Errors
    /// What breaks a rule.
    pub fn new(baked: &'m Baked, composition: Composition, seed: u64) -> anyhow::Result<Self> {
        let channels: [Channel; 3] = Default::default();
        let app = app(baked, Flash::new(seed), 0)?;
        let mut robot = Self {
            baked,
            composition,
            app,
            hardware: hardware(&channels, seed),
            channels,
            faults: [Fault::None; 4],
            line: Line::default(),
            real: 0,
            clock: 0,
            place: Place::START,
            drives: false,
            may_drive: false,
            bearings: [0.0; 3],
            receiver: Receiver::new(),
            sender: Sender::starting_at(1),
            session: 0,
            sent: VecDeque::new(),
            noise: ChaCha8Rng::seed_from_u64(seed),
            since: Since::default(),
            absolute_at: 0,
            keeps_link: false,
            asks_at: 0,
            accepted: 0,
        };
        robot.begin()?;
        Ok(robot)
    }

    /// The first polls, and a session.
    fn begin(&mut self) -> anyhow::Result<()> {
        self.pass(2_000)?;
        if !self.line.is_unplugged {
            self.open_session()?;
        }
        Ok(())
    }

    /// Switches the robot off, in a write after so many words if it writes, and on again after so many resets in a row.
    ///
    /// # Errors
    /// What breaks a rule.
    pub fn power_cut(self, words: u16, resets: u8) -> anyhow::Result<Self> {
        let mut robot = self;
        robot.flash().cut_after(words);
        let start = robot.true_start();
        robot.send(&Command::SetPose(start));
        robot.pass(3_000)?;
        let Self { baked, app, hardware, .. } = robot;
        let mut flash = app.release().release();
        flash.power_up();
        robot.app = wiring::app(baked, flash, resets)?;
        robot.hardware = hardware;
        for (ranger, channel) in (0..).zip(&robot.channels) {
            let id = sonarfix::config::RangerId(ranger);
            *robot.hardware.servo_of(id) = servo(channel);
            robot.hardware.ranger_of(id).reset();
        }
        robot.line = Line { is_unplugged: robot.line.is_unplugged, ..Line::default() };
        (robot.clock, robot.may_drive) = (0, false);
        robot.since = Since { blind: robot.since.blind, ..Since::default() };
        robot.restart_times();
        robot.begin()?;
        Ok(robot)
    }

    /// What is due periodically is counted from now.
    fn restart_times(&mut self) {
        let now = self.real;
        (self.since.tick, self.since.status, self.since.heard) = (now, now, now);
    }

    fn flash(&mut self) -> &mut Flash {
        self.app.store_mut().flash_mut()
    }

    /// Lets a part fail, or work again.
    pub fn set_fault(&mut self, part: Part, fault: Fault) {
        let [right, left, gyro, absolute] = &mut self.faults;
        match part {
            Part::Right => *right = fault,
            Part::Left => *left = fault,
            Part::Gyro => *gyro = fault,
            Part::Absolute => *absolute = fault,
            Part::Servo(number) => {
                if let Some(channel) = self.channels.get(usize::from(number)) {
                    channel.fault.set(fault);
                }
            }
            Part::Ranger(number) => {
                self.hardware.ranger_of(sonarfix::config::RangerId(number)).fault = fault;
            }
            Part::Flash => self.flash().fault = fault,
        }
        let devices = &mut self.hardware.devices.devices;
        (devices.right.fault, devices.left.fault) = (self.faults[0], self.faults[1]);
        self.hardware.gyro.fault = self.faults[2];
        let is_blind = self.faults[0] == Fault::Dead || self.faults[1] == Fault::Dead;
        self.since.blind = is_blind.then(|| self.since.blind.unwrap_or(self.real));
        let measures =
            |ranger: &SimRanger| matches!(ranger.fault, Fault::None | Fault::Frozen | Fault::Lying);
        let further =
            self.hardware.devices.rangers.iter().take(usize::from(self.composition.rangers) - 1);
        let measures =
            measures(&self.hardware.devices.devices.ranger) || further.into_iter().any(measures);
        self.since.no_range = (!measures).then(|| self.since.no_range.unwrap_or(self.real));
    }

    /// Makes all parts work again, but for the flash if it stays as it is.
    pub fn mend(&mut self, flash_stays: bool) {
        for part in [Part::Right, Part::Left, Part::Gyro, Part::Absolute] {
            self.set_fault(part, Fault::None);
        }
        for ranger in 0..3 {
            self.set_fault(Part::Servo(ranger), Fault::None);
            self.set_fault(Part::Ranger(ranger), Fault::None);
        }
        if !flash_stays {
            self.set_fault(Part::Flash, Fault::None);
        }
    }

    /// Unplugs the link, or plugs it.
    pub fn unplug(&mut self, is_unplugged: bool) {
        self.line.is_unplugged = is_unplugged;
        self.since.status = self.real;
    }

    /// Sets the clock ahead, or back.
    pub fn set_clock(&mut self, millis: i64) {
        self.clock = self.clock.saturating_add_signed(1_000 * millis);
        // The first poll has no effect, and the second one confirms the new time.
        self.since.heard += 2 * POLL;
        self.since.blind = self.since.blind.map(|since| since + 2 * POLL);
    }

    /// A poll whose time is ahead by so much, µs.
    ///
    /// # Errors
    /// What breaks a rule.
    pub fn torn_poll(&mut self, ahead: u64) -> anyhow::Result<()> {
        self.poll_at(self.clock.saturating_add(ahead)).map(drop)
    }

    /// So many polls, each at any time.
    ///
    /// # Errors
    /// What breaks a rule.
    pub fn broken_clock(&mut self, polls: u8) -> anyhow::Result<()> {
        for _ in 0..polls {
            self.advance(1_000);
            self.excuse(1_000);
            self.since.leaps += 1;
            let any = self.noise.next_u64() >> 3;
            let _ = self.poll_at(any)?;
        }
        self.since.leaps = 0;
        Ok(())
    }

    /// The program is not polled for a time, µs.
    ///
    /// # Errors
    /// What breaks a rule.
    pub fn stall(&mut self, micros: u64) -> anyhow::Result<()> {
        self.advance(micros);
        self.excuse(micros);
        self.poll_at(self.clock).map(drop)
    }

    /// What is due may be late by so much.
    fn excuse(&mut self, micros: u64) {
        self.since.tick += micros;
        self.since.status += micros;
        self.since.heard += micros;
        self.since.blind = self.since.blind.map(|since| since + micros);
    }

    /// Lets a time pass, µs.
    ///
    /// # Errors
    /// What breaks a rule.
    pub fn pass(&mut self, micros: u64) -> anyhow::Result<()> {
        let end = self.real + micros;
        while self.real < end {
            let _ = self.step()?;
        }
        Ok(())
    }

    /// Advances to the next poll.
    fn step(&mut self) -> anyhow::Result<Polled> {
        let due = self.app.next_poll(&mut self.hardware).ticks();
        self.advance(due.saturating_sub(self.clock).clamp(1_000, POLL));
        self.measure_position();
        if self.keeps_link && self.real >= self.asks_at {
            self.asks_at = self.real + 1_000_000;
            self.send(&Command::MapChecksum);
        }
        self.poll_at(self.clock)
    }

    /// Moves the robot while its motors are on.
    #[expect(clippy::cast_precision_loss, reason = "a few seconds")]
    fn advance(&mut self, micros: u64) {
        self.real += micros;
        self.clock = self.clock.saturating_add(micros);
        let seconds = 1e-6 * micros as f64;
        let moves = self.drives && self.may_drive;
        let (advance, turn) =
            if moves { (SPEED * seconds, SPEED / RADIUS * seconds) } else { (0.0, 0.0) };
        self.place.roll(advance, turn);
        let devices = &mut self.hardware.devices.devices;
        devices.right.roll(advance + 0.5 * TRACK_WIDTH * turn);
        devices.left.roll(advance - 0.5 * TRACK_WIDTH * turn);
        self.hardware.gyro.rate = if seconds > 0.0 { turn / seconds } else { 0.0 };
    }

    /// What each ranger would measure now.
    fn sense(&mut self) {
        for (number, mount) in (0..self.composition.rangers).zip(MOUNTS) {
            let id = sonarfix::config::RangerId(number);
            let target = self.hardware.servo_of(id).target();
            let at = usize::from(number);
            let is_stuck = self.channels.get(at).is_some_and(|it| it.fault.get() == Fault::Stuck);
            if let (Some(bearing), Some(target), false) =
                (self.bearings.get_mut(at), target, is_stuck)
            {
                *bearing = target.0.into();
            }
            let bearing = self.bearings.get(at).copied().unwrap_or_default();
            let place = self.place.of_ranger(mount.into(), bearing);
            let is_light = number == 0 && self.composition.light;
            let range = if is_light { place.by_light() } else { place.by_sound() };
            self.hardware.ranger_of(id).range = range;
        }
    }

    /// Polls at this time of its clock, and checks the rules.
    fn poll_at(&mut self, clock: u64) -> anyhow::Result<Polled> {
        self.sense();
        let (before, was_running) = (self.app.faults(), self.app.is_running());
        let failures = self.failures();
        let now = Instant::from_ticks(clock);
        let polled = self.app.poll(now, &mut self.hardware, &mut self.line);
        if self.app.navigation_mode().is_some_and(|mode| mode != Mode::Tracking) {
            self.app.work(now, || now);
        }
        self.may_drive = polled.may_drive;
        if polled.answered.is_some() {
            self.since.heard = self.real;
            self.since.told = self.real;
        }
        if !was_running {
            self.since.began = self.real;
        }
        if polled.is_running && !was_running || polled.answered.is_some() {
            self.since.tick = self.real;
            self.since.no_range = self.since.no_range.map(|_| self.real);
        }
        if let Some(report) = self.app.report() {
            let fix = report.ping_result.and_then(|result| result.fix);
            self.accepted += u32::from(matches!(fix, Some(Fix::Accepted(_))));
            if report.tick.is_some() {
                self.since.tick = self.real;
            }
        }
        self.read_telemetry();
        let took = std::mem::take(&mut self.flash().took);
        self.advance(took);
        self.excuse(took);
        let failed = self.failures().since(&failures);
        if was_running && polled.is_running {
            self.check_counts(failed, before)?;
        }
        self.check(&polled)?;
        Ok(polled)
    }

    fn read_telemetry(&mut self) {
        for byte in std::mem::take(&mut self.line.from_robot) {
            let Some(frame) = self.receiver.push(byte) else { continue };
            if matches!(frame.message, Telemetry::LoopStatus(_)) {
                self.since.status = self.real;
            }
        }
    }

    /// A start at the true pose.
    pub fn true_start(&self) -> Start {
        Start {
            pose: self.place.pose(),
            position_deviation: Metres(0.02),
            heading_deviation: Radians(0.01),
        }
    }

    /// Puts a command on the line.
    pub fn send(&mut self, command: &Command) {
        let command = SessionCommand { session: self.session, command: *command };
        let frame = self.sender.frame(&command, &mut frame::EMPTY.clone()).to_vec();
        self.line.to_robot.extend(&frame);
        self.sent.push_front(frame);
        self.sent.truncate(20);
    }

    /// Puts random bytes on the line.
    pub fn garble(&mut self, count: u16, seed: u64) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        self.line.to_robot.extend((0..count).map(|_| random.random::<u8>()));
    }

    /// Puts a frame on the line that was sent before, with so many bits flipped.
    pub fn repeat(&mut self, number: u8, flips: u8) {
        let Some(mut frame) = self.sent.get(usize::from(number) % 20).cloned() else { return };
        for _ in 0..flips {
            let random = self.noise.next_u32();
            let at = random as usize % frame.len().max(1);
            if let Some(byte) = frame.get_mut(at) {
                *byte ^= 1 << (random >> 29);
            }
        }
        self.line.to_robot.extend(frame);
    }

    /// The position from outside, once a second.
    fn measure_position(&mut self) {
        let fault = self.faults[3];
        let is_silent = matches!(fault, Fault::Dead | Fault::Silent | Fault::Hanging);
        if !self.composition.absolute || self.real < self.absolute_at || is_silent {
            return;
        }
        self.absolute_at = self.real + 1_000_000;
        let off = if fault == Fault::None { 0.02 } else { 1.0 };
        let mut noise = || self.noise.random_range(-off..=off);
        let place = Place { x: self.place.x + noise(), y: self.place.y + noise(), ..self.place };
        let measurement = AbsoluteMeasurement::Position {
            point: place.pose().position(),
            noise: PositionNoise::circular(Metres(0.02)),
        };
        self.send(&Command::Absolute { age: Duration::from_ticks(0), measurement });
    }

    /// Sends a command when the robot has read the whole line, and returns the answer.
    ///
    /// # Errors
    /// What breaks a rule; if there is no answer.
    pub fn order(&mut self, command: &Command) -> anyhow::Result<CommandResult> {
        let begun = self.real;
        while !self.line.to_robot.is_empty() {
            let _ = self.step()?;
            ensure!(self.real < begun + 10_000_000, "the line is not read");
        }
        self.absolute_at = self.real + 100_000;
        self.send(command);
        let mut answer = None;
        while !self.line.to_robot.is_empty() || answer.is_none() {
            answer = self.step()?.answered.or(answer);
            ensure!(self.real < begun + 20_000_000, "{command:?} is not answered");
        }
        answer.context("no answer")
    }

    /// Opens a session.
    ///
    /// # Errors
    /// What breaks a rule; if it is refused.
    pub fn open_session(&mut self) -> anyhow::Result<()> {
        self.sender = Sender::starting_at(1);
        let CommandResult::Session(session) = self.order(&Command::OpenSession)? else {
            anyhow::bail!("no session is opened");
        };
        self.session = session;
        Ok(())
    }

    /// Distance of the estimated position from the true one, metres; `None` while the loop does not run.
    #[must_use]
    pub fn error(&self) -> Option<f64> {
        let state = self.app.localizer()?.filter().state();
        Some((f64::from(state.x.0) - self.place.x).hypot(f64::from(state.y.0) - self.place.y))
    }

    /// The health; `None` while the loop does not run.
    #[must_use]
    pub fn health(&self) -> Option<Health> {
        Some(self.app.localizer()?.health())
    }

    /// Whether its verdict is `Tracking`.
    #[must_use]
    pub fn is_tracking(&self) -> bool {
        self.health().is_some_and(|health| health.verdict == Verdict::Tracking)
    }

    /// Whether it has lost its pose and searches for it.
    #[must_use]
    pub fn searches(&self) -> bool {
        self.app.navigation_mode().is_some_and(|mode| mode != Mode::Tracking)
    }

    /// Whether the motors are enabled.
    #[must_use]
    pub fn may_drive(&self) -> bool {
        self.may_drive
    }
}
