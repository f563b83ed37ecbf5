//! Gyros that measure the yaw rate.
//!
//! The loop reads a gyro at the period of its [`GyroParameters`] and adds the rates up
//! ([`TurnIntegral`](sonarfix::sensor::gyro::TurnIntegral)).

mod mpu6050;

use sonarfix::geometry::units::RadiansPerSecond;
use sonarfix::sensor::gyro::GyroParameters;

pub use mpu6050::{Mpu6050, Mpu6050Error};

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
