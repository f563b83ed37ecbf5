//! The report of one poll of the loop.

use sonarfix::aim::{Aim, NoAim};
use sonarfix::geometry::units::Duration;
use sonarfix::localizer::{Fix, Mode};

use super::{AbsoluteResult, Faults, Step, SweepResult};
use crate::ranger::Outcome;

/// The report of one poll, in the order of execution.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub struct Report {
    /// The step of the wheels up to the reflection at a wall, whose range is taken in the same or the next poll.
    pub reached: Option<Step>,
    /// The result of a ping that has ended.
    pub ping_result: Option<PingResult>,
    /// The result of a ping of the search's sweep that has ended.
    pub swept: Option<SweepResult>,
    /// The encoders were sampled.
    pub tick: Option<Tick>,
    /// A part of the choice of a wall was made.
    pub is_choosing: bool,
    /// The wall that the localizer has chosen; the servo turns there.
    pub aimed: Option<Result<Aim, NoAim>>,
    /// A ping was started, at the bearing of the servo, which differs from that of the choice by the
    /// resolution of the PWM.
    pub pinged: Option<Aim>,
    /// A heading, position or pose from outside, made in the last step of the localizer, which was passed to it.
    pub absolute: Option<AbsoluteResult>,
    /// The new mode, if it has changed.
    pub mode: Option<Mode>,
    /// The faults of this poll.
    pub faults: Faults,
}

impl Report {
    /// Empties it in place: only the discriminants are written, of half a kilobyte.
    pub(super) fn clear(&mut self) {
        let Self {
            reached,
            ping_result,
            swept,
            tick,
            is_choosing,
            aimed,
            pinged,
            absolute,
            mode,
            faults,
        } = self;
        (*reached, *ping_result, *swept, *tick) = (None, None, None, None);
        (*is_choosing, *aimed, *pinged, *mode) = (false, None, None, None);
        *absolute = None;
        *faults = Faults::default();
    }

    /// Whether the poll did nothing and found no fault.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Whether the poll handled a ping, a tick or a choice, or changed the mode.
    #[must_use]
    pub fn has_worked(&self) -> bool {
        let has_pinged = self.has_ended_ping() || self.pinged.is_some();
        has_pinged
            || self.is_choosing
            || self.tick.is_some()
            || self.aimed.is_some()
            || self.mode.is_some()
            || self.absolute.is_some()
    }

    /// Whether the echo of a ping, or its end, was handled.
    pub(super) fn has_ended_ping(&self) -> bool {
        self.reached.is_some() || self.ping_result.is_some() || self.swept.is_some()
    }
}

/// A sample of both encoders.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tick {
    /// The step of the wheels; `None` if a counter could not be read (see [`Report::faults`]).
    pub step: Option<Step>,
    /// The delay after its deadline.
    pub lateness: Duration,
    /// Whether a ping has delayed it. Only the time since the previous poll then counts as late.
    pub held: bool,
    /// Later samples that are covered by this one.
    pub skipped: u64,
}

/// The result of a ping.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PingResult {
    /// The wall and the bearing.
    pub aim: Aim,
    /// The echo, or why there is none.
    pub outcome: Outcome,
    /// The localizer's response; `None` if there was an echo but a counter could not be read.
    pub fix: Option<Fix>,
}
