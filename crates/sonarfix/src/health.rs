//! A verdict on the estimate, from what the ranges said over time.
//!
//! The covariance is what the filter believes of itself; it cannot tell that it is wrong. The
//! innovations can.
//!
//! ```text
//!              3 gated, or 10 without a range         8 gated in a row
//!   Tracking ────────────────────────────▶ Degraded ──────────────────▶ Lost
//!      ▲                                    │   ▲                         │
//!      └────────── 3 accepted in a row ─────┘   └── 3 accepted in a row ──┘
//! ```
//!
//! # Non-finite policy
//! Only counts are kept; there is nothing to be NaN.

/// What the localizer thinks of its own estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Verdict {
    /// Ranges come and agree with the map.
    #[default]
    Tracking,
    /// Ranges have stopped coming, or have begun to disagree: the estimate lives on the encoders.
    Degraded,
    /// Ranges disagree and keep disagreeing: the pose is likely wrong.
    Lost,
}

/// Gated ranges in a row that a good estimate in a known room does not meet: something stands
/// before the wall, or the pose is wrong.
const DEGRADED_AFTER_GATED: u16 = 3;
/// Turns of the sonar in a row without a usable range.
const DEGRADED_AFTER_SILENT: u16 = 10;
/// Gated ranges in a row, from walls all round, that furniture no longer explains.
const LOST_AFTER_GATED: u16 = 8;
/// Accepted ranges in a row that lead one step back up.
const RECOVERED_AFTER: u16 = 3;

/// The counts behind the verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Health {
    /// The verdict.
    pub verdict: Verdict,
    /// Ranges accepted since the last that was not.
    pub accepted_in_a_row: u16,
    /// Ranges gated since the last accepted one; refused ones between do not count or interrupt.
    pub gated_in_a_row: u16,
    /// Turns of the sonar without a usable range since the last accepted or gated one.
    pub silent_in_a_row: u16,
}

impl Health {
    /// Takes note of an accepted range.
    pub(crate) fn accepted(&mut self) {
        self.gated_in_a_row = 0;
        self.silent_in_a_row = 0;
        self.accepted_in_a_row = self.accepted_in_a_row.saturating_add(1);
        if self.accepted_in_a_row >= RECOVERED_AFTER {
            self.verdict = match self.verdict {
                Verdict::Lost => Verdict::Degraded,
                Verdict::Degraded | Verdict::Tracking => Verdict::Tracking,
            };
            if self.verdict == Verdict::Degraded {
                self.accepted_in_a_row = 0;
            }
        }
    }

    /// Takes note of a gated range.
    pub(crate) fn gated(&mut self) {
        self.accepted_in_a_row = 0;
        self.silent_in_a_row = 0;
        self.gated_in_a_row = self.gated_in_a_row.saturating_add(1);
        if self.gated_in_a_row >= LOST_AFTER_GATED {
            self.verdict = Verdict::Lost;
        } else if self.gated_in_a_row >= DEGRADED_AFTER_GATED {
            self.degrade();
        }
    }

    /// Takes note of a turn of the sonar that brought no usable range.
    pub(crate) fn silent(&mut self) {
        self.accepted_in_a_row = 0;
        self.silent_in_a_row = self.silent_in_a_row.saturating_add(1);
        if self.silent_in_a_row >= DEGRADED_AFTER_SILENT {
            self.degrade();
        }
    }

    fn degrade(&mut self) {
        if self.verdict == Verdict::Tracking {
            self.verdict = Verdict::Degraded;
        }
    }
}
