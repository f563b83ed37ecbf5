//! Duration of a ping.
//!
//! # Non-finite policy
//! Times are whole ticks and ranges are within the limits of the sonar, so all numbers are finite; a
//! duration from NaN or from a negative number is zero.

use crate::geometry::units::{Duration, Metres, Radians, seconds};
use crate::sensor::ranger::{PingSchedule, RangerParameters, Ranging};
use crate::sensor::servo::ServoMotion;

/// Speed of sound in air of 20 °C, m/s (331.3 + 0.606 · 20). Planning needs no better value.
const SPEED_OF_SOUND: f32 = 343.4;

/// The duration of a number of seconds.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "not negative; the cast saturates, and converts NaN to zero"
)]
pub(crate) fn duration(seconds: f32) -> Duration {
    Duration::from_ticks((seconds * 1e6) as u64)
}

/// [`PingTiming`](crate::sensor::ranger::PingTiming) in seconds.
pub(crate) struct PingDuration {
    /// Time from the ping to the range: constant, and per metre of range.
    measuring: f32,
    per_metre: f32,
    /// Least time between two pings by the schedule.
    period: f32,
    /// Least time between two pings by the ranger; zero where the period ensures it.
    cycle: f32,
    servo: ServoMotion,
}

impl PingDuration {
    pub fn new(sonar: &RangerParameters) -> Self {
        let timing = &sonar.timing;
        let (period, cycle) = match timing.schedule {
            PingSchedule::Every(period) => (seconds(period), 0.0),
            PingSchedule::AsFastAsPossible => (0.0, seconds(timing.cycle)),
        };
        // A time-of-flight ranger collects light for the whole of its cycle.
        let (measuring, per_metre) = match sonar.ranging {
            Ranging::Sound => (0.0, 2.0 / SPEED_OF_SOUND),
            Ranging::Light(_) => (seconds(timing.cycle), 0.0),
        };
        Self { measuring, per_metre, period, cycle, servo: ServoMotion::new(&timing.servo) }
    }

    /// Seconds from a ping until its echo from `range`.
    fn flight(&self, range: Metres) -> f32 {
        self.measuring + self.per_metre * range.0
    }

    /// Time of the servo for a turn, until it has settled.
    pub fn turn(&self, by: Radians) -> f32 {
        self.servo.settling(by)
    }

    /// Remaining rest of the ranger when the echo from `range` has just arrived.
    pub fn rest_after(&self, range: Metres) -> f32 {
        let rest = self.cycle - self.flight(range);
        if rest > 0.0 { rest } else { 0.0 }
    }

    /// Duration of a ping, from the choice of the wall to the echo from `range`; the ping starts after
    /// `until_ping`.
    pub fn ping(&self, until_ping: f32, range: Metres) -> f32 {
        let ping = until_ping + self.flight(range);
        // A duration of zero would make the score infinite.
        let least = if self.period > 1e-4 { self.period } else { 1e-4 };
        if ping > least { ping } else { least }
    }
}
