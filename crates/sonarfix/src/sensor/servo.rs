//! The motion of a hobby servo, which has no feedback: how long a turn takes. The choice of a wall and the driver
//! of the servo (`sonarfix-hal`) evaluate this one model.
//!
//! ```text
//!   bearing
//!      ▲                    ┌──────────┬───▶ settled
//!      │                  ╱ │ settle   │
//!      │                ╱   │          │
//!      │───────────────╱    │          │
//!      └──┬────────────┬────┬──────────┬───▶ time
//!       command  frame     slew
//! ```
//!
//! # Non-finite policy
//! Times are whole microseconds. A turn that is not finite has a time that is not.

use crate::geometry::units::{Duration, Radians, seconds};
use crate::sensor::ranger::ServoTiming;

/// The model of one servo.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ServoMotion {
    /// Microseconds of a turn of 60°, as datasheets give it.
    sixty_degrees: f32,
    /// Seconds of a turn of one radian.
    per_radian: f32,
    /// Seconds from the command to the start and from the arrival until it has settled, together.
    start_and_settle: f32,
}

impl ServoMotion {
    /// The model of a servo with this timing.
    #[must_use]
    pub fn new(timing: &ServoTiming) -> Self {
        Self {
            sixty_degrees: micros(timing.sixty_degrees),
            per_radian: seconds(timing.sixty_degrees) * core::f32::consts::FRAC_1_PI * 3.0,
            start_and_settle: seconds(timing.frame) + seconds(timing.settle),
        }
    }

    /// The time of a turn once it has begun, for the driver: in whole microseconds, rounded up, so that no ping
    /// starts before the servo has settled.
    ///
    /// ```
    /// use sonarfix::{config::ServoTiming, sensor::servo::ServoMotion, geometry::units::{Duration, Radians}};
    /// let sg90 = ServoMotion::new(&ServoTiming::SG90);
    /// assert_eq!(sg90.slew(Radians::from_degrees(-90.0)), Duration::from_ticks(180_001));
    /// ```
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "not negative; the cast saturates, and converts NaN to zero"
    )]
    #[must_use]
    pub fn slew(&self, turn: Radians) -> Duration {
        let micros = self.sixty_degrees * (turn.abs().0 / core::f32::consts::FRAC_PI_3);
        Duration::from_ticks((micros + 1.0) as u64)
    }

    /// Seconds from the command of a turn until the servo has settled, for the choice of a wall; zero for no turn.
    ///
    /// ```
    /// use sonarfix::{config::ServoTiming, sensor::servo::ServoMotion, geometry::units::Radians};
    /// let sg90 = ServoMotion::new(&ServoTiming::SG90);
    /// assert!((sg90.settling(Radians::from_degrees(90.0)) - 0.26).abs() < 1e-6);
    /// assert_eq!(sg90.settling(Radians(0.0)).to_bits(), 0);
    /// ```
    #[must_use]
    pub fn settling(&self, turn: Radians) -> f32 {
        let turn = turn.abs();
        if turn > Radians(0.0) { self.start_and_settle + self.per_radian * turn.0 } else { 0.0 }
    }
}

/// Microseconds as a number. Exact below 16 s, which no servo takes for 60°.
#[expect(clippy::cast_precision_loss, reason = "exact for the times of a servo")]
fn micros(span: Duration) -> f32 {
    span.ticks() as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Driver and planner reckon with the same times, to a microsecond.
    #[test]
    fn both_evaluations_agree() {
        let slow =
            ServoTiming { sixty_degrees: Duration::from_ticks(170_000), ..ServoTiming::SG90 };
        for timing in [ServoTiming::SG90, slow] {
            let servo = ServoMotion::new(&timing);
            for degrees in 1..=180_u8 {
                let turn = Radians::from_degrees(f32::from(degrees));
                let driver = timing.frame + servo.slew(turn) + timing.settle;
                let difference = seconds(driver) - servo.settling(turn);
                assert!((-1e-7..2.1e-6).contains(&difference), "{degrees}°: {difference} s");
            }
        }
    }
}
