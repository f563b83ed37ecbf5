//! A verdict on the estimate, from what the ranges said over time.
//!
//! The covariance is what the filter believes of itself; it cannot tell that it is wrong. The
//! ranges can. Each turn of the sonar adds to the evidence against the pose, or takes from it:
//!
//! | the turn | evidence | of the same wall again | because |
//! |---|---|---|---|
//! | taken | −1.2 | | down to 0 |
//! | taken, but weakened | 0 | | it may have been something else |
//! | gated, too long | 1 | 0.7 | nothing that stands in a room makes a range longer |
//! | no echo | 0.6 | 0.3 | a sonar misses some, and a wall that is not there all |
//! | gated, too short | 0.5 | 0 | furniture does that, and stays while the robot passes it |
//! | not a range to compare, or no wall to look at | 0 | | it says nothing of the pose |
//!
//! It is Page's cumulative sum test: each number is about the logarithm of how much more often a turn
//! ends so with a wrong pose than with a good one (in `classroom` and of robots carried off, a third
//! of it), and the sum, never below 0, decides:
//!
//! ```text
//!              1, or 10 turns without a usable
//!              range, or NIS above 3, or stale,
//!              or doubtful                                4
//!   Tracking ────────────────────────────▶ Degraded ──────────────────────▶ Lost
//!      ▲                                    │   ▲                             │
//!      └── below 0.5, 3 taken in a row,  ───┘   └── below 0.5, 3 taken in a row
//!          and none of the others holds
//! ```
//!
//! - *NIS* is the mean of ν²/S over the ranges taken, in which one counts for a sixteenth and fades:
//!   1 if the filter is consistent, less if its noise is set too large. Ranges that pass the gate
//!   one by one, but too far off together.
//! - *Stale*: rolled farther than [`Trust::stale`] since the last range taken. A robot that stands
//!   still does not grow stale, for its pose does not either; the time is told all the same.
//! - *Doubtful*: a direction in which the position's deviation is beyond [`Trust::doubtful`], or a
//!   heading less certain than half of what leaves the sonar anything to look at. It is the
//!   filter's own covariance that says so: what the ranges have not let it observe.
//!
//! # Non-finite policy
//! The evidence is made of constants and stays between 0 and [`LOST_AT`]; the mean NIS is made of
//! ranges taken, which are finite, each counted as [`MOST_NIS`] at the most. The rest is counted,
//! saturating.

#[cfg(doc)]
use crate::config::Trust;
use crate::localizer::{Fix, Refusal};
use crate::units::{Duration, Metres, Radians};

/// What the localizer thinks of its own estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Verdict {
    /// Ranges come and agree with the map.
    #[default]
    Tracking,
    /// Ranges have stopped coming, or have begun to disagree: the estimate lives on the encoders.
    Degraded,
    /// Ranges disagree and keep disagreeing: the pose is likely wrong.
    Lost,
}

/// The evidence of a turn against the pose.
const TAKEN: f32 = -1.2;
const WEAKENED: f32 = 0.0;
const TOO_LONG: f32 = 1.0;
const TOO_LONG_AGAIN: f32 = 0.7;
const NO_ECHO: f32 = 0.6;
const NO_ECHO_AGAIN: f32 = 0.3;
const TOO_SHORT: f32 = 0.5;
const TOO_SHORT_AGAIN: f32 = 0.0;

/// One range that is too long reaches it, one that is short or missing does not.
const DEGRADED_AT: f32 = 1.0;
/// The evidence with which a pose is called lost, and the most there is. Chosen so that a robot put
/// down 1 m and 90° away is called so within 15 turns in 95 % of trials, and one in its place among
/// unmapped furniture in no run of 1,000 (`docs/health.md`).
pub const LOST_AT: f32 = 4.0;
/// What it must have fallen to before things are called better.
const BETTER_BELOW: f32 = 0.5;

/// Turns of the sonar in a row without a usable range.
const DEGRADED_AFTER_SILENT: u16 = 10;
/// Accepted ranges in a row that lead one step back up.
const BETTER_AFTER: u16 = 3;

