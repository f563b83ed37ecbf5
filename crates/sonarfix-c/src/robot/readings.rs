//! What a running robot knows.

#![expect(unsafe_code, reason = "exports functions to C")]

use sonarfix::localizer::Localizer;
use sonarfix_hal::robot::Faults;

use super::held::{Core, read, sonarfix_robot_t};
use crate::state::{
    sonarfix_covariance_t, sonarfix_health_t, sonarfix_mismatch_t, sonarfix_state_t,
};
use crate::status::{Result, sonarfix_status_t};

/// Counts of faults since the robot was opened.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sonarfix_faults_t {
    /// Samples of the right encoder that failed.
    pub right_errors: u32,
    /// Illegal transitions of the right encoder.
    pub right_illegal: u32,
    /// Samples of the left encoder that failed.
    pub left_errors: u32,
    /// Illegal transitions of the left encoder.
    pub left_illegal: u32,
    /// Commands that a servo could not follow.
    pub servo: u32,
    /// Pings that a ranger could not make.
    pub ranger: u32,
    /// Travels that the localizer refused.
    pub travel: u32,
    /// Samples of the encoders that were late.
    pub deadlines: u32,
    /// Times that ran backwards or leapt.
    pub clock: u32,
    /// Samples of the gyro that failed.
    pub gyro: u32,
}

impl From<Faults> for sonarfix_faults_t {
    fn from(faults: Faults) -> Self {
        Self {
            right_errors: faults.right.errors,
            right_illegal: faults.right.illegal,
            left_errors: faults.left.errors,
            left_illegal: faults.left.illegal,
            servo: faults.servo,
            ranger: faults.ranger,
            travel: faults.travel,
            deadlines: faults.deadlines,
            clock: faults.clock,
            gyro: faults.gyro,
        }
    }
}

fn localizer(core: &Core) -> Result<&Localizer<'static>> {
    core.app.localizer().ok_or(sonarfix_status_t::SONARFIX_ERROR_NOT_RUNNING)
}

/// Reads pose and calibration of a running robot.
///
/// @param robot  an open robot
/// @param state  gets the seven states, in metres, radians and dimensionless
/// @return SONARFIX_OK; SONARFIX_ERROR_NOT_RUNNING; or an error of a pointer or the handle
/// Threads: one at a time for the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_state(
    robot: *const sonarfix_robot_t,
    state: *mut sonarfix_state_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { read(robot, state, |core| Ok(localizer(core)?.filter().state().into())) }
}

/// Reads the standard deviations of pose and calibration of a running robot.
///
/// @param robot  an open robot
/// @param deviations  gets the standard deviation of each of the seven states, in its unit
/// @return SONARFIX_OK; SONARFIX_ERROR_NOT_RUNNING; or an error of a pointer or the handle
/// Threads: one at a time for the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_deviations(
    robot: *const sonarfix_robot_t,
    deviations: *mut sonarfix_state_t,
) -> sonarfix_status_t {
    let read_deviations = |core: &Core| Ok(localizer(core)?.filter().standard_deviations().into());
    // SAFETY: the contract of the crate.
    unsafe { read(robot, deviations, read_deviations) }
}

/// Reads the covariance of the seven states of a running robot.
///
/// @param robot  an open robot
/// @param covariance  gets the upper triangle; sonarfix_covariance_t has order and units
/// @return SONARFIX_OK; SONARFIX_ERROR_NOT_RUNNING; or an error of a pointer or the handle
/// Threads: one at a time for the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_covariance(
    robot: *const sonarfix_robot_t,
    covariance: *mut sonarfix_covariance_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { read(robot, covariance, |core| Ok(sonarfix_covariance_t::of(localizer(core)?))) }
}

/// Reads the verdict of a running robot and the numbers behind it.
///
/// @param robot  an open robot
/// @param health  gets the verdict, with metres, radians and microseconds
/// @return SONARFIX_OK; SONARFIX_ERROR_NOT_RUNNING; or an error of a pointer or the handle
/// Threads: one at a time for the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_health(
    robot: *const sonarfix_robot_t,
    health: *mut sonarfix_health_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { read(robot, health, |core| Ok(localizer(core)?.health().into())) }
}

/// Reads what of the configuration of a running robot is probably wrong.
///
/// @param robot  an open robot
/// @param mismatch  gets what is wrong, or SONARFIX_MISMATCH_NONE
/// @return SONARFIX_OK; SONARFIX_ERROR_NOT_RUNNING; or an error of a pointer or the handle
/// Threads: one at a time for the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_mismatch(
    robot: *const sonarfix_robot_t,
    mismatch: *mut sonarfix_mismatch_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { read(robot, mismatch, |core| Ok(localizer(core)?.mismatch().into())) }
}

/// Reads the counts of faults, running or not.
///
/// @param robot  an open robot
/// @param faults  gets the counts since it was opened
/// @return SONARFIX_OK, or an error of a pointer or the handle
/// Threads: one at a time for the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_faults(
    robot: *const sonarfix_robot_t,
    faults: *mut sonarfix_faults_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { read(robot, faults, |core| Ok(core.app.faults().into())) }
}
