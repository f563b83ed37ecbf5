//! The loop of the robot: encoder ticks, and the sonar's cycle beside them.
//!
//! Responsibilities:
//! - [`Robot`]: what is done when. It composes; it computes nothing itself.
//! - [`Hardware`], [`Devices`]: what it is polled with.
//! - [`Settings`], [`Rhythm`], [`Stamp`]: what can be set.
//! - [`Report`] and its parts: what a poll did. [`Faults`]: what went wrong.
//! - private: the ledger of ticks (`odometer`), the grid of due times (`schedule`), the sonar's
//!   state machine (`sonar`).
//!
//! *Tick*: here, one round of reading both encoders (every 100 ms), and telling the localizer.
//! *Look*: one cycle of the sonar: aim, turn, settle, ping, listen, fuse.
//!
//! # Time
//! [`Robot::poll`] never waits and reads no clock. It may be called as often as you like, and
//! late: due times stay on their grid, and a late one is done once.
//!
//! An echo belongs to the instant at which the sound met the wall, which is over when the echo
//! is heard. So both counters are read at the trigger and again when the echo is taken; the
//! wheels' position at the reflection is interpolated between the two (their mean, if the echo
//! is taken as it is heard), rounded to half a tick; the localizer is told the travel up to
//! there, then the range, and with the next tick the rest. A tick that falls due while the sonar
//! listens is held back until the ping is over (32 ms with an HC-SR04, 65 ms with an SRF08): so
//! time never runs backwards for the localizer, and nothing has to be undone.
//!
//! # Nothing lost
//! The ledger of ticks is kept in whole half ticks. However polls are spread and steps are cut,
//! what [`Step`]s report as taken and as written off adds up to what the counters counted from
//! the first poll on.
//!
//! # Faults
//! No fault stops the loop; each is counted in [`Faults`], and the robot goes on with what it
//! has. An encoder that cannot be read: no step, until it can be, which then brings the whole
//! travel; a ping waits. A servo that does not obey: the wall that its last bearing meets
//! squarely, if there is one. A ranger that fails: odometry only. What a driver cannot notice
//! (an encoder that stands still, a servo that is blocked) shows in the localizer's health.
//!
//! # Non-finite policy
//! Nothing here computes with floats but travel from whole ticks and ranges from whole
//! microseconds, which are finite; the localizer refuses what is not.

mod faults;
mod hardware;
mod odometer;
mod report;
mod schedule;
mod settings;
mod sonar;

use sonarfix::aim::Aim;
use sonarfix::localizer::{Fix, Localizer};
use sonarfix::motion::WheelTravel;
use sonarfix::units::Instant;

use crate::encoder::Wheels;
use crate::ranger::{Echo, NoEcho, Ranger, TriggerError};
use crate::time::{after, micros, since};

pub use faults::{EncoderFaults, Faults};
pub use hardware::{Devices, Hardware};
use odometer::{Odometer, Position, Reading};
pub use report::{Heard, Report, Step, Taken, Tick};
use schedule::Schedule;
pub use settings::{Rhythm, Settings, SettingsError, Stamp};
use sonar::Cycle;

