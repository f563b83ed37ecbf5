//! Poses, states, deviations and the health of the estimate.

#![expect(unsafe_code, reason = "exports a function to C")]

use sonarfix::filter::ekf::{STATES, StandardDeviations, StateEstimate};
use sonarfix::geometry::pose::Pose;
use sonarfix::geometry::units::{Instant, Metres, Radians};
use sonarfix::health::{Health, Mismatch, Verdict};
use sonarfix::localizer::{
    GyroStatus, Localizer, Mode, Start, TurnUse, UNKNOWN_HEADING, UNKNOWN_POSITION,
};
use sonarfix::sensor::gyro::TurnRefusal;

use crate::memory::give;
use crate::status::{Result, sonarfix_status_t};

/// The latest time that a function takes, microseconds: 2^62, 146,000 years.
pub const SONARFIX_TIME_MAX_US: u64 = 0x4000_0000_0000_0000;

/// A time of the caller's clock.
pub(crate) fn instant(us: u64) -> Result<Instant> {
    let is_near = us <= SONARFIX_TIME_MAX_US;
    is_near.then_some(Instant::from_ticks(us)).ok_or(sonarfix_status_t::SONARFIX_ERROR_TIME)
}

/// A number that is neither NaN nor infinite.
pub(crate) fn finite(number: f32) -> Result<f32> {
    let is_finite = number.is_finite();
    is_finite.then_some(number).ok_or(sonarfix_status_t::SONARFIX_ERROR_NOT_FINITE)
}

/// A duration as the microseconds of a header.
pub(crate) fn micros(duration: sonarfix::geometry::units::Duration) -> u32 {
    u32::try_from(duration.ticks()).unwrap_or(u32::MAX)
}

/// A pose in the map frame: x and y of the midpoint between the wheels, and the direction ahead.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_pose_t {
    /// Along map x, metres.
    pub x_m: f32,
    /// Along map y, metres.
    pub y_m: f32,
    /// Counter-clockwise from map x, radians, in (-pi, pi]; as an input, any angle.
    pub heading_rad: f32,
}

impl From<Pose> for sonarfix_pose_t {
    fn from(pose: Pose) -> Self {
        Self { x_m: pose.x.0, y_m: pose.y.0, heading_rad: pose.heading.radians().0 }
    }
}

impl From<sonarfix_pose_t> for Pose {
    fn from(pose: sonarfix_pose_t) -> Self {
        Self::new(pose.x_m, pose.y_m, Radians(pose.heading_rad))
    }
}

/// A pose with the standard deviations of its errors.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_start_t {
    /// The pose.
    pub pose: sonarfix_pose_t,
    /// Standard deviation of x and of y, metres.
    pub position_deviation_m: f32,
    /// Standard deviation of the heading, radians.
    pub heading_deviation_rad: f32,
}

impl From<sonarfix_start_t> for Start {
    fn from(start: sonarfix_start_t) -> Self {
        Self {
            pose: start.pose.into(),
            position_deviation: Metres(start.position_deviation_m),
            heading_deviation: Radians(start.heading_deviation_rad),
        }
    }
}

/// The start of a robot that does not know where it is: the deviations of an unknown pose.
///
/// @param start  gets the pose (0, 0, 0) with deviations of metres and radians by which no wall can be measured
/// @return SONARFIX_OK, or an error of the pointer
/// Threads: any number at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sonarfix_start_unknown(start: *mut sonarfix_start_t) -> sonarfix_status_t {
    let pose = sonarfix_pose_t { x_m: 0.0, y_m: 0.0, heading_rad: 0.0 };
    let unknown = sonarfix_start_t {
        pose,
        position_deviation_m: UNKNOWN_POSITION.0,
        heading_deviation_rad: UNKNOWN_HEADING.0,
    };
    // SAFETY: the contract of the crate.
    unsafe { give(start, || Ok(unknown)) }
}

/// The seven states of the filter, or the standard deviation of each.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_state_t {
    /// Position along map x, metres.
    pub x_m: f32,
    /// Position along map y, metres.
    pub y_m: f32,
    /// Heading, counter-clockwise from map x, radians.
    pub heading_rad: f32,
    /// Scale error of the right wheel: true travel is (1 + this) times the measured one.
    pub scale_right: f32,
    /// Scale error of the left wheel.
    pub scale_left: f32,
    /// Error of the track width, metres: to be added to the configured one.
    pub track_width_error_m: f32,
    /// Scale error of the ranger.
    pub range_scale: f32,
}

impl sonarfix_state_t {
    fn from_array(numbers: [f32; STATES]) -> Self {
        let [x_m, y_m, heading_rad, scale_right, scale_left, track_width_error_m, range_scale] =
            numbers;
        Self { x_m, y_m, heading_rad, scale_right, scale_left, track_width_error_m, range_scale }
    }

