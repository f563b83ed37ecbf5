/* Sonarfix: localization of a small wheeled robot with two wheel encoders and a rotating sonar in a map of walls.
 *
 * Generated from crates/sonarfix-c by `cargo xtask c --write`. Not to be edited. Guide: docs/c.md.
 *
 * Units: metres, radians, seconds; times are microseconds in 64 bits, of any clock that does not run backwards.
 * Frames: map frame with x, y and headings counter-clockwise from x; robot frame with x ahead, y to the left, origin midway
 * between the wheels; bearings counter-clockwise from the robot's heading.
 *
 * Every function returns a status. After an error nothing has changed, and no result was written. NULL, a wrong alignment, NaN,
 * an unknown number of an enumeration and a handle that was not initialised, was closed or was copied are errors.
 *
 * Memory belongs to the caller. The library has no global variable, allocates nothing, calls nothing back and never waits. What a
 * handle was initialised with by reference (walls, images, a search, a store) stays where it is until the handle is closed.
 *
 * Threads: one handle is used by one thread at a time. Different handles are independent, unless one was given to the other.
 */

#ifndef SONARFIX_H
#define SONARFIX_H



#include <stddef.h>
#include <stdint.h>
#if !defined(UINTPTR_MAX) || UINTPTR_MAX < 0xFFFFFFFFu
#error "Sonarfix needs a processor with 32 or 64 bits: it takes more memory than a smaller one has."
#endif
#if UINTPTR_MAX > 0xFFFFFFFFu
#define SONARFIX_64_BIT
#endif

/*
 The wall of an aim that is a step of the sweep of a search.
 */
#define SONARFIX_WALL_OF_SWEEP UINT32_MAX

/*
 The largest number of rangers of a robot.
 */
#define SONARFIX_RANGERS 3

/*
 Bytes of the name of a field.
 */
#define SONARFIX_FIELD_LENGTH 48

/*
 Bytes of a rule.
 */
#define SONARFIX_RULE_LENGTH 96

#if defined(SONARFIX_64_BIT)
/*
 64-bit words of a localizer.
 */
#define SONARFIX_LOCALIZER_WORDS 236
#endif

#if !defined(SONARFIX_64_BIT)
/*
 64-bit words of a localizer.
 */
#define SONARFIX_LOCALIZER_WORDS 231
#endif

/*
 Size of a wall in memory, bytes.
 */
#define SONARFIX_WALL_SIZE 24

#if defined(SONARFIX_64_BIT)
/*
 64-bit words of a map.
 */
#define SONARFIX_MAP_WORDS 14
#endif

#if !defined(SONARFIX_64_BIT)
/*
 64-bit words of a map.
 */
#define SONARFIX_MAP_WORDS 8
#endif

/*
 Bytes of the store of a robot.
 */
#define SONARFIX_STORE_SIZE 4096

#if defined(SONARFIX_64_BIT)
/*
 64-bit words of a robot.
 */
#define SONARFIX_ROBOT_WORDS 1423
#endif

#if !defined(SONARFIX_64_BIT)
/*
 64-bit words of a robot.
 */
#define SONARFIX_ROBOT_WORDS 1386
#endif

#if defined(SONARFIX_64_BIT)
/*
 64-bit words of a search.
 */
#define SONARFIX_SEARCH_WORDS 515
#endif

#if !defined(SONARFIX_64_BIT)
/*
 64-bit words of a search.
 */
#define SONARFIX_SEARCH_WORDS 507
#endif

/*
 The latest time that a function takes, microseconds: 2^62, 146,000 years.
 */
#define SONARFIX_TIME_MAX_US 4611686018427387904

/*
 Entries of the upper triangle of the covariance.
 */
#define SONARFIX_COVARIANCE_ENTRIES 28

/*
 The result of a call. After an error nothing has changed, and no result was written.
 */
enum sonarfix_status_t
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   The call was executed.
   */
  SONARFIX_OK = 0,
  /*
   A pointer is NULL.
   */
  SONARFIX_ERROR_NULL = 1,
  /*
   A pointer is not aligned for its type.
   */
  SONARFIX_ERROR_MISALIGNED = 2,
  /*
   The handle was never initialised, was closed, or is a copy of another one.
   */
  SONARFIX_ERROR_NOT_OPEN = 3,
  /*
   A number is NaN or infinite.
   */
  SONARFIX_ERROR_NOT_FINITE = 4,
  /*
   A time is later than SONARFIX_TIME_MAX_US.
   */
  SONARFIX_ERROR_TIME = 5,
  /*
   An argument is no value of its enumeration, or a count is too large.
   */
  SONARFIX_ERROR_VALUE = 6,
  /*
   An array is longer than the address space.
   */
  SONARFIX_ERROR_LENGTH = 7,
  /*
   The library was built without the part that this needs.
   */
  SONARFIX_ERROR_NOT_LINKED = 8,
  /*
   The configuration breaks a rule: sonarfix_config_check names the field.
   */
  SONARFIX_ERROR_CONFIG = 9,
  /*
   A wall is shorter than 0.1 mm.
   */
  SONARFIX_ERROR_WALL_TOO_SHORT = 10,
  /*
   The program computes other bits than this library: compile with -ffp-contract=off and without -ffast-math, and link the
   floating point of the compiler.
   */
  SONARFIX_ERROR_ARITHMETIC = 11,
  /*
   The bytes are no baked map.
   */
  SONARFIX_ERROR_MAP_MISSING = 20,
  /*
   The baked map has a format that this library does not read: bake it again.
   */
  SONARFIX_ERROR_MAP_VERSION = 21,
  /*
   The baked map is damaged or cut off.
   */
  SONARFIX_ERROR_MAP_CHECKSUM = 22,
  /*
   The length of the baked map is not that of its header.
   */
  SONARFIX_ERROR_MAP_LENGTH = 23,
  /*
   The header of the baked map describes no valid grid.
   */
  SONARFIX_ERROR_MAP_GRID = 24,
  /*
   A wall of the baked map is degenerate or outside its grid.
   */
  SONARFIX_ERROR_MAP_WALL = 25,
  /*
   The index of the baked map does not belong to its walls.
   */
  SONARFIX_ERROR_MAP_INDEX = 26,
  /*
   The bytes are no baked configuration.
   */
  SONARFIX_ERROR_IMAGE_MISSING = 30,
  /*
   The baked configuration has a version that this library does not read: bake it again.
   */
  SONARFIX_ERROR_IMAGE_VERSION = 31,
  /*
   The baked configuration is cut off.
   */
  SONARFIX_ERROR_IMAGE_CUT = 32,
  /*
   The baked configuration is damaged.
   */
  SONARFIX_ERROR_IMAGE_CHECKSUM = 33,
  /*
   The baked configuration is intact, but its bytes are not those of one.
   */
  SONARFIX_ERROR_IMAGE_LAYOUT = 34,
  /*
   The time of the odometry is before that of an earlier call.
   */
  SONARFIX_ERROR_TIME_RAN_BACKWARDS = 40,
  /*
   A wheel moved although no time has passed.
   */
  SONARFIX_ERROR_NO_TIME_PASSED = 41,
  /*
   A wheel moved faster than the configured maximum speed.
   */
  SONARFIX_ERROR_TOO_FAST = 42,
  /*
   A variance or a standard deviation is negative.
   */
  SONARFIX_ERROR_NEGATIVE_VARIANCE = 50,
  /*
   A variance would become negative.
   */
  SONARFIX_ERROR_INDEFINITE = 51,
  /*
   The noise variance of a range is zero.
   */
  SONARFIX_ERROR_ZERO_NOISE = 52,
  /*
   The turn of one step is larger than 64 rad.
   */
  SONARFIX_ERROR_TURN_TOO_LARGE = 53,
  /*
   The innovation is larger than 1,000 km.
   */
  SONARFIX_ERROR_INNOVATION_TOO_LARGE = 54,
  /*
   The noise variance of a range is larger than 1 km^2.
   */
  SONARFIX_ERROR_NOISE_TOO_LARGE = 55,
  /*
   The derivatives of a range are NaN or larger than 1,000.
   */
  SONARFIX_ERROR_JACOBIAN_TOO_LARGE = 56,
  /*
   A variance would exceed (1,000 km)^2.
   */
  SONARFIX_ERROR_VARIANCE_TOO_LARGE = 57,
  /*
   No wall can be measured from here: call sonarfix_localizer_skip.
   */
  SONARFIX_ERROR_NO_WALL = 60,
  /*
   No search is attached to the localizer.
   */
  SONARFIX_ERROR_NO_SEARCH = 61,
  /*
   The search has no such hypothesis.
   */
  SONARFIX_ERROR_NO_HYPOTHESIS = 62,
  /*
   The robot's loop does not run: start it first.
   */
  SONARFIX_ERROR_NOT_RUNNING = 70,
  /*
   An earlier command, or an earlier measurement of this kind, waits for its poll.
   */
  SONARFIX_ERROR_OCCUPIED = 71,
  /*
   The drivers do not support the robot: a servo, or an encoder that is too fast for its period.
   */
  SONARFIX_ERROR_UNSUPPORTED = 72,
  /*
   Another error, of a newer core.
   */
  SONARFIX_ERROR_OTHER = 99,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum sonarfix_status_t sonarfix_status_t;
#else
typedef int32_t sonarfix_status_t;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 What the localizer did with a measurement.
 */
enum sonarfix_outcome_t
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   It agrees: state and covariance are corrected.
   */
  SONARFIX_OUTCOME_ACCEPTED = 0,
  /*
   It may be clutter: state and covariance are corrected with less weight.
   */
  SONARFIX_OUTCOME_DOWNWEIGHTED = 1,
  /*
   It is clutter or an outlier: not used. The covariance of a lost robot may be inflated.
   */
  SONARFIX_OUTCOME_GATED = 2,
  /*
   It cannot be compared with the estimate, for the reason of sonarfix_refusal_t: the filter is unchanged.
   */
  SONARFIX_OUTCOME_REFUSED = 3,
  /*
   The pose is unknown: the search took the ping.
   */
  SONARFIX_OUTCOME_SEARCHED = 4,
  /*
   The pose is unknown: the search took the ping, which is like an earlier one and tells nothing new.
   */
  SONARFIX_OUTCOME_NOT_NOVEL = 5,
  /*
   Another outcome, of a newer core.
   */
  SONARFIX_OUTCOME_OTHER = 6,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum sonarfix_outcome_t sonarfix_outcome_t;
#else
typedef int32_t sonarfix_outcome_t;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 Reason for which a measurement is not compared with the estimate.
 */
