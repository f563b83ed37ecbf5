//! Commands of the program to its robot; the same come over the link.

#![expect(unsafe_code, reason = "exports functions to C")]

use sonarfix::sensor::absolute::AbsoluteMeasurement;
use sonarfix_link::message::{CommandError, CommandResult};

use super::held::{Pending, parts, sonarfix_robot_t};
use crate::fix::{heading, pose, position, sonarfix_pose_noise_t};
use crate::memory::value;
use crate::state::{instant, sonarfix_pose_t, sonarfix_start_t};
use crate::status::{Result, sonarfix_status_t, status_of};

/// The result of a command.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum sonarfix_command_result_t {
    /// No command was waiting.
    SONARFIX_COMMAND_NONE = 0,
    /// It was executed.
    SONARFIX_COMMAND_DONE = 1,
    /// Refused: the configuration breaks a rule.
    SONARFIX_COMMAND_CONFIGURATION = 2,
    /// Refused: the pose or a deviation is not finite, negative or too large.
    SONARFIX_COMMAND_POSE = 3,
    /// Refused: there is no valid map.
    SONARFIX_COMMAND_NO_MAP = 4,
    /// Refused: there is no valid configuration.
    SONARFIX_COMMAND_NO_CONFIGURATION = 5,
    /// Refused: the pose is unknown; set it first.
    SONARFIX_COMMAND_NO_POSE = 6,
    /// Refused: the drivers do not support the robot.
    SONARFIX_COMMAND_UNSUPPORTED = 7,
    /// Refused: the configuration does not let the robot search for its pose.
    SONARFIX_COMMAND_NO_SEARCH = 8,
    /// Refused for another reason.
    SONARFIX_COMMAND_REFUSED = 9,
}

use sonarfix_command_result_t::*;

impl From<CommandResult> for sonarfix_command_result_t {
    fn from(result: CommandResult) -> Self {
        let CommandResult::Refused(error) = result else { return SONARFIX_COMMAND_DONE };
        match error {
            CommandError::Configuration => SONARFIX_COMMAND_CONFIGURATION,
            CommandError::Pose => SONARFIX_COMMAND_POSE,
            CommandError::NoMap => SONARFIX_COMMAND_NO_MAP,
            CommandError::NoConfiguration => SONARFIX_COMMAND_NO_CONFIGURATION,
            CommandError::NoPose => SONARFIX_COMMAND_NO_POSE,
            CommandError::Unsupported(_) => SONARFIX_COMMAND_UNSUPPORTED,
            CommandError::NoSearch => SONARFIX_COMMAND_NO_SEARCH,
            _ => SONARFIX_COMMAND_REFUSED,
        }
    }
}

/// Lets a command wait for the next poll.
///
/// # Safety
/// As of [`parts`].
unsafe fn wait(
    robot: *mut sonarfix_robot_t,
    command: impl FnOnce() -> Result<Pending>,
) -> sonarfix_status_t {
    // SAFETY: by the caller.
    let parts = unsafe { parts(robot) };
    status_of(parts.and_then(|(_, core)| {
        let command = command()?;
        if core.pending.is_some() {
            return Err(sonarfix_status_t::SONARFIX_ERROR_OCCUPIED);
        }
        core.pending = Some(command);
        Ok(())
    }))
}

/// Sets the pose of the robot in the next poll; outputs.command has the result.
///
/// @param robot  an open robot
/// @param start  the pose in the map frame, metres and radians, with its standard deviations
/// @return SONARFIX_OK; SONARFIX_ERROR_OCCUPIED if another command waits; or an error of a pointer or the handle
/// Threads: one at a time for the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_set_pose(
    robot: *mut sonarfix_robot_t,
    start: *const sonarfix_start_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { wait(robot, || Ok(Pending::SetPose(value(start)?.into()))) }
}

/// Starts the loop in the next poll: from the pose that was set or stored, or with a search; outputs.command has the result.
///
/// @param robot  an open robot
/// @return SONARFIX_OK; SONARFIX_ERROR_OCCUPIED if another command waits; or an error of the pointer or the handle
/// Threads: one at a time for the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_start(robot: *mut sonarfix_robot_t) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { wait(robot, || Ok(Pending::Start)) }
}

