//! The localizer: wheel travels and ranges in, pose and the bearing of the next ping out.

#![expect(unsafe_code, reason = "exports functions to C")]

pub mod measurements;
pub mod readings;
#[cfg(feature = "search")]
pub mod searching;

use sonarfix::filter::motion::WheelTravel;
use sonarfix::geometry::units::{Duration, Radians};
use sonarfix::localizer::Localizer;
use sonarfix::sensor::gyro::MeasuredTurn;

use crate::arithmetic;
use crate::config::{config_of, sonarfix_config_t};
use crate::map::{map_of, sonarfix_map_t};
use crate::memory::{close, handle, open, update, value};
use crate::state::{finite, instant, sonarfix_start_t, sonarfix_state_t};
use crate::status::sonarfix_status_t;
use crate::tracker::Tracker;

/// 64-bit words of a localizer.
#[cfg(target_pointer_width = "64")]
pub const SONARFIX_LOCALIZER_WORDS: usize = 236;
/// 64-bit words of a localizer.
#[cfg(not(target_pointer_width = "64"))]
pub const SONARFIX_LOCALIZER_WORDS: usize = 231;

/// A localizer in memory of the caller. It must not be copied.
#[repr(C)]
#[derive(Debug)]
pub struct sonarfix_localizer_t {
    /// Only for this library.
    pub opaque: [u64; SONARFIX_LOCALIZER_WORDS],
}

handle!(sonarfix_localizer_t: Tracker, b"Sloc");

/// Opens a localizer at a known pose. The configuration is copied; the map is referred to.
///
/// @param localizer  memory for the localizer
/// @param config  the parameters of the robot
/// @param map  an open map
/// @param start  the pose, in the map frame, metres and radians, with its standard deviations; by sonarfix_start_unknown of a
///   robot that searches
/// @param now_us  the time, microseconds of any clock that does not run backwards
/// @return SONARFIX_OK; SONARFIX_ERROR_CONFIG, _VALUE or _NOT_LINKED by what is wrong with the configuration (sonarfix_config_check
///   names the field); SONARFIX_ERROR_NOT_FINITE, _NEGATIVE_VARIANCE or _VARIANCE_TOO_LARGE by what is wrong with the start;
///   SONARFIX_ERROR_TIME; SONARFIX_ERROR_ARITHMETIC; or an error of a pointer or a handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_init(
    localizer: *mut sonarfix_localizer_t,
    config: *const sonarfix_config_t,
    map: *const sonarfix_map_t,
    start: *const sonarfix_start_t,
    now_us: u64,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        open(localizer, || {
            let (config, map, start) = (config_of(config)?, map_of(map)?, value(start)?);
            arithmetic::check()?;
            let localizer = Localizer::new(config, map, start.into(), instant(now_us)?)?;
            Ok(Tracker::new(localizer))
        })
    }
}

/// Opens a localizer that continues from the state of an earlier one, calibration included.
///
/// @param localizer  memory for the localizer
/// @param config  the parameters of the robot; of its prior only prior_scale_difference is used
/// @param map  an open map
/// @param state  the state, as sonarfix_localizer_state returned it
/// @param deviations  the standard deviations of the state as they are now, in the units of the state
/// @param now_us  the time, microseconds
/// @return as sonarfix_localizer_init
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_resume(
    localizer: *mut sonarfix_localizer_t,
    config: *const sonarfix_config_t,
    map: *const sonarfix_map_t,
    state: *const sonarfix_state_t,
    deviations: *const sonarfix_state_t,
    now_us: u64,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        open(localizer, || {
            let (config, map) = (config_of(config)?, map_of(map)?);
            let (state, deviations) = (value(state)?.into(), value(deviations)?.into());
            let now = instant(now_us)?;
            arithmetic::check()?;
            let localizer = Localizer::resume(config, map, state, deviations, now)?;
            Ok(Tracker::new(localizer))
        })
    }
}

/// Closes a localizer. Every later call with it is SONARFIX_ERROR_NOT_OPEN, until it is opened again.
///
/// @param localizer  an open localizer
/// @return SONARFIX_OK, or an error of the pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_close(
    localizer: *mut sonarfix_localizer_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { close(localizer) }
}

