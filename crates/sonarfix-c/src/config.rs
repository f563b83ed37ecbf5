//! The configuration of a localizer.

#![expect(unsafe_code, reason = "exports functions to C")]

mod parts;
mod ranger;
mod rules;

use sonarfix::config::{Config, Policy, Rangers};
use sonarfix::filter::motion::Drive;
use sonarfix::geometry::units::{Metres, MetresPerSecond, PerRootMetre};
use sonarfix_link::baked;

use crate::memory::{give, slice, update_value, value};
use crate::status::{Result, sonarfix_status_t};

pub use parts::{sonarfix_gyro_config_t, sonarfix_sensor_t, sonarfix_servo_t};
pub use ranger::{sonarfix_ranger_config_t, sonarfix_ranging_t};
pub use rules::{sonarfix_config_check, sonarfix_config_error_t};

/// The largest number of rangers of a robot.
pub const SONARFIX_RANGERS: usize = 3;

/// How the wall is chosen among those that can be measured.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum sonarfix_policy_t {
    /// The nearest.
    SONARFIX_POLICY_NEAREST = 0,
    /// The one with the largest expected decrease of the variance per time.
    SONARFIX_POLICY_INFORMATIVE = 1,
}

/// The policy with this number.
pub(crate) fn policy_of(number: i32) -> Result<Policy> {
    match number {
        0 => Ok(Policy::Nearest),
        1 => Ok(Policy::Informative),
        _ => Err(sonarfix_status_t::SONARFIX_ERROR_VALUE),
    }
}

fn number_of(policy: Policy) -> i32 {
    let policy = match policy {
        Policy::Nearest => sonarfix_policy_t::SONARFIX_POLICY_NEAREST,
        Policy::Informative => sonarfix_policy_t::SONARFIX_POLICY_INFORMATIVE,
    };
    policy as i32
}

/// The parameters of a localizer. Start from sonarfix_config_default, and set what is known of the robot.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_config_t {
    /// Distance between the contact points of the wheels, metres.
    pub track_width_m: f32,
    /// White noise of the travel of each wheel: standard deviation after one metre, metres. Good robots on a hard floor: 0.001;
    /// recordings show 0.0005 to 0.02.
    pub wheel_noise_m: f32,
    /// Random walk of the scale error of each wheel: standard deviation after one metre.
    pub scale_walk: f32,
    /// Random walk of the track width: standard deviation after one metre, metres.
    pub track_width_walk_m: f32,
    /// Fastest speed of a wheel, metres per second; a faster travel is a fault of an encoder.
    pub max_wheel_speed_m_per_s: f32,

    /// Standard deviation of the scale error of the right wheel before the first range.
    pub prior_scale_right: f32,
    /// That of the left wheel. Either both are zero or none.
    pub prior_scale_left: f32,
    /// That of the difference of both, for wheels that are alike; zero: the errors are independent.
    pub prior_scale_difference: f32,
    /// That of the track width, metres.
    pub prior_track_width_m: f32,
    /// That of the scale of the ranger; zero: it is exact and not estimated.
    pub prior_range_scale: f32,
    /// That of each coordinate of the mount of a ranger, metres; zero: it is exact and not estimated, the only value of a library
    /// without it.
    pub prior_mount_m: f32,

    /// A wall is measured only if no other can answer first, even if the pose is wrong by this many standard deviations.
    pub gating_confidence: f32,
    /// Standard deviation that is added to the position of a lost robot by a ping that contradicts it, metres; zero: none.
    pub gating_inflation_m: f32,
    /// Distance without a range used above which the verdict is not Tracking, metres.
    pub gating_max_distance_without_fix_m: f32,
    /// Standard deviation of the position above which the verdict is not Tracking, metres.
    pub gating_max_position_deviation_m: f32,

    /// Probability that a wall within range, square to the beam, returns no echo.
    pub echo_missed: f32,
    /// Probability of a spurious range that is shorter than that of the wall.
    pub echo_short: f32,
    /// Probability of a spurious range that is longer.
    pub echo_long: f32,
    /// Range at which every second beam meets an object that is not in the map, metres; zero: there are none.
    pub echo_free_path_m: f32,
    /// Standard deviation of the place of a wall in the map, metres.
    pub echo_map_accuracy_m: f32,
    /// Mean by which an echo on the normal of a wall is reported too far, metres.
    pub echo_late_m: f32,
    /// By how much more per radian off the normal, metres.
    pub echo_late_m_per_rad: f32,
    /// Angle off the normal at which a wall answers half as often as on it, radians; zero: the cone of the ranger.
    pub echo_half_angle_rad: f32,
    /// Standard deviation of that angle from ping to ping, radians.
    pub echo_rim_rad: f32,
    /// Range up to which hardly any echo is missed or spurious, metres; zero: echo_missed, echo_short and echo_long hold at every range.
    pub echo_sure_within_m: f32,

    /// Metres of position error that an error of one radian of heading is worth to the policy.
    pub weight_heading_m: f32,
    /// Metres of position error that an error of 1 of the scale of a wheel is worth to the policy.
    pub weight_wheels_m: f32,
    /// A sonarfix_policy_t: how the wall to measure is chosen.
    pub policy: i32,

    /// The gyro, if gyro.is_fitted is not zero.
    pub gyro: sonarfix_gyro_config_t,
    /// Number of rangers: 1 to SONARFIX_RANGERS.
    pub ranger_count: u32,
    /// The rangers, the first ranger_count of them.
    pub rangers: [sonarfix_ranger_config_t; SONARFIX_RANGERS],
}

