//! The motor code of the boards: an example, to be replaced by your own.
//!
//! A board calls [`Pattern::drive`] after each poll of the robot's loop, and at least every [`PERIOD`] while the motors are
//! enabled, and puts the result on the inputs of its motor driver. Your controller takes the place of [`Pattern`]; no other file changes.
//! `cargo test --package sonarfix-tests --test main motor` tests it on the PC.
//!
//! The motor driver's enable pin is not controlled here: the loop sets it, by the motor policy of the robot file.
//!
//! [`commanded`] has motor code for a board that a PC drives: it follows the commanded motion, by the speeds of the wheels.

#![no_std]

pub mod commanded;

use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::trig;
use sonarfix::geometry::units::Duration;
use sonarfix::health::Verdict;

/// The longest time between two calls while the motors are enabled. A new estimate comes at every encoder tick; a controller of
/// your own may need a shorter period.
pub const PERIOD: Duration = Duration::from_ticks(10_000);

/// The newest estimate of a robot whose motors are enabled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The pose in the map.
    pub pose: Pose,
    /// Its reliability.
    pub verdict: Verdict,
}

/// The voltage of each motor as a fraction of the supply, −1 to 1; positive drives the wheel forwards.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Drive {
    /// Right motor.
    pub right: f32,
    /// Left motor.
    pub left: f32,
}

impl Drive {
    /// No voltage.
    pub const STOP: Self = Self { right: 0.0, left: 0.0 };

    /// The inputs of a driver with two H bridges: how many of `full` counts of a PWM period each is high.
    ///
    /// The order is that of the pins: first and second input of the right motor, then of the left one. The first input
    /// drives forwards, the second backwards; while both are low, the motor coasts (DRV8833 and, with its pins PWMA and PWMB
    /// at VCC, TB6612FNG).
    #[must_use]
    pub fn inputs(self, full: u16) -> [u16; 4] {
        let [right, left] = [self.right, self.left].map(|fraction| {
            [fraction, -fraction].map(|fraction| {
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "it saturates: at zero, also for NaN, and below the largest count"
                )]
                let counts = (fraction * f32::from(full)) as u16;
                counts.min(full)
            })
        });
        [right[0], right[1], left[0], left[1]]
    }
}

/// The example: slowly to and fro on a straight line, which begins where the motors were enabled. It avoids no obstacle:
/// leave a metre ahead of the robot free.
#[derive(Debug, Clone, Default)]
pub struct Pattern {
    line: Option<Line>,
}

/// A line that the robot follows.
#[derive(Debug, Clone)]
struct Line {
    from: Pose,
    /// Its direction, a unit vector.
    direction: (f32, f32),
    is_ahead: bool,
}

impl Line {
    fn from(pose: Pose) -> Self {
        let (sin, cos) = trig::sin_cos(pose.heading.radians());
        Self { from: pose, direction: (cos, sin), is_ahead: true }
    }

    /// The position along the line and to its left, metres.
    fn position(&self, pose: Pose) -> (f32, f32) {
        let (x, y) = (pose.x.0 - self.from.x.0, pose.y.0 - self.from.y.0);
        let (along_x, along_y) = self.direction;
        (x * along_x + y * along_y, y * along_x - x * along_y)
    }
}

impl Pattern {
    /// Length of the line, metres.
    pub const LENGTH: f32 = 0.5;
    /// Fraction of the supply: slow, but more than the friction of a gear motor.
    const SPEED: f32 = 0.4;
    /// Difference of the motors per radian off the line's direction, and its limit.
    const PER_RADIAN: f32 = 1.0;
    const CORRECTION: f32 = 0.15;
    /// Radians that the robot heads for the line per metre off it.
    const PER_METRE: f32 = 3.0;

    /// What the motors do now. `None`: they are disabled, or there is no estimate.
    pub fn drive(&mut self, estimate: Option<Estimate>) -> Drive {
        let Some(Estimate { pose, .. }) = estimate.filter(|e| e.verdict != Verdict::Lost) else {
            self.line = None;
            return Drive::STOP;
        };
        let line = self.line.get_or_insert_with(|| Line::from(pose));
        let (along, aside) = line.position(pose);
        if along.abs().max(aside.abs()) > 2.0 * Self::LENGTH {
            // The pose was set to another place.
            self.line = None;
            return Drive::STOP;
        }
        if along >= Self::LENGTH {
            line.is_ahead = false;
        } else if along <= 0.0 {
            line.is_ahead = true;
        }
        let sign = if line.is_ahead { 1.0 } else { -1.0 };
        let off = pose.heading.from(line.from.heading).0;
        // Backwards the robot approaches the line with the opposite heading.
        let turn = -Self::PER_RADIAN * (off + sign * Self::PER_METRE * aside);
        let turn = turn.clamp(-Self::CORRECTION, Self::CORRECTION);
        let speed = sign * Self::SPEED;
        Drive { right: speed + turn, left: speed - turn }
    }
}
