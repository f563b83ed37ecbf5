//! What a replay stumbles over, and what it cannot get over.

use std::fmt;
use std::io;

use sonarfix::localizer::{OdometryError, StartError};

use crate::replay::log::Malformed;

/// Why a line was skipped.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// It could not be read.
    #[error(transparent)]
    Malformed(#[from] Malformed),
    /// The encoders were polled before they had anything new to say.
    #[error("stale: the time is that of the record before")]
    Stale,
    /// It comes after a record that is later.
    #[error("the time goes back")]
    TimeWentBack,
    /// A wheel cannot roll that fast.
    #[error("a wheel rolled faster than max_wheel_speed")]
    TooFast,
    /// A log has one start.
    #[error("the log has a start record already")]
    SecondStart,
    /// A log tells its wheels in one way.
    #[error("the log has both ticks and wheels")]
    BothEncoders,
    /// There is no memory for what waits for the encoders.
    #[error("too many ranges since the last encoder record")]
    TooManyRanges,
    /// The localizer refused the wheels' travel.
    #[error("the localizer refuses the wheels' travel: {0}")]
    Odometry(#[from] OdometryError),
}

/// Which file a line is of.
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

/// A line that was skipped, and why.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{source_file} line {line}: {fault}")]
pub struct Complaint {
    /// The file.
    pub source_file: Source,
    /// The line, from 1.
    pub line: u64,
    /// Why.
    pub fault: Fault,
}

/// A replay that could not go on.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// A file cannot be read further.
    #[error("the {0} cannot be read: {1}")]
    Read(Source, io::Error),
    /// The file is something else.
    #[error("the {0} must start with the line `{1}`")]
    Header(Source, &'static str),
    /// Nobody said where the robot was.
    #[error("the log has no start record with an encoder record after it")]
    NoStart,
    /// The counts have no length.
    #[error("the log counts ticks, but the robot file has no drive.travel_per_tick")]
    NoTravelPerTick,
    /// The localizer could not be made.
    #[error("the localizer refuses to start: {0}")]
    Start(#[from] StartError),
    /// A line was wrong, and none may be.
    #[error(transparent)]
    Strict(#[from] Complaint),
}
