//! Statistics over many runs.

#![expect(
    clippy::indexing_slicing,
    reason = "vectors and matrices of a fixed size, indexed by constants of the model"
)]

use serde::Serialize;

use crate::STATES;
use crate::row::{COUNTS, REALS, Row, place};

pub use crate::run_result::{FixCounts, NisSum, PathSum, RunResult};

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
        let rows = || results.iter().map(|result| Row::new(0, result));
        let mut totals = Totals::default();
        rows().for_each(|row| totals.add(&row));
        let mut deviations = totals.deviations();
        rows().for_each(|row| deviations.add(&row));
        deviations.summary()
    }
}

/// The sums of many runs: the first of two passes over their rows, in the same order.
#[derive(Debug, Clone)]
pub struct Totals {
    runs: usize,
    estimated_states: u64,
    reals: [f64; REALS.len()],
    counts: [u64; COUNTS.len()],
    squared_errors: [f64; STATES.len()],
}

impl Default for Totals {
    fn default() -> Self {
        // Minus zero is the neutral element of a sum.
        Self {
            runs: 0,
            estimated_states: 0,
            reals: [-0.0; REALS.len()],
            counts: [0; COUNTS.len()],
            squared_errors: [-0.0; STATES.len()],
        }
    }
}

impl Totals {
    /// Adds a run.
    pub fn add(&mut self, row: &Row) {
        if self.runs == 0 {
            self.estimated_states = row.counts[place::ESTIMATED_STATES];
        }
        self.runs += 1;
        for (sum, term) in self.reals.iter_mut().zip(row.reals) {
            *sum += term;
        }
        for (sum, term) in self.counts.iter_mut().zip(row.counts) {
            *sum += term;
        }
        for (sum, error) in self.squared_errors.iter_mut().zip(row.reals) {
            *sum += error.powi(2);
        }
    }

    /// Number of runs.
    #[must_use]
    pub fn runs(&self) -> usize {
        self.runs
    }

    /// Ends the first pass.
    #[must_use]
    pub fn deviations(self) -> Deviations {
        Deviations { totals: self, squares: [-0.0; STATES.len()] }
    }

    fn mean(&self, real: usize) -> f64 {
        self.reals[real] / as_f64(self.runs as u64)
    }

    fn state(&self, state: usize, squares: f64) -> StateSummary {
        let n = as_f64(self.runs as u64);
        // Sample variance: n − 1.
        let std_error = (squares / n * n / (n - 1.0)).sqrt();
        let bound = self.mean(place::BOUND_VARIANCE + state).sqrt();
        let rms_error = (self.squared_errors[state] / n).sqrt();
        StateSummary {
            name: STATES[state],
            unit: UNITS[state],
            mean_error: self.mean(place::ERROR + state),
            std_error: if self.runs > 1 { std_error } else { 0.0 },
            rms_error,
            bound,
            rms_over_bound: (bound > 0.0).then(|| rms_error / bound),
        }
    }
}

/// The squared deviations from the mean errors: the second pass.
#[derive(Debug, Clone)]
pub struct Deviations {
    totals: Totals,
    squares: [f64; STATES.len()],
}

impl Deviations {
    /// Adds a run.
    pub fn add(&mut self, row: &Row) {
        for (state, sum) in self.squares.iter_mut().enumerate() {
            *sum +=
                (row.reals[place::ERROR + state] - self.totals.mean(place::ERROR + state)).powi(2);
        }
    }

    /// The statistics of all runs.
    #[must_use]
    pub fn summary(&self) -> Summary {
        let Self { totals, squares } = self;
        let states = squares.iter().enumerate();
        let ticks = as_f64(totals.counts[place::PATH_TICKS]);
        let rms = |of: usize| (totals.reals[place::PATH_SQUARES + of] / ticks).sqrt();
        let count = |of: usize| totals.counts[of];
        let small = |of: usize| u32::try_from(count(of)).unwrap_or(u32::MAX);
        let whole = |number: u64| usize::try_from(number).unwrap_or(usize::MAX);
        Summary {
            runs: totals.runs,
            states: states.map(|(state, &squares)| totals.state(state, squares)).collect(),
            nees_mean: totals.mean(place::NEES),
            nees_states: whole(totals.estimated_states),
            nis_mean: totals.reals[place::NIS_SUM] / as_f64(count(place::NIS_COUNT)),
            fixes: FixCounts {
                accepted: count(place::FIXES),
                gated: count(place::FIXES + 1),
                refused: count(place::FIXES + 2),
            },
            lost_runs: whole(count(place::LOST)),
            undetected_error: totals.reals[place::UNDETECTED_ERROR],
            called_lost: small(place::CALLED_LOST),
            false_alarms: small(place::FALSE_ALARMS),
            rms_path: PathSummary { x: rms(0), y: rms(1), heading: rms(2) },
        }
    }
}

#[expect(clippy::cast_precision_loss, reason = "counts stay below 2^53")]
fn as_f64(count: u64) -> f64 {
    count as f64
}
