//! A robot on a bench: an app on devices that do what the test says, with a PC at its link.

use std::collections::VecDeque;

use embedded_hal::pwm;
use sonarfix::config::Config;
use sonarfix::localizer::Start;
use sonarfix::map::Wall;
use sonarfix::pose::{Point, Pose};
use sonarfix::units::{Duration, Instant, Metres, Radians};
use sonarfix_app::store::Store;
use sonarfix_app::{App, Body, Flashed, Link, Polled};
use sonarfix_hal::encoder::{Counter, WheelGeometry, Wheels};
use sonarfix_hal::ranger::{NoEcho, Outcome as Heard, Ranger, TriggerError};
use sonarfix_hal::robot::{Devices, Settings};
use sonarfix_hal::servo::{Calibration, MeasuredPulse, Pace, Servo};
use sonarfix_link::message::{Estimate, Loop, Outcome, Reset};
use sonarfix_link::{Command, Receiver, Sender, Telemetry, baked, frame};

use crate::flash::{SECTOR, SECTORS, SimFlash};

/// A device that is not there.
#[derive(Debug, Clone, Copy)]
pub struct Missing;

impl pwm::Error for Missing {
    fn kind(&self) -> pwm::ErrorKind {
        pwm::ErrorKind::Other
    }
}

/// An encoder at some count, or none.
pub struct Encoder(pub Option<u16>);

impl Counter for Encoder {
    type Error = Missing;
    const BITS: u32 = 16;

    fn count(&mut self) -> Result<u32, Missing> {
        self.0.map(u32::from).ok_or(Missing)
    }
}

/// A servo's PWM, there or not.
pub struct Pwm(pub bool);

impl pwm::ErrorType for Pwm {
    type Error = Missing;
}

impl pwm::SetDutyCycle for Pwm {
    fn max_duty_cycle(&self) -> u16 {
        40_000
    }

    fn set_duty_cycle(&mut self, _duty: u16) -> Result<(), Missing> {
        if self.0 { Ok(()) } else { Err(Missing) }
    }
}

/// A ranger that hears nothing, or does not even listen.
pub struct Sonar {
    pub is_there: bool,
    is_pinging: bool,
}

impl Ranger for Sonar {
    type Error = Missing;

    fn ready_at(&self) -> Instant {
        Instant::from_ticks(0)
    }

    fn trigger(&mut self, _now: Instant) -> Result<(), TriggerError<Missing>> {
        self.is_pinging = true;
        Ok(())
    }

    fn poll(&mut self, _now: Instant) -> Result<Option<Heard>, Missing> {
        let silence = if self.is_there { NoEcho::Nothing } else { NoEcho::NoResponse };
        Ok(std::mem::take(&mut self.is_pinging).then_some(Err(silence)))
    }
}

type Hardware = Devices<Encoder, Encoder, Pwm, Sonar>;

/// The link, with its bytes counted.
#[derive(Default)]
pub struct Line {
    to_robot: VecDeque<u8>,
    from_robot: Vec<u8>,
    pub sent: usize,
}

impl Link for Line {
    fn receive(&mut self) -> Option<u8> {
        self.to_robot.pop_front()
    }

    fn send(&mut self, frame: &[u8]) {
        self.sent += frame.len();
        self.from_robot.extend(frame);
    }
}

/// What lies in the flash beside the store.
pub struct Baked {
    pub map: Vec<u8>,
    pub config: Vec<u8>,
}

impl Baked {
    /// A room and a robot; behind both, the flash is as it left the factory.
    pub fn new(config: &Config) -> Self {
        let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0), (0.0, 0.0)];
        let point = |(x, y): (f32, f32)| Point::new(x, y);
        let wall = |ends: &[(f32, f32)]| Wall::new(point(ends[0]), point(ends[1])).unwrap();
        let walls: Vec<Wall> = corners.windows(2).map(wall).collect();
        let mut map = sonarfix_map::bake(&walls).unwrap();
        let mut config = baked::write(config, &mut [0; baked::LENGTH_MAX]).unwrap().to_vec();
        map.resize(map.len() + 1_000, 0xFF);
        config.resize(config.len() + 100, 0xFF);
        Self { map, config }
    }
}

