//! A gyro: its parameters, and the turn that its rates add up to.
//!
//! The loop passes every sample to [`TurnIntegral`], up to a thousand a second; the localizer takes the turn of a step,
//! [`Localizer::odometry_with_turn`](crate::localizer::Localizer::odometry_with_turn), beside the travel of the wheels.
//!
//! # Non-finite policy
//! A rate that is NaN or infinite is a [`SampleFault`], and its time has no sample.

mod integral;

use crate::geometry::units::{Duration, PerRootSecond, Radians, RadiansPerSecond, seconds};

pub use integral::{SampleFault, SampleFaults, TurnIntegral, TurnReading};

/// Exists only in a program that is linked with the feature `gyro`.
#[cfg(feature = "gyro")]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GyroLinked;

/// Has no value: this program is linked without the feature `gyro`.
#[cfg(not(feature = "gyro"))]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum GyroLinked {}

/// Parameters of a gyro that measures the yaw rate.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GyroParameters {
    /// Largest rate that it can measure. A sample of 99.9 % of it or more is saturated.
    pub range: RadiansPerSecond,
    /// White noise of the rate, as the standard deviation of the angle after one second.
    pub noise: PerRootSecond<Radians>,
    /// Standard deviation of the bias before it has been estimated.
    pub bias: RadiansPerSecond,
    /// Random walk of the bias.
    pub bias_walk: PerRootSecond<RadiansPerSecond>,
    /// Standard deviation of the scale error, dimensionless.
    pub scale: f32,
    /// Time from one sample to the next.
    pub period: Duration,
    /// Whether it is mounted upside down, so that it measures clockwise turns as positive.
    pub is_inverted: bool,
    /// The feature `gyro`.
    pub linked: GyroLinked,
}

#[cfg(feature = "gyro")]
impl GyroParameters {
    /// MPU-6050 at ±250°/s and 100 samples a second. By its product specification 0.005°/s/√Hz of noise; the scale error
    /// of 3 % before calibration is taken as calibrated to 1 %. Assumed: bias known to 3°/s at the start, a bias walk of
    /// 0.001°/s/√s, which is 0.06°/s in an hour.
    pub const MPU_6050: Self = Self {
        range: RadiansPerSecond(250.0 * DEGREE),
        noise: PerRootSecond(Radians(0.005 * DEGREE)),
        bias: RadiansPerSecond(3.0 * DEGREE),
        bias_walk: PerRootSecond(RadiansPerSecond(0.001 * DEGREE)),
        scale: 0.01,
        period: Duration::from_ticks(10_000),
        is_inverted: false,
        linked: GyroLinked,
    };
}

impl GyroParameters {
    // ===== Eq. (36): variance of the white noise of a turn =====
    /// Variance of the noise of a turn without bias, rad². The scale error enters as white noise that has its deviation
    /// after a quarter turn; the noise of a straight step, squared, adds nothing.
    pub(crate) fn variance(&self, angle: f32, seconds: f32) -> f32 {
        let (noise, scale) = (self.noise.0.0, self.scale);
        let quarter_turns =
            core::f32::consts::FRAC_PI_2 * angle * angle / (angle.abs() + SMALL_TURN);
        noise * noise * seconds + scale * scale * quarter_turns
    }
}

/// Turn of a step below which it is nearly straight, rad: 6°/s at ten steps a second.
const SMALL_TURN: f32 = 0.01;

#[cfg(feature = "gyro")]
const DEGREE: f32 = core::f32::consts::PI / 180.0;

/// A turn measured by a gyro: the integral of its rate, bias included.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MeasuredTurn {
    /// The angle, counter-clockwise; whole turns count.
    pub angle: Radians,
    /// The time that it covers.
    pub duration: Duration,
}

/// Why a measured turn was not used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum TurnRefusal {
    /// The angle is NaN or infinite.
    NotFinite,
    /// It does not cover the time of the step: the clocks of gyro and encoders differ.
    WrongDuration,
    /// It is faster than the range of the gyro.
    TooFast,
}

impl MeasuredTurn {
    /// Checks the turn of a step that took `elapsed`.
    pub(crate) fn check(
        &self,
        parameters: &GyroParameters,
        elapsed: Duration,
    ) -> Result<(), TurnRefusal> {
        if !self.angle.is_finite() {
            return Err(TurnRefusal::NotFinite);
        }
        let (one, other) = (self.duration.ticks(), elapsed.ticks());
        if one.abs_diff(other) > other / 16 + TOLERANCE {
            return Err(TurnRefusal::WrongDuration);
        }
        if self.angle.0.abs() > parameters.range.0 * seconds(self.duration) * 1.01 {
            return Err(TurnRefusal::TooFast);
        }
        Ok(())
    }
}

/// Difference of two durations that is not a difference of clocks, µs.
const TOLERANCE: u64 = 2_000;

#[cfg(test)]
mod tests;
