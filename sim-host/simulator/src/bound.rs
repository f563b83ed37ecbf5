//! The posterior Cramér–Rao bound of a run: the least error of any unbiased estimator, given the
//! motion and the measurements of the run (`docs/model.md`, "The bound").
//!
//! It is the filter's covariance recursion, evaluated at the true states. The RMS error of an
//! efficient filter equals it.

use crate::dense::{DenseFilter, Line, Model, Vector};

/// The bound of a run in progress.
#[derive(Debug, Clone)]
pub struct Bound {
    filter: DenseFilter,
}

impl Bound {
    /// The bound at the true start, with the deviations of the filter's initial estimate.
    #[must_use]
    pub fn new(model: Model, truth: Vector, deviation: &Vector) -> Self {
        Self { filter: DenseFilter::new(model, truth, deviation) }
    }

    /// Predicts over a motion; `travel` is the noiseless encoder reading, `truth` the state after it.
    pub fn moved(&mut self, travel: [f64; 2], truth: Vector) {
        self.filter.propagate(travel);
        self.filter.x = truth;
    }

    /// Updates with a range to a wall at the current state.
    pub fn fixed(&mut self, line: &Line) {
        let truth = self.filter.x;
        let (range, _) = self.filter.model.range(&truth, line);
        self.filter.correct(line, range);
        self.filter.x = truth;
    }

    /// The bound on each state's standard deviation.
    #[must_use]
    pub fn standard_deviations(&self) -> Vector {
        self.filter.standard_deviations()
    }

    /// The bound on each state's variance.
    #[must_use]
    pub fn variance(&self) -> Vector {
        self.filter.p.diagonal()
    }
}
