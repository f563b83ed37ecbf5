//! Errors of a replay: skipped lines, and errors that end it.

use std::fmt;
use std::io;

use sonarfix::filter::ekf::EkfError;
use sonarfix::localizer::{OdometryError, StartError};

use crate::log::Malformed;

/// Why a line was skipped.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// It cannot be parsed.
    #[error(transparent)]
    Malformed(#[from] Malformed),
    /// The encoders were polled before a new reading.
    #[error("the time is that of the previous record")]
    Stale,
    /// It is earlier than a previous record.
    #[error("the time goes back")]
    TimeWentBack,
    /// A wheel cannot roll that fast.
    #[error("a wheel rolled faster than max_wheel_speed")]
    TooFast,
    /// A log has one start.
    #[error("the log has a start record already")]
    SecondStart,
    /// A log has one kind of encoder record.
    #[error("the log has both ticks and wheels")]
    BothEncoders,
    /// Too many ranges wait for an encoder record.
    #[error("too many ranges since the last encoder record")]
    TooManyRanges,
    /// The localizer rejects a pose.
    #[error("the localizer rejects the pose: {0}")]
    Pose(#[from] EkfError),
    /// The localizer rejects the travel.
    #[error("the localizer rejects the travel of the wheels: {0}")]
    Odometry(#[from] OdometryError),
}

/// The file of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The log.
    Log,
    /// The reference.
    Reference,
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Log => "log",
            Self::Reference => "reference",
        })
    }
}

/// A skipped line, with the reason.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{source_file} line {line}: {fault}")]
pub struct Complaint {
    /// The file.
    pub source_file: Source,
    /// The line, from 1.
    pub line: u64,
    /// The reason.
    pub fault: Fault,
}

/// Why a replay failed.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// A file cannot be read.
    #[error("the {0} cannot be read: {1}")]
    Read(Source, io::Error),
    /// The file has another format.
    #[error("the {0} must start with the line `{1}`")]
    Header(Source, &'static str),
    /// There is no initial estimate.
    #[error("the log has no start record with an encoder record after it")]
    NoStart,
    /// The localizer rejects its start.
    #[error("the localizer rejects its start: {0}")]
    Start(#[from] StartError),
    /// A line is malformed, in strict mode.
    #[error(transparent)]
    Strict(#[from] Complaint),
}
