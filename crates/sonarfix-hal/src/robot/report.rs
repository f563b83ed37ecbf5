//! What one poll of the loop did.

use sonarfix::aim::{Aim, NoAim};
use sonarfix::localizer::{Fix, OdometryError};
use sonarfix::motion::WheelTravel;
use sonarfix::units::{Duration, Instant};

use super::Faults;
use crate::ranger::Outcome;

/// What one poll did, in the order in which it happened.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub struct Report {
    /// A ping came to its end.
    pub heard: Option<Heard>,
    /// An encoder tick was done.
    pub tick: Option<Tick>,
    /// The localizer was asked where to look, and the servo sent there.
    pub aimed: Option<Result<Aim, NoAim>>,
    /// A ping was started. Its bearing is the servo's, which is the aim's only within the PWM's
    /// resolution.
    pub pinged: Option<Aim>,
    /// What went wrong in this poll.
    pub faults: Faults,
}

impl Report {
    /// Whether anything is to be told.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// A step of both wheels, told to the localizer.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Step {
    /// The time up to which the wheels rolled.
    pub at: Instant,
    /// How far, since the last step that was not [`Taken::Kept`].
    pub travel: WheelTravel,
    /// What became of it.
    pub taken: Taken,
}

/// What became of a step. No tick is ever lost in silence: what a step holds is either taken,
/// part of the next step, or written off here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Taken {
    /// The localizer took it.
    Yes,
    /// The localizer refused it, for a reason that is the loop's and not the wheels' (a whole
    /// tick in a time so short that it looks too fast). It comes again as part of the next step;
    /// a range that came with it met the pose before it, which is that much behind.
    Kept(OdometryError),
    /// The localizer refused it, and no wheel can have rolled so: it is given up.
    WrittenOff(OdometryError),
}

/// An encoder tick.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tick {
    /// The wheels' step; `None` if a counter could not be read (see [`Report::faults`]).
    pub step: Option<Step>,
    /// How long after it was due it was done.
    pub lateness: Duration,
    /// Whether it would have been done earlier, had the sonar not listened. It is late only by
    /// what went by since the poll before this.
    pub held: bool,
    /// Ticks that fell due after it and are not done, for this one covers them.
    pub skipped: u64,
}

/// The end of a ping.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Heard {
    /// What was looked at.
    pub aim: Aim,
    /// The echo, or why there is none.
    pub outcome: Outcome,
    /// The wheels' step up to the reflection; `None` without an echo, or if a counter could not
    /// be read.
    pub step: Option<Step>,
    /// What the localizer made of it; `None` if there was an echo but no step to go with it.
    pub fix: Option<Fix>,
}
