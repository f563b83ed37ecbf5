//! Outcomes of a measurement.

use crate::ekf::EkfError;
use crate::range::Innovation;

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
            Self::Filter(error) => return write!(f, "the filter refused the range: {error}"),
        })
    }
}