/// The share of the latest range in the mean NIS: sixteen ranges or so are remembered.
const LATEST_NIS: f32 = 1.0 / 16.0;
/// Sixteen values of χ² with one degree of freedom scatter by 0.25 in this mean: eight of that above
/// what a consistent filter has.
const DEGRADED_NIS: f32 = 3.0;
/// The most that one range counts in the mean NIS, so that one alone does not decide.
pub const MOST_NIS: f32 = 25.0;

/// The numbers behind the verdict.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Health {
    /// The verdict.
    pub verdict: Verdict,
    /// The evidence against the pose: from 0, none, to [`LOST_AT`].
    pub evidence: f32,
    /// Mean of ν²/S over the latest ranges taken; 1 at the start.
    pub nis: f32,
    /// Ranges taken since the last that was not, or since the verdict last rose.
    pub accepted_in_a_row: u16,
    /// Ranges gated since the last one taken; turns without a range do not interrupt.
    pub gated_in_a_row: u16,
    /// Turns without a usable range since the last one taken or gated.
    pub silent_in_a_row: u16,
    /// Looks that let the doubt of a lost robot grow ([`Trust::reopen`]), since it was last called
    /// tracking.
    pub reopened: u16,
    /// How far the robot has rolled since the last range taken.
    pub rolled_since_fix: Metres,
    /// How long ago that was.
    pub time_since_fix: Duration,
    /// Standard deviation of the position in the direction in which it is largest, after the last
    /// turn of the sonar.
    pub position_deviation: Metres,
    /// Standard deviation of the heading then.
    pub heading_deviation: Radians,
}

impl Default for Health {
    fn default() -> Self {
        Self {
            verdict: Verdict::Tracking,
            evidence: 0.0,
            nis: 1.0,
            accepted_in_a_row: 0,
            gated_in_a_row: 0,
            silent_in_a_row: 0,
            reopened: 0,
            rolled_since_fix: Metres(0.0),
            time_since_fix: Duration::from_ticks(0),
            position_deviation: Metres(0.0),
            heading_deviation: Radians(0.0),
        }
    }
}

/// What a turn of the sonar says of the pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Turn {
    /// A range that was taken, with its ν²/S.
    Taken(f32),
    /// The same of a range that was believed less than its noise allows.
    Weakened(f32),
    /// A range beyond the gate and too long; whether the same wall has been the last to contradict,
    /// and no range has been taken since.
    TooLong { again: bool },
    /// A range beyond the gate and too short.
    TooShort { again: bool },
    /// A ping that brought no echo where one was to come.
    NoEcho { again: bool },
    /// Nothing of the pose.
    Silent,
}

impl Turn {
    pub fn of(fix: &Fix, again: bool) -> Self {
        match *fix {
            Fix::Accepted(innovation) => Self::Taken(innovation.nis()),
            Fix::Weakened(innovation) => Self::Weakened(innovation.nis()),
            Fix::Gated(innovation) if innovation.value > Metres(0.0) => Self::TooLong { again },
            Fix::Gated(_) => Self::TooShort { again },
            Fix::Refused(Refusal::NoEcho) => Self::NoEcho { again },
            Fix::Refused(_) => Self::Silent,
        }
    }

    fn evidence(self) -> f32 {
        match self {
            Self::Taken(_) => TAKEN,
            Self::Weakened(_) => WEAKENED,
            Self::TooLong { again: false } => TOO_LONG,
            Self::TooLong { again: true } => TOO_LONG_AGAIN,
            Self::TooShort { again: false } => TOO_SHORT,
            Self::TooShort { again: true } => TOO_SHORT_AGAIN,
            Self::NoEcho { again: false } => NO_ECHO,
            Self::NoEcho { again: true } => NO_ECHO_AGAIN,
            Self::Silent => 0.0,
        }
    }
}

/// How uncertain the filter is of the pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Doubt {
    /// Standard deviation of the position in its worst direction.
    pub position: Metres,
    pub heading: Radians,
}

