//! The configuration of a robot: the localizer's, and what only the loop and the drivers need.

#![expect(unsafe_code, reason = "exports functions to C")]

use sonarfix::config::{Rangers, ServoTiming};
use sonarfix::geometry::units::{Duration, Metres, Radians};
use sonarfix_hal::config::{
    MotorPolicy, RangerConfig, RobotConfig, SearchMotion, SearchMotionKind, StartPose, WheelConfig,
};
use sonarfix_hal::ranger::{Celsius, PulseTiming, RangerKind};
use sonarfix_hal::servo::MeasuredPulse;
use sonarfix_link::baked;

use crate::config::{SONARFIX_RANGERS, sonarfix_config_error_t, sonarfix_config_t};
use crate::memory::{give, slice, value};
use crate::search::sonarfix_region_t;
use crate::state::micros;
use crate::status::{Result, sonarfix_status_t};

/// How a ranger is read.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum sonarfix_driver_t {
    /// By a trigger pin and an echo pin, whose edges the program stamps: an HC-SR04, an LV-MaxSonar.
    SONARFIX_DRIVER_PULSE = 0,
    /// Any other one, by the program, which starts a range when it is asked to, and reports it in metres.
    SONARFIX_DRIVER_CUSTOM = 1,
    /// SRF02 or SRF08, read by the program.
    SONARFIX_DRIVER_SRF = 2,
    /// VL53L1X, read by the program.
    SONARFIX_DRIVER_VL53L1X = 3,
    /// VL53L0X, read by the program.
    SONARFIX_DRIVER_VL53L0X = 4,
}

use sonarfix_driver_t::*;

/// How a robot moves by itself while it searches for its pose and no motion is commanded over the link.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum sonarfix_search_motion_t {
    /// It stands.
    SONARFIX_SEARCH_MOTION_NONE = 0,
    /// It turns once on the spot.
    SONARFIX_SEARCH_MOTION_SPIN = 1,
    /// It drives ahead where the sonar finds free floor, and turns where it does not. What the sonar does not detect, it hits.
    SONARFIX_SEARCH_MOTION_AHEAD = 2,
}

use sonarfix_search_motion_t::*;

/// The drivers of a ranger and of its servo.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_driver_config_t {
    /// A sonarfix_driver_t.
    pub driver: i32,
    /// SRF, VL53L1X, VL53L0X: address in seven bits.
    pub address: u32,
    /// Pulse: shortest trigger pulse, microseconds.
    pub trigger_us: u32,
    /// Pulse: echoes shorter than this are the direct burst, microseconds.
    pub blanking_us: u32,
    /// Pulse: longest reliable time of flight, microseconds.
    pub longest_us: u32,
    /// Pulse: width from which on a pulse means that there was no echo, microseconds.
    pub silence_us: u32,
    /// Pulse: time to wait for the echo after the trigger, microseconds.
    pub listen_us: u32,
    /// Pulse: time after a trigger from which on a high line counts as stuck, microseconds.
    pub stuck_us: u32,
    /// Pulse: temperature of the air, degrees Celsius, the same for all rangers; it determines the speed of sound.
    pub temperature_c: f32,
    /// Two widths of the servo's pulse, microseconds, as far apart as possible.
    pub servo_pulse_us: [u32; 2],
    /// The bearing of the ranger that was measured with each, radians.
    pub servo_bearing_rad: [f32; 2],
}

/// A wheel and its encoder.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_wheel_config_t {
    /// Travel of the wheel from one count of its encoder to the next, metres.
    pub travel_per_count_m: f32,
    /// Not zero if the encoder counts down while the robot drives ahead.
    pub is_mirrored: u8,
}

/// The configuration of a robot. Start from sonarfix_robot_config_default, and set what was measured.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_robot_config_t {
    /// The parameters of the localizer, its rangers and their servos.
    pub localizer: sonarfix_config_t,
    /// The right wheel.
    pub right_wheel: sonarfix_wheel_config_t,
    /// The left wheel.
    pub left_wheel: sonarfix_wheel_config_t,
    /// Time from one sample of the encoders to the next, microseconds.
    pub encoder_period_us: u32,
    /// The drivers of localizer.rangers, in the same order.
    pub drivers: [sonarfix_driver_config_t; SONARFIX_RANGERS],
    /// Time without a frame over the link after which it counts as lost, microseconds.
    pub link_timeout_us: u32,
    /// Not zero if a lost robot may drive.
    pub may_drive_lost: u8,
    /// Not zero if a robot without odometry may drive.
    pub may_drive_without_encoder: u8,
    /// Not zero if a robot without link may drive.
    pub may_drive_without_link: u8,
    /// Not zero if the robot searches for its pose when it starts without one, and when it is lost.
    pub searches: u8,
    /// Not zero if it starts in a part of the map.
    pub has_start_region: u8,
    /// That part.
    pub start_region: sonarfix_region_t,
    /// How the robot moves by itself while it searches: a sonarfix_search_motion_t. The program obeys the motion of the outputs.
    pub search_motion: i32,
    /// Ahead: the least range of an echo ahead, from the sonar, with which the robot drives on, metres. Half of its width, and what it
    /// needs to stop.
    pub bumper_distance_m: f32,
}

