//! The drivers of a robot whose signals a C program passes in and out.

use core::cell::Cell;
use core::convert::Infallible;

use sonarfix::config::{MAX_RANGERS, RangerId, ServoTiming};
use sonarfix::geometry::units::{Duration, Instant, Metres, RadiansPerSecond};
use sonarfix::sensor::gyro::GyroParameters;
use sonarfix_hal::config::{RobotConfig, Unsupported};
use sonarfix_hal::gyro::{Unreadable, YawRate};
use sonarfix_hal::ranger::{
    Captured, Echo, NoEcho, OneOf, Outcome, PulseRanger, Ranger, RangerKind, RangerSettings,
    TriggerError, UnsupportedKind,
};
use sonarfix_hal::robot::{Devices, Hardware, WithGyro, WithRangers};
use sonarfix_hal::servo::{PwmFrame, Servo};
use sonarfix_pil::Wires;
use sonarfix_pil::wires::{CounterWire, ServoWire, TriggerWire};

use crate::state::micros;

/// The rangers beside the first.
const FURTHER: usize = MAX_RANGERS - 1;

/// The drivers on the signals.
pub type SignalDevices = WithGyro<WithRangers<OneRanger, FURTHER>, ReportedGyro>;

type OneRanger = Devices<
    &'static CounterWire,
    &'static CounterWire,
    &'static ServoWire,
    OneOf<PulseRanger<&'static TriggerWire, Captured<'static>>, ReportedRanger>,
>;

/// What a C program passes in and out: the wires of the drivers, and what it has read itself.
#[derive(Debug, Default)]
pub struct Signals {
    pub wires: Wires,
    pub readings: [ReadingWire; MAX_RANGERS],
    /// `None`: the gyro does not respond.
    pub yaw_rate: Cell<Option<f32>>,
}

/// A ranger that the program reads.
#[derive(Debug, Default)]
pub struct ReadingWire {
    /// What it has read since the last poll.
    pub reading: Cell<Option<Reading>>,
    has_started: Cell<bool>,
}

impl ReadingWire {
    /// Whether a range was asked for since the last call.
    pub fn take_start(&self) -> bool {
        self.has_started.take()
    }
}

/// What a program has read from a ranger.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reading {
    /// A range, and the instant to which it belongs.
    Range(Instant, Metres),
    NoEcho,
    Failed,
}

/// A time without a report after which the ranger does not respond. A slow one takes 70 ms.
const GIVE_UP: Duration = Duration::from_ticks(200_000);

/// The driver of a ranger that the program reads.
#[derive(Debug)]
pub struct ReportedRanger {
    wire: &'static ReadingWire,
    cycle: Duration,
    started: Option<Instant>,
    in_flight: bool,
}

impl ReportedRanger {
    fn new(wire: &'static ReadingWire) -> Self {
        Self { wire, cycle: RangerSettings::HC_SR04.cycle, started: None, in_flight: false }
    }

    fn age(&self, now: Instant) -> Duration {
        let started = self.started.unwrap_or(now);
        now.checked_duration_since(started).unwrap_or(Duration::from_ticks(0))
    }
}

impl Ranger for ReportedRanger {
    type Error = Infallible;

    fn ready_at(&self) -> Instant {
        let after = |at: Instant| at.checked_add_duration(self.cycle);
        self.started.map_or(Instant::from_ticks(0), |at| after(at).unwrap_or(at))
    }

    fn trigger(&mut self, now: Instant) -> Result<(), TriggerError<Infallible>> {
        let is_busy = self.in_flight && self.age(now) < GIVE_UP;
        if is_busy || now < self.ready_at() {
            return Err(TriggerError::TooSoon);
        }
        (self.started, self.in_flight) = (Some(now), true);
        self.wire.reading.set(None);
        self.wire.has_started.set(true);
        Ok(())
    }