/// Predicts the estimate over the travel of both wheels since the last call. To be called at every sample of the encoders, and
/// at the instant when an echo left the wall.
///
/// @param localizer  an open localizer
/// @param now_us  the time up to which the wheels travelled, microseconds, not before that of the last call
/// @param right_m  travel of the right wheel by its encoder, metres, negative backwards
/// @param left_m  travel of the left wheel, metres
/// @return SONARFIX_OK; SONARFIX_ERROR_TIME_RAN_BACKWARDS, _NO_TIME_PASSED, _TOO_FAST, _NOT_FINITE, _TURN_TOO_LARGE, _INDEFINITE
///   or _VARIANCE_TOO_LARGE: the travel is not part of the estimate; SONARFIX_ERROR_TIME; or an error of the pointer or a handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_odometry(
    localizer: *mut sonarfix_localizer_t,
    now_us: u64,
    right_m: f32,
    left_m: f32,
) -> sonarfix_status_t {
    let travel = WheelTravel::new(right_m, left_m);
    // SAFETY: the contract of the crate.
    unsafe { update(localizer, |tracker| tracker.odometry(instant(now_us)?, travel, None)) }
}

/// As sonarfix_localizer_odometry, with the turn that a gyro has measured over the same time. Without a gyro in the configuration
/// the turn is ignored. What became of it: sonarfix_localizer_gyro.
///
/// @param localizer  an open localizer
/// @param now_us  the time up to which the wheels travelled, microseconds
/// @param right_m  travel of the right wheel, metres, negative backwards
/// @param left_m  travel of the left wheel, metres
/// @param turn_rad  integral of the yaw rate, bias included, radians, counter-clockwise; whole turns count
/// @param turn_us  the time that the integral covers, microseconds
/// @return as sonarfix_localizer_odometry; SONARFIX_ERROR_NOT_FINITE for the turn, too
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_odometry_with_turn(
    localizer: *mut sonarfix_localizer_t,
    now_us: u64,
    right_m: f32,
    left_m: f32,
    turn_rad: f32,
    turn_us: u32,
) -> sonarfix_status_t {
    let travel = WheelTravel::new(right_m, left_m);
    let duration = Duration::from_ticks(u64::from(turn_us));
    // SAFETY: the contract of the crate.
    unsafe {
        update(localizer, |tracker| {
            let turn = MeasuredTurn { angle: Radians(finite(turn_rad)?), duration };
            tracker.odometry(instant(now_us)?, travel, Some(turn))
        })
    }
}

/// Records that the wheels could not be observed. To be called whenever a sample of the encoders is due and fails: the deviations
/// of the pose grow, and the next travel may be the whole one.
///
/// @param localizer  an open localizer
/// @param now_us  the time, microseconds
/// @return SONARFIX_OK; SONARFIX_ERROR_TIME; or an error of the pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_odometry_missing(
    localizer: *mut sonarfix_localizer_t,
    now_us: u64,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        update(localizer, |tracker| {
            tracker.localizer_mut().odometry_missing(instant(now_us)?);
            Ok(())
        })
    }
}

/// Replaces the pose by one that was measured independently. The calibration is unchanged; the mode is Tracking.
///
/// @param localizer  an open localizer
/// @param start  the pose in the map frame, metres and radians, with its standard deviations
/// @return SONARFIX_OK; SONARFIX_ERROR_NOT_FINITE, _NEGATIVE_VARIANCE or _VARIANCE_TOO_LARGE; or an error of a pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_set_pose(
    localizer: *mut sonarfix_localizer_t,
    start: *const sonarfix_start_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { update(localizer, |tracker| Ok(tracker.set_pose(&value(start)?.into())?)) }
}

/// Continues at another time after the clock was set back. The next travel is that since the last accepted one; measurements
/// from before are refused.
///
/// @param localizer  an open localizer
/// @param now_us  the new time, microseconds
/// @return SONARFIX_OK; SONARFIX_ERROR_TIME; or an error of the pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_set_clock(
    localizer: *mut sonarfix_localizer_t,
    now_us: u64,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        update(localizer, |tracker| {
            tracker.localizer_mut().set_clock(instant(now_us)?);
            Ok(())
        })
    }
}
