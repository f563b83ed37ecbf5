//! Measurements and their outcomes.

use sonarfix::filter::ekf::EkfError;
use sonarfix::geometry::pose::{Point, Pose};
use sonarfix::geometry::units::Radians;
use sonarfix::localizer::{AbsoluteFix, AbsoluteRefusal, Fix, Refusal};
use sonarfix::sensor::absolute::{AbsoluteMeasurement, PoseNoise, PositionNoise};

use crate::state::{finite, sonarfix_pose_t};
use crate::status::{Result, sonarfix_status_t};

/// What the localizer did with a measurement.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum sonarfix_outcome_t {
    /// It agrees: state and covariance are corrected.
    SONARFIX_OUTCOME_ACCEPTED = 0,
    /// It may be clutter: state and covariance are corrected with less weight.
    SONARFIX_OUTCOME_DOWNWEIGHTED = 1,
    /// It is clutter or an outlier: not used. The covariance of a lost robot may be inflated.
    SONARFIX_OUTCOME_GATED = 2,
    /// It cannot be compared with the estimate, for the reason of sonarfix_refusal_t: the filter is unchanged.
    SONARFIX_OUTCOME_REFUSED = 3,
    /// The pose is unknown: the search took the ping.
    SONARFIX_OUTCOME_SEARCHED = 4,
    /// The pose is unknown: the search took the ping, which is like an earlier one and tells nothing new.
    SONARFIX_OUTCOME_NOT_NOVEL = 5,
    /// Another outcome, of a newer core.
    SONARFIX_OUTCOME_OTHER = 6,
}

use sonarfix_outcome_t::*;

/// Reason for which a measurement is not compared with the estimate.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum sonarfix_refusal_t {
    /// It was not refused.
    SONARFIX_REFUSAL_NONE = 0,
    /// A number is NaN or infinite.
    SONARFIX_REFUSAL_NOT_FINITE = 1,
    /// There was no echo.
    SONARFIX_REFUSAL_NO_ECHO = 2,
    /// The range, or the expected one, is outside the limits of the ranger.
    SONARFIX_REFUSAL_OUT_OF_RANGE = 3,
    /// The foot of the perpendicular may be off the wall.
    SONARFIX_REFUSAL_FOOT_OFF_WALL = 4,
    /// The beam is not square to the wall, or the heading is too uncertain to decide.
    SONARFIX_REFUSAL_NOT_SQUARE = 5,
    /// The map has no such wall.
    SONARFIX_REFUSAL_UNKNOWN_WALL = 6,
    /// The filter refused the correction: filter_error.
    SONARFIX_REFUSAL_FILTER = 7,
    /// The robot has no such ranger.
    SONARFIX_REFUSAL_UNKNOWN_RANGER = 8,
    /// The covariance of the noise is not positive definite, or a deviation is not positive.
    SONARFIX_REFUSAL_NOT_POSITIVE_DEFINITE = 9,
    /// It was measured before the latest step of the odometry.
    SONARFIX_REFUSAL_BEFORE_LAST_STEP = 10,
    /// It was measured after the latest step of the odometry: pass the wheel travel first.
    SONARFIX_REFUSAL_AFTER_LAST_STEP = 11,
    /// The pose is unknown: set it, or wait for the search.
    SONARFIX_REFUSAL_NO_POSE = 12,
    /// The library was built without the part that this needs.
    SONARFIX_REFUSAL_NOT_LINKED = 13,
    /// Another reason, of a newer core.
    SONARFIX_REFUSAL_OTHER = 14,
}

use sonarfix_refusal_t::*;

/// The outcome of a ping.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_fix_t {
    /// What the localizer did with it.
    pub outcome: sonarfix_outcome_t,
    /// Why it was refused, if it was.
    pub refusal: sonarfix_refusal_t,
    /// Why the filter refused it, if it did; otherwise SONARFIX_OK.
    pub filter_error: sonarfix_status_t,
    /// Innovation: the range less the expected one, metres; zero if it was refused or searched.
    pub innovation_m: f32,
    /// Variance of the innovation, square metres; zero if it was refused or searched.
    pub variance_m2: f32,
}

