//! A robot that drives along x in a room, down to its pins: two counters, a PWM channel, a
//! trigger pin, and an echo line whose edges go into an [`EchoCapture`] as they happen.
//!
//! The loop under test accesses only the pins; the test accesses the [`World`].

use core::cell::{Cell, RefCell};
use std::collections::VecDeque;

use embedded_hal::{digital, pwm};
use sonarfix::config::{Config, PingSchedule};
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::localizer::{Localizer, Start};
use sonarfix::map::{Map, Wall};
use sonarfix_hal::encoder::{Counter, WheelGeometry, Wheels};
use sonarfix_hal::ranger::{Air, Captured, EchoCapture, PulseRanger};
use sonarfix_hal::robot::{Devices, Report, Robot, Settings, Step, StepResult};
use sonarfix_hal::servo::{MeasuredPulse, Servo, ServoSettings, ServoTiming};

/// The room: x from −3 to 3, y from −1.2 to 1.
const CORNERS: [(f32, f32); 5] = [(-3.0, -1.2), (3.0, -1.2), (3.0, 1.0), (-3.0, 1.0), (-3.0, -1.2)];
/// From trigger to burst of an HC-SR04, µs.
const LATENCY: u64 = 460;
/// Duty counts of the PWM.
const COUNTS: u16 = 40_000;

/// How the robot drives: a speed, and a sway on it.
#[derive(Debug, Clone, Copy)]
pub struct Drive {
    /// m/s.
    pub speed: f64,
    /// Amplitude of the sway, metres, with 3 rad/s.
    pub sway: f64,
}

/// The present faults of the hardware.
#[expect(clippy::struct_excessive_bools, reason = "any of them may be broken beside the others")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Broken {
    pub right_counter: bool,
    pub pwm: bool,
    pub trigger: bool,
    /// No edges come from the echo line.
    pub echo: bool,
    /// The ranger receives no echo: its pulse lasts 38 ms.
    pub deaf: bool,
    /// The left wheel rolls backwards: the robot spins on the spot. The simulated echoes do not model a
    /// spinning robot, so `deaf` should be set as well.
    pub spin: bool,
    /// The right counter jumps by so many ticks, and stays there.
    pub jump: u32,
}

/// Everything outside of the loop.
pub struct World {
    pub now: Cell<u64>,
    pub broken: Cell<Broken>,
    pub capture: EchoCapture,
    /// Every duty that was set, with its time.
    pub duties: RefCell<Vec<(u64, u16)>>,
    /// Times at which the trigger went high.
    pub triggers: RefCell<Vec<u64>>,
    /// Times at which the trigger went low, which starts a burst.
    pub bursts: RefCell<Vec<u64>>,
    /// Times of each burst and of the reception of its echo.
    pub flights: RefCell<Vec<(u64, u64)>>,
    edges: RefCell<VecDeque<(u64, bool)>>,
    /// Period of the PWM, µs.
    frame: Cell<f64>,
    drive: Drive,
    tick: f64,
    first_count: u32,
}

impl World {
    pub fn new(drive: Drive, tick: f32, first_count: u32) -> Self {
        Self {
            now: Cell::new(0),
            broken: Cell::default(),
            capture: EchoCapture::new(),
            duties: RefCell::default(),
            triggers: RefCell::default(),
            bursts: RefCell::default(),
            flights: RefCell::default(),
            edges: RefCell::default(),
            frame: Cell::new(20_000.0),
            drive,
            tick: f64::from(tick),
            first_count,
        }
    }

    /// Where the robot is along x, metres.
    pub fn x(&self, micros: u64) -> f64 {
        let t = micros as f64 * 1e-6;
        self.drive.speed * t + self.drive.sway * (3.0 * t).sin()
    }

    /// Whole ticks up to a time.
    pub fn ticks(&self, micros: u64) -> i64 {
        (self.x(micros) / self.tick).floor() as i64 - (self.x(0) / self.tick).floor() as i64
    }

    /// Advances the time, and passes every edge until then to the interrupt.
    pub fn advance(&self, to: u64) {
        self.now.set(to);
        while let Some((time, high)) = self.next_edge(to) {
            let at = Instant::from_ticks(time);
            if high {
                self.capture.rose(at);
            } else {
                self.capture.fell(at);
            }
        }
    }