enum sonarfix_refusal_t
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   It was not refused.
   */
  SONARFIX_REFUSAL_NONE = 0,
  /*
   A number is NaN or infinite.
   */
  SONARFIX_REFUSAL_NOT_FINITE = 1,
  /*
   There was no echo.
   */
  SONARFIX_REFUSAL_NO_ECHO = 2,
  /*
   The range, or the expected one, is outside the limits of the ranger.
   */
  SONARFIX_REFUSAL_OUT_OF_RANGE = 3,
  /*
   The foot of the perpendicular may be off the wall.
   */
  SONARFIX_REFUSAL_FOOT_OFF_WALL = 4,
  /*
   The beam is not square to the wall, or the heading is too uncertain to decide.
   */
  SONARFIX_REFUSAL_NOT_SQUARE = 5,
  /*
   The map has no such wall.
   */
  SONARFIX_REFUSAL_UNKNOWN_WALL = 6,
  /*
   The filter refused the correction: filter_error.
   */
  SONARFIX_REFUSAL_FILTER = 7,
  /*
   The robot has no such ranger.
   */
  SONARFIX_REFUSAL_UNKNOWN_RANGER = 8,
  /*
   The covariance of the noise is not positive definite, or a deviation is not positive.
   */
  SONARFIX_REFUSAL_NOT_POSITIVE_DEFINITE = 9,
  /*
   It was measured before the latest step of the odometry.
   */
  SONARFIX_REFUSAL_BEFORE_LAST_STEP = 10,
  /*
   It was measured after the latest step of the odometry: pass the wheel travel first.
   */
  SONARFIX_REFUSAL_AFTER_LAST_STEP = 11,
  /*
   The pose is unknown: set it, or wait for the search.
   */
  SONARFIX_REFUSAL_NO_POSE = 12,
  /*
   The library was built without the part that this needs.
   */
  SONARFIX_REFUSAL_NOT_LINKED = 13,
  /*
   Another reason, of a newer core.
   */
  SONARFIX_REFUSAL_OTHER = 14,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum sonarfix_refusal_t sonarfix_refusal_t;
#else
typedef int32_t sonarfix_refusal_t;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 Verdict on the estimate.
 */
enum sonarfix_verdict_t
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   Ranges arrive and agree with the map.
   */
  SONARFIX_VERDICT_TRACKING = 0,
  /*
   Ranges are missing or begin to disagree: the estimate depends on the encoders.
   */
  SONARFIX_VERDICT_DEGRADED = 1,
  /*
   Ranges keep disagreeing, too few agree with an uncertain pose, or the path has led through a wall: the pose is probably wrong.
   */
  SONARFIX_VERDICT_LOST = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum sonarfix_verdict_t sonarfix_verdict_t;
#else
typedef int32_t sonarfix_verdict_t;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 What of the robot's configuration is probably wrong.
 */
enum sonarfix_mismatch_t
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   Nothing, as far as the ranges tell by now.
   */
  SONARFIX_MISMATCH_NONE = 0,
  /*
   The noise of wheels or ranges is larger than it says.
   */
  SONARFIX_MISMATCH_NOISE_TOO_SMALL = 1,
  /*
   Diameters of the wheels or track width are farther from it than its deviations permit.
   */
  SONARFIX_MISMATCH_WHEELS_OUTSIDE_PRIOR = 2,
  /*
   The same of the place of the first ranger in the robot.
   */
  SONARFIX_MISMATCH_MOUNT_SUSPECT = 3,
  /*
   Another one, of a newer core.
   */
  SONARFIX_MISMATCH_OTHER = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum sonarfix_mismatch_t sonarfix_mismatch_t;
#else
typedef int32_t sonarfix_mismatch_t;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 What determines the pose.
 */
enum sonarfix_mode_t
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   The localizer tracks it.
   */
  SONARFIX_MODE_TRACKING = 0,
  /*
   It is unknown, and a search for it is running.
   */
  SONARFIX_MODE_SEARCHING = 1,
  /*
   The localizer tracks a pose that a search has found, which is not confirmed yet.
   */
  SONARFIX_MODE_PROVISIONAL = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum sonarfix_mode_t sonarfix_mode_t;
#else
typedef int32_t sonarfix_mode_t;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 What became of the latest turn of the gyro.
 */
enum sonarfix_turn_use_t
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   There was none: the wheels alone are used.
   */
  SONARFIX_TURN_MISSING = 0,
  /*
   The wheels stand; it is collected.
   */
  SONARFIX_TURN_STANDING = 1,
  /*
   It was combined with the turn of the wheels.
   */
  SONARFIX_TURN_COMBINED = 2,
  /*
   A wheel slips: the turn is the gyro's.
   */
  SONARFIX_TURN_WHEEL_SLIP = 3,
  /*
   It was refused: not finite.
   */
  SONARFIX_TURN_NOT_FINITE = 4,
  /*
   It was refused: it does not cover the time of the step.
   */
  SONARFIX_TURN_WRONG_DURATION = 5,
  /*
   It was refused: faster than the range of the gyro.
   */
  SONARFIX_TURN_TOO_FAST = 6,
  /*
   Another use, of a newer core.
   */
  SONARFIX_TURN_OTHER = 7,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum sonarfix_turn_use_t sonarfix_turn_use_t;
#else
typedef int32_t sonarfix_turn_use_t;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 The result of a command.
 */
enum sonarfix_command_result_t
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   No command was waiting.
   */
  SONARFIX_COMMAND_NONE = 0,
  /*
   It was executed.
   */
  SONARFIX_COMMAND_DONE = 1,
  /*
   Refused: the configuration breaks a rule.
   */
  SONARFIX_COMMAND_CONFIGURATION = 2,
  /*
   Refused: the pose or a deviation is not finite, negative or too large.
   */
  SONARFIX_COMMAND_POSE = 3,
  /*
   Refused: there is no valid map.
   */
  SONARFIX_COMMAND_NO_MAP = 4,
  /*
   Refused: there is no valid configuration.
   */
  SONARFIX_COMMAND_NO_CONFIGURATION = 5,
  /*
   Refused: the pose is unknown; set it first.
   */
  SONARFIX_COMMAND_NO_POSE = 6,
  /*
   Refused: the drivers do not support the robot.
   */
  SONARFIX_COMMAND_UNSUPPORTED = 7,
  /*
   Refused: the configuration does not let the robot search for its pose.
   */
  SONARFIX_COMMAND_NO_SEARCH = 8,
  /*
   Refused for another reason.
   */
  SONARFIX_COMMAND_REFUSED = 9,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum sonarfix_command_result_t sonarfix_command_result_t;
#else
typedef int32_t sonarfix_command_result_t;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 What a search has found.
 */
enum sonarfix_answer_kind_t
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   Nothing yet: no cycle is complete, or there are too few pings.
   */
  SONARFIX_ANSWER_SEARCHING = 0,
  /*
   Several poses fit.
   */
  SONARFIX_ANSWER_SEVERAL = 1,
  /*
   The position along a wall is undetermined.
   */
  SONARFIX_ANSWER_ALONG = 2,
  /*
   No pose of the map fits.
   */
  SONARFIX_ANSWER_NOWHERE = 3,
  /*
   One pose fits, and no other.
   */
  SONARFIX_ANSWER_UNIQUE = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum sonarfix_answer_kind_t sonarfix_answer_kind_t;
#else
typedef int32_t sonarfix_answer_kind_t;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 How a ranger is read.
 */
enum sonarfix_driver_t
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   By a trigger pin and an echo pin, whose edges the program stamps: an HC-SR04, an LV-MaxSonar.
   */
  SONARFIX_DRIVER_PULSE = 0,
  /*
   Any other one, by the program, which starts a range when it is asked to, and reports it in metres.
   */
  SONARFIX_DRIVER_CUSTOM = 1,
  /*
   SRF02 or SRF08, read by the program.
   */
  SONARFIX_DRIVER_SRF = 2,
  /*
   VL53L1X, read by the program.
   */
  SONARFIX_DRIVER_VL53L1X = 3,
  /*
   VL53L0X, read by the program.
   */
  SONARFIX_DRIVER_VL53L0X = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum sonarfix_driver_t sonarfix_driver_t;
#else
typedef int32_t sonarfix_driver_t;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 How a robot moves by itself while it searches for its pose and no motion is commanded over the link.
 */
enum sonarfix_search_motion_t
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   It stands.
   */
  SONARFIX_SEARCH_MOTION_NONE = 0,
  /*
   It turns once on the spot.
   */
  SONARFIX_SEARCH_MOTION_SPIN = 1,
  /*
   It drives ahead where the sonar finds free floor, and turns where it does not. What the sonar does not detect, it hits.
   */
  SONARFIX_SEARCH_MOTION_AHEAD = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum sonarfix_search_motion_t sonarfix_search_motion_t;
#else
typedef int32_t sonarfix_search_motion_t;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 How the wall is chosen among those that can be measured.
 */
enum sonarfix_policy_t
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   The nearest.
   */
  SONARFIX_POLICY_NEAREST = 0,
  /*
   The one with the largest expected decrease of the variance per time.
   */
  SONARFIX_POLICY_INFORMATIVE = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum sonarfix_policy_t sonarfix_policy_t;
#else
typedef int32_t sonarfix_policy_t;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 What a ranger measures with.
 */
enum sonarfix_ranging_t
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   Sound: the first echo comes from the foot of the perpendicular on a wall.
   */
  SONARFIX_RANGING_SOUND = 0,
  /*
   Light: the range is along the beam, to the wall that it meets first.
   */
  SONARFIX_RANGING_LIGHT = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum sonarfix_ranging_t sonarfix_ranging_t;
#else
typedef int32_t sonarfix_ranging_t;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 What the program has read from a ranger that it reads itself.
 */
enum sonarfix_reading_t
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   Nothing since the last poll.
   */
  SONARFIX_READING_NONE = 0,
  /*
   A range.
   */
  SONARFIX_READING_RANGE = 1,
  /*
   No echo, or too little light.
   */
  SONARFIX_READING_NO_ECHO = 2,
  /*
   The ranger has failed.
   */
  SONARFIX_READING_FAILED = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum sonarfix_reading_t sonarfix_reading_t;
#else
typedef int32_t sonarfix_reading_t;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 A sensor with a name.
 */
enum sonarfix_sensor_t
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   A sonar that always hears its wall and nothing else.
   */
  SONARFIX_SENSOR_IDEAL = 0,
  /*
   HC-SR04, and compatible ones, in a furnished room.
   */
  SONARFIX_SENSOR_HC_SR04 = 1,
  /*
   VL53L1X in a furnished room.
   */
  SONARFIX_SENSOR_VL53L1X = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum sonarfix_sensor_t sonarfix_sensor_t;
#else
typedef int32_t sonarfix_sensor_t;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 A servo with a name.
 */
