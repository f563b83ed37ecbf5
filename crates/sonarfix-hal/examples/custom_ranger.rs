//! A ranger of one's own: a laser time-of-flight module that reports a distance some milliseconds after it was
//! triggered. `cargo run --package sonarfix-hal --example custom_ranger`
//!
//! A driver implements [`Ranger`]. Its configuration is `ranger = "custom"` with a `cycle` in the robot file.

use std::convert::Infallible;
use std::error::Error;

use embedded_hal::pwm::{self, SetDutyCycle};
use sonarfix::config::{Config, PingSchedule, ServoTiming};
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::{Duration, Instant, Metres, Radians};
use sonarfix::localizer::{Localizer, Start};
use sonarfix::map::{Map, Wall};
use sonarfix_hal::config::RobotConfig;
use sonarfix_hal::encoder::Count16;
use sonarfix_hal::ranger::{
    Echo, NoEcho, Outcome, Ranger, RangerKind, RangerSettings, TriggerError, UnsupportedKind,
};
use sonarfix_hal::robot::{Devices, Hardware, Robot, Settings};
use sonarfix_hal::servo::{PwmFrame, Servo};

/// The module: its distance is measured `MEASURING` after the trigger.
struct TimeOfFlight<D> {
    /// Reads the distance register, in millimetres; zero for no target.
    distance: D,
    cycle: Duration,
    triggered: Option<Instant>,
    is_measuring: bool,
}

/// From the trigger to the result.
const MEASURING: Duration = Duration::from_ticks(20_000);

impl<D: FnMut() -> u16> Ranger for TimeOfFlight<D> {
    type Error = Infallible;

    fn ready_at(&self) -> Instant {
        self.triggered.map_or(Instant::from_ticks(0), |at| at + self.cycle)
    }

    fn trigger(&mut self, now: Instant) -> Result<(), TriggerError<Infallible>> {
        if now < self.ready_at() {
            return Err(TriggerError::TooSoon);
        }
        (self.triggered, self.is_measuring) = (Some(now), true);
        Ok(())
    }

    fn poll(&mut self, now: Instant) -> Result<Option<Outcome>, Infallible> {
        let Some(sent) = self.triggered.filter(|_| self.is_measuring) else {
            return Ok(None);
        };
        let heard = sent + MEASURING;
        if now < heard {
            return Ok(None);
        }
        self.is_measuring = false;
        Ok(Some(match (self.distance)() {
            0 => Err(NoEcho::Nothing),
            // The range belongs to the middle between `sent` and `heard`.
            millimetres => Ok(Echo { sent, heard, range: Metres(f32::from(millimetres) * 1e-3) }),
        }))
    }

    fn configure(&mut self, settings: &RangerSettings) -> Result<(), UnsupportedKind> {
        if settings.kind != RangerKind::Custom {
            return Err(UnsupportedKind);
        }
        self.cycle = settings.cycle;
        Ok(())
    }
}

/// A PWM channel that is not there: on a board it is the HAL's.
struct Channel;

impl pwm::ErrorType for Channel {
    type Error = Infallible;
}

impl SetDutyCycle for Channel {
    fn max_duty_cycle(&self) -> u16 {
        40_000
    }

    fn set_duty_cycle(&mut self, _: u16) -> Result<(), Infallible> {
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut localizer = Config::for_track_width(Metres(0.16));
    localizer.rangers.first.servo = (Radians(-1.4), Radians(1.4));
    localizer.rangers.first.timing.servo = ServoTiming::SG90;
    localizer.rangers.first.timing.schedule = PingSchedule::AsFastAsPossible;
    localizer.rangers.first.timing.cycle = Duration::from_ticks(33_000);
    let mut config = RobotConfig::with_common_parts(localizer);
    config.rangers.first.kind = RangerKind::Custom;
    config.check()?;

    let mut devices = Devices {
        right: Count16(|| 0),
        left: Count16(|| 0),
        servo: Servo::new(Channel, PwmFrame::of(Duration::from_ticks(20_000))),
        ranger: TimeOfFlight {
            distance: || 1_985,
            cycle: Duration::from_ticks(0),
            triggered: None,
            is_measuring: false,
        },
    };
    devices.configure(&config)?;

    // The robot stands 2 m before a wall, by its start 1 cm farther.
    let walls = [Wall::new(Point::new(2.0, -1.0), Point::new(2.0, 1.0))?];
    let start = Start {
        pose: Pose::new(-0.01, 0.0, Radians(0.0)),
        position_deviation: Metres(0.05),
        heading_deviation: Radians(0.02),
    };
    let localizer = Localizer::new(localizer, Map::new(&walls), start, Instant::from_ticks(0))?;
    let settings = Settings { encoder_period: config.encoder_period, ..Settings::default() };
    let mut robot = Robot::new(localizer, config.wheels()?, settings)?;
    for millis in 0..1_000 {
        let report = robot.poll(Instant::from_ticks(millis * 1_000), &mut devices);
        if let Some(heard) = report.ping_result {
            println!("{millis:4} ms: {:?} -> {:?}", heard.outcome, heard.fix);
        }
    }
    let x = robot.localizer().pose().x;
    println!("x = {:.3} m", x.0);
    assert!((x - Metres(0.015)).abs() < Metres(0.003), "the ranges correct the pose");
    Ok(())
}
