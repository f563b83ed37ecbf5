//! The results of calls.

#![expect(unsafe_code, reason = "exports a function to C")]

use core::ffi::{CStr, c_char};

use sonarfix::aim::NoAim;
use sonarfix::config::ConfigError;
use sonarfix::filter::ekf::EkfError;
use sonarfix::localizer::{OdometryError, StartError};
use sonarfix::map::{MapError, WallError};
use sonarfix_hal::config::RobotConfigError;
use sonarfix_link::baked::BakedError;

/// The result of a call. After an error nothing has changed, and no result was written.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum sonarfix_status_t {
    /// The call was executed.
    SONARFIX_OK = 0,
    /// A pointer is NULL.
    SONARFIX_ERROR_NULL = 1,
    /// A pointer is not aligned for its type.
    SONARFIX_ERROR_MISALIGNED = 2,
    /// The handle was never initialised, was closed, or is a copy of another one.
    SONARFIX_ERROR_NOT_OPEN = 3,
    /// A number is NaN or infinite.
    SONARFIX_ERROR_NOT_FINITE = 4,
    /// A time is later than SONARFIX_TIME_MAX_US.
    SONARFIX_ERROR_TIME = 5,
    /// An argument is no value of its enumeration, or a count is too large.
    SONARFIX_ERROR_VALUE = 6,
    /// An array is longer than the address space.
    SONARFIX_ERROR_LENGTH = 7,
    /// The library was built without the part that this needs.
    SONARFIX_ERROR_NOT_LINKED = 8,
    /// The configuration breaks a rule: sonarfix_config_check names the field.
    SONARFIX_ERROR_CONFIG = 9,
    /// A wall is shorter than 0.1 mm.
    SONARFIX_ERROR_WALL_TOO_SHORT = 10,
    /// The program computes other bits than this library: compile with -ffp-contract=off and without -ffast-math, and link the
    /// floating point of the compiler.
    SONARFIX_ERROR_ARITHMETIC = 11,

    /// The bytes are no baked map.
    SONARFIX_ERROR_MAP_MISSING = 20,
    /// The baked map has a format that this library does not read: bake it again.
    SONARFIX_ERROR_MAP_VERSION = 21,
    /// The baked map is damaged or cut off.
    SONARFIX_ERROR_MAP_CHECKSUM = 22,
    /// The length of the baked map is not that of its header.
    SONARFIX_ERROR_MAP_LENGTH = 23,
    /// The header of the baked map describes no valid grid.
    SONARFIX_ERROR_MAP_GRID = 24,
    /// A wall of the baked map is degenerate or outside its grid.
    SONARFIX_ERROR_MAP_WALL = 25,
    /// The index of the baked map does not belong to its walls.
    SONARFIX_ERROR_MAP_INDEX = 26,

    /// The bytes are no baked configuration.
    SONARFIX_ERROR_IMAGE_MISSING = 30,
    /// The baked configuration has a version that this library does not read: bake it again.
    SONARFIX_ERROR_IMAGE_VERSION = 31,
    /// The baked configuration is cut off.
    SONARFIX_ERROR_IMAGE_CUT = 32,
    /// The baked configuration is damaged.
    SONARFIX_ERROR_IMAGE_CHECKSUM = 33,
    /// The baked configuration is intact, but its bytes are not those of one.
    SONARFIX_ERROR_IMAGE_LAYOUT = 34,

    /// The time of the odometry is before that of an earlier call.
    SONARFIX_ERROR_TIME_RAN_BACKWARDS = 40,
    /// A wheel moved although no time has passed.
    SONARFIX_ERROR_NO_TIME_PASSED = 41,
    /// A wheel moved faster than the configured maximum speed.
    SONARFIX_ERROR_TOO_FAST = 42,

    /// A variance or a standard deviation is negative.
    SONARFIX_ERROR_NEGATIVE_VARIANCE = 50,
    /// A variance would become negative.
    SONARFIX_ERROR_INDEFINITE = 51,
    /// The noise variance of a range is zero.
    SONARFIX_ERROR_ZERO_NOISE = 52,
    /// The turn of one step is larger than 64 rad.
    SONARFIX_ERROR_TURN_TOO_LARGE = 53,
    /// The innovation is larger than 1,000 km.
    SONARFIX_ERROR_INNOVATION_TOO_LARGE = 54,
    /// The noise variance of a range is larger than 1 km^2.
    SONARFIX_ERROR_NOISE_TOO_LARGE = 55,
    /// The derivatives of a range are NaN or larger than 1,000.
    SONARFIX_ERROR_JACOBIAN_TOO_LARGE = 56,
    /// A variance would exceed (1,000 km)^2.
    SONARFIX_ERROR_VARIANCE_TOO_LARGE = 57,

    /// No wall can be measured from here: call sonarfix_localizer_skip.
    SONARFIX_ERROR_NO_WALL = 60,
    /// No search is attached to the localizer.
    SONARFIX_ERROR_NO_SEARCH = 61,
    /// The search has no such hypothesis.
    SONARFIX_ERROR_NO_HYPOTHESIS = 62,

    /// The robot's loop does not run: start it first.
    SONARFIX_ERROR_NOT_RUNNING = 70,
    /// An earlier command, or an earlier measurement of this kind, waits for its poll.
    SONARFIX_ERROR_OCCUPIED = 71,
    /// The drivers do not support the robot: a servo, or an encoder that is too fast for its period.
    SONARFIX_ERROR_UNSUPPORTED = 72,

    /// Another error, of a newer core.
    SONARFIX_ERROR_OTHER = 99,
}