    fn to_array(self) -> [f32; STATES] {
        [
            self.x_m,
            self.y_m,
            self.heading_rad,
            self.scale_right,
            self.scale_left,
            self.track_width_error_m,
            self.range_scale,
        ]
    }
}

impl From<StateEstimate> for sonarfix_state_t {
    fn from(state: StateEstimate) -> Self {
        Self::from_array(state.to_array())
    }
}

impl From<StandardDeviations> for sonarfix_state_t {
    fn from(deviations: StandardDeviations) -> Self {
        Self::from_array(deviations.to_array())
    }
}

impl From<sonarfix_state_t> for StateEstimate {
    fn from(state: sonarfix_state_t) -> Self {
        Self::from_array(state.to_array())
    }
}

impl From<sonarfix_state_t> for StandardDeviations {
    fn from(state: sonarfix_state_t) -> Self {
        Self::from_array(state.to_array())
    }
}

/// Entries of the upper triangle of the covariance.
pub const SONARFIX_COVARIANCE_ENTRIES: usize = 28;

/// The covariance of the seven states, which is symmetric: its upper triangle, row by row.
///
/// Rows and columns are in the order of sonarfix_state_t. The entry of row r and column c, r <= c, has the index
/// 7 r - r (r - 1) / 2 + c - r, and the product of the units of both states.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_covariance_t {
    /// The entries.
    pub upper: [f32; SONARFIX_COVARIANCE_ENTRIES],
}

impl sonarfix_covariance_t {
    pub(crate) fn of(localizer: &Localizer) -> Self {
        let p = localizer.filter().covariance();
        let entries = (0..STATES).flat_map(|row| (row..STATES).map(move |column| (row, column)));
        let mut upper = [0.0; SONARFIX_COVARIANCE_ENTRIES];
        for (entry, at) in upper.iter_mut().zip(entries) {
            *entry = p.get(at).copied().unwrap_or(f32::NAN);
        }
        Self { upper }
    }
}

/// Verdict on the estimate.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum sonarfix_verdict_t {
    /// Ranges arrive and agree with the map.
    SONARFIX_VERDICT_TRACKING = 0,
    /// Ranges are missing or begin to disagree: the estimate depends on the encoders.
    SONARFIX_VERDICT_DEGRADED = 1,
    /// Ranges keep disagreeing, too few agree with an uncertain pose, or the path has led through a wall: the pose is probably wrong.
    SONARFIX_VERDICT_LOST = 2,
}

impl From<Verdict> for sonarfix_verdict_t {
    fn from(verdict: Verdict) -> Self {
        match verdict {
            Verdict::Tracking => Self::SONARFIX_VERDICT_TRACKING,
            Verdict::Degraded => Self::SONARFIX_VERDICT_DEGRADED,
            Verdict::Lost => Self::SONARFIX_VERDICT_LOST,
        }
    }
}

/// What of the robot's configuration is probably wrong.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum sonarfix_mismatch_t {
    /// Nothing, as far as the ranges tell by now.
    SONARFIX_MISMATCH_NONE = 0,
    /// The noise of wheels or ranges is larger than it says.
    SONARFIX_MISMATCH_NOISE_TOO_SMALL = 1,
    /// Diameters of the wheels or track width are farther from it than its deviations permit.
    SONARFIX_MISMATCH_WHEELS_OUTSIDE_PRIOR = 2,
    /// The same of the place of the first ranger in the robot.
    SONARFIX_MISMATCH_MOUNT_SUSPECT = 3,
    /// Another one, of a newer core.
    SONARFIX_MISMATCH_OTHER = 4,
}

impl From<Option<Mismatch>> for sonarfix_mismatch_t {
    fn from(mismatch: Option<Mismatch>) -> Self {
        match mismatch {
            None => Self::SONARFIX_MISMATCH_NONE,
            Some(Mismatch::NoiseTooSmall) => Self::SONARFIX_MISMATCH_NOISE_TOO_SMALL,
            Some(Mismatch::WheelsOutsidePrior) => Self::SONARFIX_MISMATCH_WHEELS_OUTSIDE_PRIOR,
            Some(Mismatch::MountSuspect) => Self::SONARFIX_MISMATCH_MOUNT_SUSPECT,
            Some(_) => Self::SONARFIX_MISMATCH_OTHER,
        }
    }
}

/// What determines the pose.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum sonarfix_mode_t {
    /// The localizer tracks it.
    SONARFIX_MODE_TRACKING = 0,
    /// It is unknown, and a search for it is running.
    SONARFIX_MODE_SEARCHING = 1,
    /// The localizer tracks a pose that a search has found, which is not confirmed yet.
    SONARFIX_MODE_PROVISIONAL = 2,
}

