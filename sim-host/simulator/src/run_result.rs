//! The result of one run.

use serde::Serialize;
use sonarfix::health::Verdict;
use sonarfix::localizer::AbsoluteFix;
use sonarfix_hal::robot::Faults;

use crate::dense::Vector;
use crate::integrity::Integrity;

/// Number of measurement cycles, or of headings and positions from outside, by outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct FixCounts {
    /// Ranges that corrected the filter.
    pub accepted: u64,
    /// Ranges beyond the gate.
    pub gated: u64,
    /// Cycles without a usable range.
    pub refused: u64,
}

impl FixCounts {
    /// Counts a heading, position or pose from outside.
    pub fn count(&mut self, fix: &AbsoluteFix) {
        *match fix {
            AbsoluteFix::Accepted(_) | AbsoluteFix::Downweighted(_) => &mut self.accepted,
            AbsoluteFix::Gated(_) => &mut self.gated,
            _ => &mut self.refused,
        } += 1;
    }
}

/// Sum of the normalised innovations squared.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NisSum {
    sum: f64,
    count: u64,
}

impl NisSum {
    /// Adds one.
    pub fn add(&mut self, nis: f64) {
        self.sum += nis;
        self.count += 1;
    }

    /// Adds that of a measurement of several numbers, whose mean is their number.
    pub fn add_vector(&mut self, nis: f64, dimensions: u8) {
        self.sum += nis;
        self.count += u64::from(dimensions);
    }

    /// The sum, and the number of terms.
    #[must_use]
    pub fn parts(&self) -> (f64, u64) {
        (self.sum, self.count)
    }
}

/// Sums of squared errors of x, y and heading along the path.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PathSum {
    squares: [f64; 3],
    ticks: u64,
}

impl PathSum {
    /// Adds the error at one tick.
    pub fn add(&mut self, error: &Vector) {
        for (sum, e) in self.squares.iter_mut().zip(error.iter()) {
            *sum += e * e;
        }
        self.ticks += 1;
    }

    /// The sums of squares of x, y (m²) and heading (rad²), and the number of ticks.
    #[must_use]
    pub fn parts(&self) -> ([f64; 3], u64) {
        (self.squares, self.ticks)
    }

    /// Mean square of the distance between estimated and true position, m².
    #[must_use]
    pub fn position_mean_square(&self) -> f64 {
        (self.squares[0] + self.squares[1]) / as_f64(self.ticks)
    }
}

/// The result of one run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RunResult {
    /// Error of each state at the end.
    pub error: Vector,
    /// The bound on each state's variance at the end.
    pub bound_variance: Vector,
    /// NEES, εᵀ P⁻¹ ε, at the end.
    pub nees: f64,
    /// Number of states in the NEES.
    pub estimated_states: usize,
    /// NIS of the ranges with the outcome `Accepted`, without the down-weighted ones.
    pub nis: NisSum,
    /// Errors along the path.
    pub path: PathSum,
    /// Outcomes of the measurement cycles.
    pub fixes: FixCounts,
    /// Outcomes of headings, positions and poses from outside.
    pub absolute: FixCounts,
    /// Whether the robot was lost at the end.
    pub lost: bool,
    /// Whether the errors along the path were inside the filter's confidence ellipse.
    pub integrity: Integrity,
    /// Faults that the robot's loop reported; empty at the ideal fidelity, which has no loop.
    pub faults: Faults,
}

/// A run ends lost with the verdict `Lost` or with a position error above this, metres.
const LOST_POSITION: f64 = 0.5;
/// A run ends lost with a heading error above this, radians: half of the paper's cone, beyond which
/// the beam no longer includes a wall's normal.
const LOST_HEADING: f64 = 0.26;

impl RunResult {
    /// Decides whether the run ended lost.
    pub fn set_lost(&mut self, verdict: Verdict) {
        let e = &self.error;
        let diverged = libm::hypot(e[0], e[1]) > LOST_POSITION || e[2].abs() > LOST_HEADING;
        self.lost = verdict == Verdict::Lost || diverged;
    }
}

#[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
fn as_f64(count: u64) -> f64 {
    count as f64
}