enum sonarfix_servo_t
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /*
   Turns at once.
   */
  SONARFIX_SERVO_INSTANT = 0,
  /*
   SG90.
   */
  SONARFIX_SERVO_SG90 = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum sonarfix_servo_t sonarfix_servo_t;
#else
typedef int32_t sonarfix_servo_t;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/*
 One ping of one ranger: at a wall, or of the sweep of a search.
 */
typedef struct {
  /*
   Number of the wall in the map; SONARFIX_WALL_OF_SWEEP while a search determines the pose.
   */
  uint32_t wall;
  /*
   Number of the ranger, from 0.
   */
  uint32_t ranger;
  /*
   Bearing of the servo, radians, counter-clockwise from the robot's heading.
   */
  float bearing_rad;
  /*
   The range expected now, metres; zero in a sweep.
   */
  float range_m;
  /*
   Expected decrease of the variance of the position and of the other weighted states, square metres.
   */
  float gain_m2;
  /*
   Probability that the wall returns its range.
   */
  float success;
  /*
   Duration of the ping, microseconds: servo, ranger and flight of sound.
   */
  uint32_t duration_us;
  /*
   Number of walls that can be measured.
   */
  uint32_t candidates;
} sonarfix_aim_t;

/*
 A gyro that measures the yaw rate.
 */
typedef struct {
  /*
   Largest rate that it can measure, radians per second.
   */
  float range_rad_per_s;
  /*
   White noise of the rate: standard deviation of the angle after one second, radians.
   */
  float noise_rad;
  /*
   Standard deviation of the bias at the start, radians per second.
   */
  float bias_rad_per_s;
  /*
   Random walk of the bias: standard deviation after one second, radians per second.
   */
  float bias_walk_rad_per_s;
  /*
   Standard deviation of the scale error.
   */
  float scale;
  /*
   Time from sample to sample, microseconds.
   */
  uint32_t period_us;
  /*
   Not zero if the robot has a gyro. The other fields are then those of an MPU-6050 by default.
   */
  uint32_t is_fitted;
  /*
   Not zero if it is mounted upside down.
   */
  uint32_t is_inverted;
} sonarfix_gyro_config_t;

/*
 A ranger on its servo, or at a fixed bearing.
 */
typedef struct {
  /*
   Position of the axis of the servo ahead of the midpoint between the wheels, metres.
   */
  float mount_x_m;
  /*
   Position of that axis to the left, metres.
   */
  float mount_y_m;
  /*
   Rightmost bearing of the servo, radians, counter-clockwise from the robot's heading; -pi without limits.
   */
  float servo_right_rad;
  /*
   Leftmost bearing, radians; pi without limits. Equal to the rightmost: the ranger is fixed there.
   */
  float servo_left_rad;
  /*
   Largest angle between beam and perpendicular at which a wall is measured, radians: half of a sonar's cone.
   */
  float cone_rad;
  /*
   Shortest range that it reports, metres.
   */
  float min_range_m;
  /*
   Longest range that it reports, metres.
   */
  float max_range_m;
  /*
   Standard deviation of a range of zero, metres.
   */
  float noise_floor_m;
  /*
   Standard deviation per metre of range, besides.
   */
  float noise_per_metre;
  /*
   Time from ping to ping, microseconds; zero: as fast as servo and ranger allow. All rangers have the same.
   */
  uint32_t ping_period_us;
  /*
   Least time between two pings, microseconds, so that echoes of the first have decayed.
   */
  uint32_t ping_cycle_us;
  /*
   Period of the pulses of the servo, microseconds.
   */
  uint32_t servo_frame_us;
  /*
   Time of a turn of 60 degrees, microseconds.
   */
  uint32_t servo_sixty_degrees_us;
  /*
   Time from arrival until the servo has settled, microseconds.
   */
  uint32_t servo_settle_us;
  /*
   A sonarfix_ranging_t.
   */
  int32_t ranging;
  /*
   Light: half of the angle of the spot, radians.
   */
  float spot_rad;
  /*
   Light: standard deviation of the direction of the beam, radians.
   */
  float pointing_rad;
} sonarfix_ranger_config_t;

/*
 The parameters of a localizer. Start from sonarfix_config_default, and set what is known of the robot.
 */
typedef struct {
  /*
   Distance between the contact points of the wheels, metres.
   */
  float track_width_m;
  /*
   White noise of the travel of each wheel: standard deviation after one metre, metres. Good robots on a hard floor: 0.001;
   recordings show 0.0005 to 0.02.
   */
  float wheel_noise_m;
  /*
   Random walk of the scale error of each wheel: standard deviation after one metre.
   */
  float scale_walk;
  /*
   Random walk of the track width: standard deviation after one metre, metres.
   */
  float track_width_walk_m;
  /*
   Fastest speed of a wheel, metres per second; a faster travel is a fault of an encoder.
   */
  float max_wheel_speed_m_per_s;
  /*
   Standard deviation of the scale error of the right wheel before the first range.
   */
  float prior_scale_right;
  /*
   That of the left wheel. Either both are zero or none.
   */
  float prior_scale_left;
  /*
   That of the difference of both, for wheels that are alike; zero: the errors are independent.
   */
  float prior_scale_difference;
  /*
   That of the track width, metres.
   */
  float prior_track_width_m;
  /*
   That of the scale of the ranger; zero: it is exact and not estimated.
   */
  float prior_range_scale;
  /*
   That of each coordinate of the mount of a ranger, metres; zero: it is exact and not estimated, the only value of a library
   without it.
   */
  float prior_mount_m;
  /*
   A wall is measured only if no other can answer first, even if the pose is wrong by this many standard deviations.
   */
  float gating_confidence;
  /*
   Standard deviation that is added to the position of a lost robot by a ping that contradicts it, metres; zero: none.
   */
  float gating_inflation_m;
  /*
   Distance without a range used above which the verdict is not Tracking, metres.
   */
  float gating_max_distance_without_fix_m;
  /*
   Standard deviation of the position above which the verdict is not Tracking, metres.
   */
  float gating_max_position_deviation_m;
  /*
   Probability that a wall within range, square to the beam, returns no echo.
   */
  float echo_missed;
  /*
   Probability of a spurious range that is shorter than that of the wall.
   */
  float echo_short;
  /*
   Probability of a spurious range that is longer.
   */
  float echo_long;
  /*
   Range at which every second beam meets an object that is not in the map, metres; zero: there are none.
   */
  float echo_free_path_m;
  /*
   Standard deviation of the place of a wall in the map, metres.
   */
  float echo_map_accuracy_m;
  /*
   Mean by which an echo on the normal of a wall is reported too far, metres.
   */
  float echo_late_m;
  /*
   By how much more per radian off the normal, metres.
   */
  float echo_late_m_per_rad;
  /*
   Angle off the normal at which a wall answers half as often as on it, radians; zero: the cone of the ranger.
   */
  float echo_half_angle_rad;
  /*
   Standard deviation of that angle from ping to ping, radians.
   */
  float echo_rim_rad;
  /*
   Range up to which hardly any echo is missed or spurious, metres; zero: echo_missed, echo_short and echo_long hold at every range.
   */
  float echo_sure_within_m;
  /*
   Metres of position error that an error of one radian of heading is worth to the policy.
   */
  float weight_heading_m;
  /*
   Metres of position error that an error of 1 of the scale of a wheel is worth to the policy.
   */
  float weight_wheels_m;
  /*
   A sonarfix_policy_t: how the wall to measure is chosen.
   */
  int32_t policy;
  /*
   The gyro, if gyro.is_fitted is not zero.
   */
  sonarfix_gyro_config_t gyro;
  /*
   Number of rangers: 1 to SONARFIX_RANGERS.
   */
  uint32_t ranger_count;
  /*
   The rangers, the first ranger_count of them.
   */
  sonarfix_ranger_config_t rangers[SONARFIX_RANGERS];
} sonarfix_config_t;

/*
 The first field of a configuration that breaks a rule, and the rule, as texts that end with zero. Both are empty if all fields are
 right.
 */
typedef struct {
  /*
   The field, as in a robot file: a ranger's begins with `sonar`.
   */
  char field[SONARFIX_FIELD_LENGTH];
  /*
   What it must be.
   */
  char rule[SONARFIX_RULE_LENGTH];
} sonarfix_config_error_t;

/*
 A localizer in memory of the caller. It must not be copied.
 */
typedef struct {
  /*
   Only for this library.
   */
  uint64_t opaque[SONARFIX_LOCALIZER_WORDS];
} sonarfix_localizer_t;

/*
 A map. It refers to walls or to an image, which must stay where they are, unchanged, as long as the map or a handle that was
 initialised with it is open. A map must not be copied.
 */
typedef struct {
  /*
   Only for this library.
   */
  uint64_t opaque[SONARFIX_MAP_WORDS];
} sonarfix_map_t;

/*
 A pose in the map frame: x and y of the midpoint between the wheels, and the direction ahead.
 */
typedef struct {
  /*
   Along map x, metres.
   */
  float x_m;
  /*
   Along map y, metres.
   */
  float y_m;
  /*
   Counter-clockwise from map x, radians, in (-pi, pi]; as an input, any angle.
   */
  float heading_rad;
} sonarfix_pose_t;

/*
 A pose with the standard deviations of its errors.
 */
typedef struct {
  /*
   The pose.
   */
  sonarfix_pose_t pose;
  /*
   Standard deviation of x and of y, metres.
   */
  float position_deviation_m;
  /*
   Standard deviation of the heading, radians.
   */
  float heading_deviation_rad;
} sonarfix_start_t;

/*
 The seven states of the filter, or the standard deviation of each.
 */
typedef struct {
  /*
   Position along map x, metres.
   */
  float x_m;
  /*
   Position along map y, metres.
   */
  float y_m;
  /*
   Heading, counter-clockwise from map x, radians.
   */
  float heading_rad;
  /*
   Scale error of the right wheel: true travel is (1 + this) times the measured one.
   */
  float scale_right;
  /*
   Scale error of the left wheel.
   */
  float scale_left;
  /*
   Error of the track width, metres: to be added to the configured one.
   */
  float track_width_error_m;
  /*
   Scale error of the ranger.
   */
  float range_scale;
} sonarfix_state_t;

/*
 Where the servo of a ranger stands, and when it can ping.
 */
typedef struct {
  /*
   The bearing to which its servo is commanded, radians from the robot's heading.
   */
  float bearing_rad;
  /*
   Time until it can ping there, microseconds.
   */
  uint32_t ready_in_us;
  /*
   0 before the first command of the servo: bearing_rad has no meaning.
   */
  uint8_t has_bearing;
} sonarfix_standing_t;

/*
 The outcome of a ping.
 */