use sonarfix_status_t::*;

/// A result, or what the C program gets instead.
pub(crate) type Result<T> = core::result::Result<T, sonarfix_status_t>;

/// The status of a call that has no other result.
pub(crate) fn status_of(result: Result<()>) -> sonarfix_status_t {
    result.map_or_else(|error| error, |()| SONARFIX_OK)
}

/// The text of a status in English, for messages.
///
/// A program that does not call this function does not link the texts.
///
/// @param status  a sonarfix_status_t; any other number gets a text of its own
/// @return a text that ends with zero and always exists
/// Threads: any number at a time.
#[unsafe(no_mangle)]
pub extern "C" fn sonarfix_status_text(status: i32) -> *const c_char {
    text(status).as_ptr()
}

const fn is(status: i32, code: sonarfix_status_t) -> bool {
    status == code as i32
}

fn text(status: i32) -> &'static CStr {
    TEXTS.iter().find(|(code, _)| is(status, *code)).map_or(c"unknown status", |(_, text)| text)
}

const TEXTS: [(sonarfix_status_t, &CStr); 42] = [
    (SONARFIX_OK, c"no error"),
    (SONARFIX_ERROR_NULL, c"a pointer is NULL"),
    (SONARFIX_ERROR_MISALIGNED, c"a pointer is not aligned for its type"),
    (SONARFIX_ERROR_NOT_OPEN, c"the handle was not initialised, was closed, or is a copy"),
    (SONARFIX_ERROR_NOT_FINITE, c"a number is NaN or infinite"),
    (SONARFIX_ERROR_TIME, c"a time is too late"),
    (SONARFIX_ERROR_VALUE, c"an argument is no value of its enumeration, or too large"),
    (SONARFIX_ERROR_LENGTH, c"an array is longer than the address space"),
    (SONARFIX_ERROR_NOT_LINKED, c"the library was built without a part that this needs"),
    (SONARFIX_ERROR_CONFIG, c"the configuration breaks a rule"),
    (SONARFIX_ERROR_WALL_TOO_SHORT, c"a wall is shorter than 0.1 mm"),
    (
        SONARFIX_ERROR_ARITHMETIC,
        c"the program computes other bits than the library: compile with -ffp-contract=off",
    ),
    (SONARFIX_ERROR_MAP_MISSING, c"the bytes are no baked map"),
    (SONARFIX_ERROR_MAP_VERSION, c"the baked map has another format"),
    (SONARFIX_ERROR_MAP_CHECKSUM, c"the baked map is damaged or cut off"),
    (SONARFIX_ERROR_MAP_LENGTH, c"the length of the baked map is not that of its header"),
    (SONARFIX_ERROR_MAP_GRID, c"the baked map has no valid grid"),
    (SONARFIX_ERROR_MAP_WALL, c"a wall of the baked map is degenerate or outside its grid"),
    (SONARFIX_ERROR_MAP_INDEX, c"the index of the baked map does not belong to its walls"),
    (SONARFIX_ERROR_IMAGE_MISSING, c"the bytes are no baked configuration"),
    (SONARFIX_ERROR_IMAGE_VERSION, c"the baked configuration has another version"),
    (SONARFIX_ERROR_IMAGE_CUT, c"the baked configuration is cut off"),
    (SONARFIX_ERROR_IMAGE_CHECKSUM, c"the baked configuration is damaged"),
    (SONARFIX_ERROR_IMAGE_LAYOUT, c"the baked configuration cannot be decoded"),
    (SONARFIX_ERROR_TIME_RAN_BACKWARDS, c"the time is before that of an earlier call"),
    (SONARFIX_ERROR_NO_TIME_PASSED, c"a wheel moved although no time has passed"),
    (SONARFIX_ERROR_TOO_FAST, c"a wheel moved faster than the maximum wheel speed"),
    (SONARFIX_ERROR_NEGATIVE_VARIANCE, c"a variance or a standard deviation is negative"),
    (SONARFIX_ERROR_INDEFINITE, c"a variance would become negative"),
    (SONARFIX_ERROR_ZERO_NOISE, c"the noise variance of a range is zero"),
    (SONARFIX_ERROR_TURN_TOO_LARGE, c"the turn of one step is larger than 64 rad"),
    (SONARFIX_ERROR_INNOVATION_TOO_LARGE, c"the innovation is larger than 1,000 km"),
    (SONARFIX_ERROR_NOISE_TOO_LARGE, c"the noise variance of a range is larger than 1 km^2"),
    (SONARFIX_ERROR_JACOBIAN_TOO_LARGE, c"the derivatives of a range are not finite or too large"),
    (SONARFIX_ERROR_VARIANCE_TOO_LARGE, c"a variance would exceed (1,000 km)^2"),
    (SONARFIX_ERROR_NO_WALL, c"no wall can be measured from here"),
    (SONARFIX_ERROR_NO_SEARCH, c"no search is attached to the localizer"),
    (SONARFIX_ERROR_NO_HYPOTHESIS, c"the search has no such hypothesis"),
    (SONARFIX_ERROR_NOT_RUNNING, c"the robot's loop does not run"),
    (SONARFIX_ERROR_OCCUPIED, c"an earlier command or measurement waits for its poll"),
    (SONARFIX_ERROR_UNSUPPORTED, c"the drivers do not support the robot"),
    (SONARFIX_ERROR_OTHER, c"another error"),
];