impl sonarfix_fix_t {
    pub(crate) fn of(outcome: sonarfix_outcome_t) -> Self {
        Self {
            outcome,
            refusal: SONARFIX_REFUSAL_NONE,
            filter_error: sonarfix_status_t::SONARFIX_OK,
            innovation_m: 0.0,
            variance_m2: 0.0,
        }
    }

    /// A ping that a search took.
    #[cfg(feature = "search")]
    pub(crate) fn searched(is_novel: bool) -> Self {
        Self::of(if is_novel { SONARFIX_OUTCOME_SEARCHED } else { SONARFIX_OUTCOME_NOT_NOVEL })
    }
}

impl From<Fix> for sonarfix_fix_t {
    fn from(fix: Fix) -> Self {
        let (outcome, innovation) = match fix {
            Fix::Accepted(innovation) => (SONARFIX_OUTCOME_ACCEPTED, innovation),
            Fix::Downweighted(innovation) => (SONARFIX_OUTCOME_DOWNWEIGHTED, innovation),
            Fix::Gated(innovation) => (SONARFIX_OUTCOME_GATED, innovation),
            Fix::Refused(refusal) => {
                let (refusal, filter_error) = refused(refusal);
                return Self { refusal, filter_error, ..Self::of(SONARFIX_OUTCOME_REFUSED) };
            }
            _ => return Self::of(SONARFIX_OUTCOME_OTHER),
        };
        let (innovation_m, variance_m2) = (innovation.value.0, innovation.variance.0);
        Self { innovation_m, variance_m2, ..Self::of(outcome) }
    }
}

fn refused(refusal: Refusal) -> (sonarfix_refusal_t, sonarfix_status_t) {
    let reason = match refusal {
        Refusal::NotFinite => SONARFIX_REFUSAL_NOT_FINITE,
        Refusal::NoEcho => SONARFIX_REFUSAL_NO_ECHO,
        Refusal::OutOfRange => SONARFIX_REFUSAL_OUT_OF_RANGE,
        Refusal::FootOffWall => SONARFIX_REFUSAL_FOOT_OFF_WALL,
        Refusal::NotSquare => SONARFIX_REFUSAL_NOT_SQUARE,
        Refusal::UnknownWall => SONARFIX_REFUSAL_UNKNOWN_WALL,
        Refusal::UnknownRanger => SONARFIX_REFUSAL_UNKNOWN_RANGER,
        Refusal::Filter(error) => return by_filter(error),
        _ => SONARFIX_REFUSAL_OTHER,
    };
    (reason, sonarfix_status_t::SONARFIX_OK)
}

fn by_filter(error: EkfError) -> (sonarfix_refusal_t, sonarfix_status_t) {
    (SONARFIX_REFUSAL_FILTER, error.into())
}

/// The outcome of an absolute measurement.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_absolute_fix_t {
    /// What the localizer did with it.
    pub outcome: sonarfix_outcome_t,
    /// Why it was refused, if it was.
    pub refusal: sonarfix_refusal_t,
    /// Why the filter refused it, if it did; otherwise SONARFIX_OK.
    pub filter_error: sonarfix_status_t,
    /// Normalized innovation squared; zero if it was refused.
    pub nis: f32,
    /// Its mean if the filter is consistent: how many numbers were measured, 1 to 3; zero if it was refused.
    pub dimensions: u32,
}

impl From<AbsoluteFix> for sonarfix_absolute_fix_t {
    fn from(fix: AbsoluteFix) -> Self {
        let mut result = Self {
            outcome: SONARFIX_OUTCOME_OTHER,
            refusal: SONARFIX_REFUSAL_NONE,
            filter_error: sonarfix_status_t::SONARFIX_OK,
            nis: 0.0,
            dimensions: 0,
        };
        let (outcome, agreement) = match fix {
            AbsoluteFix::Accepted(agreement) => (SONARFIX_OUTCOME_ACCEPTED, agreement),
            AbsoluteFix::Downweighted(agreement) => (SONARFIX_OUTCOME_DOWNWEIGHTED, agreement),
            AbsoluteFix::Gated(agreement) => (SONARFIX_OUTCOME_GATED, agreement),
            AbsoluteFix::Refused(refusal) => {
                result.outcome = SONARFIX_OUTCOME_REFUSED;
                (result.refusal, result.filter_error) = refused_absolute(refusal);
                return result;
            }
            _ => return result,
        };
        result.outcome = outcome;
        (result.nis, result.dimensions) = (agreement.nis, u32::from(agreement.dimensions));
        result
    }
}