/// The loop.
///
/// ```
/// # use embedded_hal_mock::eh1::pwm::{Mock as Pwm, Transaction};
/// # use embedded_hal_mock::eh1::digital::{Mock as Pin, State, Transaction as Level};
/// use sonarfix::{config::Config, localizer::{Fix, Localizer, Start}, map::{Map, Wall}};
/// use sonarfix::{pose::{Point, Pose}, units::{Duration, Instant, Metres, Radians}};
/// use sonarfix_hal::encoder::{Count16, WheelGeometry, Wheels};
/// use sonarfix_hal::ranger::{Air, Captured, EchoCapture, PulseRanger, PulseTiming};
/// use sonarfix_hal::robot::{Devices, Robot, Rhythm, Settings};
/// use sonarfix_hal::servo::{Calibration, MeasuredPulse, Pace, Servo};
///
/// // The robot stands 1.03 m before a wall and looks at it.
/// let walls = [Wall::new(Point::new(1.03, 2.0), Point::new(1.03, -2.0))?];
/// let start = Start {
///     pose: Pose::new(0.0, 0.0, Radians(0.0)),
///     position_deviation: Metres(0.05),
///     heading_deviation: Radians(0.02),
/// };
/// let at = |millis: u64| Instant::from_ticks(millis * 1_000);
/// let config = Config::for_track_width(Metres(0.16));
/// let localizer = Localizer::new(config, Map::new(&walls), start, at(0))?;
/// let wheel = WheelGeometry::new(Metres(0.065), 1_496.6)?;
/// let settings = Settings { rhythm: Rhythm::AsFastAsPossible, ..Settings::default() };
/// let mut robot = Robot::new(localizer, Wheels::alike(wheel), settings)?;
///
/// # let max = Transaction::max_duty_cycle(40_000);
/// # let mut channel = Pwm::new(&[max.clone(), Transaction::set_duty_cycle(3_000), max]);
/// # let mut pin = Pin::new(&[Level::set(State::High), Level::set(State::Low)]);
/// # let (pwm, trigger) = (channel.clone(), pin.clone());
/// # let degrees = Radians::from_degrees;
/// # let calibration = Calibration::new(
/// #     MeasuredPulse { width: Duration::from_ticks(1_000), bearing: degrees(-45.0) },
/// #     MeasuredPulse { width: Duration::from_ticks(2_000), bearing: degrees(45.0) },
/// # )?;
/// # let (timer_right, timer_left) = (7_u16, 9_u16);
/// let echo = EchoCapture::new();
/// let timing = PulseTiming::HC_SR04;
/// let mut devices = Devices {
///     right: Count16(|| timer_right),
///     left: Count16(|| timer_left),
///     servo: Servo::new(pwm, calibration, (degrees(-80.0), degrees(80.0)), Pace::SG90)?,
///     ranger: PulseRanger::new(trigger, Captured::new(&echo), timing, Air::ROOM),
/// };
///
/// // It aims, and 302 ms later the servo has settled, so it pings.
/// assert!(robot.poll(at(0), &mut devices).aimed.is_some());
/// assert!(robot.poll(at(302), &mut devices).pinged.is_some());
/// robot.poll(at(303), &mut devices); // ends the trigger's pulse
/// echo.rose(at(304)); // the interrupt stamps the echo's edges,
/// echo.fell(at(310));
/// let heard = robot.poll(at(311), &mut devices).heard; // and the loop finds them
/// assert!(matches!(heard.and_then(|heard| heard.fix), Some(Fix::Accepted(_))));
/// # channel.done();
/// # pin.done();
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Robot<'m> {
    localizer: Localizer<'m>,
    settings: Settings,
    odometer: Odometer,
    ticks: Schedule,
    /// The dots of [`Rhythm::Every`]; unused with the other rhythm.
    looks: Schedule,
    cycle: Cycle,
    /// The time of the poll before.
    time: Instant,
    faults: Faults,
}

impl<'m> Robot<'m> {
    /// A loop that begins at the localizer's time: ticks and looks fall due from there on.
    ///
    /// The counters' first reading, in the first poll, is where the wheels' travel begins.
    ///
    /// # Errors
    /// [`SettingsError`], by which setting breaks its rule.
    pub fn new(
        localizer: Localizer<'m>,
        wheels: Wheels,
        settings: Settings,
    ) -> Result<Self, SettingsError> {
        settings.check()?;
        let start = localizer.time();
        let (looks, look_at) = match settings.rhythm {
            Rhythm::Every(period) => (Schedule::new(start, period), after(start, period)),
            Rhythm::AsFastAsPossible => (Schedule::new(start, settings.tick), start),
        };
        Ok(Self {
            localizer,
            settings,
            odometer: Odometer::new(wheels),
            ticks: Schedule::new(start, settings.tick),
            looks,
            cycle: Cycle::Idle { look_at },
            time: start,
            faults: Faults::default(),
        })
    }

