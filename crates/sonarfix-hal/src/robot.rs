//! The robot's loop: encoder samples, and the measurement cycle of the sonar beside them.
//!
//! | item | responsibility |
//! |---|---|
//! | [`Robot`] | the order of the steps of a poll; it composes and computes nothing itself |
//! | [`Hardware`], [`Devices`] | the devices that a poll uses, and their configuration |
//! | [`Settings`], [`Stamp`] | the settings |
//! | [`Report`] | what a poll did |
//! | [`Faults`] | counts of faults |
//! | `measurement` (private) | the steps of a measurement cycle; `cycle`: its states |
//! | `rangers` (private) | when each of several rangers can ping, and which one does |
//! | `travel` (private) | the travel of the wheels for the localizer; `odometer`, `yaw`: the ledgers of edges and turns |
//! | `waiting` (private) | absolute measurements that wait for their step |
//! | `tracker` (private) | the localizer, and with the feature `search` the search beside it; `searching`: the steps of a search |
//! | `rest` (private) | when a poll has something to do; `schedule`: periodic deadlines |
//!
//! *Tick*: one sample of both encoders (every 100 ms by default), passed to the localizer.
//! *Measurement cycle*: choose a wall, a slice of the choice in each poll, turn the servo, wait until it has settled, ping, listen,
//! fuse.
//!
//! # Several rangers
//! There is one ping at a time. A ranger pings when its servo has settled and the echoes of all pings that it
//! [hears](sonarfix::config::RangerParameters::hears) have decayed, those of its own included. While one pings, the servos of the others turn
//! to their walls; while the best one turns, another one pings if it ends before.
//!
//! # Time
//! [`Robot::poll`] never waits and reads no clock. It may be called at any rate, and late: deadlines stay on their
//! grid, and a late one is handled once. A poll handles one of the things that are due (the end of a ping before a
//! tick, a tick before the choice of a wall), and leaves the others to the next polls. The end of a ping at a wall takes two: the travel, then the
//! range.
//!
//! An echo belongs to the instant of its reflection, which has passed when the echo arrives. Both counters are
//! therefore read at the trigger and again when the echo is read. The position of the wheels at the reflection is
//! interpolated between the two readings, rounded to half an edge. The localizer takes the travel up to the
//! reflection, then the range, and at the next tick the remaining travel. A tick that is due while a ping is in
//! flight is delayed until the ping has ended (32 ms with an HC-SR04, 65 ms with an SRF08), so that time never runs
//! backwards for the localizer.
//!
//! # Sleep
//! Between two polls the processor may sleep: until [`Robot::next_poll`], or until an edge of the echo is stamped. A poll at any
//! other time does nothing, so that the results are those of a loop that is polled without end ([`Robot::rest`] ends such
//! a poll early).
//!
//! # Conservation of travel
//! The ledger counts whole half edges. However the polls are spread and the steps are split, the travel that the
//! [`Step`]s report as accepted or discarded adds up to what the counters have counted since the first poll.
//!
//! # Faults
//! No fault stops the loop; each is counted in [`Faults`]. Without a readable encoder there is no step until it is
//! readable again, and that step contains the whole travel; pings are suspended. If the servo does not move, the
//! wall at its last bearing is measured, if there is one. Without a ranger, odometry continues. Faults that no
//! driver can detect (an encoder that stands still, a blocked servo) are detected by the localizer's health.
//!
//! # Non-finite policy
//! Travel is computed from whole edges and ranges from whole microseconds, so both are finite.

mod cycle;
mod faults;
mod hardware;
mod measurement;
mod odometer;
mod poll;
mod rangers;
mod report;
mod rest;
mod schedule;
#[cfg_attr(not(feature = "search"), path = "robot/lone_searching.rs")]
mod searching;
mod settings;
mod step;
#[cfg_attr(not(feature = "search"), path = "robot/lone_tracker.rs")]
mod tracker;
mod travel;
mod waiting;
mod yaw;

use sonarfix::config::PingSchedule;
use sonarfix::filter::ekf::EkfError;
use sonarfix::geometry::units::Instant;
use sonarfix::localizer::{Localizer, Mode, Start};
use sonarfix::sensor::absolute::AbsoluteMeasurement;

use crate::encoder::Wheels;
use crate::time::{AT_ONCE, after, before, since};