/// Stops the loop in the next poll; outputs.command has the result.
///
/// @param robot  an open robot
/// @return as sonarfix_robot_start
/// Threads: one at a time for the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_stop(robot: *mut sonarfix_robot_t) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { wait(robot, || Ok(Pending::Stop)) }
}

/// Declares the pose unknown in the next poll, and begins the search; outputs.command has the result.
///
/// @param robot  an open robot whose configuration searches
/// @return as sonarfix_robot_start
/// Threads: one at a time for the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_search(robot: *mut sonarfix_robot_t) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { wait(robot, || Ok(Pending::Search)) }
}

/// Discards the learned calibration in the next poll; outputs.command has the result.
///
/// @param robot  an open robot
/// @return as sonarfix_robot_start
/// Threads: one at a time for the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_reset_calibration(
    robot: *mut sonarfix_robot_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { wait(robot, || Ok(Pending::ResetCalibration)) }
}

/// Passes a heading to the running loop, which uses it at the next sample of the encoders.
///
/// @param robot  an open robot
/// @param at_us  when it was measured, microseconds
/// @param heading_rad  the heading, radians, counter-clockwise from map x
/// @param deviation_rad  standard deviation of its noise, radians
/// @return SONARFIX_OK; SONARFIX_ERROR_NOT_RUNNING; SONARFIX_ERROR_OCCUPIED if an earlier one waits; SONARFIX_ERROR_NOT_LINKED;
///   SONARFIX_ERROR_TIME; SONARFIX_ERROR_NOT_FINITE; or an error of the pointer or the handle
/// Threads: one at a time for the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_heading(
    robot: *mut sonarfix_robot_t,
    at_us: u64,
    heading_rad: f32,
    deviation_rad: f32,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { absolute(robot, at_us, || heading(heading_rad, deviation_rad)) }
}

/// Passes a position of the midpoint between the wheels to the running loop, which uses it at the next sample of the encoders.
///
/// @param robot  an open robot
/// @param at_us  when it was measured, microseconds
/// @param measured  the position in the map frame, metres; the heading is ignored
/// @param noise  covariance of its noise; of the heading it is ignored
/// @return as sonarfix_robot_heading
/// Threads: one at a time for the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_position(
    robot: *mut sonarfix_robot_t,
    at_us: u64,
    measured: *const sonarfix_pose_t,
    noise: *const sonarfix_pose_noise_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { absolute(robot, at_us, || position(value(measured)?, value(noise)?)) }
}

/// Passes a pose that was measured independently to the running loop, which uses it at the next sample of the encoders.
///
/// @param robot  an open robot
/// @param at_us  when it was measured, microseconds
/// @param measured  the pose in the map frame, metres and radians
/// @param noise  covariance of its noise
/// @return as sonarfix_robot_heading
/// Threads: one at a time for the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_robot_measured_pose(
    robot: *mut sonarfix_robot_t,
    at_us: u64,
    measured: *const sonarfix_pose_t,
    noise: *const sonarfix_pose_noise_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { absolute(robot, at_us, || pose(value(measured)?, value(noise)?)) }
}

/// Passes an absolute measurement to the loop.
///
/// # Safety
/// As of [`parts`].
unsafe fn absolute(
    robot: *mut sonarfix_robot_t,
    at_us: u64,
    measured: impl FnOnce() -> Result<AbsoluteMeasurement>,
) -> sonarfix_status_t {
    // SAFETY: by the caller.
    let parts = unsafe { parts(robot) };
    status_of(parts.and_then(|(_, core)| {
        let (at, measured) = (instant(at_us)?, measured()?);
        core.app.absolute(at, &measured).map_err(|error| match error {
            CommandError::Waiting => sonarfix_status_t::SONARFIX_ERROR_NOT_RUNNING,
            CommandError::Occupied => sonarfix_status_t::SONARFIX_ERROR_OCCUPIED,
            _ => sonarfix_status_t::SONARFIX_ERROR_NOT_LINKED,
        })
    }))
}