    /// Does what is due at `now`, which is one ping's end, one tick, one aim and one ping at
    /// most, and says what it did. It never waits.
    ///
    /// A `now` before that of an earlier call is counted as a fault, and nothing is done.
    ///
    /// # Panics
    /// Never.
    pub fn poll(&mut self, now: Instant, hardware: &mut impl Hardware) -> Report {
        let mut report = Report::default();
        if now < self.time {
            report.faults.clock = 1;
        } else {
            self.odometer.begin(now, hardware, &mut report.faults);
            self.hear(now, hardware, &mut report);
            self.tick(now, hardware, &mut report);
            self.look(now, hardware, &mut report);
            self.ping(now, hardware, &mut report);
            self.time = now;
        }
        self.faults = self.faults.plus(report.faults);
        report
    }

    /// Until when polling it is of no use; `None` while a ping is in flight, when it should be
    /// polled as often as its ranger wants. For a loop that sleeps, and for a simulator.
    pub fn idle_until(&self, hardware: &mut impl Hardware) -> Option<Instant> {
        let next_of_sonar = match self.cycle {
            Cycle::Idle { look_at } => look_at,
            Cycle::Turning { .. } => can_ping_at(hardware),
            Cycle::Listening { .. } => return None,
        };
        Some(next_of_sonar.min(self.ticks.next()))
    }