/// From where on the verdict is `Degraded` whatever the ranges say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limits {
    /// [`Trust::stale`].
    pub stale: Metres,
    /// [`Trust::doubtful`].
    pub position: Metres,
    /// Deviation of the heading.
    pub heading: Radians,
}

impl Health {
    /// Takes note of the way and the time since the last call.
    pub(crate) fn rolled(&mut self, way: Metres, time: Duration, limits: &Limits) {
        self.rolled_since_fix = self.rolled_since_fix + way;
        let ticks = self.time_since_fix.ticks().saturating_add(time.ticks());
        self.time_since_fix = Duration::from_ticks(ticks);
        self.degrade(limits);
    }

    /// Takes note of a turn of the sonar.
    pub(crate) fn turn(&mut self, turn: Turn, doubt: Doubt, limits: &Limits) {
        self.position_deviation = doubt.position;
        self.heading_deviation = doubt.heading;
        self.weigh(turn.evidence());
        match turn {
            Turn::Taken(nis) | Turn::Weakened(nis) => self.taken(nis),
            Turn::TooLong { .. } | Turn::TooShort { .. } => {
                self.accepted_in_a_row = 0;
                self.silent_in_a_row = 0;
                self.gated_in_a_row = self.gated_in_a_row.saturating_add(1);
            }
            Turn::NoEcho { .. } | Turn::Silent => {
                self.accepted_in_a_row = 0;
                self.silent_in_a_row = self.silent_in_a_row.saturating_add(1);
            }
        }
        match turn {
            Turn::Taken(_) if self.is_better(limits) => self.rise(),
            Turn::Taken(_) | Turn::Weakened(_) => self.degrade(limits),
            _ => self.worsen(limits),
        }
    }

    /// Takes note that the doubt of a lost robot has been let grow.
    pub(crate) fn reopened(&mut self) {
        self.reopened = self.reopened.saturating_add(1);
    }

    fn taken(&mut self, nis: f32) {
        self.gated_in_a_row = 0;
        self.silent_in_a_row = 0;
        self.accepted_in_a_row = self.accepted_in_a_row.saturating_add(1);
        self.rolled_since_fix = Metres(0.0);
        self.time_since_fix = Duration::from_ticks(0);
        let nis = if nis < MOST_NIS { nis } else { MOST_NIS };
        self.nis += LATEST_NIS * (nis - self.nis);
    }

    fn weigh(&mut self, evidence: f32) {
        let sum = self.evidence + evidence;
        let sum = if sum > 0.0 { sum } else { 0.0 };
        self.evidence = if sum < LOST_AT { sum } else { LOST_AT };
    }

    /// Whether, apart from what the ranges contradict, the estimate has no ground to stand on.
    fn is_groundless(&self, limits: &Limits) -> bool {
        self.nis > DEGRADED_NIS
            || self.rolled_since_fix > limits.stale
            || self.position_deviation > limits.position
            || self.heading_deviation > limits.heading
    }

    fn is_better(&self, limits: &Limits) -> bool {
        let agrees = self.evidence < BETTER_BELOW && self.accepted_in_a_row >= BETTER_AFTER;
        agrees && (self.verdict == Verdict::Lost || !self.is_groundless(limits))
    }

    fn rise(&mut self) {
        match self.verdict {
            Verdict::Lost => {
                self.verdict = Verdict::Degraded;
                self.accepted_in_a_row = 0;
            }
            Verdict::Degraded => {
                self.verdict = Verdict::Tracking;
                self.reopened = 0;
            }
            Verdict::Tracking => {}
        }
    }

    fn degrade(&mut self, limits: &Limits) {
        if self.verdict == Verdict::Tracking && self.is_groundless(limits) {
            self.verdict = Verdict::Degraded;
        }
    }

    fn worsen(&mut self, limits: &Limits) {
        let blind = self.silent_in_a_row >= DEGRADED_AFTER_SILENT;
        if self.evidence >= LOST_AT {
            self.verdict = Verdict::Lost;
        } else if self.verdict == Verdict::Tracking && (self.evidence >= DEGRADED_AT || blind) {
            self.verdict = Verdict::Degraded;
        }
        self.degrade(limits);
    }
}