impl From<EkfError> for sonarfix_status_t {
    fn from(error: EkfError) -> Self {
        match error {
            EkfError::NotFinite => SONARFIX_ERROR_NOT_FINITE,
            EkfError::NegativeVariance => SONARFIX_ERROR_NEGATIVE_VARIANCE,
            EkfError::Indefinite => SONARFIX_ERROR_INDEFINITE,
            EkfError::ZeroNoise => SONARFIX_ERROR_ZERO_NOISE,
            EkfError::TurnTooLarge => SONARFIX_ERROR_TURN_TOO_LARGE,
            EkfError::InnovationTooLarge => SONARFIX_ERROR_INNOVATION_TOO_LARGE,
            EkfError::NoiseTooLarge => SONARFIX_ERROR_NOISE_TOO_LARGE,
            EkfError::JacobianTooLarge => SONARFIX_ERROR_JACOBIAN_TOO_LARGE,
            EkfError::VarianceTooLarge => SONARFIX_ERROR_VARIANCE_TOO_LARGE,
            _ => SONARFIX_ERROR_OTHER,
        }
    }
}

impl From<OdometryError> for sonarfix_status_t {
    fn from(error: OdometryError) -> Self {
        match error {
            OdometryError::TimeRanBackwards => SONARFIX_ERROR_TIME_RAN_BACKWARDS,
            OdometryError::NoTimePassed => SONARFIX_ERROR_NO_TIME_PASSED,
            OdometryError::TooFast => SONARFIX_ERROR_TOO_FAST,
            OdometryError::Filter(error) => error.into(),
            _ => SONARFIX_ERROR_OTHER,
        }
    }
}

impl From<StartError> for sonarfix_status_t {
    fn from(error: StartError) -> Self {
        match error {
            StartError::Config(_) => SONARFIX_ERROR_CONFIG,
            StartError::Start(error) => error.into(),
            _ => SONARFIX_ERROR_OTHER,
        }
    }
}

impl From<ConfigError> for sonarfix_status_t {
    fn from(_: ConfigError) -> Self {
        SONARFIX_ERROR_CONFIG
    }
}

impl From<RobotConfigError> for sonarfix_status_t {
    fn from(_: RobotConfigError) -> Self {
        SONARFIX_ERROR_CONFIG
    }
}

impl From<NoAim> for sonarfix_status_t {
    fn from(reason: NoAim) -> Self {
        match reason {
            NoAim::NoWall => SONARFIX_ERROR_NO_WALL,
            _ => SONARFIX_ERROR_OTHER,
        }
    }
}

impl From<WallError> for sonarfix_status_t {
    fn from(error: WallError) -> Self {
        match error {
            WallError::NotFinite => SONARFIX_ERROR_NOT_FINITE,
            WallError::ZeroLength => SONARFIX_ERROR_WALL_TOO_SHORT,
            _ => SONARFIX_ERROR_OTHER,
        }
    }
}

impl From<MapError> for sonarfix_status_t {
    fn from(error: MapError) -> Self {
        match error {
            MapError::NotAMap => SONARFIX_ERROR_MAP_MISSING,
            MapError::Version(_) => SONARFIX_ERROR_MAP_VERSION,
            MapError::Checksum => SONARFIX_ERROR_MAP_CHECKSUM,
            MapError::Length => SONARFIX_ERROR_MAP_LENGTH,
            MapError::Grid => SONARFIX_ERROR_MAP_GRID,
            MapError::Wall(_) => SONARFIX_ERROR_MAP_WALL,
            MapError::Index => SONARFIX_ERROR_MAP_INDEX,
            _ => SONARFIX_ERROR_OTHER,
        }
    }
}

impl From<BakedError> for sonarfix_status_t {
    fn from(error: BakedError) -> Self {
        match error {
            BakedError::Missing => SONARFIX_ERROR_IMAGE_MISSING,
            BakedError::Version(_) => SONARFIX_ERROR_IMAGE_VERSION,
            BakedError::Cut => SONARFIX_ERROR_IMAGE_CUT,
            BakedError::Checksum => SONARFIX_ERROR_IMAGE_CHECKSUM,
            BakedError::Layout => SONARFIX_ERROR_IMAGE_LAYOUT,
            BakedError::Rule(error) => error.into(),
            BakedError::NotLinked(_) => SONARFIX_ERROR_NOT_LINKED,
            _ => SONARFIX_ERROR_OTHER,
        }
    }
}