impl From<&Config> for sonarfix_config_t {
    fn from(config: &Config) -> Self {
        let Config { drive, prior, gating, echo, weights, .. } = config;
        let mut rangers = [sonarfix_ranger_config_t::from(&config.rangers.first); SONARFIX_RANGERS];
        let mut ranger_count = 0;
        for (ranger, (_, parameters)) in rangers.iter_mut().zip(config.rangers.iter()) {
            *ranger = parameters.into();
            ranger_count += 1;
        }
        Self {
            track_width_m: drive.track_width.0,
            wheel_noise_m: drive.wheel_noise.0.0,
            scale_walk: drive.scale_walk.0,
            track_width_walk_m: drive.track_width_walk.0.0,
            max_wheel_speed_m_per_s: config.max_wheel_speed.0,
            prior_scale_right: prior.scale_right,
            prior_scale_left: prior.scale_left,
            prior_scale_difference: prior.scale_difference.unwrap_or(0.0),
            prior_track_width_m: prior.track_width.0,
            prior_range_scale: prior.range_scale,
            prior_mount_m: prior.mount.0,
            gating_confidence: gating.confidence,
            gating_inflation_m: gating.inflation.0,
            gating_max_distance_without_fix_m: gating.max_distance_without_fix.0,
            gating_max_position_deviation_m: gating.max_position_deviation.0,
            echo_missed: echo.missed,
            echo_short: echo.short,
            echo_long: echo.long,
            echo_free_path_m: echo.free_path.0,
            echo_map_accuracy_m: echo.map_accuracy.0,
            echo_late_m: echo.late.0,
            echo_late_m_per_rad: echo.late_per_radian.0,
            echo_half_angle_rad: echo.half_angle.0,
            echo_rim_rad: echo.rim.0,
            echo_sure_within_m: echo.sure_within.0,
            weight_heading_m: weights.heading.0,
            weight_wheels_m: weights.wheels.0,
            policy: number_of(config.policy),
            gyro: (&config.gyro).into(),
            ranger_count,
            rangers,
        }
    }
}

impl sonarfix_config_t {
    /// The configuration, which is not checked yet.
    pub(crate) fn config(&self) -> Result<Config> {
        let mut config = Config::for_track_width(Metres(self.track_width_m));
        config.drive = Drive {
            track_width: Metres(self.track_width_m),
            wheel_noise: PerRootMetre(Metres(self.wheel_noise_m)),
            scale_walk: PerRootMetre(self.scale_walk),
            track_width_walk: PerRootMetre(Metres(self.track_width_walk_m)),
        };
        config.max_wheel_speed = MetresPerSecond(self.max_wheel_speed_m_per_s);
        config.policy = policy_of(self.policy)?;
        config.rangers = self.rangers()?;
        config.gyro = self.gyro.parameters()?;
        self.set_prior(&mut config);
        self.set_gating(&mut config);
        self.set_echo(&mut config);
        (config.weights.heading.0, config.weights.wheels.0) =
            (self.weight_heading_m, self.weight_wheels_m);
        Ok(config)
    }

    fn rangers(&self) -> Result<Rangers<sonarfix::config::RangerParameters>> {
        let [first, further @ ..] = &self.rangers;
        let count = usize::try_from(self.ranger_count).unwrap_or(usize::MAX);
        let further = count.checked_sub(1).and_then(|count| further.get(..count));
        let mut rangers = Rangers::one(first.parameters()?);
        for ranger in further.ok_or(sonarfix_status_t::SONARFIX_ERROR_VALUE)? {
            let pushed = rangers.push(ranger.parameters()?);
            pushed.map_err(|_| sonarfix_status_t::SONARFIX_ERROR_NOT_LINKED)?;
        }
        Ok(rangers)
    }

    fn set_prior(&self, config: &mut Config) {
        let prior = &mut config.prior;
        prior.scale_right = self.prior_scale_right;
        prior.scale_left = self.prior_scale_left;
        let difference = self.prior_scale_difference;
        prior.scale_difference = (difference.to_bits() != 0).then_some(difference);
        prior.track_width.0 = self.prior_track_width_m;
        prior.range_scale = self.prior_range_scale;
        prior.mount.0 = self.prior_mount_m;
    }

    fn set_gating(&self, config: &mut Config) {
        let gating = &mut config.gating;
        gating.confidence = self.gating_confidence;
        gating.inflation.0 = self.gating_inflation_m;
        gating.max_distance_without_fix.0 = self.gating_max_distance_without_fix_m;
        gating.max_position_deviation.0 = self.gating_max_position_deviation_m;
    }

