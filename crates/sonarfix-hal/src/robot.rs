//! The robot's loop: encoder samples, and the measurement cycle of the sonar beside them.
//!
//! | item | responsibility |
//! |---|---|
//! | [`Robot`] | the order of the steps of a poll; it composes and computes nothing itself |
//! | [`Hardware`], [`Devices`] | the devices that a poll uses, and their configuration |
//! | [`Settings`], [`Stamp`] | the settings |
//! | [`Report`] | what a poll did |
//! | [`Faults`] | counts of faults |
//! | `odometer` (private) | the ledger of encoder edges |
//! | `rangers` (private) | when each of several rangers can ping, and which one does |
//! | `schedule` (private) | periodic deadlines |
//! | `sonar` (private) | the state machine of a measurement cycle |
//! | `waiting` (private) | absolute measurements that wait for their step |
//! | `yaw` (private) | the ledger of a gyro's turns |
//!
//! *Tick*: one sample of both encoders (every 100 ms by default), passed to the localizer.
//! *Measurement cycle*: choose a wall, turn the servo, wait until it has settled, ping, listen, fuse.
//!
//! # Several rangers
//! There is one ping at a time. A ranger pings when its servo has settled and the echoes of all pings that it
//! [hears](sonarfix::config::Sonar::hears) have decayed, those of its own included. While one pings, the servos of the others turn
//! to their walls; while the best one turns, another one pings if it ends before.
//!
//! # Time
//! [`Robot::poll`] never waits and reads no clock. It may be called at any rate, and late: deadlines stay on their
//! grid, and a late one is handled once. A poll handles one of the things that are due (the end of a ping before a
//! tick, a tick before the choice of a wall), and leaves the others to the next polls.
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

mod faults;
mod hardware;
mod odometer;
mod rangers;
mod report;
mod schedule;
mod settings;
mod sonar;
mod waiting;
mod yaw;

use sonarfix::aim::{Aim, NoAim};
use sonarfix::config::{MAX_RANGERS, PingSchedule, RangerId};
use sonarfix::filter::ekf::EkfError;
use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::{Duration, Instant, Radians};
use sonarfix::localizer::{Localizer, Start};
use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix::sensor::gyro::TurnReading;
use sonarfix_search::navigator::{Mode, Navigator};
use sonarfix_search::search::{Region, Search};

use crate::encoder::Wheels;
use crate::ranger::{Echo, NoEcho, Outcome, Ranger, TriggerError};
use crate::time::{NEVER, after, micros, since};

pub use faults::{EncoderFaults, Faults};
pub use hardware::{Devices, Hardware, WithGyro, WithRangers};
use odometer::{Odometer, Position, Reading};
use rangers::can_ping_at;
pub use report::{PingResult, Report, Step, StepResult, SweepResult, Tick};
use schedule::Schedule;
pub use settings::{EVALUATIONS_PER_MILLISECOND, Settings, SettingsError, Stamp};
use sonar::{Cycle, Target};
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
/// config.sonar.timing.schedule = PingSchedule::AsFastAsPossible;
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
/// // The loop chooses the wall; 302 ms later the servo has settled, and it pings.
/// assert!(robot.poll(at(0), &mut devices).aimed.is_some());
/// assert!(robot.poll(at(302), &mut devices).pinged.is_some());
/// robot.poll(at(303), &mut devices); // ends the trigger pulse
/// echo.rose(at(304)); // the interrupt stamps the edges of the echo,
/// echo.fell(at(310));
/// let result = robot.poll(at(311), &mut devices).ping_result; // and the loop reads them
/// assert!(matches!(result.and_then(|result| result.fix), Some(Fix::Accepted(_))));
/// # channel.done();
/// # pin.done();
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Robot<'m> {
    navigator: Navigator<'m>,
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
    /// The outcome of the ping in flight, which [`Self::rest`] has read for the next poll.
    heard: Option<Heard>,
    faults: Faults,
    /// The gyro, if the robot has one.
    yaw: Option<YawLedger>,
    /// Headings and positions from outside.
    waiting: Waiting,
}

/// The outcome of a ping; `None` if the ranger failed.
type Heard = Option<Outcome>;

/// Period of the polls of a loop whose next deadline is not known.
pub const PACE: Duration = Duration::from_ticks(1_000);

