//! Pings and absolute measurements.

#![expect(unsafe_code, reason = "exports functions to C")]

use sonarfix::geometry::units::{Metres, Radians};
use sonarfix::sensor::absolute::AbsoluteMeasurement;

use super::sonarfix_localizer_t;
use crate::aim::{ranger_of, sonarfix_aim_t, sonarfix_standing_t};
use crate::fix::{
    heading, pose, position, sonarfix_absolute_fix_t, sonarfix_fix_t, sonarfix_pose_noise_t,
};
use crate::memory::{borrowed, change, update, value};
use crate::state::{finite, instant, sonarfix_pose_t};
use crate::status::{Result, sonarfix_status_t};
use crate::tracker::Tracker;

/// Chooses the ranger and the wall to measure next. While a search determines the pose: the next step of its sweep, with the wall
/// SONARFIX_WALL_OF_SWEEP.
///
/// @param localizer  an open localizer
/// @param aim  gets wall, ranger and bearing, radians from the robot's heading
/// @return SONARFIX_OK; SONARFIX_ERROR_NO_WALL if none can be measured from here (then call sonarfix_localizer_skip);
///   SONARFIX_ERROR_NO_SEARCH or SONARFIX_ERROR_NOT_OPEN if the search was detached or closed; or an error of a pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_aim(
    localizer: *mut sonarfix_localizer_t,
    aim: *mut sonarfix_aim_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { change(localizer, aim, Tracker::aim) }
}

/// As sonarfix_localizer_aim for one ranger whose servo stands as given: a robot with several turns all servos, and pings with the
/// ranger whose aim has the highest sonarfix_aim_score.
///
/// @param localizer  an open localizer
/// @param ranger  number of the ranger, from 0
/// @param standing  where its servo stands, radians from the heading, and when it can ping
/// @param aim  gets wall and bearing
/// @return as sonarfix_localizer_aim; SONARFIX_ERROR_NO_WALL also if the robot has no such ranger or it has failed;
///   SONARFIX_ERROR_VALUE; SONARFIX_ERROR_NOT_FINITE
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_aim_of(
    localizer: *mut sonarfix_localizer_t,
    ranger: u32,
    standing: *const sonarfix_standing_t,
    aim: *mut sonarfix_aim_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        change(localizer, aim, |tracker| {
            tracker.aim_of(ranger_of(ranger)?, &value(standing)?.standing()?)
        })
    }
}

/// Finds the wall to which a beam is square, for a range whose bearing the localizer did not choose.
///
/// @param localizer  an open localizer
/// @param ranger  number of the ranger, from 0
/// @param bearing_rad  bearing of the beam, radians, counter-clockwise from the robot's heading
/// @param aim  gets the wall
/// @return SONARFIX_OK; SONARFIX_ERROR_NO_WALL if none can be measured along it (then call sonarfix_localizer_skip_unplanned);
///   SONARFIX_ERROR_VALUE; SONARFIX_ERROR_NOT_FINITE; or an error of a pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_aim_at(
    localizer: *const sonarfix_localizer_t,
    ranger: u32,
    bearing_rad: f32,
    aim: *mut sonarfix_aim_t,
) -> sonarfix_status_t {
    let aim_at = |tracker: &Tracker| {
        let bearing = Radians(finite(bearing_rad)?);
        Ok(tracker.localizer().aim_along(ranger_of(ranger)?, bearing)?.into())
    };
    // SAFETY: the contract of the crate.
    unsafe { crate::memory::read(localizer, aim, aim_at) }
}

/// Corrects the estimate by the range that was measured along an aim. While a search determines the pose, it takes the ping.
///
/// The estimate must be that of the instant when the echo left the wall: call sonarfix_localizer_odometry up to it first. Of an
/// echo it is the middle of its flight, about now less range / 343 m/s.
///
/// @param localizer  an open localizer
/// @param aim  the aim, with the bearing that the servo has reached
/// @param range_m  the measured range, metres
/// @param fix  gets what the localizer did with it
/// @return SONARFIX_OK, also of a range that was not used; SONARFIX_ERROR_NOT_FINITE or SONARFIX_ERROR_VALUE by a wrong number, which
///   does not enter the health; or an error of a pointer or a handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_fix(
    localizer: *mut sonarfix_localizer_t,
    aim: *const sonarfix_aim_t,
    range_m: f32,
    fix: *mut sonarfix_fix_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        change(localizer, fix, |tracker| {
            let (aim, range) = (borrowed(aim)?, Metres(finite(range_m)?));
            tracker.fix(aim, Some(range))
        })
    }
}

/// Records that a ping along an aim had no echo.
///
/// @param localizer  an open localizer
/// @param aim  the aim, with the bearing that the servo has reached, radians
/// @param fix  gets what the localizer did with it: refused, or taken by a search
/// @return as sonarfix_localizer_fix
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_no_echo(
    localizer: *mut sonarfix_localizer_t,
    aim: *const sonarfix_aim_t,
    fix: *mut sonarfix_fix_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { change(localizer, fix, |tracker| tracker.fix(borrowed(aim)?, None)) }
}