const NO_REGION: sonarfix_region_t =
    sonarfix_region_t { from_x_m: 0.0, from_y_m: 0.0, to_x_m: 0.0, to_y_m: 0.0 };

impl From<&RangerConfig> for sonarfix_driver_config_t {
    fn from(ranger: &RangerConfig) -> Self {
        let (driver, address) = match ranger.kind {
            RangerKind::Pulse(_) => (SONARFIX_DRIVER_PULSE, 0),
            RangerKind::Custom => (SONARFIX_DRIVER_CUSTOM, 0),
            RangerKind::Srf { address } => (SONARFIX_DRIVER_SRF, address),
            RangerKind::Vl53l1x { address } => (SONARFIX_DRIVER_VL53L1X, address),
            RangerKind::Vl53l0x { address } => (SONARFIX_DRIVER_VL53L0X, address),
        };
        let timing = match ranger.kind {
            RangerKind::Pulse(timing) => timing,
            _ => PulseTiming::HC_SR04,
        };
        let Celsius(temperature_c) = ranger.temperature;
        Self {
            driver: driver as i32,
            address: u32::from(address),
            trigger_us: micros(timing.trigger),
            blanking_us: micros(timing.blanking),
            longest_us: micros(timing.longest),
            silence_us: micros(timing.silence),
            listen_us: micros(timing.listen),
            stuck_us: micros(timing.stuck),
            temperature_c,
            servo_pulse_us: ranger.servo_pulses.map(|pulse| micros(pulse.width)),
            servo_bearing_rad: ranger.servo_pulses.map(|pulse| pulse.bearing.0),
        }
    }
}

fn duration(us: u32) -> Duration {
    Duration::from_ticks(u64::from(us))
}

impl sonarfix_driver_config_t {
    fn ranger(&self) -> Result<RangerConfig> {
        let unknown = sonarfix_status_t::SONARFIX_ERROR_VALUE;
        let address = u8::try_from(self.address).map_err(|_| unknown)?;
        let kind = match self.driver {
            0 => RangerKind::Pulse(self.timing()),
            1 => RangerKind::Custom,
            2 => RangerKind::Srf { address },
            3 => RangerKind::Vl53l1x { address },
            4 => RangerKind::Vl53l0x { address },
            _ => return Err(unknown),
        };
        let ([one, other], [right, left]) = (self.servo_pulse_us, self.servo_bearing_rad);
        let pulse =
            |width, bearing| MeasuredPulse { width: duration(width), bearing: Radians(bearing) };
        let servo_pulses = [pulse(one, right), pulse(other, left)];
        Ok(RangerConfig { kind, temperature: Celsius(self.temperature_c), servo_pulses })
    }

    fn timing(&self) -> PulseTiming {
        PulseTiming {
            trigger: duration(self.trigger_us),
            blanking: duration(self.blanking_us),
            longest: duration(self.longest_us),
            silence: duration(self.silence_us),
            listen: duration(self.listen_us),
            stuck: duration(self.stuck_us),
        }
    }
}

impl From<&WheelConfig> for sonarfix_wheel_config_t {
    fn from(wheel: &WheelConfig) -> Self {
        Self {
            travel_per_count_m: wheel.travel_per_edge.0,
            is_mirrored: u8::from(wheel.is_mirrored),
        }
    }
}

impl sonarfix_wheel_config_t {
    fn wheel(self) -> WheelConfig {
        let travel_per_edge = Metres(self.travel_per_count_m);
        WheelConfig { travel_per_edge, is_mirrored: self.is_mirrored != 0 }
    }
}

impl From<&RobotConfig> for sonarfix_robot_config_t {
    fn from(config: &RobotConfig) -> Self {
        let mut drivers = [sonarfix_driver_config_t::from(&config.rangers.first); SONARFIX_RANGERS];
        for (driver, (_, ranger)) in drivers.iter_mut().zip(config.rangers.iter()) {
            *driver = ranger.into();
        }
        let region = config.start.region();
        let start_region = region.as_ref().map_or(NO_REGION, sonarfix_region_t::from);
        let MotorPolicy { lost, dead_encoder, lost_link, link_timeout } = config.motors;
        let search_motion = config.start.motion();
        Self {
            localizer: (&config.localizer).into(),
            right_wheel: (&config.right_wheel).into(),
            left_wheel: (&config.left_wheel).into(),
            encoder_period_us: micros(config.encoder_period),
            drivers,
            link_timeout_us: micros(link_timeout),
            may_drive_lost: u8::from(lost),
            may_drive_without_encoder: u8::from(dead_encoder),
            may_drive_without_link: u8::from(lost_link),
            searches: u8::from(config.start.is_unknown()),
            has_start_region: u8::from(region.is_some()),
            start_region,
            search_motion: match search_motion.map(|motion| motion.kind) {
                None => SONARFIX_SEARCH_MOTION_NONE,
                Some(SearchMotionKind::Spin) => SONARFIX_SEARCH_MOTION_SPIN,
                Some(SearchMotionKind::Ahead) => SONARFIX_SEARCH_MOTION_AHEAD,
            } as i32,
            bumper_distance_m: search_motion.map_or(SearchMotion::BUMPER, |motion| motion.bumper).0,
        }
    }
}

