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

/// Gear motors of 200 turns a minute with wheels of 65 mm. Measure yours: docs/driving.md.
const FULL_SPEED: MetresPerSecond = MetresPerSecond(0.6);
const DEAD_BAND: f32 = 0.15;
const TIME_CONSTANT: Duration = Duration::from_ticks(80_000);
const LIMITS: Limits = Limits {
    response: Duration::from_ticks(150_000),
    ramp: Duration::from_ticks(500_000),
    duty: 1.0,
};

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
    /// What the motors do now. `None`: they are disabled, or there is no estimate.
    pub fn drive(&mut self, inputs: Option<Inputs>) -> Drive {
        let Some(inputs) = inputs else {
            *self = Self::default();
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
            controlled(running, inputs.now, speeds, wheels)
        });
        self.running.as_ref().map_or(Drive::STOP, |running| running.drive)
    }
}

/// The next voltages; `None` if a wheel cannot be controlled.
fn controlled(
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
        None => (Running::new(now, right, left)?, UPDATE),
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
    fn new(now: Instant, right: Wheel, left: Wheel) -> Option<Self> {
        let controller = |wheel: Wheel| {
            let motor = Motor {
                full_speed: FULL_SPEED,
                dead_band: DEAD_BAND,
                time_constant: TIME_CONSTANT,
                travel_per_tick: wheel.travel_per_tick,
            };
            SpeedController::new(motor, LIMITS).ok()
        };
        let (right, left) = (controller(right)?, controller(left)?);
        Some(Self { right, left, updated: now, drive: Drive::STOP })
    }
}
