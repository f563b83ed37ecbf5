//! The channel of a board without a servo.

use core::convert::Infallible;

use embedded_hal::pwm::{ErrorType, SetDutyCycle};
use sonarfix::geometry::units::Duration;

use super::{PwmFrame, Servo};

/// A PWM channel that generates nothing, for a robot whose ranger has a fixed bearing. A configuration with a servo is refused
/// ([`SettingError::Frame`](super::SettingError::Frame)).
///
/// ```
/// use sonarfix::geometry::units::{Instant, Radians};
/// use sonarfix_hal::servo::NoPwm;
/// let mut mount = NoPwm::servo();
/// mount.fix(Radians(1.5));
/// let now = Instant::from_ticks(0);
/// assert!(mount.point(now, Radians(1.5)).is_ok() && mount.is_settled(now));
/// assert!(mount.point(now, Radians(0.0)).is_err());
/// ```
#[derive(Debug, Clone, Copy, Default)]
pub struct NoPwm;

impl NoPwm {
    /// The driver on this channel, not configured.
    #[must_use]
    pub const fn servo() -> Servo<Self> {
        Servo::new(Self, PwmFrame::of(Duration::from_ticks(0)))
    }
}

impl ErrorType for NoPwm {
    type Error = Infallible;
}

impl SetDutyCycle for NoPwm {
    fn max_duty_cycle(&self) -> u16 {
        u16::MAX
    }

    fn set_duty_cycle(&mut self, _: u16) -> Result<(), Infallible> {
        Ok(())
    }
}