    fn next_edge(&self, until: u64) -> Option<(u64, bool)> {
        let mut edges = self.edges.borrow_mut();
        let is_past = edges.front().is_some_and(|&(time, _)| time <= until);
        if is_past { edges.pop_front() } else { None }
    }

    /// Sends a burst, and schedules the edges of its echo.
    fn burst(&self) {
        self.bursts.borrow_mut().push(self.now.get());
        let sent = self.now.get() + LATENCY;
        let duty = self.duties.borrow().last().map_or(0, |&(_, duty)| duty);
        let flight = self.flight(sent, duty);
        if self.broken.get().echo {
            return;
        }
        if self.broken.get().deaf {
            self.edges.borrow_mut().extend([(sent, true), (sent + 38_000, false)]);
            return;
        }
        self.edges.borrow_mut().extend([(sent, true), (sent + flight, false)]);
        self.flights.borrow_mut().push((sent, sent + flight));
    }

    /// Where a servo at this duty points.
    pub fn degrees(&self, duty: u16) -> f64 {
        let width = f64::from(duty) / f64::from(COUNTS) * self.frame.get();
        (width - 1_500.0) / 10.0
    }

    /// Time of flight to the wall in the direction of the servo and back, µs: the range is that at the
    /// reflection.
    fn flight(&self, sent: u64, duty: u16) -> u64 {
        let degrees = self.degrees(duty);
        let speed = f64::from(Air::ROOM.speed().0) * 1e-6;
        let mut flight = 0.0;
        for _ in 0..4 {
            let x = self.x(sent + (flight / 2.0) as u64);
            let range = match degrees {
                d if d.abs() < 45.0 => 3.0 - x,
                d if d < 0.0 => 1.2,
                _ => 1.0,
            };
            flight = 2.0 * range / speed;
        }
        flight.round() as u64
    }
}

/// A 16-bit counter on one wheel.
pub struct WheelCounter<'w>(&'w World, bool);

impl Counter for WheelCounter<'_> {
    type Error = &'static str;
    const BITS: u32 = 16;

    fn count(&mut self) -> Result<u32, Self::Error> {
        let World { now, broken, first_count, .. } = self.0;
        let (is_right, broken) = (self.1, broken.get());
        if is_right && broken.right_counter {
            return Err("no word from the right counter");
        }
        let ticks = self.0.ticks(now.get()) as u32;
        let backwards = !is_right && broken.spin;
        let ticks = if backwards { ticks.wrapping_neg() } else { ticks };
        let jump = if is_right { broken.jump } else { 0 };
        Ok(ticks.wrapping_add(*first_count).wrapping_add(jump))
    }
}

/// The servo's PWM channel.
pub struct ServoPwm<'w>(&'w World);

/// A pin that is broken.
#[derive(Debug)]
pub struct Dead;

impl pwm::Error for Dead {
    fn kind(&self) -> pwm::ErrorKind {
        pwm::ErrorKind::Other
    }
}

impl digital::Error for Dead {
    fn kind(&self) -> digital::ErrorKind {
        digital::ErrorKind::Other
    }
}

impl pwm::ErrorType for ServoPwm<'_> {
    type Error = Dead;
}

impl pwm::SetDutyCycle for ServoPwm<'_> {
    fn max_duty_cycle(&self) -> u16 {
        COUNTS
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Dead> {
        if self.0.broken.get().pwm {
            return Err(Dead);
        }
        self.0.duties.borrow_mut().push((self.0.now.get(), duty));
        Ok(())
    }
}

/// The ranger's trigger pin.
pub struct TriggerPin<'w>(&'w World);

impl digital::ErrorType for TriggerPin<'_> {
    type Error = Dead;
}

impl digital::OutputPin for TriggerPin<'_> {
    fn set_high(&mut self) -> Result<(), Dead> {
        if self.0.broken.get().trigger {
            return Err(Dead);
        }
        self.0.triggers.borrow_mut().push(self.0.now.get());
        Ok(())
    }

    fn set_low(&mut self) -> Result<(), Dead> {
        self.0.burst();
        Ok(())
    }
}

