//! Plausibility of a wheel travel.

use crate::filter::ekf::EkfError;
use crate::filter::motion::WheelTravel;
use crate::geometry::units::{Duration, Instant, Metres, MetresPerSecond, seconds};

/// Reason for which a wheel travel is refused. It is not part of the estimate; a caller that considers
/// it true adds it to the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum OdometryError {
    /// The time is before that of an earlier call.
    TimeRanBackwards,
    /// A wheel moved although no time has passed.
    NoTimePassed,
    /// A wheel moved faster than [`max_wheel_speed`](crate::config::Config::max_wheel_speed).
    TooFast,
    /// The filter refused the travel.
    Filter(EkfError),
}

impl core::fmt::Display for OdometryError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TimeRanBackwards => f.write_str("the time is before that of an earlier call"),
            Self::NoTimePassed => f.write_str("a wheel moved although no time has passed"),
            Self::TooFast => f.write_str("a wheel moved faster than the maximum wheel speed"),
            Self::Filter(error) => write!(f, "{error}"),
        }
    }
}

impl core::error::Error for OdometryError {}

/// The distance that a wheel may have rolled in this time.
pub(crate) fn largest_travel(elapsed: Duration, max_wheel_speed: MetresPerSecond) -> Metres {
    Metres(max_wheel_speed.0 * seconds(elapsed))
}

/// The time since `last`, if the travel is plausible.
///
/// # Errors
/// [`OdometryError`], by what is wrong with the travel or its time.
pub(crate) fn check(
    travel: WheelTravel,
    last: Instant,
    now: Instant,
    max_wheel_speed: MetresPerSecond,
) -> Result<Duration, OdometryError> {
    let elapsed = now.checked_duration_since(last).ok_or(OdometryError::TimeRanBackwards)?;
    if !travel.is_finite() {
        return Err(OdometryError::Filter(EkfError::NotFinite));
    }
    let (right, left) = (travel.right.abs(), travel.left.abs());
    let fastest = if right > left { right } else { left };
    if elapsed.is_zero() && fastest > Metres(0.0) {
        return Err(OdometryError::NoTimePassed);
    }
    if fastest > largest_travel(elapsed, max_wheel_speed) {
        return Err(OdometryError::TooFast);
    }
    Ok(elapsed)
}
