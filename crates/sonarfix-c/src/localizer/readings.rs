//! What a localizer knows.

#![expect(unsafe_code, reason = "exports functions to C")]

use super::sonarfix_localizer_t;
use crate::memory::read;
use crate::state::{
    sonarfix_covariance_t, sonarfix_gyro_status_t, sonarfix_health_t, sonarfix_mismatch_t,
    sonarfix_mode_t, sonarfix_pose_t, sonarfix_state_t,
};
use crate::status::sonarfix_status_t;

/// Reads the estimated pose.
///
/// @param localizer  an open localizer
/// @param pose  gets the pose in the map frame, metres and radians
/// @return SONARFIX_OK, or an error of a pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_pose(
    localizer: *const sonarfix_localizer_t,
    pose: *mut sonarfix_pose_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { read(localizer, pose, |tracker| Ok(tracker.localizer().pose().into())) }
}

/// Reads pose and calibration.
///
/// @param localizer  an open localizer
/// @param state  gets the seven states, in metres, radians and dimensionless
/// @return SONARFIX_OK, or an error of a pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_state(
    localizer: *const sonarfix_localizer_t,
    state: *mut sonarfix_state_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { read(localizer, state, |tracker| Ok(tracker.localizer().filter().state().into())) }
}

/// Reads the standard deviations of pose and calibration.
///
/// @param localizer  an open localizer
/// @param deviations  gets the standard deviation of each of the seven states, in its unit
/// @return SONARFIX_OK, or an error of a pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_deviations(
    localizer: *const sonarfix_localizer_t,
    deviations: *mut sonarfix_state_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        read(localizer, deviations, |tracker| {
            Ok(tracker.localizer().filter().standard_deviations().into())
        })
    }
}

/// Reads the covariance of the seven states.
///
/// @param localizer  an open localizer
/// @param covariance  gets the upper triangle; sonarfix_covariance_t has order and units
/// @return SONARFIX_OK, or an error of a pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_covariance(
    localizer: *const sonarfix_localizer_t,
    covariance: *mut sonarfix_covariance_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        read(localizer, covariance, |tracker| Ok(sonarfix_covariance_t::of(tracker.localizer())))
    }
}

/// Reads the verdict on the estimate and the numbers behind it.
///
/// @param localizer  an open localizer
/// @param health  gets the verdict, with metres, radians and microseconds
/// @return SONARFIX_OK, or an error of a pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_health(
    localizer: *const sonarfix_localizer_t,
    health: *mut sonarfix_health_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { read(localizer, health, |tracker| Ok(tracker.localizer().health().into())) }
}

/// Reads what of the configuration is probably wrong.
///
/// @param localizer  an open localizer
/// @param mismatch  gets what is wrong, or SONARFIX_MISMATCH_NONE
/// @return SONARFIX_OK, or an error of a pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_mismatch(
    localizer: *const sonarfix_localizer_t,
    mismatch: *mut sonarfix_mismatch_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { read(localizer, mismatch, |tracker| Ok(tracker.localizer().mismatch().into())) }
}

/// Reads what determines the pose: always SONARFIX_MODE_TRACKING without a search.
///
/// @param localizer  an open localizer
/// @param mode  gets the mode
/// @return SONARFIX_OK, or an error of a pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_mode(
    localizer: *const sonarfix_localizer_t,
    mode: *mut sonarfix_mode_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { read(localizer, mode, |tracker| Ok(tracker.mode().into())) }
}

/// Reads the time of the last accepted travel.
///
/// @param localizer  an open localizer
/// @param time_us  gets the time, microseconds
/// @return SONARFIX_OK, or an error of a pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_time(
    localizer: *const sonarfix_localizer_t,
    time_us: *mut u64,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { read(localizer, time_us, |tracker| Ok(tracker.localizer().time().ticks())) }
}

/// Reads whether a sample of the encoders has failed since the last accepted travel.
///
/// @param localizer  an open localizer
/// @param is_missing  gets 1 if so, otherwise 0
/// @return SONARFIX_OK, or an error of a pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_is_odometry_missing(
    localizer: *const sonarfix_localizer_t,
    is_missing: *mut u8,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        read(localizer, is_missing, |tracker| {
            Ok(u8::from(tracker.localizer().is_odometry_missing()))
        })
    }
}

/// Reads the probability that the echo of the latest ping was that of its wall.
///
/// @param localizer  an open localizer
/// @param association  gets the probability, dimensionless; zero without an echo, or if the range was refused
/// @return SONARFIX_OK, or an error of a pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_association(
    localizer: *const sonarfix_localizer_t,
    association: *mut f32,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { read(localizer, association, |tracker| Ok(tracker.localizer().association())) }
}

/// Reads the bias of the gyro, and what became of its turns.
///
/// @param localizer  an open localizer
/// @param gyro  gets the bias and its deviation, radians per second
/// @return SONARFIX_OK; SONARFIX_ERROR_NOT_LINKED if the configuration has no gyro, or the library was built without; or an error of
///   a pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_gyro(
    localizer: *const sonarfix_localizer_t,
    gyro: *mut sonarfix_gyro_status_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        read(localizer, gyro, |tracker| {
            let status = tracker.localizer().gyro().map(Into::into);
            status.ok_or(sonarfix_status_t::SONARFIX_ERROR_NOT_LINKED)
        })
    }
}
