//! The posterior Cramér–Rao bound of a run: how well any unbiased estimator could have known each
//! state, given the motion made and the fixes taken (`docs/model.md`, "The bound").
//!
//! It is the filter's covariance recursion evaluated at the true states, so it needs no estimate
//! and no noise: an efficient filter's RMS error equals it.

use crate::dense::{DenseFilter, Line, Model, Vector};

/// The bound, carried along with a run.
#[derive(Debug, Clone)]
pub struct Bound {
    filter: DenseFilter,
}

impl Bound {
    /// A bound at the true start, with the deviations that the filter is told of.
    #[must_use]
    pub fn new(model: Model, truth: Vector, deviation: &Vector) -> Self {
        Self { filter: DenseFilter::new(model, truth, deviation) }
    }

    /// The robot moved: the encoders, were they without noise, would have read `travel`; `truth`
    /// is the state after it.
    pub fn moved(&mut self, travel: [f64; 2], truth: Vector) {
        self.filter.predict(travel);
        self.filter.x = truth;
    }

    /// A range was taken from a wall, here and now.
    pub fn fixed(&mut self, line: &Line) {
        let truth = self.filter.x;
        let (range, _) = self.filter.model.range(&truth, line);
        self.filter.correct(line, range);
        self.filter.x = truth;
    }

    /// The bound on each state's standard deviation.
    #[must_use]
    pub fn deviation(&self) -> Vector {
        self.filter.deviation()
    }

    /// The bound on each state's variance.
    #[must_use]
    pub fn variance(&self) -> Vector {
        self.filter.p.diagonal()
    }
}