impl sonarfix_robot_config_t {
    /// The configuration, which is not checked yet.
    pub(super) fn config(&self) -> Result<RobotConfig> {
        let mut config = RobotConfig::with_common_parts(self.localizer.config()?);
        config.right_wheel = self.right_wheel.wheel();
        config.left_wheel = self.left_wheel.wheel();
        config.encoder_period = duration(self.encoder_period_us);
        config.rangers = self.rangers()?;
        config.motors = MotorPolicy {
            lost: self.may_drive_lost != 0,
            dead_encoder: self.may_drive_without_encoder != 0,
            lost_link: self.may_drive_without_link != 0,
            link_timeout: duration(self.link_timeout_us),
        };
        config.start = self.start()?;
        Ok(config)
    }

    fn rangers(&self) -> Result<Rangers<RangerConfig>> {
        let [first, further @ ..] = &self.drivers;
        let mut rangers = Rangers::one(first.ranger()?);
        let count = usize::try_from(self.localizer.ranger_count).unwrap_or(usize::MAX);
        for driver in further.iter().take(count.saturating_sub(1)) {
            let pushed = rangers.push(driver.ranger()?);
            pushed.map_err(|_| sonarfix_status_t::SONARFIX_ERROR_NOT_LINKED)?;
        }
        Ok(rangers)
    }

    fn start(&self) -> Result<StartPose> {
        if self.searches == 0 {
            return Ok(StartPose::Known);
        }
        let region = (self.has_start_region != 0).then_some(&self.start_region);
        let region = region.map(sonarfix_region_t::region).transpose()?;
        let kind = match self.search_motion {
            0 => return Ok(StartPose::Unknown { region }),
            1 => SearchMotionKind::Spin,
            2 => SearchMotionKind::Ahead,
            _ => return Err(sonarfix_status_t::SONARFIX_ERROR_VALUE),
        };
        let motion = SearchMotion { kind, bumper: Metres(self.bumper_distance_m) };
        Ok(StartPose::Exploring { region, motion })
    }
}

/// Fills the configuration of a robot with common parts: 65 mm wheels with 1,496.6 counts a revolution, read every 100 ms, and an
/// HC-SR04 on an SG90 for which pulses of 1 ms and 2 ms are -45 and 45 degrees. A start for one's own: the parts must be measured.
///
/// @param track_width_m  distance between the contact points of the wheels, metres
/// @param config  gets the defaults, the same in all rangers
/// @return SONARFIX_OK; SONARFIX_ERROR_NOT_FINITE; or an error of the pointer
/// Threads: any number at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_config_default(
    track_width_m: f32,
    config: *mut sonarfix_robot_config_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        give(config, || {
            let width = Metres(crate::state::finite(track_width_m)?);
            let mut localizer = sonarfix::config::Config::for_track_width(width);
            localizer.rangers.first.servo = (Radians(-SERVO_LIMIT), Radians(SERVO_LIMIT));
            localizer.rangers.first.timing.servo = ServoTiming::SG90;
            localizer.rangers.first.timing.cycle =
                sonarfix_hal::ranger::RangerSettings::HC_SR04.cycle;
            localizer.echo = sonarfix::config::EchoParameters::HC_SR04;
            Ok((&RobotConfig::with_common_parts(localizer)).into())
        })
    }
}

/// Limit of the servo to either side, radians: its pulses are then between 0.5 and 2.5 ms.
const SERVO_LIMIT: f32 = 1.5;

/// Reads a baked configuration: written by `sonarfix config bake`.
///
/// @param image  the image; bytes after it are ignored
/// @param length  bytes from image on
/// @param config  gets the configuration, in metres, radians and microseconds
/// @return as sonarfix_config_from_image
/// Threads: any number at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_config_from_image(
    image: *const u8,
    length: usize,
    config: *mut sonarfix_robot_config_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { give(config, || Ok((&baked::read(slice(image, length)?)?).into())) }
}

/// Checks every field of the configuration of a robot, as sonarfix_config_check does.
///
/// @param config  the configuration
/// @param error  gets the field and its rule as texts; empty texts if every rule is met
/// @return as sonarfix_config_check
/// Threads: any number at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_config_check(
    config: *const sonarfix_robot_config_t,
    error: *mut sonarfix_config_error_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        give(error, || {
            let config = value(config)?.config()?;
            let checked = config.check().map_err(|error| (error.field, error.rule));
            Ok(sonarfix_config_error_t::of(checked))
        })
    }
}