    fn set_echo(&self, config: &mut Config) {
        let echo = &mut config.echo;
        (echo.missed, echo.short, echo.long) = (self.echo_missed, self.echo_short, self.echo_long);
        echo.free_path.0 = self.echo_free_path_m;
        echo.map_accuracy.0 = self.echo_map_accuracy_m;
        echo.late.0 = self.echo_late_m;
        echo.late_per_radian.0 = self.echo_late_m_per_rad;
        echo.half_angle.0 = self.echo_half_angle_rad;
        echo.rim.0 = self.echo_rim_rad;
        echo.sure_within.0 = self.echo_sure_within_m;
    }

    fn set_echo_model(&mut self, echo: &sonarfix::config::EchoParameters) {
        (self.echo_missed, self.echo_short, self.echo_long) = (echo.missed, echo.short, echo.long);
        self.echo_free_path_m = echo.free_path.0;
        self.echo_map_accuracy_m = echo.map_accuracy.0;
        self.echo_late_m = echo.late.0;
        self.echo_late_m_per_rad = echo.late_per_radian.0;
        self.echo_half_angle_rad = echo.half_angle.0;
        self.echo_rim_rad = echo.rim.0;
        self.echo_sure_within_m = echo.sure_within.0;
    }

    fn ranger_mut(&mut self, ranger: u32) -> Result<&mut sonarfix_ranger_config_t> {
        let ranger = usize::try_from(ranger).ok().and_then(|ranger| self.rangers.get_mut(ranger));
        ranger.ok_or(sonarfix_status_t::SONARFIX_ERROR_VALUE)
    }
}

/// Fills a configuration with the defaults for a small robot with two driven wheels and one ideal ranger at its centre, which
/// pings once per second on a servo without limits or delay.
///
/// @param track_width_m  distance between the contact points of the wheels, metres
/// @param config  gets the defaults, the same in all rangers
/// @return SONARFIX_OK; SONARFIX_ERROR_NOT_FINITE; or an error of the pointer
/// Threads: any number at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_config_default(
    track_width_m: f32,
    config: *mut sonarfix_config_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        give(config, || {
            let width = Metres(crate::state::finite(track_width_m)?);
            Ok((&Config::for_track_width(width)).into())
        })
    }
}

/// Sets what is known of a named sensor: what it measures with, its least time from ping to ping, and the echo model, which all
/// rangers share. Its mount, its limits and its noise are unchanged.
///
/// @param config  a configuration
/// @param ranger  number of the ranger, from 0
/// @param sensor  a sonarfix_sensor_t
/// @return SONARFIX_OK; SONARFIX_ERROR_VALUE if there is no such ranger or sensor; SONARFIX_ERROR_NOT_LINKED if the library was
///   built without what it measures with; or an error of the pointer
/// Threads: one at a time for the configuration.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_config_set_sensor(
    config: *mut sonarfix_config_t,
    ranger: u32,
    sensor: i32,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        update_value(config, |config| {
            let sensor = parts::sensor(sensor)?;
            sensor.set(config.ranger_mut(ranger)?);
            config.set_echo_model(&sensor.echo);
            Ok(())
        })
    }
}

/// Sets the timing of a named servo, and its limits.
///
/// @param config  a configuration
/// @param ranger  number of the ranger on the servo, from 0
/// @param servo  a sonarfix_servo_t
/// @param right_rad  rightmost bearing, radians, counter-clockwise from the robot's heading, so negative to the right
/// @param left_rad  leftmost bearing, radians; equal to the rightmost: the ranger is fixed at that bearing
/// @return SONARFIX_OK; SONARFIX_ERROR_VALUE if there is no such ranger or servo; SONARFIX_ERROR_NOT_FINITE; or an error of the
///   pointer
/// Threads: one at a time for the configuration.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_config_set_servo(
    config: *mut sonarfix_config_t,
    ranger: u32,
    servo: i32,
    right_rad: f32,
    left_rad: f32,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        update_value(config, |config| {
            let timing = parts::servo(servo)?;
            let right = crate::state::finite(right_rad)?;
            let left = crate::state::finite(left_rad)?;
            config.ranger_mut(ranger)?.set_servo(&timing, right, left);
            Ok(())
        })
    }
}

/// Reads the localizer's part of a baked configuration: written by `sonarfix config bake`.
///
/// @param image  the image; bytes after it are ignored
/// @param length  bytes from image on
/// @param config  gets the configuration
/// @return SONARFIX_OK; SONARFIX_ERROR_IMAGE_... by what is wrong with the image; SONARFIX_ERROR_CONFIG;
///   SONARFIX_ERROR_NOT_LINKED if the library was built without a part of that robot; or an error of a pointer
/// Threads: any number at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_config_from_image(
    image: *const u8,
    length: usize,
    config: *mut sonarfix_config_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { give(config, || Ok((&baked::read(slice(image, length)?)?.localizer).into())) }
}

/// The configuration that a pointer leads to.
///
/// # Safety
/// As of [`value`].
pub(crate) unsafe fn config_of(config: *const sonarfix_config_t) -> Result<Config> {
    // SAFETY: by the caller.
    unsafe { value(config) }?.config()
}
