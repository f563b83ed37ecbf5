//! The posterior Cramér–Rao bound of a run: the least error of any unbiased estimator, given the
//! motion and the measurements of the run (`docs/model.md`, "The bound").
//!
//! It is the filter's covariance recursion, evaluated at the true states. The RMS error of an
//! efficient filter equals it.

use sonarfix::sensor::absolute::{AbsoluteMeasurement, PositionNoise};

use crate::dense::{DenseFilter, Line, Matrix, Model, Vector};
use crate::dense_gyro::{DenseGyroFilter, GyroModel};

/// The bound of a run in progress.
#[derive(Debug, Clone)]
pub struct Bound {
    filter: DenseFilter,
    /// The same with a gyro, if the robot has one.
    with_gyro: Option<DenseGyroFilter>,
}

impl Bound {
    /// The bound at the true start, with the covariance of the filter's initial estimate.
    #[must_use]
    pub fn new(model: Model, gyro: Option<GyroModel>, truth: Vector, p: Matrix) -> Self {
        let filter = DenseFilter { model, x: truth, p };
        let with_gyro = gyro.map(|gyro| DenseGyroFilter::new(&filter, gyro));
        Self { filter, with_gyro }
    }

    /// Predicts over a motion in a time, seconds; `travel` is the noiseless encoder reading, `truth` the state after it.
    pub fn moved(&mut self, travel: [f64; 2], seconds: f64, truth: Vector) {
        match &mut self.with_gyro {
            None => self.filter.propagate(travel),
            Some(aided) => {
                aided.x = self.filter.x;
                aided.propagate(travel, seconds);
                self.filter.p = aided.covariance();
            }
        }
        self.filter.x = truth;
    }

    /// Sets the model of the ranger that measures next.
    pub fn measures_by(&mut self, model: Model) {
        self.filter.model = model;
        if let Some(aided) = &mut self.with_gyro {
            aided.set_model(model);
        }
    }

    /// Updates with a range to a wall, by a ping at a bearing, at the current state.
    pub fn fixed(&mut self, line: &Line, bearing: f64) {
        let truth = self.filter.x;
        if let Some(aided) = &mut self.with_gyro {
            aided.x = truth;
            aided.correct(line, bearing);
            self.filter.p = aided.covariance();
            return;
        }
        // The innovation is zero: only the covariance changes.
        let (range, ..) = self.filter.model.measured(&truth, line, bearing);
        self.filter.correct_at(line, bearing, range);
        self.filter.x = truth;
    }

    /// Updates with a heading, position or pose at the current state; its components have independent noise.
    pub fn measured(&mut self, measurement: &AbsoluteMeasurement) {
        match *measurement {
            AbsoluteMeasurement::Heading { deviation, .. } => {
                self.correct_state(2, f64::from(deviation.0).powi(2));
            }
            AbsoluteMeasurement::Position { noise, .. } => self.correct_position(&noise),
            AbsoluteMeasurement::Pose { noise, .. } => {
                self.correct_position(&noise.position);
                self.correct_state(2, noise.hh.into());
            }
        }
    }

    fn correct_position(&mut self, noise: &PositionNoise) {
        self.correct_state(0, noise.xx.into());
        self.correct_state(1, noise.yy.into());
    }

    fn correct_state(&mut self, state: usize, noise: f64) {
        match &mut self.with_gyro {
            None => self.filter.correct_state(state, noise),
            Some(aided) => {
                aided.correct_state(state, noise);
                self.filter.p = aided.covariance();
            }
        }
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