typedef struct {
  /*
   What the localizer did with it.
   */
  sonarfix_outcome_t outcome;
  /*
   Why it was refused, if it was.
   */
  sonarfix_refusal_t refusal;
  /*
   Why the filter refused it, if it did; otherwise SONARFIX_OK.
   */
  sonarfix_status_t filter_error;
  /*
   Innovation: the range less the expected one, metres; zero if it was refused or searched.
   */
  float innovation_m;
  /*
   Variance of the innovation, square metres; zero if it was refused or searched.
   */
  float variance_m2;
} sonarfix_fix_t;

/*
 The outcome of an absolute measurement.
 */
typedef struct {
  /*
   What the localizer did with it.
   */
  sonarfix_outcome_t outcome;
  /*
   Why it was refused, if it was.
   */
  sonarfix_refusal_t refusal;
  /*
   Why the filter refused it, if it did; otherwise SONARFIX_OK.
   */
  sonarfix_status_t filter_error;
  /*
   Normalized innovation squared; zero if it was refused.
   */
  float nis;
  /*
   Its mean if the filter is consistent: how many numbers were measured, 1 to 3; zero if it was refused.
   */
  uint32_t dimensions;
} sonarfix_absolute_fix_t;

/*
 The covariance of the noise of a measured pose in the map frame.
 */
typedef struct {
  /*
   Variance of x, square metres.
   */
  float xx_m2;
  /*
   Covariance of x and y, square metres.
   */
  float xy_m2;
  /*
   Variance of y, square metres.
   */
  float yy_m2;
  /*
   Covariance of x and the heading, metres times radians.
   */
  float xh_m_rad;
  /*
   Covariance of y and the heading, metres times radians.
   */
  float yh_m_rad;
  /*
   Variance of the heading, square radians.
   */
  float hh_rad2;
} sonarfix_pose_noise_t;

/*
 The covariance of the seven states, which is symmetric: its upper triangle, row by row.

 Rows and columns are in the order of sonarfix_state_t. The entry of row r and column c, r <= c, has the index
 7 r - r (r - 1) / 2 + c - r, and the product of the units of both states.
 */
typedef struct {
  /*
   The entries.
   */
  float upper[SONARFIX_COVARIANCE_ENTRIES];
} sonarfix_covariance_t;

/*
 The verdict and the numbers behind it.
 */
typedef struct {
  /*
   Time since the last range used, microseconds.
   */
  uint64_t time_since_fix_us;
  /*
   The verdict.
   */
  sonarfix_verdict_t verdict;
  /*
   Evidence against the pose, from 0 to 8.5, at which the verdict is Lost.
   */
  float evidence;
  /*
   Mean of the normalized innovation squared over the latest ranges used: 1 if the filter is consistent.
   */
  float nis;
  /*
   Distance travelled since the last range used, metres.
   */
  float rolled_since_fix_m;
  /*
   Standard deviation of the position in its worst direction after the last ping, metres.
   */
  float position_deviation_m;
  /*
   Standard deviation of the heading after the last ping, radians.
   */
  float heading_deviation_rad;
  /*
   Ranges used since the last one that was not.
   */
  uint16_t accepted_in_a_row;
  /*
   Ranges gated or down-weighted since the last one accepted.
   */
  uint16_t gated_in_a_row;
  /*
   Pings without a usable range since the last one used or gated.
   */
  uint16_t silent_in_a_row;
  /*
   Inflations of the covariance of a lost robot since the verdict was last Tracking.
   */
  uint16_t inflations;
} sonarfix_health_t;

/*
 The gyro as the localizer sees it.
 */
typedef struct {
  /*
   Estimated bias, radians per second, counter-clockwise.
   */
  float bias_rad_per_s;
  /*
   Its standard deviation, radians per second.
   */
  float deviation_rad_per_s;
  /*
   What became of the latest turn.
   */
  sonarfix_turn_use_t latest;
  /*
   Slips of the wheels since the start.
   */
  uint32_t slips;
  /*
   How often wheels and gyro differed for so long that the gyro may be wrong.
   */
  uint32_t conflicts;
} sonarfix_gyro_status_t;

/*
 A search for the pose in memory of the caller. It must not be copied.
 */
typedef struct {
  /*
   Only for this library.
   */
  uint64_t opaque[SONARFIX_SEARCH_WORDS];
} sonarfix_search_t;

/*
 A rectangle of the map, parallel to its axes.
 */
typedef struct {
  /*
   Smallest x, metres.
   */
  float from_x_m;
  /*
   Smallest y, metres.
   */
  float from_y_m;
  /*
   Largest x, metres.
   */
  float to_x_m;
  /*
   Largest y, metres.
   */
  float to_y_m;
} sonarfix_region_t;

/*
 A wall of a map in memory of the caller; sonarfix_map_from_walls fills it.
 */
typedef struct {
  /*
   Only for this library.
   */
  uint32_t opaque[6];
} sonarfix_wall_t;

/*
 The ends of a wall in the map frame.
 */
typedef struct {
  /*
   Along map x of one end, metres.
   */
  float from_x_m;
  /*
   Along map y of one end, metres.
   */
  float from_y_m;
  /*
   Along map x of the other end, metres.
   */
  float to_x_m;
  /*
   Along map y of the other end, metres.
   */
  float to_y_m;
  /*
   Standard deviation of the wall's place, metres, rounded to whole millimetres from 1 to 255; zero or negative: that of
   the configuration (echo_map_accuracy_m).
   */
  float accuracy_m;
} sonarfix_segment_t;

/*
 A robot in memory of the caller. It must not be copied or moved.
 */
typedef struct {
  /*
   Only for this library.
   */
  uint64_t opaque[SONARFIX_ROBOT_WORDS];
} sonarfix_robot_t;

/*
 A wheel and its encoder.
 */
typedef struct {
  /*
   Travel of the wheel from one count of its encoder to the next, metres.
   */
  float travel_per_count_m;
  /*
   Not zero if the encoder counts down while the robot drives ahead.
   */
  uint8_t is_mirrored;
} sonarfix_wheel_config_t;

/*
 The drivers of a ranger and of its servo.
 */
typedef struct {
  /*
   A sonarfix_driver_t.
   */
  int32_t driver;
  /*
   SRF, VL53L1X, VL53L0X: address in seven bits.
   */
  uint32_t address;
  /*
   Pulse: shortest trigger pulse, microseconds.
   */
  uint32_t trigger_us;
  /*
   Pulse: echoes shorter than this are the direct burst, microseconds.
   */
  uint32_t blanking_us;
  /*
   Pulse: longest reliable time of flight, microseconds.
   */
  uint32_t longest_us;
  /*
   Pulse: width from which on a pulse means that there was no echo, microseconds.
   */
  uint32_t silence_us;
  /*
   Pulse: time to wait for the echo after the trigger, microseconds.
   */
  uint32_t listen_us;
  /*
   Pulse: time after a trigger from which on a high line counts as stuck, microseconds.
   */
  uint32_t stuck_us;
  /*
   Pulse: temperature of the air, degrees Celsius, the same for all rangers; it determines the speed of sound.
   */
  float temperature_c;
  /*
   Two widths of the servo's pulse, microseconds, as far apart as possible.
   */
  uint32_t servo_pulse_us[2];
  /*
   The bearing of the ranger that was measured with each, radians.
   */
  float servo_bearing_rad[2];
} sonarfix_driver_config_t;

/*
 The configuration of a robot. Start from sonarfix_robot_config_default, and set what was measured.
 */
typedef struct {
  /*
   The parameters of the localizer, its rangers and their servos.
   */
  sonarfix_config_t localizer;
  /*
   The right wheel.
   */
  sonarfix_wheel_config_t right_wheel;
  /*
   The left wheel.
   */
  sonarfix_wheel_config_t left_wheel;
  /*
   Time from one sample of the encoders to the next, microseconds.
   */
  uint32_t encoder_period_us;
  /*
   The drivers of localizer.rangers, in the same order.
   */
  sonarfix_driver_config_t drivers[SONARFIX_RANGERS];
  /*
   Time without a frame over the link after which it counts as lost, microseconds.
   */
  uint32_t link_timeout_us;
  /*
   Not zero if a lost robot may drive.
   */
  uint8_t may_drive_lost;
  /*
   Not zero if a robot without odometry may drive.
   */
  uint8_t may_drive_without_encoder;
  /*
   Not zero if a robot without link may drive.
   */
  uint8_t may_drive_without_link;
  /*
   Not zero if the robot searches for its pose when it starts without one, and when it is lost.
   */
  uint8_t searches;
  /*
   Not zero if it starts in a part of the map.
   */
  uint8_t has_start_region;
  /*
   That part.
   */
  sonarfix_region_t start_region;
  /*
   How the robot moves by itself while it searches: a sonarfix_search_motion_t. The program obeys the motion of the outputs.
   */
  int32_t search_motion;
  /*
   Ahead: the least range of an echo ahead, from the sonar, with which the robot drives on, metres. Half of its width, and what it
   needs to stop.
   */
  float bumper_distance_m;
} sonarfix_robot_config_t;

/*
 The counter of an encoder.
 */
typedef struct {
  /*
   Its count, which wraps around after 2^32.
   */
  uint32_t count;
  /*
   Illegal transitions that it has counted, which wraps around; 0 if it does not.
   */
  uint32_t illegal;
  /*
   Not zero if it could not be read.
   */
  uint8_t has_failed;
} sonarfix_encoder_input_t;

/*
 What a ranger has reported since the last poll.
 */
typedef struct {
  /*
   Pulse: when the echo line went high, microseconds.
   */
  uint64_t rose_us;
  /*
   Pulse: when it went low after that, microseconds.
   */
  uint64_t fell_us;
  /*
   Other: the instant to which range_m belongs, microseconds, between the start and now: of sound its reflection, of light the
   middle of the time in which it was collected.
   */
  uint64_t measured_us;
  /*
   Other: a sonarfix_reading_t.
   */
  int32_t reading;
  /*
   Other: the range, metres.
   */
  float range_m;
  /*
   Pulse: not zero if the echo line went high since the last poll.
   */
  uint8_t has_risen;
  /*
   Pulse: not zero if it went low after that.
   */
  uint8_t has_fallen;
} sonarfix_ranger_input_t;

/*
 What was sensed and received since the last poll. All zero except for the time and the counts: nothing new.
 */
