//! Outcomes of a measurement.

use crate::filter::ekf::EkfError;
use crate::sensor::range::Innovation;

/// Outcome of a measurement: what the localizer did with a range.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[must_use]
#[non_exhaustive]
pub enum Fix {
    /// The echo is probably the wall's: state and covariance are corrected.
    Accepted(Innovation),
    /// The echo may be the wall's or clutter: state and covariance are corrected by probabilistic data
    /// association.
    Downweighted(Innovation),
    /// The echo is clutter: the range is not used. The filter is unchanged, except that the covariance
    /// of the pose may be inflated while the verdict is [`Lost`](crate::health::Verdict::Lost)
    /// ([`Health::inflations`](crate::health::Health::inflations)).
    Gated(Innovation),
    /// Not comparable with an expected range: the filter is unchanged.
    Refused(Refusal),
}

impl Fix {
    /// The innovation of a range that has corrected the estimate, otherwise `None`.
    #[must_use]
    pub fn innovation_used(&self) -> Option<Innovation> {
        match *self {
            Self::Accepted(innovation) | Self::Downweighted(innovation) => Some(innovation),
            Self::Gated(_) | Self::Refused(_) => None,
        }
    }
}

/// Reason for which a range is not compared with an expected one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Refusal {
    /// The range is NaN or infinite.
    NotFinite,
    /// There was no echo.
    NoEcho,
    /// The range, or the expected one, is outside the limits of the sonar.
    OutOfRange,
    /// The foot of the perpendicular may be off the wall.
    FootOffWall,
    /// The beam is not square to the wall, or the heading is too uncertain to decide.
    NotSquare,
    /// The map has no such wall.
    UnknownWall,
    /// The filter refused the correction.
    Filter(EkfError),
    /// The robot has no such ranger.
    UnknownRanger,
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "the range is not finite",
            Self::NoEcho => "no echo",
            Self::OutOfRange => "out of the sonar's range",
            Self::FootOffWall => "the foot of the perpendicular may be off the wall",
            Self::NotSquare => "the beam is not square to the wall",
            Self::UnknownWall => "the map has no such wall",
            Self::UnknownRanger => "the robot has no such ranger",
            Self::Filter(error) => return write!(f, "the filter refused the range: {error}"),
        })
    }
}

/// How an absolute measurement agrees with the estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Agreement {
    /// Normalized innovation squared νᵀ S⁻¹ ν, dimensionless.
    pub nis: f32,
    /// Its mean if the filter is consistent: how many numbers were measured, 1 to 3.
    pub dimensions: u8,
}

/// Outcome of an absolute measurement: what the localizer did with it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[must_use]
#[non_exhaustive]
pub enum AbsoluteFix {
    /// Probably no outlier: state and covariance are corrected.
    Accepted(Agreement),
    /// Possibly an outlier: state and covariance are corrected by probabilistic data association.
    Downweighted(Agreement),
    /// An outlier: not used. The filter is unchanged, except for the inflation of a lost one ([`Fix::Gated`]).
    Gated(Agreement),
    /// Not comparable with the estimate: nothing has changed.
    Refused(AbsoluteRefusal),
}

impl AbsoluteFix {
    /// Whether the measurement has corrected the estimate.
    #[must_use]
    pub fn is_used(&self) -> bool {
        matches!(self, Self::Accepted(_) | Self::Downweighted(_))
    }
}

/// Reason for which an absolute measurement is not compared with the estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum AbsoluteRefusal {
    /// A number is NaN or infinite.
    NotFinite,
    /// The covariance of the noise is not positive definite, or a deviation is not positive.
    NotPositiveDefinite,
    /// It was measured before the latest step of the odometry.
    BeforeLastStep,
    /// It was measured after the latest step of the odometry: pass the wheel travel first.
    AfterLastStep,
    /// The pose is unknown: set it, or wait for the search.
    NoPose,
    /// The filter refused the correction.
    Filter(EkfError),
    /// This program was built without the feature `absolute`.
    NotLinked,
}

impl core::fmt::Display for AbsoluteRefusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "a number is not finite",
            Self::NotPositiveDefinite => "the covariance of the noise is not positive definite",
            Self::BeforeLastStep => "measured before the latest step of the odometry",
            Self::AfterLastStep => "measured after the latest step of the odometry",
            Self::NoPose => "the pose is unknown",
            Self::Filter(error) => {
                return write!(f, "the filter refused the measurement: {error}");
            }
            Self::NotLinked => "this program was built without `absolute`",
        })
    }
}