use cycle::{Cycle, PingEnd};
pub use faults::{EncoderFaults, Faults};
pub use hardware::{Devices, Hardware, WithGyro, WithRangers};
use odometer::Odometer;
use poll::Poll;
pub use report::{PingResult, Report, Tick};
pub use rest::{PACE, PROMPT};
use schedule::Schedule;
pub use settings::{EVALUATIONS_PER_MILLISECOND, Settings, SettingsError, Stamp};
pub use step::{Step, StepResult};
use tracker::Tracker;
pub use tracker::{Search, SweepResult};
use waiting::Waiting;
pub use waiting::{AbsoluteResult, Occupied};
use yaw::YawLedger;

/// The loop.
///
/// ```
/// # use embedded_hal_mock::eh1::pwm::{Mock as Pwm, Transaction};
/// # use embedded_hal_mock::eh1::digital::{Mock as Pin, State, Transaction as Level};
/// use sonarfix::{config::{Config, PingSchedule}, localizer::{Fix, Localizer, Start}, map::{Map, Wall}};
/// use sonarfix::geometry::{pose::{Point, Pose}, units::{Duration, Instant, Metres, Radians}};
/// use sonarfix_hal::encoder::{Count16, WheelGeometry, Wheels};
/// use sonarfix_hal::ranger::{Captured, EchoCapture, PulseRanger};
/// use sonarfix_hal::robot::{Devices, Robot, Settings};
/// use sonarfix_hal::servo::{MeasuredPulse, Servo, ServoSettings, ServoTiming};
///
/// // The robot stands 1.03 m in front of a wall.
/// let walls = [Wall::new(Point::new(1.03, 2.0), Point::new(1.03, -2.0))?];
/// let start = Start {
///     pose: Pose::new(0.0, 0.0, Radians(0.0)),
///     position_deviation: Metres(0.05),
///     heading_deviation: Radians(0.02),
/// };
/// let at = |millis: u64| Instant::from_ticks(millis * 1_000);
/// let mut config = Config::for_track_width(Metres(0.16));
/// config.rangers.first.timing.schedule = PingSchedule::AsFastAsPossible;
/// let localizer = Localizer::new(config, Map::new(&walls), start, at(0))?;
/// let wheel = WheelGeometry::new(Metres(0.065), 1_496.6)?;
/// let mut robot = Robot::new(localizer, Wheels::alike(wheel), Settings::default())?;
///
/// # let max = Transaction::max_duty_cycle(40_000);
/// # let mut channel = Pwm::new(&[max, Transaction::set_duty_cycle(3_000)]);
/// # let mut pin = Pin::new(&[Level::set(State::High), Level::set(State::Low)]);
/// # let (pwm, trigger) = (channel.clone(), pin.clone());
/// # let pulse = |width, degrees| MeasuredPulse {
/// #     width: Duration::from_ticks(width),
/// #     bearing: Radians::from_degrees(degrees),
/// # };
/// # let servo = ServoSettings {
/// #     pulses: [pulse(1_000, -45.0), pulse(2_000, 45.0)],
/// #     limits: (Radians::from_degrees(-80.0), Radians::from_degrees(80.0)),
/// #     timing: ServoTiming::SG90,
/// # };
/// # let (timer_right, timer_left) = (7_u16, 9_u16);
/// let echo = EchoCapture::new();
/// let mut devices = Devices {
///     right: Count16(|| timer_right),
///     left: Count16(|| timer_left),
///     servo: Servo::configured(pwm, servo)?,
///     ranger: PulseRanger::new(trigger, Captured::new(&echo)),
/// };
///
/// // The loop chooses the wall in some polls; 302 ms later the servo has settled, and it pings.
/// while robot.poll(at(0), &mut devices).aimed.is_none() {}
/// while robot.poll(at(302), &mut devices).pinged.is_none() {}
/// robot.poll(at(303), &mut devices); // ends the trigger pulse
/// echo.rose(at(304)); // the interrupt stamps the edges of the echo,
/// echo.fell(at(310));
/// robot.poll(at(311), &mut devices); // and the loop reads them: the travel up to the reflection,
/// let result = robot.poll(at(311), &mut devices).ping_result; // then the range
/// assert!(matches!(result.and_then(|result| result.fix), Some(Fix::Accepted(_))));
/// # channel.done();
/// # pin.done();
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Robot<'m> {
    tracker: Tracker<'m>,
    settings: Settings,
    odometer: Odometer,
    ticks: Schedule,
    /// The deadlines of [`PingSchedule::Every`]; unused with the other schedule.
    pings: Schedule,
    cycle: Cycle,
    /// The time of the previous poll.
    time: Instant,
    /// Before this instant a poll has nothing to do, except for a ping in flight ([`Self::rest`]).
    rests_until: Instant,
    /// Whether the previous poll found something to do.
    has_worked: bool,
    /// Whether the previous poll asked for another one at once.
    has_asked: bool,
    /// Whether such a poll came within [`PROMPT`], the last time that there was one.
    is_prompt: bool,
    /// The end of the ping in flight, which [`Self::rest`] has read for the next poll.
    ping_end: Option<PingEnd>,
    faults: Faults,
    /// The gyro, if the robot has one.
    yaw: Option<YawLedger>,
    /// Headings and positions from outside.
    waiting: Waiting,
}

