//! The motor code of a board that a PC drives.
//!
//! ```text
//!   motors enabled                       a motion is commanded
//!   ─────────────▶ Pattern ──────────────────────────────────▶ Follows: the wheels have its speeds
//!                     ▲                                          │   ▲
//!                     │                               it has ended ▼   │ another one
//!                     └──────────────────────────────────────── Stands
//!                          the motors were disabled
//! ```
//!
//! The speed of each wheel is controlled by its encoder ([`sonarfix_drive::wheel`]).

use sonarfix::geometry::units::{Duration, Instant, Metres, MetresPerSecond};
use sonarfix_drive::wheel::{LONGEST_PERIOD, Limits, Motor, SpeedController};

use crate::{Drive, Estimate, Pattern};

/// The least time between two updates of the controllers: some ticks of an encoder with 360 edges in a revolution.
pub const UPDATE: Duration = Duration::from_ticks(20_000);

const LIMITS: Limits = Limits {
    response: Duration::from_ticks(150_000),
    ramp: Duration::from_ticks(500_000),
    duty: 1.0,
};

/// A gear motor with its wheel, on the floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GearMotor {
    /// Speed at the full voltage.
    pub full_speed: MetresPerSecond,
    /// The fraction of the voltage below which the wheel does not turn.
    pub dead_band: f32,
    /// The time from rest to 63 % of the speed.
    pub time_constant: Duration,
}

impl GearMotor {
    /// 200 turns a minute, wheels of 65 mm. Measure yours: docs/driving.md.
    pub const USUAL: Self = Self {
        full_speed: MetresPerSecond(0.6),
        dead_band: 0.15,
        time_constant: Duration::from_ticks(80_000),
    };

    /// That of the XRP: 90 turns a minute without load at 4.5 V by its documentation, which are 120 at the 6 V of four new cells; wheels of 60 mm. Assumed:
    /// a fifth less on the floor; the dead band; the time constant.
    pub const XRP: Self = Self {
        full_speed: MetresPerSecond(0.3),
        dead_band: 0.15,
        time_constant: Duration::from_ticks(80_000),
    };
}

impl Default for GearMotor {
    fn default() -> Self {
        Self::USUAL
    }
}

/// A wheel and its encoder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wheel {
    /// The position of the encoder, ticks.
    pub position: i64,
    /// Travel ahead for a tick of plus one.
    pub travel_per_tick: Metres,
}

/// What is known after a poll that leaves the motors enabled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inputs {
    /// The time of the poll.
    pub now: Instant,
    /// The newest estimate.
    pub estimate: Estimate,
    /// The commanded speeds of the right and the left wheel, if a motion is commanded.
    pub speeds: Option<[MetresPerSecond; 2]>,
    /// The right and the left wheel; `None` if an encoder cannot be read.
    pub wheels: Option<[Wheel; 2]>,
}

/// Follows the commanded motion. Before the first one it drives the example [`Pattern`].
#[derive(Debug, Clone, Default)]
pub struct Commanded {
    motor: GearMotor,
    pattern: Pattern,
    /// Whether a motion has been commanded since the motors were enabled.
    has_moved: bool,
    /// The controllers of the right and the left wheel, while a motion is commanded.
    running: Option<Running>,
}

#[derive(Debug, Clone)]
struct Running {
    right: SpeedController,
    left: SpeedController,
    updated: Instant,
    drive: Drive,
}

impl Commanded {
    /// That of a robot with two of these motors.
    #[must_use]
    pub fn new(motor: GearMotor) -> Self {
        Self { motor, ..Self::default() }
    }

    /// What the motors do now. `None`: they are disabled, or there is no estimate.
    pub fn drive(&mut self, inputs: Option<Inputs>) -> Drive {
        let Some(inputs) = inputs else {
            *self = Self::new(self.motor);
            return Drive::STOP;
        };
        let Some(speeds) = inputs.speeds else {
            self.running = None;
            let is_free = !self.has_moved;
            return if is_free { self.pattern.drive(Some(inputs.estimate)) } else { Drive::STOP };
        };
        self.has_moved = true;
        self.running = inputs.wheels.and_then(|wheels| {
            let running = self.running.take();
            controlled(self.motor, running, inputs.now, speeds, wheels)
        });
        self.running.as_ref().map_or(Drive::STOP, |running| running.drive)
    }
}

/// The next voltages; `None` if a wheel cannot be controlled.
fn controlled(
    motor: GearMotor,
    running: Option<Running>,
    now: Instant,
    speeds: [MetresPerSecond; 2],
    [right, left]: [Wheel; 2],
) -> Option<Running> {
    let age = |running: &Running| now.checked_duration_since(running.updated);
    // After a pause the controllers begin at rest.
    let running = running.filter(|running| age(running).is_some_and(|age| age <= LONGEST_PERIOD));
    let (mut next, period) = match running {
        Some(running) => {
            let age = age(&running)?;
            if age < UPDATE {
                return Some(running);
            }
            (running, age)
        }
        None => (Running::new(motor, now, right, left)?, UPDATE),
    };
    next.updated = now;
    let [right_speed, left_speed] = speeds;
    next.drive = Drive {
        right: next.right.update(right_speed, right.position, period).ok()?,
        left: next.left.update(left_speed, left.position, period).ok()?,
    };
    Some(next)
}

impl Running {
    /// Both wheels at rest.
    fn new(motor: GearMotor, now: Instant, right: Wheel, left: Wheel) -> Option<Self> {
        let controller = |wheel: Wheel| {
            let motor = Motor {
                full_speed: motor.full_speed,
                dead_band: motor.dead_band,
                time_constant: motor.time_constant,
                travel_per_tick: wheel.travel_per_tick,
            };
            SpeedController::new(motor, LIMITS).ok()
        };
        let (right, left) = (controller(right)?, controller(left)?);
        Some(Self { right, left, updated: now, drive: Drive::STOP })
    }
}