    /// The localizer: pose, covariance, calibration, health.
    #[must_use]
    pub fn localizer(&self) -> &Localizer<'m> {
        &self.localizer
    }

    /// What went wrong since the start.
    #[must_use]
    pub fn faults(&self) -> Faults {
        self.faults
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Takes the outcome of the ping in flight.
    fn hear(&mut self, now: Instant, hardware: &mut impl Hardware, report: &mut Report) {
        let Cycle::Listening { aim, from, asked } = &mut self.cycle else {
            return;
        };
        let (aim, from, asked) = (*aim, *from, *asked.get_or_insert(now));
        let outcome = match hardware.ranger().poll(now) {
            Ok(Some(outcome)) => outcome.and_then(|echo| in_time(echo, from.at, now)),
            Ok(None) if since(now, asked) < self.settings.patience => return,
            Ok(None) => Err(NoEcho::NoResponse),
            Err(_) => Err(NoEcho::Failed),
        };
        let (step, fix) = match outcome {
            Ok(echo) => self.fuse(now, &aim, &from, &echo, hardware, report),
            Err(reason) => {
                report.faults.ranger += u32::from(reason.is_fault());
                (None, Some(self.localizer.fix(&aim, None)))
            }
        };
        report.heard = Some(Heard { aim, outcome, step, fix });
        self.rest(now, true);
    }

    /// Tells the localizer the wheels' travel up to the echo's instant, and the range.
    fn fuse(
        &mut self,
        now: Instant,
        aim: &Aim,
        from: &Reading,
        echo: &Echo,
        hardware: &mut impl Hardware,
        report: &mut Report,
    ) -> (Option<Step>, Option<Fix>) {
        let Some(reading) = self.odometer.read(now, hardware, &mut report.faults) else {
            return (None, None);
        };
        let (at, position) = match self.settings.stamp {
            Stamp::Reflection => {
                let at = echo.reflected();
                (at, from.between(&reading, at))
            }
            Stamp::Arrival => (now, reading.position),
        };
        let step = self.advance(at, position, &mut report.faults);
        (Some(step), Some(self.localizer.fix(aim, Some(echo.range))))
    }

    /// Does the encoder tick, if one is due and the sonar does not listen.
    fn tick(&mut self, now: Instant, hardware: &mut impl Hardware, report: &mut Report) {
        if self.cycle.is_listening() {
            return;
        }
        let Some(due) = self.ticks.take(now) else {
            return;
        };
        // Up to the poll before, it was the sonar that held it back; from then on it is late.
        let held = self.time >= due.due;
        let late = since(now, due.due.max(self.time));
        report.faults.deadlines += u32::from(late > self.settings.tolerance);
        let reading = self.odometer.read(now, hardware, &mut report.faults);
        let step = reading.map(|reading| self.advance(now, reading.position, &mut report.faults));
        report.tick =
            Some(Tick { step, lateness: since(now, due.due), held, skipped: due.skipped });
    }

    /// Asks where to look, if it is time, and sends the servo there.
    fn look(&mut self, now: Instant, hardware: &mut impl Hardware, report: &mut Report) {
        let is_due = matches!(self.cycle, Cycle::Idle { look_at } if now >= look_at);
        if !is_due {
            return;
        }
        let aimed = self.localizer.aim();
        if let Ok(aim) = aimed {
            let turned = hardware.servo().point(now, aim.bearing);
            // If it does not turn, its last bearing will do.
            report.faults.servo += u32::from(turned.is_err());
            self.cycle = Cycle::Turning { why: aim.why };
        } else {
            self.localizer.skip();
            self.rest(now, false);
        }
        report.aimed = Some(aimed);
    }

    /// Pings, if the servo has settled, the ranger is ready and a wall is met squarely: the robot
    /// may have turned in the meantime.
    fn ping(&mut self, now: Instant, hardware: &mut impl Hardware, report: &mut Report) {
        let Cycle::Turning { why } = self.cycle else {
            return;
        };
        let Some(bearing) = hardware.servo().target() else {
            self.rest(now, false);
            return;
        };
        let ready_at = can_ping_at(hardware);
        if now < ready_at {
            return;
        }
        let Ok(aim) = self.localizer.aim_at(bearing) else {
            self.rest(now, false);
            return;
        };
        let Some(from) = self.odometer.read(now, hardware, &mut report.faults) else {
            self.rest(now, false);
            return;
        };
        match hardware.ranger().trigger(now) {
            Ok(()) => {
                let (aim, asked) = (Aim { why, ..aim }, None);
                self.cycle = Cycle::Listening { aim, from, asked };
                report.pinged = Some(aim);
            }
            Err(TriggerError::TooSoon) if since(now, ready_at) < self.settings.patience => {}
            Err(_) => {
                report.faults.ranger += 1;
                self.rest(now, false);
            }
        }
    }

    /// Ends the sonar's cycle. After one that did not come to a ping nothing is new before the
    /// next tick.
    fn rest(&mut self, now: Instant, pinged: bool) {
        let look_at = match self.settings.rhythm {
            Rhythm::Every(_) => {
                self.looks.take(now);
                self.looks.next()
            }
            Rhythm::AsFastAsPossible if pinged => now,
            Rhythm::AsFastAsPossible => self.ticks.next(),
        };
        self.cycle = Cycle::Idle { look_at };
    }

    /// Tells the localizer how far the wheels rolled up to `at`.
    fn advance(&mut self, at: Instant, position: Position, faults: &mut Faults) -> Step {
        let travel = self.odometer.travel_to(position);
        let taken = match self.localizer.odometry(at, travel) {
            Ok(()) => Taken::Yes,
            Err(error) if self.is_credible(at, travel) => Taken::Kept(error),
            Err(error) => Taken::WrittenOff(error),
        };
        if !matches!(taken, Taken::Kept(_)) {
            self.odometer.settle(position);
        }
        faults.travel += u32::from(matches!(taken, Taken::WrittenOff(_)));
        Step { at, travel, taken }
    }

    /// Whether wheels can have rolled so since the localizer's last step, were it not for ticks:
    /// a position read is wrong by up to one, and so is the one before.
    fn is_credible(&self, at: Instant, travel: WheelTravel) -> bool {
        let seconds = 1e-6 * micros(since(at, self.localizer.time()));
        let fastest = self.localizer.config().max_wheel_speed.0 * seconds;
        let limit = fastest + 2.0 * self.odometer.wheels().coarser_tick().0;
        travel.right.abs().0 <= limit && travel.left.abs().0 <= limit
    }
}

/// When the servo has settled and the last ping's echoes have died away.
fn can_ping_at(hardware: &mut impl Hardware) -> Instant {
    let settled_at = hardware.servo().settles_at();
    settled_at.max(hardware.ranger().ready_at())
}

/// The echo, if its times lie between the trigger and now.
fn in_time(echo: Echo, triggered: Instant, now: Instant) -> Result<Echo, NoEcho> {
    let fits = triggered <= echo.sent && echo.sent <= echo.heard && echo.heard <= now;
    if fits { Ok(echo) } else { Err(NoEcho::Mistimed) }
}
