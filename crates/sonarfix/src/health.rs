//! A verdict on the estimate, from what the ranges said over time.
//!
//! The covariance is what the filter believes of itself; it cannot tell that it is wrong. The
//! ranges can. Each turn of the sonar contradicts the pose by so much:
//!
//! | the turn | contradicts | because |
//! |---|---|---|
//! | accepted | 0 | |
//! | gated, too long | 1 | nothing that stands in a room makes a range longer |
//! | gated, too short | 0.55 | furniture that the map does not know does, and stays |
//! | no echo | 0.55 | a sonar misses some, and a wall that is not there all |
//! | not a range to compare, or no wall to look at | not counted | it says nothing of the pose |
//!
//! The mean of it, in which a turn counts for a sixth and fades, decides:
//!
//! ```text
//!              above 0.15, or 10 turns                 above 0.5
//!              without a usable range                  or 20 gated in a row
//!   Tracking ────────────────────────────▶ Degraded ──────────────────────▶ Lost
//!      ▲                                    │   ▲                             │
//!      └──── below 0.1, 3 accepted in a row ┘   └──── below 0.1, 3 accepted in a row
//! ```
//!
//! # Non-finite policy
//! The mean is made of constants and stays between 0 and 1.

use crate::units::Metres;

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

/// How much a turn contradicts the pose.
const TOO_LONG: f32 = 1.0;
const TOO_SHORT: f32 = 0.55;
const NO_ECHO: f32 = 0.55;

/// The share of the latest turn in the mean: six turns or so are remembered.
const LATEST: f32 = 1.0 / 6.0;

/// One range that is too long lies above it, one that is short or missing does not.
const DEGRADED_ABOVE: f32 = 0.15;
/// Every third range shortened, or two of three missed, does not reach it; thirteen in a row do.
/// Chosen so that a robot put down 1 m and 90° away is called lost within 15 turns in 95 % of
/// trials (`tests/tests/kidnapped.rs`).
const LOST_ABOVE: f32 = 0.5;
/// What it must have fallen to before things are called better.
const BETTER_BELOW: f32 = 0.1;

/// Turns of the sonar in a row without a usable range.
const DEGRADED_AFTER_SILENT: u16 = 10;
/// Gated ranges in a row that furniture no longer explains, even if all are too short.
const LOST_AFTER_GATED: u16 = 20;
/// Accepted ranges in a row that lead one step back up.
const BETTER_AFTER: u16 = 3;

/// The numbers behind the verdict.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Health {
    /// The verdict.
    pub verdict: Verdict,
    /// How much the latest turns contradict the pose: 0 not at all, 1 all of them.
    pub contradiction: f32,
    /// Ranges accepted since the last that was not, or since the verdict last rose.
    pub accepted_in_a_row: u16,
    /// Ranges gated since the last accepted one; turns without a range do not interrupt.
    pub gated_in_a_row: u16,
    /// Turns without a usable range since the last accepted or gated one.
    pub silent_in_a_row: u16,
}

impl Health {
    /// Takes note of an accepted range.
    pub(crate) fn accepted(&mut self) {
        self.gated_in_a_row = 0;
        self.silent_in_a_row = 0;
        self.accepted_in_a_row = self.accepted_in_a_row.saturating_add(1);
        self.mix_in(0.0);
        let better = self.contradiction < BETTER_BELOW && self.accepted_in_a_row >= BETTER_AFTER;
        self.verdict = match self.verdict {
            Verdict::Lost if better => Verdict::Degraded,
            Verdict::Degraded if better => Verdict::Tracking,
            same => same,
        };
        if better && self.verdict == Verdict::Degraded {
            self.accepted_in_a_row = 0;
        }
    }

    /// Takes note of a gated range, with its innovation.
    pub(crate) fn gated(&mut self, innovation: Metres) {
        self.accepted_in_a_row = 0;
        self.silent_in_a_row = 0;
        self.gated_in_a_row = self.gated_in_a_row.saturating_add(1);
        self.mix_in(if innovation.0 > 0.0 { TOO_LONG } else { TOO_SHORT });
        self.worsen();
    }

    /// Takes note of a ping that brought no echo, where one was to come.
    pub(crate) fn no_echo(&mut self) {
        self.mix_in(NO_ECHO);
        self.silent();
    }

    /// Takes note of a turn that says nothing of the pose.
    pub(crate) fn silent(&mut self) {
        self.accepted_in_a_row = 0;
        self.silent_in_a_row = self.silent_in_a_row.saturating_add(1);
        self.worsen();
    }

    fn mix_in(&mut self, contradiction: f32) {
        self.contradiction += LATEST * (contradiction - self.contradiction);
    }

    fn worsen(&mut self) {
        let gated_on_and_on = self.gated_in_a_row >= LOST_AFTER_GATED;
        let blind = self.silent_in_a_row >= DEGRADED_AFTER_SILENT;
        if self.contradiction > LOST_ABOVE || gated_on_and_on {
            self.verdict = Verdict::Lost;
        } else if self.verdict == Verdict::Tracking
            && (self.contradiction > DEGRADED_ABOVE || blind)
        {
            self.verdict = Verdict::Degraded;
        }
    }
}