typedef struct {
  /*
   The time, microseconds.
   */
  uint64_t now_us;
  /*
   The right wheel.
   */
  sonarfix_encoder_input_t right;
  /*
   The left wheel.
   */
  sonarfix_encoder_input_t left;
  /*
   The rangers.
   */
  sonarfix_ranger_input_t rangers[SONARFIX_RANGERS];
  /*
   The yaw rate now, radians per second, counter-clockwise.
   */
  float yaw_rate_rad_per_s;
  /*
   Not zero if yaw_rate_rad_per_s was read; zero of a robot with a gyro: the gyro has failed.
   */
  uint8_t has_yaw_rate;
  /*
   Bytes that were received over the link; NULL if there are none.
   */
  const uint8_t *received;
  /*
   Their number. A poll takes some of them: pass the others again.
   */
  size_t received_length;
  /*
   Memory for bytes to be sent over the link; NULL without a link.
   */
  uint8_t *to_send;
  /*
   Its length. A poll builds no telemetry while less than 600 bytes are free.
   */
  size_t to_send_length;
} sonarfix_inputs_t;

/*
 What to do with a ranger and its servo.
 */
typedef struct {
  /*
   Width of the pulse to which the servo is to be set, microseconds, if has_servo_pulse is not zero.
   */
  float servo_pulse_us;
  /*
   Not zero if the servo is to be set.
   */
  uint8_t has_servo_pulse;
  /*
   Pulse: the level of the trigger pin from now on.
   */
  uint8_t trigger;
  /*
   Not zero if a ping begins with this poll: the trigger has fallen, or another ranger is to be started now.
   */
  uint8_t starts;
} sonarfix_ranger_output_t;

/*
 How a robot is to move.
 */
typedef struct {
  /*
   Speed ahead, metres per second; negative: backwards.
   */
  float speed_m_per_s;
  /*
   Turn rate, counter-clockwise, radians per second.
   */
  float turn_rad_per_s;
  /*
   The speed of the right wheel at this motion, metres per second.
   */
  float right_m_per_s;
  /*
   The speed of the left wheel at this motion, metres per second.
   */
  float left_m_per_s;
} sonarfix_motion_t;

/*
 What to do after a poll.
 */
typedef struct {
  /*
   When to poll next, microseconds, unless a byte or an edge of an echo arrives earlier.
   */
  uint64_t next_poll_us;
  /*
   The rangers and their servos.
   */
  sonarfix_ranger_output_t rangers[SONARFIX_RANGERS];
  /*
   The estimated pose in the map frame, while the loop runs.
   */
  sonarfix_pose_t pose;
  /*
   The verdict, while the loop runs; otherwise Lost.
   */
  sonarfix_verdict_t verdict;
  /*
   What determines the pose.
   */
  sonarfix_mode_t mode;
  /*
   The result of the command that was waiting.
   */
  sonarfix_command_result_t command;
  /*
   The ping that this poll has started or ended, if has_pinged or has_fix is not zero.
   */
  sonarfix_aim_t aim;
  /*
   What the localizer did with the ping that this poll has ended, if has_fix is not zero.
   */
  sonarfix_fix_t fix;
  /*
   The motion that was commanded over the link, else that of a robot that searches, if has_motion is not zero; otherwise at rest.
   */
  sonarfix_motion_t motion;
  /*
   How many of the received bytes were taken.
   */
  size_t received_taken;
  /*
   How many bytes are to be sent.
   */
  size_t to_send;
  /*
   Not zero while the loop runs.
   */
  uint8_t is_running;
  /*
   Not zero if the motors may be enabled.
   */
  uint8_t may_drive;
  /*
   Not zero if the robot is to move by motion. Zero: it stands, or drives by the rules of the program.
   */
  uint8_t has_motion;
  /*
   Not zero if a deadline was met: the condition for feeding a watchdog.
   */
  uint8_t is_on_time;
  /*
   Not zero if the poll has done anything in the loop: the estimate may have changed.
   */
  uint8_t has_worked;
  /*
   Not zero if a ping was started: aim.
   */
  uint8_t has_pinged;
  /*
   Not zero if a ping along an aim has ended: aim and fix.
   */
  uint8_t has_fix;
  /*
   Not zero if the store has changed: save it.
   */
  uint8_t store_has_changed;
} sonarfix_outputs_t;

/*
 Counts of faults since the robot was opened.
 */
typedef struct {
  /*
   Samples of the right encoder that failed.
   */
  uint32_t right_errors;
  /*
   Illegal transitions of the right encoder.
   */
  uint32_t right_illegal;
  /*
   Samples of the left encoder that failed.
   */
  uint32_t left_errors;
  /*
   Illegal transitions of the left encoder.
   */
  uint32_t left_illegal;
  /*
   Commands that a servo could not follow.
   */
  uint32_t servo;
  /*
   Pings that a ranger could not make.
   */
  uint32_t ranger;
  /*
   Travels that the localizer refused.
   */
  uint32_t travel;
  /*
   Samples of the encoders that were late.
   */
  uint32_t deadlines;
  /*
   Times that ran backwards or leapt.
   */
  uint32_t clock;
  /*
   Samples of the gyro that failed.
   */
  uint32_t gyro;
} sonarfix_faults_t;

/*
 What a search has found, with its numbers.
 */
typedef struct {
  /*
   What it is.
   */
  sonarfix_answer_kind_t kind;
  /*
   Of several: how many poses fit, the first ones of sonarfix_search_hypothesis.
   */
  uint32_t count;
  /*
   Along a wall: its number.
   */
  uint32_t wall;
  /*
   Along a wall: standard deviation of the position along it, metres.
   */
  float extent_m;
  /*
   The complete cycles of the search.
   */
  uint32_t cycles;
  /*
   The pings in its window.
   */
  uint32_t pings;
} sonarfix_answer_t;

/*
 A pose that the pings of a search fit.
 */
typedef struct {
  /*
   The robot's pose now, in the map frame.
   */
  sonarfix_pose_t pose;
  /*
   Standard deviation of the position in its worst direction, metres.
   */
  float position_deviation_m;
  /*
   Standard deviation of the heading, radians.
   */
  float heading_deviation_rad;
  /*
   Mean weighted log-likelihood per ping, relative to a place without walls.
   */
  float fit;
  /*
   Share of the echoes that the map explains.
   */
  float explained;
} sonarfix_hypothesis_t;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/*
 Computes what a policy maximizes over all rangers of a robot: the expected gain per time, or the nearness.

 @param aim  an aim
 @param policy  a sonarfix_policy_t
 @param score  gets the score, in square metres per second or in 1/metre
 @return SONARFIX_OK; SONARFIX_ERROR_VALUE if there is no such policy; or an error of a pointer or a number of the aim
 Threads: any number at a time.
 */
sonarfix_status_t sonarfix_aim_score(const sonarfix_aim_t *aim, int32_t policy, float *score);

/*
 Fills a configuration with the defaults for a small robot with two driven wheels and one ideal ranger at its centre, which
 pings once per second on a servo without limits or delay.

 @param track_width_m  distance between the contact points of the wheels, metres
 @param config  gets the defaults, the same in all rangers
 @return SONARFIX_OK; SONARFIX_ERROR_NOT_FINITE; or an error of the pointer
 Threads: any number at a time.
 */
sonarfix_status_t sonarfix_config_default(float track_width_m,
                                          sonarfix_config_t *config);

/*
 Sets what is known of a named sensor: what it measures with, its least time from ping to ping, and the echo model, which all
 rangers share. Its mount, its limits and its noise are unchanged.

 @param config  a configuration
 @param ranger  number of the ranger, from 0
 @param sensor  a sonarfix_sensor_t
 @return SONARFIX_OK; SONARFIX_ERROR_VALUE if there is no such ranger or sensor; SONARFIX_ERROR_NOT_LINKED if the library was
   built without what it measures with; or an error of the pointer
 Threads: one at a time for the configuration.
 */
sonarfix_status_t sonarfix_config_set_sensor(sonarfix_config_t *config,
                                             uint32_t ranger,
                                             int32_t sensor);

/*
 Sets the timing of a named servo, and its limits.

 @param config  a configuration
 @param ranger  number of the ranger on the servo, from 0
 @param servo  a sonarfix_servo_t
 @param right_rad  rightmost bearing, radians, counter-clockwise from the robot's heading, so negative to the right
 @param left_rad  leftmost bearing, radians; equal to the rightmost: the ranger is fixed at that bearing
 @return SONARFIX_OK; SONARFIX_ERROR_VALUE if there is no such ranger or servo; SONARFIX_ERROR_NOT_FINITE; or an error of the
   pointer
 Threads: one at a time for the configuration.
 */
sonarfix_status_t sonarfix_config_set_servo(sonarfix_config_t *config,
                                            uint32_t ranger,
                                            int32_t servo,
                                            float right_rad,
                                            float left_rad);

/*
 Reads the localizer's part of a baked configuration: written by `sonarfix config bake`.

 @param image  the image; bytes after it are ignored
 @param length  bytes from image on
 @param config  gets the configuration
 @return SONARFIX_OK; SONARFIX_ERROR_IMAGE_... by what is wrong with the image; SONARFIX_ERROR_CONFIG;
   SONARFIX_ERROR_NOT_LINKED if the library was built without a part of that robot; or an error of a pointer
 Threads: any number at a time.
 */
sonarfix_status_t sonarfix_config_from_image(const uint8_t *image, size_t length, sonarfix_config_t *config);

/*
 Checks every field of a configuration, and names the first one that breaks its rule.

 A program that does not call this function does not link the texts.

 @param config  the configuration
 @param error  gets the field and its rule as texts; empty texts if every rule is met
 @return SONARFIX_OK if the check was made, also if it found an error; SONARFIX_ERROR_VALUE or SONARFIX_ERROR_NOT_LINKED if a
   field has no meaning to this library; or an error of a pointer
 Threads: any number at a time.
 */
sonarfix_status_t sonarfix_config_check(const sonarfix_config_t *config,
                                        sonarfix_config_error_t *error);