    fn poll(&mut self, now: Instant) -> Result<Option<Outcome>, Infallible> {
        if !self.in_flight {
            return Ok(None);
        }
        let outcome = match self.wire.reading.take() {
            Some(Reading::Range(at, range)) => Some(Ok(Echo { sent: at, heard: at, range })),
            Some(Reading::NoEcho) => Some(Err(NoEcho::Nothing)),
            Some(Reading::Failed) => Some(Err(NoEcho::Failed)),
            None => (self.age(now) >= GIVE_UP).then_some(Err(NoEcho::NoResponse)),
        };
        self.in_flight = outcome.is_none();
        Ok(outcome)
    }

    fn poll_at(&self) -> Option<Instant> {
        let started = self.started.filter(|_| self.in_flight)?;
        started.checked_add_duration(GIVE_UP)
    }

    fn set_clock(&mut self, now: Instant) {
        self.started = self.started.map(|_| now);
    }

    fn configure(&mut self, settings: &RangerSettings) -> Result<(), UnsupportedKind> {
        if matches!(settings.kind, RangerKind::Pulse(_)) {
            return Err(UnsupportedKind);
        }
        self.cycle = settings.cycle;
        Ok(())
    }
}

/// The driver of a gyro that the program reads.
#[derive(Debug)]
pub struct ReportedGyro(&'static Cell<Option<f32>>);

impl YawRate for ReportedGyro {
    type Error = Infallible;

    fn configure(&mut self, _: &GyroParameters) -> Result<(), Infallible> {
        Ok(())
    }

    fn rate(&mut self) -> Result<RadiansPerSecond, Unreadable> {
        self.0.get().map(RadiansPerSecond).ok_or(Unreadable)
    }
}

/// Creates the drivers on the signals for this robot.
///
/// # Errors
/// [`Unsupported`], by what the drivers do not support.
pub fn devices(
    config: &RobotConfig,
    signals: &'static Signals,
) -> Result<SignalDevices, Unsupported> {
    let Wires { right, left, rangers: [first, further @ ..], .. } = &signals.wires;
    let [reading, readings @ ..] = &signals.readings;
    let ranger = |wires: &'static sonarfix_pil::wires::RangerWires, reading| {
        let pulse = PulseRanger::new(&wires.trigger, Captured::new(&wires.echo));
        OneOf::new(pulse, ReportedRanger::new(reading))
    };
    let mut numbers = (0..).map(|number| frame_of(config, RangerId(number)));
    let mut servo = |wires: &'static sonarfix_pil::wires::RangerWires| {
        Servo::new(&wires.servo, numbers.next().unwrap_or(PwmFrame::of(Duration::from_ticks(0))))
    };
    let one = Devices { right, left, servo: servo(first), ranger: ranger(first, reading) };
    let servos = further.each_ref().map(&mut servo);
    let mut readings = readings.iter();
    let rangers = further.each_ref().map(|wires| ranger(wires, readings.next().unwrap_or(reading)));
    let devices = WithRangers { devices: one, servos, rangers };
    let mut devices = WithGyro { devices, gyro: ReportedGyro(&signals.yaw_rate) };
    devices.configure(config)?;
    Ok(devices)
}

/// The periods of the servos, microseconds.
#[expect(clippy::cast_precision_loss, reason = "far below a second")]
pub fn frames(config: &RobotConfig) -> [f32; MAX_RANGERS] {
    let mut frames = [0.0; MAX_RANGERS];
    for (frame, number) in frames.iter_mut().zip(0..) {
        *frame = micros(frame_of(config, RangerId(number)).period) as f32;
    }
    frames
}

/// The frame of the servo of a ranger.
fn frame_of(config: &RobotConfig, ranger: RangerId) -> PwmFrame {
    let timing = config.localizer.rangers.get(ranger).map(|sonar| sonar.timing.servo);
    PwmFrame::of(timing.unwrap_or(ServoTiming::INSTANT).frame)
}