/// Records that sonarfix_localizer_aim found no wall when a ping was due.
///
/// @param localizer  an open localizer
/// @return SONARFIX_OK, or an error of the pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_skip(
    localizer: *mut sonarfix_localizer_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { changed(localizer, |tracker| tracker.localizer_mut().skip()) }
}

/// Records that sonarfix_localizer_aim_at found no wall for a ping. It counts at most once per second.
///
/// @param localizer  an open localizer
/// @return SONARFIX_OK, or an error of the pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_skip_unplanned(
    localizer: *mut sonarfix_localizer_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { changed(localizer, |tracker| tracker.localizer_mut().skip_unplanned()) }
}

/// Records that a ranger could not ping, because it or its servo has failed.
///
/// @param localizer  an open localizer
/// @param ranger  number of the ranger, from 0
/// @return SONARFIX_OK; SONARFIX_ERROR_VALUE; or an error of the pointer or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_ranger_failed(
    localizer: *mut sonarfix_localizer_t,
    ranger: u32,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe {
        update(localizer, |tracker| {
            tracker.localizer_mut().ranger_failed(ranger_of(ranger)?);
            Ok(())
        })
    }
}

/// Corrects the estimate by a heading that was measured independently, as by a compass.
///
/// @param localizer  an open localizer
/// @param at_us  when it was measured, microseconds: within the latest step of the odometry
/// @param heading_rad  the heading, radians, counter-clockwise from map x
/// @param deviation_rad  standard deviation of its noise, radians
/// @param fix  gets what the localizer did with it
/// @return SONARFIX_OK, also of a heading that was not used; SONARFIX_ERROR_TIME; SONARFIX_ERROR_NOT_FINITE; or an error of a pointer
///   or the handle
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_heading(
    localizer: *mut sonarfix_localizer_t,
    at_us: u64,
    heading_rad: f32,
    deviation_rad: f32,
    fix: *mut sonarfix_absolute_fix_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { absolute(localizer, at_us, fix, || heading(heading_rad, deviation_rad)) }
}

/// Corrects the estimate by a position of the midpoint between the wheels that was measured independently, as by a beacon.
///
/// @param localizer  an open localizer
/// @param at_us  when it was measured, microseconds: within the latest step of the odometry
/// @param measured  the position in the map frame, metres; the heading is ignored
/// @param noise  covariance of its noise; of the heading it is ignored
/// @param fix  gets what the localizer did with it
/// @return as sonarfix_localizer_heading
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_position(
    localizer: *mut sonarfix_localizer_t,
    at_us: u64,
    measured: *const sonarfix_pose_t,
    noise: *const sonarfix_pose_noise_t,
    fix: *mut sonarfix_absolute_fix_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { absolute(localizer, at_us, fix, || position(value(measured)?, value(noise)?)) }
}

/// Corrects the estimate by a pose that was measured independently, as by a camera.
///
/// @param localizer  an open localizer
/// @param at_us  when it was measured, microseconds: within the latest step of the odometry
/// @param measured  the pose in the map frame, metres and radians
/// @param noise  covariance of its noise
/// @param fix  gets what the localizer did with it
/// @return as sonarfix_localizer_heading
/// Threads: one at a time for the localizer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_localizer_measured_pose(
    localizer: *mut sonarfix_localizer_t,
    at_us: u64,
    measured: *const sonarfix_pose_t,
    noise: *const sonarfix_pose_noise_t,
    fix: *mut sonarfix_absolute_fix_t,
) -> sonarfix_status_t {
    // SAFETY: the contract of the crate.
    unsafe { absolute(localizer, at_us, fix, || pose(value(measured)?, value(noise)?)) }
}

/// Changes a localizer in a way that does not fail.
///
/// # Safety
/// As of [`update`].
unsafe fn changed(
    localizer: *mut sonarfix_localizer_t,
    change: impl FnOnce(&mut Tracker),
) -> sonarfix_status_t {
    let changed = |tracker: &mut Tracker| {
        change(tracker);
        Ok(())
    };
    // SAFETY: by the caller.
    unsafe { update(localizer, changed) }
}

/// Corrects by an absolute measurement.
///
/// # Safety
/// As of [`change`].
unsafe fn absolute(
    localizer: *mut sonarfix_localizer_t,
    at_us: u64,
    fix: *mut sonarfix_absolute_fix_t,
    measured: impl FnOnce() -> Result<AbsoluteMeasurement>,
) -> sonarfix_status_t {
    let correct = |tracker: &mut Tracker| {
        let (at, measured) = (instant(at_us)?, measured()?);
        Ok(tracker.absolute(at, &measured).into())
    };
    // SAFETY: by the caller.
    unsafe { change(localizer, fix, correct) }
}