/*
 Opens a localizer at a known pose. The configuration is copied; the map is referred to.

 @param localizer  memory for the localizer
 @param config  the parameters of the robot
 @param map  an open map
 @param start  the pose, in the map frame, metres and radians, with its standard deviations; by sonarfix_start_unknown of a
   robot that searches
 @param now_us  the time, microseconds of any clock that does not run backwards
 @return SONARFIX_OK; SONARFIX_ERROR_CONFIG, _VALUE or _NOT_LINKED by what is wrong with the configuration (sonarfix_config_check
   names the field); SONARFIX_ERROR_NOT_FINITE, _NEGATIVE_VARIANCE or _VARIANCE_TOO_LARGE by what is wrong with the start;
   SONARFIX_ERROR_TIME; SONARFIX_ERROR_ARITHMETIC; or an error of a pointer or a handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_init(sonarfix_localizer_t *localizer,
                                          const sonarfix_config_t *config,
                                          const sonarfix_map_t *map,
                                          const sonarfix_start_t *start,
                                          uint64_t now_us);

/*
 Opens a localizer that continues from the state of an earlier one, calibration included.

 @param localizer  memory for the localizer
 @param config  the parameters of the robot; of its prior only prior_scale_difference is used
 @param map  an open map
 @param state  the state, as sonarfix_localizer_state returned it
 @param deviations  the standard deviations of the state as they are now, in the units of the state
 @param now_us  the time, microseconds
 @return as sonarfix_localizer_init
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_resume(sonarfix_localizer_t *localizer,
                                            const sonarfix_config_t *config,
                                            const sonarfix_map_t *map,
                                            const sonarfix_state_t *state,
                                            const sonarfix_state_t *deviations,
                                            uint64_t now_us);

/*
 Closes a localizer. Every later call with it is SONARFIX_ERROR_NOT_OPEN, until it is opened again.

 @param localizer  an open localizer
 @return SONARFIX_OK, or an error of the pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_close(sonarfix_localizer_t *localizer);

/*
 Predicts the estimate over the travel of both wheels since the last call. To be called at every sample of the encoders, and
 at the instant when an echo left the wall.

 @param localizer  an open localizer
 @param now_us  the time up to which the wheels travelled, microseconds, not before that of the last call
 @param right_m  travel of the right wheel by its encoder, metres, negative backwards
 @param left_m  travel of the left wheel, metres
 @return SONARFIX_OK; SONARFIX_ERROR_TIME_RAN_BACKWARDS, _NO_TIME_PASSED, _TOO_FAST, _NOT_FINITE, _TURN_TOO_LARGE, _INDEFINITE
   or _VARIANCE_TOO_LARGE: the travel is not part of the estimate; SONARFIX_ERROR_TIME; or an error of the pointer or a handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_odometry(sonarfix_localizer_t *localizer,
                                              uint64_t now_us,
                                              float right_m,
                                              float left_m);

/*
 As sonarfix_localizer_odometry, with the turn that a gyro has measured over the same time. Without a gyro in the configuration
 the turn is ignored. What became of it: sonarfix_localizer_gyro.

 @param localizer  an open localizer
 @param now_us  the time up to which the wheels travelled, microseconds
 @param right_m  travel of the right wheel, metres, negative backwards
 @param left_m  travel of the left wheel, metres
 @param turn_rad  integral of the yaw rate, bias included, radians, counter-clockwise; whole turns count
 @param turn_us  the time that the integral covers, microseconds
 @return as sonarfix_localizer_odometry; SONARFIX_ERROR_NOT_FINITE for the turn, too
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_odometry_with_turn(sonarfix_localizer_t *localizer,
                                                        uint64_t now_us,
                                                        float right_m,
                                                        float left_m,
                                                        float turn_rad,
                                                        uint32_t turn_us);

/*
 Records that the wheels could not be observed. To be called whenever a sample of the encoders is due and fails: the deviations
 of the pose grow, and the next travel may be the whole one.

 @param localizer  an open localizer
 @param now_us  the time, microseconds
 @return SONARFIX_OK; SONARFIX_ERROR_TIME; or an error of the pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_odometry_missing(sonarfix_localizer_t *localizer,
                                                      uint64_t now_us);

/*
 Replaces the pose by one that was measured independently. The calibration is unchanged; the mode is Tracking.

 @param localizer  an open localizer
 @param start  the pose in the map frame, metres and radians, with its standard deviations
 @return SONARFIX_OK; SONARFIX_ERROR_NOT_FINITE, _NEGATIVE_VARIANCE or _VARIANCE_TOO_LARGE; or an error of a pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_set_pose(sonarfix_localizer_t *localizer,
                                              const sonarfix_start_t *start);

/*
 Continues at another time after the clock was set back. The next travel is that since the last accepted one; measurements
 from before are refused.

 @param localizer  an open localizer
 @param now_us  the new time, microseconds
 @return SONARFIX_OK; SONARFIX_ERROR_TIME; or an error of the pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_set_clock(sonarfix_localizer_t *localizer,
                                               uint64_t now_us);

/*
 Chooses the ranger and the wall to measure next. While a search determines the pose: the next step of its sweep, with the wall
 SONARFIX_WALL_OF_SWEEP.

 @param localizer  an open localizer
 @param aim  gets wall, ranger and bearing, radians from the robot's heading
 @return SONARFIX_OK; SONARFIX_ERROR_NO_WALL if none can be measured from here (then call sonarfix_localizer_skip);
   SONARFIX_ERROR_NO_SEARCH or SONARFIX_ERROR_NOT_OPEN if the search was detached or closed; or an error of a pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_aim(sonarfix_localizer_t *localizer,
                                         sonarfix_aim_t *aim);

/*
 As sonarfix_localizer_aim for one ranger whose servo stands as given: a robot with several turns all servos, and pings with the
 ranger whose aim has the highest sonarfix_aim_score.

 @param localizer  an open localizer
 @param ranger  number of the ranger, from 0
 @param standing  where its servo stands, radians from the heading, and when it can ping
 @param aim  gets wall and bearing
 @return as sonarfix_localizer_aim; SONARFIX_ERROR_NO_WALL also if the robot has no such ranger or it has failed;
   SONARFIX_ERROR_VALUE; SONARFIX_ERROR_NOT_FINITE
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_aim_of(sonarfix_localizer_t *localizer,
                                            uint32_t ranger,
                                            const sonarfix_standing_t *standing,
                                            sonarfix_aim_t *aim);

/*
 Finds the wall to which a beam is square, for a range whose bearing the localizer did not choose.

 @param localizer  an open localizer
 @param ranger  number of the ranger, from 0
 @param bearing_rad  bearing of the beam, radians, counter-clockwise from the robot's heading
 @param aim  gets the wall
 @return SONARFIX_OK; SONARFIX_ERROR_NO_WALL if none can be measured along it (then call sonarfix_localizer_skip_unplanned);
   SONARFIX_ERROR_VALUE; SONARFIX_ERROR_NOT_FINITE; or an error of a pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_aim_at(const sonarfix_localizer_t *localizer,
                                            uint32_t ranger,
                                            float bearing_rad,
                                            sonarfix_aim_t *aim);

/*
 Corrects the estimate by the range that was measured along an aim. While a search determines the pose, it takes the ping.

 The estimate must be that of the instant when the echo left the wall: call sonarfix_localizer_odometry up to it first. Of an
 echo it is the middle of its flight, about now less range / 343 m/s.

 @param localizer  an open localizer
 @param aim  the aim, with the bearing that the servo has reached
 @param range_m  the measured range, metres
 @param fix  gets what the localizer did with it
 @return SONARFIX_OK, also of a range that was not used; SONARFIX_ERROR_NOT_FINITE or SONARFIX_ERROR_VALUE by a wrong number, which
   does not enter the health; or an error of a pointer or a handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_fix(sonarfix_localizer_t *localizer,
                                         const sonarfix_aim_t *aim,
                                         float range_m,
                                         sonarfix_fix_t *fix);

/*
 Records that a ping along an aim had no echo.

 @param localizer  an open localizer
 @param aim  the aim, with the bearing that the servo has reached, radians
 @param fix  gets what the localizer did with it: refused, or taken by a search
 @return as sonarfix_localizer_fix
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_no_echo(sonarfix_localizer_t *localizer,
                                             const sonarfix_aim_t *aim,
                                             sonarfix_fix_t *fix);

/*
 Records that sonarfix_localizer_aim found no wall when a ping was due.

 @param localizer  an open localizer
 @return SONARFIX_OK, or an error of the pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_skip(sonarfix_localizer_t *localizer);

/*
 Records that sonarfix_localizer_aim_at found no wall for a ping. It counts at most once per second.

 @param localizer  an open localizer
 @return SONARFIX_OK, or an error of the pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_skip_unplanned(sonarfix_localizer_t *localizer);

/*
 Records that a ranger could not ping, because it or its servo has failed.

 @param localizer  an open localizer
 @param ranger  number of the ranger, from 0
 @return SONARFIX_OK; SONARFIX_ERROR_VALUE; or an error of the pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_ranger_failed(sonarfix_localizer_t *localizer, uint32_t ranger);

/*
 Corrects the estimate by a heading that was measured independently, as by a compass.

 @param localizer  an open localizer
 @param at_us  when it was measured, microseconds: within the latest step of the odometry
 @param heading_rad  the heading, radians, counter-clockwise from map x
 @param deviation_rad  standard deviation of its noise, radians
 @param fix  gets what the localizer did with it
 @return SONARFIX_OK, also of a heading that was not used; SONARFIX_ERROR_TIME; SONARFIX_ERROR_NOT_FINITE; or an error of a pointer
   or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_heading(sonarfix_localizer_t *localizer,
                                             uint64_t at_us,
                                             float heading_rad,
                                             float deviation_rad,
                                             sonarfix_absolute_fix_t *fix);

/*
 Corrects the estimate by a position of the midpoint between the wheels that was measured independently, as by a beacon.

 @param localizer  an open localizer
 @param at_us  when it was measured, microseconds: within the latest step of the odometry
 @param measured  the position in the map frame, metres; the heading is ignored
 @param noise  covariance of its noise; of the heading it is ignored
 @param fix  gets what the localizer did with it
 @return as sonarfix_localizer_heading
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_position(sonarfix_localizer_t *localizer,
                                              uint64_t at_us,
                                              const sonarfix_pose_t *measured,
                                              const sonarfix_pose_noise_t *noise,
                                              sonarfix_absolute_fix_t *fix);

/*
 Corrects the estimate by a pose that was measured independently, as by a camera.

 @param localizer  an open localizer
 @param at_us  when it was measured, microseconds: within the latest step of the odometry
 @param measured  the pose in the map frame, metres and radians
 @param noise  covariance of its noise
 @param fix  gets what the localizer did with it
 @return as sonarfix_localizer_heading
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_measured_pose(sonarfix_localizer_t *localizer,
                                                   uint64_t at_us,
                                                   const sonarfix_pose_t *measured,
                                                   const sonarfix_pose_noise_t *noise,
                                                   sonarfix_absolute_fix_t *fix);

/*
 Reads the estimated pose.

 @param localizer  an open localizer
 @param pose  gets the pose in the map frame, metres and radians
 @return SONARFIX_OK, or an error of a pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_pose(const sonarfix_localizer_t *localizer, sonarfix_pose_t *pose);

/*
 Reads pose and calibration.

 @param localizer  an open localizer
 @param state  gets the seven states, in metres, radians and dimensionless
 @return SONARFIX_OK, or an error of a pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_state(const sonarfix_localizer_t *localizer, sonarfix_state_t *state);

/*
 Reads the standard deviations of pose and calibration.

 @param localizer  an open localizer
 @param deviations  gets the standard deviation of each of the seven states, in its unit
 @return SONARFIX_OK, or an error of a pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_deviations(const sonarfix_localizer_t *localizer, sonarfix_state_t *deviations);

/*
 Reads the covariance of the seven states.

 @param localizer  an open localizer
 @param covariance  gets the upper triangle; sonarfix_covariance_t has order and units
 @return SONARFIX_OK, or an error of a pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_covariance(const sonarfix_localizer_t *localizer,
                                                sonarfix_covariance_t *covariance);

/*
 Reads the verdict on the estimate and the numbers behind it.

 @param localizer  an open localizer
 @param health  gets the verdict, with metres, radians and microseconds
 @return SONARFIX_OK, or an error of a pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_health(const sonarfix_localizer_t *localizer, sonarfix_health_t *health);

/*
 Reads what of the configuration is probably wrong.

 @param localizer  an open localizer
 @param mismatch  gets what is wrong, or SONARFIX_MISMATCH_NONE
 @return SONARFIX_OK, or an error of a pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_mismatch(const sonarfix_localizer_t *localizer, sonarfix_mismatch_t *mismatch);

/*
 Reads what determines the pose: always SONARFIX_MODE_TRACKING without a search.

 @param localizer  an open localizer
 @param mode  gets the mode
 @return SONARFIX_OK, or an error of a pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_mode(const sonarfix_localizer_t *localizer, sonarfix_mode_t *mode);

/*
 Reads the time of the last accepted travel.

 @param localizer  an open localizer
 @param time_us  gets the time, microseconds
 @return SONARFIX_OK, or an error of a pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_time(const sonarfix_localizer_t *localizer, uint64_t *time_us);

/*
 Reads whether a sample of the encoders has failed since the last accepted travel.

 @param localizer  an open localizer
 @param is_missing  gets 1 if so, otherwise 0
 @return SONARFIX_OK, or an error of a pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_is_odometry_missing(const sonarfix_localizer_t *localizer, uint8_t *is_missing);

/*
 Reads the probability that the echo of the latest ping was that of its wall.

 @param localizer  an open localizer
 @param association  gets the probability, dimensionless; zero without an echo, or if the range was refused
 @return SONARFIX_OK, or an error of a pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_association(const sonarfix_localizer_t *localizer, float *association);

/*
 Reads the bias of the gyro, and what became of its turns.

 @param localizer  an open localizer
 @param gyro  gets the bias and its deviation, radians per second
 @return SONARFIX_OK; SONARFIX_ERROR_NOT_LINKED if the configuration has no gyro, or the library was built without; or an error of
   a pointer or the handle
 Threads: one at a time for the localizer.
 */
