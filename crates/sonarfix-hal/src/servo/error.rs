//! Errors of the servo's driver.

/// Settings that do not describe a servo, or a servo that the channel cannot drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum SettingError {
    /// The two measured points are not finite, or share a pulse width or a bearing.
    Calibration,
    /// The limits are not finite, or not a rightmost bearing below a leftmost one.
    Limits,
    /// A pulse at one of the limits is shorter or longer than the channel allows.
    Pulse,
    /// The frame differs from the period of the channel's pulses.
    Frame,
}

impl core::fmt::Display for SettingError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Calibration => "a calibration needs two different, finite points",
            Self::Limits => "the limits must be finite, the rightmost below the leftmost",
            Self::Pulse => "a pulse at one of the limits is outside the channel's range",
            Self::Frame => "the servo's frame is not the period of the channel's pulses",
        })
    }
}

impl core::error::Error for SettingError {}

/// Why the servo was not turned. It keeps its target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum PointError<E> {
    /// The driver has no [`ServoSettings`](super::ServoSettings) yet.
    NotConfigured,
    /// The bearing is beyond a limit, or NaN.
    OutOfReach,
    /// The PWM channel's error.
    Pwm(E),
}

impl<E: core::fmt::Debug> core::fmt::Display for PointError<E> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NotConfigured => f.write_str("the servo is not configured"),
            Self::OutOfReach => f.write_str("the bearing is out of the servo's reach"),
            Self::Pwm(error) => write!(f, "the PWM channel: {error:?}"),
        }
    }
}

impl<E: core::fmt::Debug> core::error::Error for PointError<E> {}
