//! Pulse width ↔ bearing: a straight line through two measured points.

use sonarfix::geometry::units::{Duration, Radians};

use super::error::SettingError;
use crate::time::micros;

/// A pulse, and the bearing of the sonar that was measured with it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MeasuredPulse {
    /// Width of the pulse.
    pub width: Duration,
    /// Bearing of the sonar, relative to the robot's heading, positive to the left.
    pub bearing: Radians,
}

/// The line through two measured points. Servos of one type differ by some degrees, so each is measured, at two
/// bearings as far apart as possible.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Calibration {
    /// Pulse width at bearing zero, µs.
    ahead: f32,
    /// µs per radian; negative for a servo that turns right as pulses get longer.
    slope: f32,
}

impl Calibration {
    /// The calibration through two points, in any order.
    ///
    /// # Errors
    /// [`SettingError::Calibration`] if they do not define a line.
    pub fn new(one: MeasuredPulse, other: MeasuredPulse) -> Result<Self, SettingError> {
        let (from, to) = (micros(one.width), micros(other.width));
        let slope = (to - from) / (other.bearing - one.bearing).0;
        let ahead = from - slope * one.bearing.0;
        let is_line = slope.is_finite() && slope.abs() > 0.0 && ahead.is_finite();
        if is_line { Ok(Self { ahead, slope }) } else { Err(SettingError::Calibration) }
    }

    /// Width of the pulse for `bearing`, µs.
    pub(super) fn pulse(self, bearing: Radians) -> f32 {
        self.ahead + self.slope * bearing.0
    }

    /// The bearing for a pulse of this width in µs.
    pub(super) fn bearing(self, pulse: f32) -> Radians {
        Radians((pulse - self.ahead) / self.slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(width: u64, bearing: f32) -> MeasuredPulse {
        let width = Duration::from_ticks(width);
        MeasuredPulse { width, bearing: Radians(bearing) }
    }

    #[test]
    fn the_line_passes_through_both_points_in_any_order() {
        let (low, high) = (point(2_310, -1.4), point(640, 1.5));
        for calibration in [Calibration::new(low, high), Calibration::new(high, low)] {
            let calibration = calibration.unwrap();
            for measured in [low, high] {
                let pulse = calibration.pulse(measured.bearing);
                assert!((pulse - micros(measured.width)).abs() < 0.01, "{pulse}");
                let bearing = calibration.bearing(micros(measured.width));
                assert!((bearing - measured.bearing).abs() < Radians(1e-5));
            }
        }
    }

    #[test]
    fn two_points_that_make_no_line_are_refused() {
        let one = point(1_000, 0.0);
        for other in [one, point(1_000, 1.0), point(1_500, 0.0), point(1_500, f32::NAN)] {
            let error = Calibration::new(one, other);
            assert_eq!(error, Err(SettingError::Calibration), "{other:?}");
        }
    }
}