sonarfix_status_t sonarfix_localizer_gyro(const sonarfix_localizer_t *localizer,
                                          sonarfix_gyro_status_t *gyro);

/*
 Attaches a search to a localizer, which from then on begins it when the verdict is Lost, and uses it in every call. A search is
 attached to one localizer at a time.

 @param localizer  an open localizer
 @param search  an open search, which stays where it is until it is detached or the localizer is closed; NULL detaches the present one
 @return SONARFIX_OK, or an error of a pointer or a handle
 Threads: one at a time for the localizer and the search together, from now on.
 */
sonarfix_status_t sonarfix_localizer_attach_search(sonarfix_localizer_t *localizer,
                                                   sonarfix_search_t *search);

/*
 Declares the pose unknown and begins the search; the present pose is proposed to it.

 @param localizer  an open localizer with a search
 @return SONARFIX_OK; SONARFIX_ERROR_NO_SEARCH; or an error of the pointer or a handle
 Threads: one at a time for the localizer and its search.
 */
sonarfix_status_t sonarfix_localizer_search(sonarfix_localizer_t *localizer);

/*
 Begins the search of a localizer that was opened with sonarfix_start_unknown, anywhere on the map.

 @param localizer  an open localizer with a search
 @return SONARFIX_OK; SONARFIX_ERROR_NO_SEARCH; or an error of the pointer or a handle
 Threads: one at a time for the localizer and its search.
 */
sonarfix_status_t sonarfix_localizer_search_anywhere(sonarfix_localizer_t *localizer);

/*
 Begins the search of a localizer that was opened with sonarfix_start_unknown, in a part of the map.

 @param localizer  an open localizer with a search
 @param region  where the robot starts, metres in the map frame
 @return SONARFIX_OK; SONARFIX_ERROR_NO_SEARCH; SONARFIX_ERROR_VALUE if the region is empty or not finite; or an error of a pointer or
   a handle
 Threads: one at a time for the localizer and its search.
 */
sonarfix_status_t sonarfix_localizer_search_in(sonarfix_localizer_t *localizer,
                                               const sonarfix_region_t *region);

/*
 Works on the search while the pose is not confirmed, and changes the mode when it is time. To be called after each input, and
 in any time that is left.

 @param localizer  an open localizer with a search
 @param evaluations  number of slices of work; one takes less than 0.1 ms on a Cortex-M4F at 168 MHz
 @param mode  gets what determines the pose now
 @return SONARFIX_OK; SONARFIX_ERROR_NO_SEARCH; or an error of a pointer or a handle
 Threads: one at a time for the localizer and its search.
 */
sonarfix_status_t sonarfix_localizer_work(sonarfix_localizer_t *localizer,
                                          uint16_t evaluations,
                                          sonarfix_mode_t *mode);

/*
 Opens a map of walls, which suits a room: every call considers all of them.

 @param map  memory for the map
 @param walls  memory for count walls, which the map refers to
 @param segments  the ends of count walls in the map frame, metres; wall i of the map is the i-th
 @param count  number of walls, at least 1
 @return SONARFIX_OK; SONARFIX_ERROR_NOT_FINITE or SONARFIX_ERROR_WALL_TOO_SHORT by the first wall that is not one;
   SONARFIX_ERROR_LENGTH; or an error of a pointer. The map is then as it was.
 Threads: one at a time for the map and its walls.
 */
sonarfix_status_t sonarfix_map_from_walls(sonarfix_map_t *map,
                                          sonarfix_wall_t *walls,
                                          const sonarfix_segment_t *segments,
                                          size_t count);

/*
 Opens a baked map, which is read in place: written by `sonarfix map bake`, in flash or in RAM, with any alignment.

 The cost of a call does not depend on the size of the map. The whole image is checked once, here.

 @param map  memory for the map
 @param image  the image, which the map refers to; bytes after it are ignored
 @param length  bytes from image on
 @return SONARFIX_OK; SONARFIX_ERROR_MAP_... by the first fault; or an error of a pointer
 Threads: one at a time for the map; several maps may share an image.
 */
sonarfix_status_t sonarfix_map_from_image(sonarfix_map_t *map, const uint8_t *image, size_t length);

/*
 Reads the number of walls of a map.

 @param map  an open map
 @param count  gets the number; the walls have the numbers below it
 @return SONARFIX_OK, or an error of a pointer or the handle
 Threads: any number at a time while none opens or closes the map.
 */
sonarfix_status_t sonarfix_map_count(const sonarfix_map_t *map, uint32_t *count);

/*
 Closes a map. Handles that were initialised with it still refer to its walls or its image.

 @param map  an open map
 @return SONARFIX_OK, or an error of the pointer or the handle
 Threads: one at a time for the map.
 */
sonarfix_status_t sonarfix_map_close(sonarfix_map_t *map);

/*
 Opens a robot that waits: its loop starts by sonarfix_robot_start, or by a command over the link.

 @param robot  memory for the robot, which stays where it is until the robot is closed
 @param config  the configuration, which is copied
 @param map  an open map; that of a baked image can be compared with the one of a monitor
 @param store  SONARFIX_STORE_SIZE bytes that survive a power loss if the program saves them when an output says so: all 0xFF at
   first, later what was saved. They stay where they are until the robot is closed
 @param now_us  the time, microseconds
 @return SONARFIX_OK; SONARFIX_ERROR_CONFIG, _VALUE or _NOT_LINKED by what is wrong with the configuration
   (sonarfix_robot_config_check names the field); SONARFIX_ERROR_UNSUPPORTED; SONARFIX_ERROR_TIME; SONARFIX_ERROR_ARITHMETIC; or
   an error of a pointer or a handle. After an error the robot is closed
 Threads: one at a time for the robot.
 */
sonarfix_status_t sonarfix_robot_init(sonarfix_robot_t *robot,
                                      const sonarfix_robot_config_t *config,
                                      const sonarfix_map_t *map,
                                      uint8_t *store,
                                      uint64_t now_us);

/*
 Closes a robot.

 @param robot  an open robot
 @return SONARFIX_OK, or an error of the pointer or the handle
 Threads: one at a time for the robot.
 */
sonarfix_status_t sonarfix_robot_close(sonarfix_robot_t *robot);

/*
 Sets the pose of the robot in the next poll; outputs.command has the result.

 @param robot  an open robot
 @param start  the pose in the map frame, metres and radians, with its standard deviations
 @return SONARFIX_OK; SONARFIX_ERROR_OCCUPIED if another command waits; or an error of a pointer or the handle
 Threads: one at a time for the robot.
 */
sonarfix_status_t sonarfix_robot_set_pose(sonarfix_robot_t *robot, const sonarfix_start_t *start);

/*
 Starts the loop in the next poll: from the pose that was set or stored, or with a search; outputs.command has the result.

 @param robot  an open robot
 @return SONARFIX_OK; SONARFIX_ERROR_OCCUPIED if another command waits; or an error of the pointer or the handle
 Threads: one at a time for the robot.
 */
sonarfix_status_t sonarfix_robot_start(sonarfix_robot_t *robot);

/*
 Stops the loop in the next poll; outputs.command has the result.

 @param robot  an open robot
 @return as sonarfix_robot_start
 Threads: one at a time for the robot.
 */
sonarfix_status_t sonarfix_robot_stop(sonarfix_robot_t *robot);

/*
 Declares the pose unknown in the next poll, and begins the search; outputs.command has the result.

 @param robot  an open robot whose configuration searches
 @return as sonarfix_robot_start
 Threads: one at a time for the robot.
 */
sonarfix_status_t sonarfix_robot_search(sonarfix_robot_t *robot);

/*
 Discards the learned calibration in the next poll; outputs.command has the result.

 @param robot  an open robot
 @return as sonarfix_robot_start
 Threads: one at a time for the robot.
 */
sonarfix_status_t sonarfix_robot_reset_calibration(sonarfix_robot_t *robot);

/*
 Passes a heading to the running loop, which uses it at the next sample of the encoders.

 @param robot  an open robot
 @param at_us  when it was measured, microseconds
 @param heading_rad  the heading, radians, counter-clockwise from map x
 @param deviation_rad  standard deviation of its noise, radians
 @return SONARFIX_OK; SONARFIX_ERROR_NOT_RUNNING; SONARFIX_ERROR_OCCUPIED if an earlier one waits; SONARFIX_ERROR_NOT_LINKED;
   SONARFIX_ERROR_TIME; SONARFIX_ERROR_NOT_FINITE; or an error of the pointer or the handle
 Threads: one at a time for the robot.
 */