fn refused_absolute(refusal: AbsoluteRefusal) -> (sonarfix_refusal_t, sonarfix_status_t) {
    let reason = match refusal {
        AbsoluteRefusal::NotFinite => SONARFIX_REFUSAL_NOT_FINITE,
        AbsoluteRefusal::NotPositiveDefinite => SONARFIX_REFUSAL_NOT_POSITIVE_DEFINITE,
        AbsoluteRefusal::BeforeLastStep => SONARFIX_REFUSAL_BEFORE_LAST_STEP,
        AbsoluteRefusal::AfterLastStep => SONARFIX_REFUSAL_AFTER_LAST_STEP,
        AbsoluteRefusal::NoPose => SONARFIX_REFUSAL_NO_POSE,
        AbsoluteRefusal::NotLinked => SONARFIX_REFUSAL_NOT_LINKED,
        AbsoluteRefusal::Filter(error) => return by_filter(error),
        _ => SONARFIX_REFUSAL_OTHER,
    };
    (reason, sonarfix_status_t::SONARFIX_OK)
}

/// The covariance of the noise of a measured pose in the map frame.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sonarfix_pose_noise_t {
    /// Variance of x, square metres.
    pub xx_m2: f32,
    /// Covariance of x and y, square metres.
    pub xy_m2: f32,
    /// Variance of y, square metres.
    pub yy_m2: f32,
    /// Covariance of x and the heading, metres times radians.
    pub xh_m_rad: f32,
    /// Covariance of y and the heading, metres times radians.
    pub yh_m_rad: f32,
    /// Variance of the heading, square radians.
    pub hh_rad2: f32,
}

impl sonarfix_pose_noise_t {
    fn position(self) -> PositionNoise {
        PositionNoise { xx: self.xx_m2, xy: self.xy_m2, yy: self.yy_m2 }
    }
}

/// A heading, of finite numbers.
pub(crate) fn heading(heading_rad: f32, deviation_rad: f32) -> Result<AbsoluteMeasurement> {
    let (angle, deviation) = (Radians(finite(heading_rad)?), Radians(finite(deviation_rad)?));
    Ok(AbsoluteMeasurement::Heading { angle, deviation })
}

/// A position, of finite numbers.
pub(crate) fn position(
    pose: sonarfix_pose_t,
    noise: sonarfix_pose_noise_t,
) -> Result<AbsoluteMeasurement> {
    for number in [pose.x_m, pose.y_m, noise.xx_m2, noise.xy_m2, noise.yy_m2] {
        finite(number)?;
    }
    let point = Point::new(pose.x_m, pose.y_m);
    Ok(AbsoluteMeasurement::Position { point, noise: noise.position() })
}

/// A pose, of finite numbers.
pub(crate) fn pose(
    pose: sonarfix_pose_t,
    noise: sonarfix_pose_noise_t,
) -> Result<AbsoluteMeasurement> {
    let sonarfix_pose_noise_t { xx_m2, xy_m2, yy_m2, xh_m_rad, yh_m_rad, hh_rad2 } = noise;
    let noises = [xx_m2, xy_m2, yy_m2, xh_m_rad, yh_m_rad, hh_rad2];
    for number in [pose.x_m, pose.y_m, pose.heading_rad].into_iter().chain(noises) {
        finite(number)?;
    }
    let position = noise.position();
    let noise = PoseNoise { position, xh: xh_m_rad, yh: yh_m_rad, hh: hh_rad2 };
    Ok(AbsoluteMeasurement::Pose { pose: Pose::from(pose), noise })
}
