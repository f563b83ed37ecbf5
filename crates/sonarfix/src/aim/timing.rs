//! How long a look takes, and where the servo is to point.
//!
//! # Non-finite policy
//! Times are whole ticks and ranges those of a sonar, so nothing here is not finite; a span made from NaN
//! or from less than nothing is zero.

use crate::config::{Rhythm, Timing};
use crate::units::{Duration, Metres, Radians};

/// Metres that sound travels in a second, in air of 20 °C (331.3 + 0.606 · 20). Planning needs no
/// better.
const SPEED_OF_SOUND: f32 = 343.4;

/// A span in seconds.
#[expect(
    clippy::cast_precision_loss,
    reason = "a share of an hour, where microseconds do not count"
)]
pub(crate) fn seconds(span: Duration) -> f32 {
    span.to_micros() as f32 * 1e-6
}

/// The span of so many seconds.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "not negative; the cast saturates, and makes zero of NaN"
)]
pub(super) fn span(seconds: f32) -> Duration {
    Duration::from_ticks((seconds * 1e6) as u64)
}

/// Seconds from a sonar's cry until it is heard again from `range` away.
pub(super) fn flight(range: Metres) -> f32 {
    2.0 / SPEED_OF_SOUND * range.0
}

/// [`Timing`] in seconds.
pub(super) struct Pacing {
    /// From one look to the next at least.
    period: f32,
    /// From ping to ping at least; zero where the period has seen to that.
    cycle: f32,
    /// Of any turn of the servo.
    start_and_settle: f32,
    per_radian: f32,
}

impl Pacing {
    pub fn new(timing: &Timing) -> Self {
        let servo = &timing.servo;
        let (period, cycle) = match timing.rhythm {
            Rhythm::Every(period) => (seconds(period), 0.0),
            Rhythm::AsFastAsPossible => (0.0, seconds(timing.cycle)),
        };
        Self {
            period,
            cycle,
            start_and_settle: seconds(servo.frame) + seconds(servo.settle),
            per_radian: seconds(servo.sixty_degrees) * core::f32::consts::FRAC_1_PI * 3.0,
        }
    }

    /// How long the servo takes for a turn and to stand still.
    pub fn turn(&self, by: Radians) -> f32 {
        if by.abs() > Radians(0.0) {
            self.start_and_settle + self.per_radian * by.abs().0
        } else {
            0.0
        }
    }

    /// How long the ranger still rests when the echo from `range` has just come back.
    pub fn rest_after(&self, range: Metres) -> f32 {
        let rest = self.cycle - flight(range);
        if rest > 0.0 { rest } else { 0.0 }
    }

    /// How long a look takes, from asking where to look until the echo from `range` is there; the
    /// ping goes out after `until_ping`.
    pub fn look(&self, until_ping: f32, range: Metres) -> f32 {
        let look = until_ping + flight(range);
        // A look that takes no time at all would be worth infinitely much.
        let least = if self.period > 1e-4 { self.period } else { 1e-4 };
        if look > least { look } else { least }
    }
}