sonarfix_status_t sonarfix_robot_heading(sonarfix_robot_t *robot,
                                         uint64_t at_us,
                                         float heading_rad,
                                         float deviation_rad);

/*
 Passes a position of the midpoint between the wheels to the running loop, which uses it at the next sample of the encoders.

 @param robot  an open robot
 @param at_us  when it was measured, microseconds
 @param measured  the position in the map frame, metres; the heading is ignored
 @param noise  covariance of its noise; of the heading it is ignored
 @return as sonarfix_robot_heading
 Threads: one at a time for the robot.
 */
sonarfix_status_t sonarfix_robot_position(sonarfix_robot_t *robot,
                                          uint64_t at_us,
                                          const sonarfix_pose_t *measured,
                                          const sonarfix_pose_noise_t *noise);

/*
 Passes a pose that was measured independently to the running loop, which uses it at the next sample of the encoders.

 @param robot  an open robot
 @param at_us  when it was measured, microseconds
 @param measured  the pose in the map frame, metres and radians
 @param noise  covariance of its noise
 @return as sonarfix_robot_heading
 Threads: one at a time for the robot.
 */
sonarfix_status_t sonarfix_robot_measured_pose(sonarfix_robot_t *robot,
                                               uint64_t at_us,
                                               const sonarfix_pose_t *measured,
                                               const sonarfix_pose_noise_t *noise);

/*
 Fills the configuration of a robot with common parts: 65 mm wheels with 1,496.6 counts a revolution, read every 100 ms, and an
 HC-SR04 on an SG90 for which pulses of 1 ms and 2 ms are -45 and 45 degrees. A start for one's own: the parts must be measured.

 @param track_width_m  distance between the contact points of the wheels, metres
 @param config  gets the defaults, the same in all rangers
 @return SONARFIX_OK; SONARFIX_ERROR_NOT_FINITE; or an error of the pointer
 Threads: any number at a time.
 */
sonarfix_status_t sonarfix_robot_config_default(float track_width_m,
                                                sonarfix_robot_config_t *config);

/*
 Reads a baked configuration: written by `sonarfix config bake`.

 @param image  the image; bytes after it are ignored
 @param length  bytes from image on
 @param config  gets the configuration, in metres, radians and microseconds
 @return as sonarfix_config_from_image
 Threads: any number at a time.
 */
sonarfix_status_t sonarfix_robot_config_from_image(const uint8_t *image,
                                                   size_t length,
                                                   sonarfix_robot_config_t *config);

/*
 Checks every field of the configuration of a robot, as sonarfix_config_check does.

 @param config  the configuration
 @param error  gets the field and its rule as texts; empty texts if every rule is met
 @return as sonarfix_config_check
 Threads: any number at a time.
 */
sonarfix_status_t sonarfix_robot_config_check(const sonarfix_robot_config_t *config, sonarfix_config_error_t *error);

/*
 Handles what is due: at most one command, one poll of the loop, and telemetry. It never waits. A poll at any other time does
 nothing, so that a program may poll as often as it likes.

 @param robot  an open robot
 @param inputs  what was sensed and received since the last poll
 @param outputs  gets what to do and to send
 @return SONARFIX_OK; SONARFIX_ERROR_TIME, SONARFIX_ERROR_NOT_FINITE, SONARFIX_ERROR_VALUE or SONARFIX_ERROR_LENGTH by a wrong input;
   or an error of a pointer or the handle. After an error the poll has not taken place
 Threads: one at a time for the robot.
 */
sonarfix_status_t sonarfix_robot_poll(sonarfix_robot_t *robot,
                                      const sonarfix_inputs_t *inputs,
                                      sonarfix_outputs_t *outputs);

/*
 Works on the search for the pose in time that is left after a poll: 39 slices, each less than 0.1 ms on a Cortex-M4F at
 168 MHz. Nothing happens while the robot does not search.

 @param robot  an open robot
 @param now_us  the time of the latest poll, microseconds
 @return SONARFIX_OK; SONARFIX_ERROR_TIME; or an error of the pointer or the handle
 Threads: one at a time for the robot.
 */
sonarfix_status_t sonarfix_robot_work(sonarfix_robot_t *robot, uint64_t now_us);

/*
 Reads pose and calibration of a running robot.

 @param robot  an open robot
 @param state  gets the seven states, in metres, radians and dimensionless
 @return SONARFIX_OK; SONARFIX_ERROR_NOT_RUNNING; or an error of a pointer or the handle
 Threads: one at a time for the robot.
 */
sonarfix_status_t sonarfix_robot_state(const sonarfix_robot_t *robot, sonarfix_state_t *state);

/*
 Reads the standard deviations of pose and calibration of a running robot.

 @param robot  an open robot
 @param deviations  gets the standard deviation of each of the seven states, in its unit
 @return SONARFIX_OK; SONARFIX_ERROR_NOT_RUNNING; or an error of a pointer or the handle
 Threads: one at a time for the robot.
 */
sonarfix_status_t sonarfix_robot_deviations(const sonarfix_robot_t *robot, sonarfix_state_t *deviations);

/*
 Reads the covariance of the seven states of a running robot.

 @param robot  an open robot
 @param covariance  gets the upper triangle; sonarfix_covariance_t has order and units
 @return SONARFIX_OK; SONARFIX_ERROR_NOT_RUNNING; or an error of a pointer or the handle
 Threads: one at a time for the robot.
 */
sonarfix_status_t sonarfix_robot_covariance(const sonarfix_robot_t *robot, sonarfix_covariance_t *covariance);

/*
 Reads the verdict of a running robot and the numbers behind it.

 @param robot  an open robot
 @param health  gets the verdict, with metres, radians and microseconds
 @return SONARFIX_OK; SONARFIX_ERROR_NOT_RUNNING; or an error of a pointer or the handle
 Threads: one at a time for the robot.
 */
sonarfix_status_t sonarfix_robot_health(const sonarfix_robot_t *robot, sonarfix_health_t *health);

/*
 Reads what of the configuration of a running robot is probably wrong.

 @param robot  an open robot
 @param mismatch  gets what is wrong, or SONARFIX_MISMATCH_NONE
 @return SONARFIX_OK; SONARFIX_ERROR_NOT_RUNNING; or an error of a pointer or the handle
 Threads: one at a time for the robot.
 */
sonarfix_status_t sonarfix_robot_mismatch(const sonarfix_robot_t *robot, sonarfix_mismatch_t *mismatch);

/*
 Reads the counts of faults, running or not.

 @param robot  an open robot
 @param faults  gets the counts since it was opened
 @return SONARFIX_OK, or an error of a pointer or the handle
 Threads: one at a time for the robot.
 */
sonarfix_status_t sonarfix_robot_faults(const sonarfix_robot_t *robot, sonarfix_faults_t *faults);

/*
 Opens a search. It works for the localizer to which it is attached.

 @param search  memory for the search
 @return SONARFIX_OK, or an error of the pointer
 Threads: one at a time for the search.
 */
sonarfix_status_t sonarfix_search_init(sonarfix_search_t *search);

/*
 Closes a search. A localizer to which it is attached refuses calls that need it: attach another one first.

 @param search  an open search
 @return SONARFIX_OK, or an error of the pointer or the handle
 Threads: one at a time for the search and its localizer.
 */
sonarfix_status_t sonarfix_search_close(sonarfix_search_t *search);

/*
 Reads what a search has found in its last complete cycle.

 @param search  an open search
 @param answer  gets the answer, with metres
 @return SONARFIX_OK, or an error of a pointer or the handle
 Threads: one at a time for the search and its localizer.
 */
sonarfix_status_t sonarfix_search_answer(const sonarfix_search_t *search, sonarfix_answer_t *answer);

/*
 Reads a hypothesis of a search.

 @param search  an open search
 @param rank  0 for the best
 @param hypothesis  gets the pose in the map frame, metres and radians
 @return SONARFIX_OK; SONARFIX_ERROR_NO_HYPOTHESIS if there are not so many; or an error of a pointer or the handle
 Threads: one at a time for the search and its localizer.
 */
sonarfix_status_t sonarfix_search_hypothesis(const sonarfix_search_t *search,
                                             uint32_t rank,
                                             sonarfix_hypothesis_t *hypothesis);

/*
 The start of a robot that does not know where it is: the deviations of an unknown pose.

 @param start  gets the pose (0, 0, 0) with deviations of metres and radians by which no wall can be measured
 @return SONARFIX_OK, or an error of the pointer
 Threads: any number at a time.
 */
sonarfix_status_t sonarfix_start_unknown(sonarfix_start_t *start);

/*
 The text of a status in English, for messages.

 A program that does not call this function does not link the texts.

 @param status  a sonarfix_status_t; any other number gets a text of its own
 @return a text that ends with zero and always exists
 Threads: any number at a time.
 */
const char *sonarfix_status_text(int32_t status);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* SONARFIX_H */

#ifndef SONARFIX_SIZES
#define SONARFIX_SIZES
#ifdef __cplusplus
#define SONARFIX_STATIC_ASSERT static_assert
#else
#define SONARFIX_STATIC_ASSERT _Static_assert
#endif

/* Sizes of the handles, bytes. */
#define SONARFIX_MAP_SIZE (8 * SONARFIX_MAP_WORDS)
#define SONARFIX_LOCALIZER_SIZE (8 * SONARFIX_LOCALIZER_WORDS)
#define SONARFIX_SEARCH_SIZE (8 * SONARFIX_SEARCH_WORDS)
#define SONARFIX_ROBOT_SIZE (8 * SONARFIX_ROBOT_WORDS)

SONARFIX_STATIC_ASSERT(sizeof(float) == 4, "floats are those of IEEE 754");
SONARFIX_STATIC_ASSERT(sizeof(sonarfix_wall_t) == SONARFIX_WALL_SIZE, "size of a wall");
SONARFIX_STATIC_ASSERT(sizeof(sonarfix_map_t) == SONARFIX_MAP_SIZE, "size of a map");
SONARFIX_STATIC_ASSERT(sizeof(sonarfix_localizer_t) == SONARFIX_LOCALIZER_SIZE, "size of a localizer");
SONARFIX_STATIC_ASSERT(sizeof(sonarfix_search_t) == SONARFIX_SEARCH_SIZE, "size of a search");
SONARFIX_STATIC_ASSERT(sizeof(sonarfix_robot_t) == SONARFIX_ROBOT_SIZE, "size of a robot");
#endif /* SONARFIX_SIZES */