impl<'m> Robot<'m> {
    /// A loop that starts at the localizer's time, from which the deadlines of ticks and pings are counted.
    ///
    /// The first poll reads the counters; the travel of the wheels is counted from there.
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
        let yaw = yaw_of(&localizer);
        let (pings, until) = match localizer.config().rangers.first.timing.schedule {
            PingSchedule::Every(period) => (Schedule::new(start, period), after(start, period)),
            PingSchedule::AsFastAsPossible => {
                (Schedule::new(start, settings.encoder_period), start)
            }
        };
        Ok(Self {
            tracker: Tracker::new(localizer),
            settings,
            odometer: Odometer::new(wheels),
            ticks: Schedule::new(start, settings.encoder_period),
            pings,
            cycle: Cycle::Idle { until },
            time: start,
            rests_until: AT_ONCE,
            has_worked: true,
            has_asked: false,
            is_prompt: false,
            ping_end: None,
            faults: Faults::default(),
            yaw,
            waiting: Waiting::default(),
        })
    }

    /// Continues with another localizer, other wheels and other settings. Ticks stay on their grid; a ping in
    /// flight is aborted.
    ///
    /// # Errors
    /// [`SettingsError`], by which setting breaks its rule; nothing has changed.
    pub fn restart(
        &mut self,
        localizer: Localizer<'m>,
        wheels: Wheels,
        settings: Settings,
    ) -> Result<(), SettingsError> {
        settings.check()?;
        let now = localizer.time();
        let pings = match localizer.config().rangers.first.timing.schedule {
            PingSchedule::Every(period) => self.pings.continued(now, period),
            PingSchedule::AsFastAsPossible => self.pings,
        };
        self.yaw = yaw_of(&localizer);
        self.tracker = Tracker::new(localizer);
        self.odometer = Odometer::new(wheels);
        self.ticks = self.ticks.continued(now, settings.encoder_period);
        self.pings = pings;
        self.settings = settings;
        self.waiting = Waiting::default();
        self.end_cycle(now, false);
        Ok(())
    }

    /// Replaces the pose at the time `now`. The localizer first takes the travel of the wheels up to `now`; that
    /// step is returned, `None` if a counter cannot be read. A ping in flight is aborted.
    ///
    /// # Errors
    /// [`EkfError`], by what is wrong with the pose or its deviations; nothing has changed.
    pub fn set_pose(
        &mut self,
        now: Instant,
        start: &Start,
        hardware: &mut impl Hardware,
    ) -> Result<Option<Step>, EkfError> {
        start.check()?;
        self.rests_until = AT_ONCE;
        let poll = &mut Poll::new(now, hardware, None);
        self.odometer.begin(poll);
        let mut step = None;
        if let Some(reading) = self.read(poll) {
            self.advance(poll, &reading, &mut step);
        } else {
            // The travel up to now does not belong to the new pose.
            self.odometer.forget();
            self.tracker.localizer_mut().odometry_missing(now);
        }
        self.faults = self.faults.plus(poll.faults);
        self.tracker.set_pose(start)?;
        self.end_cycle(now, false);
        Ok(step)
    }

    /// Continues at `now` after the clock was set back: travel and turn since the last step belong to the next one, a ping
    /// in flight is aborted, and measurements that wait are dropped.
    pub fn set_clock(&mut self, now: Instant) {
        // Wheels that could not be read are not seen now: the motors must not run longer for it.
        let unseen = since(self.time, self.localizer().time());
        self.tracker.localizer_mut().set_clock(before(now, unseen));
        self.ticks = Schedule::new(now, self.settings.encoder_period);
        self.pings = match self.localizer().config().rangers.first.timing.schedule {
            PingSchedule::Every(period) => Schedule::new(now, period),
            PingSchedule::AsFastAsPossible => self.ticks,
        };
        self.yaw = yaw_of(self.localizer());
        self.waiting = Waiting::default();
        self.time = now;
        self.end_cycle(now, false);
    }

    /// Passes a heading, position or pose that was measured at the time `at` to the localizer, when it has taken the travel
    /// of the wheels up to then: in one of the next polls, with the outcome in its report. At most one heading
    /// and one position or pose wait.
    ///
    /// # Errors
    /// [`Occupied`], if another one of this kind waits; nothing has changed.
    pub fn absolute(
        &mut self,
        at: Instant,
        measurement: &AbsoluteMeasurement,
    ) -> Result<(), Occupied> {
        self.waiting.add(at, measurement)?;
        self.rests_until = AT_ONCE;
        Ok(())
    }

    /// Handles what is due at `now`: one measurement from outside, or the end of one ping, or one tick, or a slice of the choice of a
    /// wall, or the start of one ping. It never waits. Of several that are due, the next poll handles the next one, so that no poll takes as long
    /// as all of them; in a loop that is not polled again soon ([`Self::is_prompt`]), a poll handles a measurement from outside, or a range,
    /// with the rest.
    ///
    /// A `now` before that of an earlier call is counted as a fault and has no other effect.
    ///
    /// # Panics
    /// Never.
    pub fn poll(&mut self, now: Instant, hardware: &mut impl Hardware) -> Report {
        let mut report = Report::default();
        self.poll_into(now, hardware, None, &mut report);
        report
    }

    /// As [`Self::poll`], with or without a search: with one, a robot whose pose is unknown sweeps with its sonar and searches
    /// for its pose, and a poll with nothing else to do makes [`Settings::evaluations`] of the search, which must be the same in
    /// every call. The report, which is half a kilobyte, is written in place.
    ///
    /// # Panics
    /// Never.
    pub fn poll_into(
        &mut self,
        now: Instant,
        hardware: &mut impl Hardware,
        search: Option<&mut Search<'m>>,
        report: &mut Report,
    ) {
        report.clear();
        if now < self.time {
            report.faults.clock = 1;
        } else {
            self.poll_in_time(&mut Poll::new(now, hardware, search), report);
        }
        if !report.faults.is_none() {
            self.faults = self.faults.plus(report.faults);
        }
    }

    /// A poll at a time that is not before that of the previous one.
    #[inline]
    fn poll_in_time(&mut self, poll: &mut Poll<'_, 'm, impl Hardware>, report: &mut Report) {
        self.odometer.begin(poll);
        if let Some(yaw) = &mut self.yaw {
            yaw.sample(poll);
        }
        self.judge_executor(poll.now);
        // What was made in the last step, before there is another one; alone, if another poll follows.
        report.absolute = self.take_absolute();
        let is_alone = self.is_prompt || self.waiting.is_due(self.localizer().time());
        if report.absolute.is_none() || !is_alone {
            self.finish_ping(poll, report);
            self.sample_encoders(poll, report);
            self.choose_bearing(poll, report);
            self.start_ping(poll, report);
        }
        report.faults = poll.faults;
        if let Some(search) = poll.search.as_deref_mut() {
            self.work_on(search, report);
        }
        self.time = poll.now;
        self.has_worked = report.has_worked();
        self.rests_until =
            if self.can_rest() { self.next_deadline(poll.hardware) } else { AT_ONCE };
        self.has_asked = self.rests_until == AT_ONCE;
    }

    /// What determines the pose.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.tracker.mode()
    }

    /// The localizer: pose, covariance, calibration, health.
    #[must_use]
    pub fn localizer(&self) -> &Localizer<'m> {
        self.tracker.localizer()
    }

    /// Whether a poll comes soon after one that asked for another at once. If so, what is due in one poll is divided into several.
    #[must_use]
    pub fn is_prompt(&self) -> bool {
        self.is_prompt
    }

    /// Whether both encoders have been read since the loop started.
    #[must_use]
    pub fn has_read_encoders(&self) -> bool {
        self.odometer.has_begun()
    }

    /// The faults since the start.
    #[must_use]
    pub fn faults(&self) -> Faults {
        self.faults
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }
}

/// The ledger of the gyro in the configuration of a localizer.
fn yaw_of(localizer: &Localizer) -> Option<YawLedger> {
    let parameters = localizer.config().gyro.as_ref()?;
    Some(YawLedger::new(parameters, localizer.time()))
}
