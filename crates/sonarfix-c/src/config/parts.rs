//! Named parts: sensors, servos and gyros.

use sonarfix::config::{EchoParameters, Ranging, ServoTiming};
use sonarfix::geometry::units::Duration;
use sonarfix::sensor::gyro::GyroParameters;
use sonarfix_hal::ranger::RangerSettings;

use super::ranger::{sonarfix_ranger_config_t, sonarfix_ranging_t};
use crate::state::micros;
use crate::status::{Result, sonarfix_status_t};

/// A sensor with a name.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum sonarfix_sensor_t {
    /// A sonar that always hears its wall and nothing else.
    SONARFIX_SENSOR_IDEAL = 0,
    /// HC-SR04, and compatible ones, in a furnished room.
    SONARFIX_SENSOR_HC_SR04 = 1,
    /// VL53L1X in a furnished room.
    SONARFIX_SENSOR_VL53L1X = 2,
}

/// A servo with a name.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum sonarfix_servo_t {
    /// Turns at once.
    SONARFIX_SERVO_INSTANT = 0,
    /// SG90.
    SONARFIX_SERVO_SG90 = 1,
}

pub(super) fn servo(number: i32) -> Result<ServoTiming> {
    match number {
        0 => Ok(ServoTiming::INSTANT),
        1 => Ok(ServoTiming::SG90),
        _ => Err(sonarfix_status_t::SONARFIX_ERROR_VALUE),
    }
}

/// What is known of a sensor.
pub(super) struct Sensor {
    pub echo: EchoParameters,
    ranging: Ranging,
    cycle: Duration,
}

impl Sensor {
    pub fn set(&self, ranger: &mut sonarfix_ranger_config_t) {
        ranger.ping_cycle_us = micros(self.cycle);
        ranger.ranging = sonarfix_ranging_t::SONARFIX_RANGING_SOUND as i32;
        if let Ranging::Light(beam) = self.ranging {
            ranger.ranging = sonarfix_ranging_t::SONARFIX_RANGING_LIGHT as i32;
            (ranger.spot_rad, ranger.pointing_rad) = (beam.spot.0, beam.pointing.0);
        }
    }
}

pub(super) fn sensor(number: i32) -> Result<Sensor> {
    let sound = |echo, cycle| Ok(Sensor { echo, ranging: Ranging::Sound, cycle });
    match number {
        0 => sound(EchoParameters::NONE, Duration::from_ticks(0)),
        1 => sound(EchoParameters::HC_SR04, RangerSettings::HC_SR04.cycle),
        2 => vl53l1x(),
        _ => Err(sonarfix_status_t::SONARFIX_ERROR_VALUE),
    }
}

#[cfg(feature = "light")]
#[expect(clippy::unnecessary_wraps, reason = "a library without light returns an error")]
fn vl53l1x() -> Result<Sensor> {
    let ranging = Ranging::Light(sonarfix::config::LightBeam::VL53L1X);
    Ok(Sensor { echo: EchoParameters::VL53L1X, ranging, cycle: RangerSettings::VL53L1X.cycle })
}

#[cfg(not(feature = "light"))]
fn vl53l1x() -> Result<Sensor> {
    Err(sonarfix_status_t::SONARFIX_ERROR_NOT_LINKED)
}

/// A gyro that measures the yaw rate.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_gyro_config_t {
    /// Largest rate that it can measure, radians per second.
    pub range_rad_per_s: f32,
    /// White noise of the rate: standard deviation of the angle after one second, radians.
    pub noise_rad: f32,
    /// Standard deviation of the bias at the start, radians per second.
    pub bias_rad_per_s: f32,
    /// Random walk of the bias: standard deviation after one second, radians per second.
    pub bias_walk_rad_per_s: f32,
    /// Standard deviation of the scale error.
    pub scale: f32,
    /// Time from sample to sample, microseconds.
    pub period_us: u32,
    /// Not zero if the robot has a gyro. The other fields are then those of an MPU-6050 by default.
    pub is_fitted: u32,
    /// Not zero if it is mounted upside down.
    pub is_inverted: u32,
}

impl From<&Option<GyroParameters>> for sonarfix_gyro_config_t {
    fn from(gyro: &Option<GyroParameters>) -> Self {
        match gyro {
            Some(parameters) => Self { is_fitted: 1, ..Self::of(parameters) },
            None => Self::of_usual(),
        }
    }
}

impl sonarfix_gyro_config_t {
    fn of(gyro: &GyroParameters) -> Self {
        Self {
            range_rad_per_s: gyro.range.0,
            noise_rad: gyro.noise.0.0,
            bias_rad_per_s: gyro.bias.0,
            bias_walk_rad_per_s: gyro.bias_walk.0.0,
            scale: gyro.scale,
            period_us: micros(gyro.period),
            is_fitted: 0,
            is_inverted: u32::from(gyro.is_inverted),
        }
    }

    #[cfg(feature = "gyro")]
    fn of_usual() -> Self {
        Self::of(&GyroParameters::MPU_6050)
    }

    #[cfg(not(feature = "gyro"))]
    fn of_usual() -> Self {
        Self {
            range_rad_per_s: 0.0,
            noise_rad: 0.0,
            bias_rad_per_s: 0.0,
            bias_walk_rad_per_s: 0.0,
            scale: 0.0,
            period_us: 0,
            is_fitted: 0,
            is_inverted: 0,
        }
    }

    #[cfg(feature = "gyro")]
    #[expect(clippy::unnecessary_wraps, reason = "a library without gyro returns an error")]
    pub(super) fn parameters(&self) -> Result<Option<GyroParameters>> {
        use sonarfix::geometry::units::{PerRootSecond, Radians, RadiansPerSecond};
        Ok((self.is_fitted != 0).then_some(GyroParameters {
            range: RadiansPerSecond(self.range_rad_per_s),
            noise: PerRootSecond(Radians(self.noise_rad)),
            bias: RadiansPerSecond(self.bias_rad_per_s),
            bias_walk: PerRootSecond(RadiansPerSecond(self.bias_walk_rad_per_s)),
            scale: self.scale,
            period: Duration::from_ticks(u64::from(self.period_us)),
            is_inverted: self.is_inverted != 0,
            linked: sonarfix::sensor::gyro::GyroLinked,
        }))
    }

    #[cfg(not(feature = "gyro"))]
    pub(super) fn parameters(&self) -> Result<Option<GyroParameters>> {
        let is_absent = self.is_fitted == 0;
        is_absent.then_some(None).ok_or(sonarfix_status_t::SONARFIX_ERROR_NOT_LINKED)
    }
}
