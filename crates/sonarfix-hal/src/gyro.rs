//! Gyros that measure the yaw rate.
//!
//! The loop reads a gyro at the period of its [`GyroParameters`] and adds the rates up
//! ([`TurnIntegral`](sonarfix::sensor::gyro::TurnIntegral)).

mod lsm6dso;
mod mpu6050;
mod registers;

use sonarfix::geometry::units::RadiansPerSecond;
use sonarfix::sensor::gyro::GyroParameters;

pub use lsm6dso::Lsm6dso;
pub use mpu6050::Mpu6050;

/// The smallest range of the sensors, °/s; each of the three others has twice the one before.
const SMALLEST_RANGE: f32 = 250.0;
const RANGES: u8 = 4;

/// Why a gyro cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum GyroError {
    /// It does not respond on the bus.
    Bus,
    /// Another device responds, with this identity.
    Identity(u8),
    /// The configured range is larger than its largest, 2,000°/s.
    Range,
}

impl core::fmt::Display for GyroError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Bus => f.write_str("the gyro does not respond on the bus"),
            Self::Identity(found) => {
                write!(f, "a device with the identity {found:#04x} responds instead of the gyro")
            }
            Self::Range => f.write_str("the range of the gyro exceeds 2,000 degrees per second"),
        }
    }
}

impl core::error::Error for GyroError {}

/// The number of the smallest range that includes the configured one.
fn range(parameters: &GyroParameters) -> Result<u8, GyroError> {
    let wanted = parameters.range.to_degrees();
    // Half a per mille for the conversion to radians and back.
    let includes = |number: &u8| wanted <= times_two(SMALLEST_RANGE, *number) * 1.0005;
    (0..RANGES).find(includes).ok_or(GyroError::Range)
}

/// A value of the smallest range in the range of this number, which has twice the one of the range before.
fn times_two(value: f32, number: u8) -> f32 {
    value * f32::from(1_u8 << number)
}

/// The gyro could not be read. The loop counts it and continues with the wheels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Unreadable;

/// A source of yaw rates.
pub trait YawRate {
    /// Why it cannot be configured.
    type Error: core::fmt::Debug;

    /// Configures the sensor; to be called before the first reading.
    ///
    /// # Errors
    /// If it does not respond, is another sensor, or does not have the range.
    fn configure(&mut self, parameters: &GyroParameters) -> Result<(), Self::Error>;

    /// The rate now, counter-clockwise seen from above.
    ///
    /// # Errors
    /// [`Unreadable`], if the sensor does not respond.
    fn rate(&mut self) -> Result<RadiansPerSecond, Unreadable>;
}
