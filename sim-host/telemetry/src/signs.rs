//! Signs of life: what each device of a robot on the bench reads, and what to do about it.
//!
//! [`Signs`] takes the telemetry that [`Command::ShowDevices`](sonarfix_link::Command::ShowDevices) asks for, and gives a
//! [`Row`] for each device. The hints are functions of what was read ([`hints`]).

pub mod hints;

use std::fmt;

use sonarfix::geometry::units::Instant;
use sonarfix_link::message::{DeviceReadings, EncoderReading, ServoReading, Telemetry};
use sonarfix_link::{Hello, ReceiverCounters};

use hints::{Board, Counted, Heard, Hint, Servo, Supply};

use crate::Received;
use crate::view;

/// A device: what it reads, and what to do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// Its name.
    pub device: &'static str,
    /// What it reads.
    pub reading: String,
    /// What that means.
    pub hint: Hint,
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { device, reading, hint } = self;
        write!(f, "{device:<14} {reading:<38} {hint}")
    }
}

/// The devices' readings since the beginning, or since the robot was last started.
#[derive(Debug, Default)]
pub struct Signs {
    hello: Option<Hello>,
    at: Option<Instant>,
    restarts: u32,
    right: Encoder,
    left: Encoder,
    servo: Servo,
    sonar: Heard,
}

impl Signs {
    /// Takes a message; returns whether the robot has been restarted since the one before.
    pub fn take(&mut self, received: &Received) -> bool {
        match &received.telemetry {
            Telemetry::Hello(hello) => self.hello = Some(*hello),
            Telemetry::Devices(readings) => return self.read(readings),
            Telemetry::LoopStatus(status) => return self.is_restart(status.at),
            _ => {}
        }
        false
    }

    fn read(&mut self, readings: &DeviceReadings) -> bool {
        let is_restart = self.is_restart(readings.at);
        self.right.read(&readings.right);
        self.left.read(&readings.left);
        self.servo = readings.servo.into();
        self.sonar = self.sonar.then(readings.ping);
        is_restart
    }

    /// The robot's clock starts at zero. After a restart the counters do, too.
    fn is_restart(&mut self, at: Instant) -> bool {
        let is_restart = self.at.is_some_and(|last| at < last);
        if is_restart {
            let (hello, restarts) = (self.hello, self.restarts + 1);
            *self = Self { hello, restarts, ..Self::default() };
        }
        self.at = Some(at);
        is_restart
    }

    /// A row for each device, the board first.
    #[must_use]
    pub fn rows(&self, counters: &ReceiverCounters) -> [Row; 6] {
        let board = Board { hello: self.hello, counters: *counters };
        let supply = Supply { reset: self.hello.map(|hello| hello.reset), restarts: self.restarts };
        [
            Row { device: "board", reading: board_text(&board), hint: hints::of_board(&board) },
            Row { device: "supply", reading: supply_text(supply), hint: hints::of_supply(supply) },
            self.right.row("right encoder"),
            self.left.row("left encoder"),
            Row {
                device: "servo",
                reading: servo_text(self.servo),
                hint: hints::of_servo(self.servo, self.hello.map(|hello| hello.configuration)),
            },
            Row {
                device: "sonar",
                reading: self.sonar.to_string(),
                hint: hints::of_sonar(&self.sonar),
            },
        ]
    }

    /// The time of the last message, by the robot's clock.
    #[must_use]
    pub fn time(&self) -> Option<Instant> {
        self.at
    }
}

fn board_text(board: &Board) -> String {
    let frames = board.counters.frames;
    match &board.hello {
        Some(hello) => {
            let [major, minor, patch] = hello.firmware;
            let images = [hello.map, hello.configuration].map(view::flashed);
            format!("{major}.{minor}.{patch}, map {}, robot {}", images[0], images[1])
        }
        None => format!("no Hello yet, {frames} frames"),
    }
}

fn supply_text(supply: Supply) -> String {
    let restarts = match supply.restarts {
        0 => String::new(),
        1 => ", 1 restart since".to_owned(),
        several => format!(", {several} restarts since"),
    };
    match supply.reset {
        Some(reset) => format!("started by {}{restarts}", view::reset(reset)),
        None => format!("no Hello yet{restarts}"),
    }
}

fn servo_text(servo: Servo) -> String {
    match servo {
        Servo::Unread => "no reading yet".to_owned(),
        Servo::Failing => "cannot be commanded".to_owned(),
        Servo::Commanded(ServoReading { bearing, micros }) => {
            format!("pulses of {micros:.0} µs, {:+.0}°", bearing.to_degrees())
        }
    }
}

/// The history of an encoder.
#[derive(Debug, Default)]
struct Encoder {
    counted: Option<Counted>,
    /// The last count that was read.
    last: Option<u32>,
    position: i64,
    lowest: i64,
    highest: i64,
    /// Illegal transitions before the first reading.
    illegal: Option<u32>,
}

impl Encoder {
    fn read(&mut self, reading: &EncoderReading) {
        let mut counted = self.counted.unwrap_or_default();
        counted.is_readable = reading.count.is_some();
        counted.metres_per_edge = reading.metres_per_edge;
        let before = *self.illegal.get_or_insert(reading.illegal);
        counted.illegal = reading.illegal.wrapping_sub(before);
        if let Some(count) = reading.count {
            let moved = self.last.map_or(0, |last| difference(count, last, reading.bits));
            self.last = Some(count);
            self.position += moved;
            self.lowest = self.lowest.min(self.position);
            self.highest = self.highest.max(self.position);
            counted = counted.then(moved, self.highest - self.lowest);
        }
        self.counted = Some(counted);
    }

    fn row(&self, device: &'static str) -> Row {
        let (reading, hint) = match &self.counted {
            None => ("no reading yet".to_owned(), Hint::wait()),
            Some(counted) => (self.text(counted), hints::of_encoder(counted)),
        };
        Row { device, reading, hint }
    }

    #[expect(clippy::cast_precision_loss, reason = "a few metres of a wheel's edges")]
    fn text(&self, counted: &Counted) -> String {
        if !counted.is_readable {
            return "cannot be read".to_owned();
        }
        let position = self.position;
        if counted.metres_per_edge == 0.0 {
            return format!("{position:+} edges");
        }
        // No travel is not shown as minus zero.
        let metres = position as f64 * f64::from(counted.metres_per_edge) + 0.0;
        format!("{position:+} edges, {metres:+.3} m")
    }
}

/// `to − from` of a counter with this number of bits: the difference of the smallest magnitude.
#[must_use]
pub fn difference(to: u32, from: u32, bits: u8) -> i64 {
    let spare = 32_u32.saturating_sub(bits.into()).min(31);
    let shifted = (to.wrapping_sub(from) << spare).cast_signed();
    i64::from(shifted >> spare)
}