pub type Pins<'w> = Devices<
    WheelCounter<'w>,
    WheelCounter<'w>,
    ServoPwm<'w>,
    PulseRanger<TriggerPin<'w>, Captured<'w>>,
>;

/// A servo with limits of 100° to either side: 10 µs per degree.
pub fn servo(world: &World, timing: ServoTiming) -> Servo<ServoPwm<'_>> {
    world.frame.set(timing.frame.to_micros() as f64);
    let degrees = Radians::from_degrees;
    let point = |width, bearing| MeasuredPulse {
        width: Duration::from_ticks(width),
        bearing: degrees(bearing),
    };
    let settings = ServoSettings {
        pulses: [point(600, -90.0), point(2_400, 90.0)],
        limits: (degrees(-100.0), degrees(100.0)),
        timing,
    };
    Servo::configured(ServoPwm(world), settings).unwrap()
}

pub fn pins(world: &World, timing: ServoTiming) -> Pins<'_> {
    let line = Captured::new(&world.capture);
    Devices {
        right: WheelCounter(world, true),
        left: WheelCounter(world, false),
        servo: servo(world, timing),
        ranger: PulseRanger::new(TriggerPin(world), line),
    }
}

pub fn walls() -> Vec<Wall> {
    let pairs = CORNERS.iter().zip(&CORNERS[1..]);
    pairs
        .map(|(from, to)| Wall::new(Point::new(from.0, from.1), Point::new(to.0, to.1)).unwrap())
        .collect()
}

/// The loop, at the origin of the room at time zero. `tick` is the length of an encoder tick.
pub fn robot(walls: &[Wall], tick: f32, schedule: PingSchedule, settings: Settings) -> Robot<'_> {
    let mut config = Config::for_track_width(Metres(0.16));
    config.rangers.first.timing.schedule = schedule;
    config.rangers.first.servo = (Radians::from_degrees(-95.0), Radians::from_degrees(95.0));
    let start = Start {
        pose: Pose::new(0.0, 0.0, Radians(0.0)),
        position_deviation: Metres(0.02),
        heading_deviation: Radians(0.01),
    };
    let localizer = Localizer::new(config, Map::new(walls), start, Instant::from_ticks(0)).unwrap();
    Robot::new(localizer, Wheels::alike(wheel(tick)), settings).unwrap()
}

/// A wheel whose tick is exactly this long.
pub fn wheel(tick: f32) -> WheelGeometry {
    let diameter = Metres(tick * 1_024.0 / core::f32::consts::PI);
    WheelGeometry::new(diameter, 1_024.0).unwrap()
}

/// Polls at each of these times; returns the reports with them.
pub fn run(
    world: &World,
    robot: &mut Robot<'_>,
    pins: &mut Pins<'_>,
    times: impl IntoIterator<Item = u64>,
) -> Vec<(u64, Report)> {
    let mut reports = vec![];
    for time in times {
        world.advance(time);
        reports.push((time, robot.poll(Instant::from_ticks(time), pins)));
    }
    reports
}

/// Every step of the wheels.
pub fn steps(reports: &[(u64, Report)]) -> impl Iterator<Item = Step> {
    reports.iter().flat_map(|(_, report)| {
        let of_echo = report.reached;
        let of_tick = report.tick.and_then(|tick| tick.step);
        [of_echo, of_tick].into_iter().flatten()
    })
}

/// Accepted and discarded travel of the right wheel, metres.
pub fn accounts(reports: &[(u64, Report)]) -> (f64, f64) {
    let (mut taken, mut written_off) = (0.0, 0.0);
    for step in steps(reports) {
        let metres = f64::from(step.travel.right.0);
        match step.result {
            StepResult::Accepted => taken += metres,
            StepResult::Discarded(_) => written_off += metres,
            StepResult::Deferred(_) => {}
        }
    }
    (taken, written_off)
}

/// Polls every millisecond from one time to another.
pub fn millis(from: u64, to: u64) -> impl Iterator<Item = u64> {
    (from..to).map(|millis| millis * 1_000)
}