/// An instant that has passed.
const AT_ONCE: Instant = Instant::from_ticks(0);

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
        let (pings, until) = match localizer.config().sonar.timing.schedule {
            PingSchedule::Every(period) => (Schedule::new(start, period), after(start, period)),
            PingSchedule::AsFastAsPossible => {
                (Schedule::new(start, settings.encoder_period), start)
            }
        };
        Ok(Self {
            navigator: Navigator::new(localizer),
            settings,
            odometer: Odometer::new(wheels),
            ticks: Schedule::new(start, settings.encoder_period),
            pings,
            cycle: Cycle::Idle { until },
            time: start,
            rests_until: AT_ONCE,
            has_worked: true,
            heard: None,
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
        let pings = match localizer.config().sonar.timing.schedule {
            PingSchedule::Every(period) => self.pings.continued(now, period),
            PingSchedule::AsFastAsPossible => self.pings,
        };
        self.yaw = yaw_of(&localizer);
        self.navigator = Navigator::new(localizer);
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
    /// [`EkfError`], by what is wrong with the pose or its deviations.
    pub fn set_pose(
        &mut self,
        now: Instant,
        start: &Start,
        hardware: &mut impl Hardware,
    ) -> Result<Option<Step>, EkfError> {
        self.rests_until = AT_ONCE;
        let mut faults = Faults::default();
        self.odometer.begin(now, hardware, &mut faults);
        let reading = self.read(now, hardware, &mut faults);
        let mut step = None;
        if let Some(Reading { position, turn, .. }) = reading {
            self.advance(now, position, turn, &mut faults, None, &mut step);
        } else {
            // The travel up to now does not belong to the new pose.
            self.odometer.forget();
            self.navigator.odometry_missing(now);
        }
        self.faults = self.faults.plus(faults);
        self.navigator.set_pose(start)?;
        self.end_cycle(now, false);
        Ok(step)
    }

    /// Continues at `now` after the clock was set back: travel and turn since the last step belong to the next one, a ping
    /// in flight is aborted, and measurements that wait are dropped.
    pub fn set_clock(&mut self, now: Instant) {
        self.navigator.set_clock(now);
        self.ticks = Schedule::new(now, self.settings.encoder_period);
        self.pings = match self.localizer().config().sonar.timing.schedule {
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

    /// Handles what is due at `now`: the end of one ping, or one tick, or the choice of one wall, and the start of one
    /// ping. It never waits. Of several that are due, the next poll handles the next one, so that no poll takes as long
    /// as all of them.
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

    /// As [`Self::poll`], with a search: a robot whose pose is unknown sweeps with its sonar and searches for its pose
    /// ([`Navigator`]). A poll with nothing else to do makes [`Settings::evaluations`] of the search.
    ///
    /// The search must be the same in every call.
    ///
    /// # Panics
    /// Never.
    pub fn poll_with_search(
        &mut self,
        now: Instant,
        hardware: &mut impl Hardware,
        search: &mut Search<'m>,
    ) -> Report {
        let mut report = Report::default();
        self.poll_into(now, hardware, Some(search), &mut report);
        report
    }

    /// As [`Self::poll`], or with a search as [`Self::poll_with_search`]; the report, which is half a kilobyte, is written in
    /// place.
    ///
    /// # Panics
    /// Never.
    pub fn poll_into(
        &mut self,
        now: Instant,
        hardware: &mut impl Hardware,
        mut search: Option<&mut Search<'m>>,
        report: &mut Report,
    ) {
        report.clear();
        if now < self.time {
            report.faults.clock = 1;
        } else {
            self.odometer.begin(now, hardware, &mut report.faults);
            if let Some(yaw) = &mut self.yaw {
                yaw.sample(now, hardware, &mut report.faults);
            }
            // What has arrived since the last step, before there is another one.
            report.absolute = [self.take_absolute(), self.take_absolute()];
            self.finish_ping(now, hardware, report, search.as_deref_mut());
            self.sample_encoders(now, hardware, report, search.as_deref_mut());
            self.choose_bearing(now, hardware, report, search.as_deref_mut());
            self.start_ping(now, hardware, report);
            if let Some(search) = search {
                self.work_on(search, report);
            }
            self.time = now;
            self.has_worked = report.has_worked();
            self.rests_until = if self.can_rest() { self.next_deadline(hardware) } else { AT_ONCE };
        }
        if !report.faults.is_none() {
            self.faults = self.faults.plus(report.faults);
        }
    }

    /// Whether a poll at `now` has nothing to do. If so, it is done: [`Self::poll`] need not be called, and would return
    /// an empty report. If not, [`Self::poll`] is to be called at the same `now`.
    ///
    /// For a loop that is also polled for other reasons, or at a fixed rate: this takes a tenth of the instructions of an empty
    /// poll.
    ///
    /// # Panics
    /// Never.
    pub fn rest(&mut self, now: Instant, hardware: &mut impl Hardware) -> bool {
        if now < self.time || now >= self.rests_until || !self.is_silent(now, hardware) {
            return false;
        }
        self.time = now;
        true
    }

    /// Whether the ping in flight has no outcome at `now`, if there is one.
    fn is_silent(&mut self, now: Instant, hardware: &mut impl Hardware) -> bool {
        let Cycle::Listening { polled, target, .. } = &mut self.cycle else {
            return true;
        };
        let polled = *polled.get_or_insert(now);
        if self.heard.is_none() {
            match hardware.ranger_of(target.ranger()).poll(now) {
                Ok(None) => return since(now, polled) < self.settings.patience,
                Ok(outcome) => self.heard = Some(outcome),
                Err(_) => self.heard = Some(None),
            }
        }
        false
    }

    /// The next instant at which a poll has something to do besides a ping in flight.
    fn next_deadline(&self, hardware: &mut impl Hardware) -> Instant {
        let next = match self.cycle {
            // Ticks are delayed until it has ended.
            Cycle::Listening { .. } => NEVER,
            Cycle::Idle { until } => until.min(self.ticks.next()),
            Cycle::Turning { ranger, .. } => {
                can_ping_at(self.localizer().config(), ranger, hardware).min(self.ticks.next())
            }
        };
        self.yaw.as_ref().map_or(next, |yaw| next.min(yaw.next()))
    }

    /// Whether polls before the next deadline have nothing to do. A search works at every poll.
    fn can_rest(&self) -> bool {
        self.odometer.has_begun() && self.mode() == Mode::Tracking
    }

    /// When the loop must be polled next, if no edge of the echo is stamped earlier: at the next deadline of ticks, sonar, servo
    /// or gyro, and every [`PACE`] where no deadline is known (a search, a ranger without [`Ranger::poll_at`]). An instant that
    /// has passed: at once.
    pub fn next_poll(&self, hardware: &mut impl Hardware) -> Instant {
        let paced = after(self.time, PACE);
        let deadline = match self.cycle {
            Cycle::Listening { polled, target, .. } => {
                let timeout = polled.map_or(NEVER, |polled| after(polled, self.settings.patience));
                hardware.ranger_of(target.ranger()).poll_at().unwrap_or(AT_ONCE).min(timeout)
            }
            _ => NEVER,
        };
        let deadline = deadline.min(self.next_deadline(hardware));
        if !self.can_rest() {
            return deadline.min(paced);
        }
        // A deadline that has passed without effect, such as that of a ranger that is not ready.
        let is_waiting = deadline <= self.time && !self.has_worked;
        if is_waiting { paced } else { deadline }
    }

    /// Reads both counters, and the gyro if there is one; `None` if a counter fails.
    fn read(
        &mut self,
        now: Instant,
        hardware: &mut impl Hardware,
        faults: &mut Faults,
    ) -> Option<Reading> {
        let reading = self.odometer.read(now, hardware, faults)?;
        Some(Reading { turn: self.yaw.as_ref().map(|yaw| yaw.reading(now)), ..reading })
    }

    /// Declares the pose unknown and begins the search, to which the present pose is proposed; a ping in flight is
    /// aborted.
    pub fn search(&mut self, now: Instant, search: &mut Search<'m>) {
        self.navigator.search(search);
        self.end_cycle(now, false);
    }

    /// Begins the search of a robot that has been started without a pose ([`Navigator::search_in`]); a ping in flight
    /// is aborted.
    pub fn search_in(&mut self, now: Instant, region: Option<Region>, search: &mut Search<'m>) {
        self.navigator.search_in(region, search);
        self.end_cycle(now, false);
    }

    /// What determines the pose.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.navigator.mode()
    }

    /// The next instant at which a poll has something to do; `None` while a ping is in flight, when the loop
    /// should be polled at the rate that the ranger requires. For an executor that sleeps, and for a simulator.
    pub fn idle_until(&self, hardware: &mut impl Hardware) -> Option<Instant> {
        (!self.cycle.is_listening()).then(|| self.next_deadline(hardware))
    }

    /// The localizer: pose, covariance, calibration, health.
    #[must_use]
    pub fn localizer(&self) -> &Localizer<'m> {
        self.navigator.localizer()
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

    /// Reads the outcome of the ping in flight.
    fn finish_ping(
        &mut self,
        now: Instant,
        hardware: &mut impl Hardware,
        report: &mut Report,
        search: Option<&mut Search<'m>>,
    ) {
        let Cycle::Listening { target, from, polled } = &mut self.cycle else {
            return;
        };
        let (target, from, polled) = (*target, *from, *polled.get_or_insert(now));
        let heard = match self.heard.take() {
            Some(heard) => heard,
            None => match hardware.ranger_of(target.ranger()).poll(now) {
                Ok(None) if since(now, polled) < self.settings.patience => return,
                Ok(None) => Some(Err(NoEcho::NoResponse)),
                Ok(outcome) => outcome,
                Err(_) => None,
            },
        };
        let outcome = heard.unwrap_or(Err(NoEcho::Failed));
        let outcome = outcome.and_then(|echo| in_time(echo, from.at, now));
        report.faults.ranger += u32::from(outcome.err().is_some_and(NoEcho::is_fault));
        match target {
            Target::Wall(aim) => self.fuse(now, &aim, &from, outcome, hardware, report, search),
            Target::Sweep(bearing) => {
                self.sweep(now, bearing, &from, outcome, hardware, report, search);
            }
        }
        self.end_cycle(now, true);
    }

    /// Passes the travel up to the instant of the echo to the localizer, then the range.
    #[expect(clippy::too_many_arguments, reason = "a ping, its echo, and what takes them")]
    #[inline(never)]
    fn fuse(
        &mut self,
        now: Instant,
        aim: &Aim,
        from: &Reading,
        outcome: Outcome,
        hardware: &mut impl Hardware,
        report: &mut Report,
        mut search: Option<&mut Search<'m>>,
    ) {
        let Report { ping_result, faults, .. } = report;
        let result = ping_result.insert(PingResult { aim: *aim, outcome, step: None, fix: None });
        let range = outcome.ok().map(|echo| echo.range);
        if let Ok(echo) = outcome {
            let (step, search) = (&mut result.step, search.as_deref_mut());
            if !self.reach(now, from, &echo, hardware, faults, search, step) {
                self.navigator.skip();
                return;
            }
        }
        result.fix = Some(self.navigator.fix(aim, range, search));
    }

    /// Passes the travel up to the instant of the echo to the localizer, then the range to the search.
    #[expect(clippy::too_many_arguments, reason = "a ping, its echo, and what takes them")]
    #[inline(never)]
    fn sweep(
        &mut self,
        now: Instant,
        bearing: Radians,
        from: &Reading,
        outcome: Outcome,
        hardware: &mut impl Hardware,
        report: &mut Report,
        mut search: Option<&mut Search<'m>>,
    ) {
        let Report { swept, faults, .. } = report;
        let result = swept.insert(SweepResult { bearing, outcome, step: None, is_novel: None });
        let range = match outcome {
            Ok(echo) => {
                let (step, search) = (&mut result.step, search.as_deref_mut());
                let is_reached = self.reach(now, from, &echo, hardware, faults, search, step);
                is_reached.then_some(Some(echo.range))
            }
            Err(reason) => (!reason.is_fault()).then_some(None),
        };
        result.is_novel = range.zip(search).map(|(range, search)| {
            // A range of a driver is finite, and so is the bearing.
            self.navigator.ping(bearing, range, search).unwrap_or(false)
        });
    }

    /// Passes the travel up to the instant of the echo to the localizer, and writes the step in place, because it is
    /// large. Returns whether the counters could be read.
    #[expect(
        clippy::too_many_arguments,
        reason = "a ping, its echo, what takes them, and the step"
    )]
    fn reach(
        &mut self,
        now: Instant,
        from: &Reading,
        echo: &Echo,
        hardware: &mut impl Hardware,
        faults: &mut Faults,
        search: Option<&mut Search<'m>>,
        step: &mut Option<Step>,
    ) -> bool {
        let Some(reading) = self.read(now, hardware, faults) else { return false };
        let (at, position, turn) = match self.settings.stamp {
            Stamp::Reflection => {
                let at = echo.reflected();
                (at, from.between(&reading, at), from.turn_between(&reading, at))
            }
            Stamp::Arrival => (now, reading.position, reading.turn),
        };
        self.advance(at, position, turn, faults, search, step);
        true
    }

    /// Passes one absolute measurement to the localizer, if one is due.
    #[inline]
    fn take_absolute(&mut self) -> Option<AbsoluteResult> {
        let at = self.localizer().time();
        let (measured_at, measurement) = self.waiting.take(at)?;
        let fix = self.navigator.absolute(measured_at, &measurement);
        Some(AbsoluteResult { at, measured_at, measurement, fix })
    }

    /// Samples the encoders, if a tick is due and no ping is in flight.
    fn sample_encoders(
        &mut self,
        now: Instant,
        hardware: &mut impl Hardware,
        report: &mut Report,
        search: Option<&mut Search<'m>>,
    ) {
        if self.cycle.is_listening() || report.has_ended_ping() {
            return;
        }
        let Some(due) = self.ticks.take(now) else {
            return;
        };
        // Up to the previous poll a ping has delayed it; the time since then counts as late.
        let held = self.time >= due.due;
        let late = since(now, due.due.max(self.time));
        report.faults.deadlines += u32::from(late > self.settings.tolerance);
        let Report { tick, faults, .. } = report;
        let lateness = since(now, due.due);
        let Tick { step, .. } =
            tick.insert(Tick { step: None, lateness, held, skipped: due.skipped });
        if let Some(Reading { position, turn, .. }) = self.read(now, hardware, faults) {
            self.advance(now, position, turn, faults, search, step);
        }
        if step.as_ref().is_none_or(|step| matches!(step.result, StepResult::Discarded(_))) {
            self.navigator.odometry_missing(now);
        }
    }

    /// Chooses a wall, or the next bearing of the sweep, if a ping is due, and turns the servo.
    #[inline(never)]
    fn choose_bearing(
        &mut self,
        now: Instant,
        hardware: &mut impl Hardware,
        report: &mut Report,
        search: Option<&mut Search<'m>>,
    ) {
        let is_due = matches!(self.cycle, Cycle::Idle { until } if now >= until);
        if !is_due || report.has_ended_ping() || report.tick.is_some() {
            return;
        }
        if let (Mode::Searching, Some(search)) = (self.mode(), search) {
            let turned = hardware.servo().point(now, search.aim());
            report.faults.servo += u32::from(turned.is_err());
            self.cycle = Cycle::Turning { ranger: RangerId::FIRST, why: None };
            return;
        }
        if self.localizer().is_odometry_missing() {
            // The next encoder sample ends the period, or the health records that it lasts.
            self.cycle = Cycle::Idle { until: self.ticks.next() };
            return;
        }
        let aimed = if self.localizer().config().has_several_sonars() {
            self.choose_among(now, hardware, &mut report.faults)
        } else {
            self.navigator.aim().inspect(|aim| {
                let turned = hardware.servo().point(now, aim.bearing);
                // If it does not turn, the wall at its last bearing is measured.
                report.faults.servo += u32::from(turned.is_err());
            })
        };
        if let Ok(aim) = aimed {
            self.cycle = Cycle::Turning { ranger: aim.ranger, why: Some(aim.why) };
        } else {
            self.navigator.skip();
            self.end_cycle(now, false);
        }
        report.aimed = Some(aimed);
    }

    /// Chooses ranger and wall of the next ping of a robot with several rangers. The servos of the others turn to their
    /// walls meanwhile.
    #[inline(never)]
    fn choose_among(
        &mut self,
        now: Instant,
        hardware: &mut impl Hardware,
        faults: &mut Faults,
    ) -> Result<Aim, NoAim> {
        let config = self.localizer().config();
        let mut aims = [None; MAX_RANGERS];
        for ((ranger, _), aim) in config.sonars().zip(&mut aims) {
            let standing = rangers::standing(config, ranger, now, hardware);
            *aim = self.navigator.aim_of(ranger, &standing).ok();
        }
        let chosen = rangers::first_of(config, &aims).ok_or(NoAim::NoWall)?;
        for aim in aims.iter().flatten() {
            let turned = hardware.servo_of(aim.ranger).point(now, aim.bearing);
            faults.servo += u32::from(turned.is_err());
        }
        Ok(chosen)
    }

    /// Starts a ping once the servo has settled and the ranger is ready ([`can_ping_at`]), if a wall is square to
    /// the sonar (the robot may have turned in the meantime) or the sonar sweeps.
    fn start_ping(&mut self, now: Instant, hardware: &mut impl Hardware, report: &mut Report) {
        let Cycle::Turning { ranger, why } = self.cycle else {
            return;
        };
        let Some(bearing) = hardware.servo_of(ranger).target() else {
            self.navigator.ranger_failed(ranger);
            self.abort_cycle(now);
            return;
        };
        let ready_at = can_ping_at(self.localizer().config(), ranger, hardware);
        if now < ready_at {
            return;
        }
        let target = match why {
            None => Target::Sweep(bearing),
            Some(why) => {
                let Ok(aim) = self.navigator.aim_along(ranger, bearing) else {
                    self.end_cycle(now, false);
                    return;
                };
                Target::Wall(Aim { why, ..aim })
            }
        };
        let Some(from) = self.read(now, hardware, &mut report.faults) else {
            self.abort_cycle(now);
            return;
        };
        match hardware.ranger_of(ranger).trigger(now) {
            Ok(()) => {
                self.cycle = Cycle::Listening { target, from, polled: None };
                if let Target::Wall(aim) = target {
                    report.pinged = Some(aim);
                }
            }
            Err(TriggerError::TooSoon) if since(now, ready_at) < self.settings.patience => {}
            Err(_) => {
                report.faults.ranger += 1;
                self.navigator.ranger_failed(ranger);
                self.abort_cycle(now);
            }
        }
    }

    /// Ends a measurement cycle in which a device has prevented the ping.
    fn abort_cycle(&mut self, now: Instant) {
        if self.mode() != Mode::Searching {
            self.navigator.skip();
        }
        self.end_cycle(now, false);
    }

    /// Ends the measurement cycle. If there was no ping, nothing changes before the next tick.
    fn end_cycle(&mut self, now: Instant, pinged: bool) {
        let is_sweeping = self.mode() == Mode::Searching;
        let until = match self.localizer().config().sonar.timing.schedule {
            PingSchedule::Every(_) if !is_sweeping => {
                self.pings.take(now);
                self.pings.next()
            }
            _ if pinged => now,
            _ => self.ticks.next(),
        };
        self.cycle = Cycle::Idle { until };
        (self.rests_until, self.heard) = (AT_ONCE, None);
    }

    /// Works on the search if nothing else was done in this poll, and changes the mode when it is time.
    fn work_on(&mut self, search: &mut Search<'m>, report: &mut Report) {
        let evaluations = if report.is_empty() { self.settings.evaluations } else { 0 };
        report.mode = self.navigator.work(evaluations, search);
    }

    /// Passes the travel of the wheels up to `at` to the localizer, and the turn of the gyro; writes the step in place.
    fn advance(
        &mut self,
        at: Instant,
        position: Position,
        reading: Option<TurnReading>,
        faults: &mut Faults,
        search: Option<&mut Search<'m>>,
        step: &mut Option<Step>,
    ) {
        let travel = self.odometer.travel_to(position);
        let turn = self.yaw.as_ref().and_then(|yaw| yaw.turn_to(&reading?));
        let result = match self.navigator.odometry_with_turn(at, travel, turn, search) {
            Ok(()) => StepResult::Accepted,
            Err(error) if self.is_credible(at, travel) => StepResult::Deferred(error),
            Err(error) => StepResult::Discarded(error),
        };
        if !matches!(result, StepResult::Deferred(_)) {
            self.odometer.settle(position);
        }
        if let (StepResult::Accepted, Some(yaw), Some(reading)) = (result, &mut self.yaw, reading) {
            yaw.settle(reading);
        }
        faults.travel += u32::from(matches!(result, StepResult::Discarded(_)));
        let step = step.insert(Step { at, travel, turn: reading, result, absolute: None });
        step.absolute = self.take_absolute();
    }

    /// Whether the wheels can have travelled so far since the localizer's last step. Each of the two positions is
    /// quantized to one edge.
    fn is_credible(&self, at: Instant, travel: WheelTravel) -> bool {
        let seconds = 1e-6 * micros(since(at, self.localizer().time()));
        let fastest = self.localizer().config().max_wheel_speed.0 * seconds;
        let limit = fastest + 2.0 * self.odometer.wheels().coarser_tick().0;
        travel.right.abs().0 <= limit && travel.left.abs().0 <= limit
    }
}

/// The ledger of the gyro in the configuration of a localizer.
fn yaw_of(localizer: &Localizer) -> Option<YawLedger> {
    let parameters = localizer.config().gyro.as_ref()?;
    Some(YawLedger::new(parameters, localizer.time()))
}

/// The echo, if its times are between the trigger and now.
fn in_time(echo: Echo, triggered: Instant, now: Instant) -> Result<Echo, NoEcho> {
    let fits = triggered <= echo.sent && echo.sent <= echo.heard && echo.heard <= now;
    if fits { Ok(echo) } else { Err(NoEcho::Mistimed) }
}
