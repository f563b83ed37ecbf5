//! Statistics over many runs.

#![expect(
    clippy::indexing_slicing,
    reason = "vectors and matrices of a fixed size, indexed by constants of the model"
)]

use serde::Serialize;
use sonarfix::health::Verdict;
use sonarfix_hal::robot::Faults;

use crate::STATES;
use crate::dense::Vector;
use crate::integrity::Integrity;

/// Number of measurement cycles by outcome.
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
    fn add(&mut self, other: &Self) {
        self.accepted += other.accepted;
        self.gated += other.gated;
        self.refused += other.refused;
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
        let diverged = e[0].hypot(e[1]) > LOST_POSITION || e[2].abs() > LOST_HEADING;
        self.lost = verdict == Verdict::Lost || diverged;
    }
}

/// One state over many runs, errors at the end in SI units.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StateSummary {
    /// One of [`STATES`].
    pub name: &'static str,
    /// `m`, `rad` or `1`.
    pub unit: &'static str,
    /// Mean error.
    pub mean_error: f64,
    /// Standard deviation of the error about its mean.
    pub std_error: f64,
    /// Root mean square error.
    pub rms_error: f64,
    /// Root mean square of the runs' bounds.
    pub bound: f64,
    /// Ratio of the two; `None` if the state is not estimated.
    pub rms_over_bound: Option<f64>,
}

/// RMS errors over all ticks of all runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PathSummary {
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
    /// Radians.
    pub heading: f64,
}

/// Statistics of many runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Number of runs.
    pub runs: usize,
    /// The states, in the order of [`STATES`].
    pub states: Vec<StateSummary>,
    /// Mean of εᵀ P⁻¹ ε at the end: `nees_states` for a consistent filter.
    pub nees_mean: f64,
    /// Number of states in the NEES.
    pub nees_states: usize,
    /// Mean of ν²/S over the ranges with the outcome `Accepted`: 1 for a consistent filter, and a few
    /// per cent less where the association rejects the tail of the distribution.
    pub nis_mean: f64,
    /// Outcomes of the measurement cycles of all runs.
    pub fixes: FixCounts,
    /// Runs that ended lost.
    pub lost_runs: usize,
    /// RMS errors along the path.
    pub rms_path: PathSummary,
    /// Time with a position error of more than 10 cm and the verdict `Tracking`, of all runs, seconds.
    pub undetected_error: f64,
    /// How often the verdict became `Lost`.
    pub called_lost: u32,
    /// How often it became so with the pose inside its confidence ellipse.
    pub false_alarms: u32,
}

const UNITS: [&str; 7] = ["m", "m", "rad", "1", "1", "m", "1"];

impl Summary {
    /// Sums up runs in their order, so that the result does not depend on the number of threads.
    #[must_use]
    pub fn of(results: &[RunResult]) -> Self {
        let states = (0..STATES.len()).map(|state| StateSummary::of(state, results)).collect();
        let mut fixes = FixCounts::default();
        let (mut nis, mut path) = (NisSum::default(), PathSum::default());
        for result in results {
            fixes.add(&result.fixes);
            nis.sum += result.nis.sum;
            nis.count += result.nis.count;
            path.ticks += result.path.ticks;
            for (sum, squares) in path.squares.iter_mut().zip(result.path.squares) {
                *sum += squares;
            }
        }
        let rms = path.squares.map(|sum| (sum / as_f64(path.ticks)).sqrt());
        Self {
            runs: results.len(),
            states,
            nees_mean: mean(results, |result| result.nees),
            nees_states: results.first().map_or(0, |result| result.estimated_states),
            nis_mean: nis.sum / as_f64(nis.count),
            fixes,
            lost_runs: results.iter().filter(|result| result.lost).count(),
            undetected_error: results.iter().map(|run| run.integrity.undetected_error()).sum(),
            called_lost: results.iter().map(|run| run.integrity.called_lost()).sum(),
            false_alarms: results.iter().map(|run| run.integrity.false_alarms()).sum(),
            rms_path: PathSummary { x: rms[0], y: rms[1], heading: rms[2] },
        }
    }
}

impl StateSummary {
    fn of(state: usize, results: &[RunResult]) -> Self {
        let mean_error = mean(results, |result| result.error[state]);
        let mean_square = mean(results, |result| result.error[state].powi(2));
        let spread = mean(results, |result| (result.error[state] - mean_error).powi(2));
        // Sample variance: n − 1.
        let n = as_f64(results.len() as u64);
        let std_error = (spread * n / (n - 1.0)).sqrt();
        let bound = mean(results, |result| result.bound_variance[state]).sqrt();
        let rms_error = mean_square.sqrt();
        Self {
            name: STATES[state],
            unit: UNITS[state],
            mean_error,
            std_error: if results.len() > 1 { std_error } else { 0.0 },
            rms_error,
            bound,
            rms_over_bound: (bound > 0.0).then(|| rms_error / bound),
        }
    }
}

fn mean(results: &[RunResult], of: impl Fn(&RunResult) -> f64) -> f64 {
    results.iter().map(of).sum::<f64>() / as_f64(results.len() as u64)
}

#[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
fn as_f64(count: u64) -> f64 {
    count as f64
}
