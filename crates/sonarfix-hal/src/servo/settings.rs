//! The settings of a servo's driver, and the pulses of a PWM channel.

use sonarfix::config::ServoTiming;
use sonarfix::geometry::units::{Duration, Radians};

use super::calibration::{Calibration, MeasuredPulse};
use super::error::SettingError;
use super::motion::Motion;
use crate::time::micros;

/// The settings of a servo's driver.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ServoSettings {
    /// Two pulses, and the bearing of the sonar that was measured with each.
    pub pulses: [MeasuredPulse; 2],
    /// The rightmost and the leftmost permitted bearing, relative to the heading.
    pub limits: (Radians, Radians),
    /// Speed and settling time.
    pub timing: ServoTiming,
}

impl ServoSettings {
    /// Whether the pulses at both limits fit into the servo's frame.
    #[must_use]
    pub fn fits_its_frame(&self) -> bool {
        Setup::of(self, &PwmFrame::of(self.timing.frame)).is_ok()
    }
}

/// The pulses that a PWM channel generates, limited to those that the board permits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PwmFrame {
    /// Period of the pulses.
    pub period: Duration,
    /// The shortest pulse.
    pub shortest: Duration,
    /// The longest pulse.
    pub longest: Duration,
}

impl PwmFrame {
    /// A channel that generates any pulse up to its period.
    #[must_use]
    pub const fn of(period: Duration) -> Self {
        Self { period, shortest: Duration::from_ticks(0), longest: period }
    }
}

/// A configured servo.
#[derive(Debug)]
pub(super) struct Setup {
    pub settings: ServoSettings,
    pub calibration: Calibration,
    pub motion: Motion,
}

impl Setup {
    pub fn of(settings: &ServoSettings, channel: &PwmFrame) -> Result<Self, SettingError> {
        let ServoSettings { pulses: [one, other], limits: (rightmost, leftmost), timing } =
            *settings;
        let calibration = Calibration::new(one, other)?;
        let in_order = rightmost < leftmost && rightmost.is_finite() && leftmost.is_finite();
        if !in_order {
            return Err(SettingError::Limits);
        }
        if timing.frame != channel.period {
            return Err(SettingError::Frame);
        }
        let allowed = micros(channel.shortest)..=micros(channel.longest);
        let fits = |bearing| allowed.contains(&calibration.pulse(bearing));
        if channel.period.is_zero() || !fits(rightmost) || !fits(leftmost) {
            return Err(SettingError::Pulse);
        }
        Ok(Self { settings: *settings, calibration, motion: Motion::unknown(timing) })
    }
}