/// The configuration of most tests.
pub fn config() -> Config {
    let mut config = Config::for_track_width(Metres(0.16));
    config.prior.range_scale = 0.02;
    config
}

/// A start that is known well.
pub fn start() -> Start {
    Start {
        pose: Pose::new(1.0, 1.5, Radians(0.5)),
        position_deviation: Metres(0.02),
        heading_deviation: Radians(0.01),
    }
}

/// A robot that is switched on.
pub struct Bench<'m> {
    pub app: App<'m, SimFlash>,
    pub hardware: Hardware,
    pub line: Line,
    pub now: u64,
    receiver: Receiver<Telemetry>,
    sender: Sender<Command>,
}

impl<'m> Bench<'m> {
    /// Switches a robot on, with this in its flash.
    pub fn switched_on(baked: &'m Baked, flash: SimFlash) -> Self {
        let wheel = WheelGeometry::new(Metres(0.065), 1_024.0).unwrap();
        let (wheels, settings) = (Wheels::alike(wheel), Settings::default());
        let body = Body { wheels, settings, firmware: [1, 2, 3], reset: Reset::PowerOn };
        let store = Store::new(flash, 0..(SECTOR * SECTORS) as u32).unwrap();
        let flashed = Flashed::read(&baked.map, &baked.config);
        let app = App::new(body, flashed, store, Instant::from_ticks(0)).unwrap();
        let pulse = |width, degrees| MeasuredPulse {
            width: Duration::from_ticks(width),
            bearing: Radians::from_degrees(degrees),
        };
        let calibration = Calibration::new(pulse(1_000, -45.0), pulse(2_000, 45.0)).unwrap();
        let limits = (Radians::from_degrees(-90.0), Radians::from_degrees(90.0));
        let hardware = Devices {
            right: Encoder(Some(0)),
            left: Encoder(Some(0)),
            servo: Servo::new(Pwm(true), calibration, limits, Pace::SG90).unwrap(),
            ranger: Sonar { is_there: true, is_pinging: false },
        };
        let (receiver, sender) = (Receiver::new(), Sender::starting_at(1));
        let mut bench = Self { app, hardware, line: Line::default(), now: 0, receiver, sender };
        let _ = bench.turn();
        bench
    }

    /// Switches it off; the flash keeps what it has.
    pub fn switched_off(self) -> SimFlash {
        self.app.release().release()
    }

    /// A turn of the loop, a millisecond after the one before.
    pub fn turn(&mut self) -> Polled {
        self.now += 1_000;
        self.app.poll(Instant::from_ticks(self.now), &mut self.hardware, &mut self.line)
    }

    /// Lets time go by; gives what was said.
    pub fn wait(&mut self, millis: u64) -> Vec<Telemetry> {
        for _ in 0..millis {
            let _ = self.turn();
        }
        self.said()
    }

    /// What was said since it was last asked.
    pub fn said(&mut self) -> Vec<Telemetry> {
        let bytes = std::mem::take(&mut self.line.from_robot);
        let frames = bytes.into_iter().filter_map(|byte| self.receiver.push(byte));
        frames.map(|frame| frame.message).collect()
    }

    /// Sends a command, and takes the answer.
    pub fn order(&mut self, command: &Command) -> Outcome {
        let mut buffer = frame::EMPTY;
        self.line.to_robot.extend(self.sender.frame(command, &mut buffer));
        self.turn().answered.expect("a command is answered at once")
    }

    /// What it knows while it runs.
    pub fn estimate(&self) -> Estimate {
        sonarfix_link::reporter::estimate(self.app.localizer().expect("it runs"))
    }
}

/// How the loop fares, as said last.
pub fn fares(said: &[Telemetry]) -> Loop {
    let found = said.iter().rev().find_map(|told| match told {
        Telemetry::Loop(told) => Some(*told),
        _ => None,
    });
    found.expect("it is said once a second")
}