impl From<Mode> for sonarfix_mode_t {
    fn from(mode: Mode) -> Self {
        match mode {
            Mode::Tracking => Self::SONARFIX_MODE_TRACKING,
            Mode::Searching => Self::SONARFIX_MODE_SEARCHING,
            Mode::Provisional => Self::SONARFIX_MODE_PROVISIONAL,
        }
    }
}

/// The verdict and the numbers behind it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_health_t {
    /// Time since the last range used, microseconds.
    pub time_since_fix_us: u64,
    /// The verdict.
    pub verdict: sonarfix_verdict_t,
    /// Evidence against the pose, from 0 to 8.5, at which the verdict is Lost.
    pub evidence: f32,
    /// Mean of the normalized innovation squared over the latest ranges used: 1 if the filter is consistent.
    pub nis: f32,
    /// Distance travelled since the last range used, metres.
    pub rolled_since_fix_m: f32,
    /// Standard deviation of the position in its worst direction after the last ping, metres.
    pub position_deviation_m: f32,
    /// Standard deviation of the heading after the last ping, radians.
    pub heading_deviation_rad: f32,
    /// Ranges used since the last one that was not.
    pub accepted_in_a_row: u16,
    /// Ranges gated or down-weighted since the last one accepted.
    pub gated_in_a_row: u16,
    /// Pings without a usable range since the last one used or gated.
    pub silent_in_a_row: u16,
    /// Inflations of the covariance of a lost robot since the verdict was last Tracking.
    pub inflations: u16,
}

impl From<Health> for sonarfix_health_t {
    fn from(health: Health) -> Self {
        Self {
            time_since_fix_us: health.time_since_fix.ticks(),
            verdict: health.verdict.into(),
            evidence: health.evidence,
            nis: health.nis,
            rolled_since_fix_m: health.rolled_since_fix.0,
            position_deviation_m: health.position_deviation.0,
            heading_deviation_rad: health.heading_deviation.0,
            accepted_in_a_row: health.accepted_in_a_row,
            gated_in_a_row: health.gated_in_a_row,
            silent_in_a_row: health.silent_in_a_row,
            inflations: health.inflations,
        }
    }
}

/// What became of the latest turn of the gyro.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum sonarfix_turn_use_t {
    /// There was none: the wheels alone are used.
    SONARFIX_TURN_MISSING = 0,
    /// The wheels stand; it is collected.
    SONARFIX_TURN_STANDING = 1,
    /// It was combined with the turn of the wheels.
    SONARFIX_TURN_COMBINED = 2,
    /// A wheel slips: the turn is the gyro's.
    SONARFIX_TURN_WHEEL_SLIP = 3,
    /// It was refused: not finite.
    SONARFIX_TURN_NOT_FINITE = 4,
    /// It was refused: it does not cover the time of the step.
    SONARFIX_TURN_WRONG_DURATION = 5,
    /// It was refused: faster than the range of the gyro.
    SONARFIX_TURN_TOO_FAST = 6,
    /// Another use, of a newer core.
    SONARFIX_TURN_OTHER = 7,
}

impl From<TurnUse> for sonarfix_turn_use_t {
    fn from(used: TurnUse) -> Self {
        match used {
            TurnUse::Missing => Self::SONARFIX_TURN_MISSING,
            TurnUse::Standing => Self::SONARFIX_TURN_STANDING,
            TurnUse::Combined => Self::SONARFIX_TURN_COMBINED,
            TurnUse::WheelSlip => Self::SONARFIX_TURN_WHEEL_SLIP,
            TurnUse::Refused(TurnRefusal::NotFinite) => Self::SONARFIX_TURN_NOT_FINITE,
            TurnUse::Refused(TurnRefusal::WrongDuration) => Self::SONARFIX_TURN_WRONG_DURATION,
            TurnUse::Refused(TurnRefusal::TooFast) => Self::SONARFIX_TURN_TOO_FAST,
            _ => Self::SONARFIX_TURN_OTHER,
        }
    }
}

/// The gyro as the localizer sees it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_gyro_status_t {
    /// Estimated bias, radians per second, counter-clockwise.
    pub bias_rad_per_s: f32,
    /// Its standard deviation, radians per second.
    pub deviation_rad_per_s: f32,
    /// What became of the latest turn.
    pub latest: sonarfix_turn_use_t,
    /// Slips of the wheels since the start.
    pub slips: u32,
    /// How often wheels and gyro differed for so long that the gyro may be wrong.
    pub conflicts: u32,
}

impl From<GyroStatus> for sonarfix_gyro_status_t {
    fn from(status: GyroStatus) -> Self {
        Self {
            bias_rad_per_s: status.bias.0,
            deviation_rad_per_s: status.deviation.0,
            latest: status.latest.into(),
            slips: status.slips,
            conflicts: status.conflicts,
        }
    }
}
