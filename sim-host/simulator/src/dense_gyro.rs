//! The covariance of the estimation problem with a gyro, in `f64` and dense matrices: seven states and the bias of the
//! gyro (`docs/model.md`, "Gyro"). The turn by the gyro is a measurement in the joint space of the states and the noise of
//! both wheels, one for each step. The core combines turns and sums up their differences instead.

#![expect(
    clippy::indexing_slicing,
    reason = "vectors and matrices of a fixed size, indexed by constants of the model"
)]

use nalgebra::{SMatrix, SVector};
use sonarfix::sensor::gyro::GyroParameters;

use crate::dense::{DenseFilter, Line, Matrix, Model, Vector};

/// The seven states, then the bias.
const STATES: usize = 8;
const BIAS: usize = 7;
const HEADING: usize = 2;
/// The states, the bias, and the noise of the right and the left wheel in one step.
const JOINT: usize = 10;

/// Variances of a gyro.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GyroModel {
    /// Of the angle, per second, rad²/s.
    pub noise: f64,
    /// Of the angle, per radian of a long turn, rad.
    pub scale: f64,
    /// Of the bias at the start, (rad/s)².
    pub bias: f64,
    /// Of the bias, per second, (rad/s)²/s.
    pub bias_walk: f64,
}

impl GyroModel {
    /// The model that a localizer assumes.
    #[must_use]
    pub fn of(gyro: &GyroParameters) -> Self {
        let square = |v: f32| f64::from(v) * f64::from(v);
        Self {
            noise: square(gyro.noise.0.0),
            scale: square(gyro.scale) * std::f64::consts::FRAC_PI_2,
            bias: square(gyro.bias.0),
            bias_walk: square(gyro.bias_walk.0.0),
        }
    }
}

/// The covariance of states and bias.
#[derive(Debug, Clone, PartialEq)]
pub struct DenseGyroFilter {
    model: Model,
    gyro: GyroModel,
    /// The state at which the model is linearized.
    pub x: Vector,
    p: SMatrix<f64, STATES, STATES>,
}

impl DenseGyroFilter {
    /// A filter without a gyro, and a bias that is independent of its states.
    #[must_use]
    pub fn new(filter: &DenseFilter, gyro: GyroModel) -> Self {
        let mut p = SMatrix::<f64, STATES, STATES>::zeros();
        p.fixed_view_mut::<7, 7>(0, 0).copy_from(&filter.p);
        p[(BIAS, BIAS)] = gyro.bias;
        Self { model: filter.model, gyro, x: filter.x, p }
    }

    /// The covariance after the encoders read `travel` (right, left), metres, and the gyro a turn, in a time, seconds.
    pub fn propagate(&mut self, travel: [f64; 2], seconds: f64) {
        let (f, g) = self.model.motion_jacobians(&self.x, travel);
        let turn = self.model.turn(&self.x, travel);
        let mut joint = SMatrix::<f64, JOINT, JOINT>::zeros();
        joint.fixed_view_mut::<STATES, STATES>(0, 0).copy_from(&self.p);
        let mut h = SVector::<f64, JOINT>::zeros();
        for (wheel, metres) in travel.iter().enumerate() {
            joint[(STATES + wheel, STATES + wheel)] = metres.abs() * self.model.wheel_variance;
            h[STATES + wheel] = g[(HEADING, wheel)];
        }
        for state in 3..7 {
            h[state] = f[(HEADING, state)];
        }
        h[BIAS] = seconds;
        let scale = self.gyro.scale * turn * turn / (turn.abs() + 0.01);
        let noise = self.gyro.noise * seconds + scale;
        let m = joint * h;
        let s = h.dot(&m) + noise;
        if s > 0.0 {
            joint -= m * m.transpose() / s;
        }
        let mut step = SMatrix::<f64, STATES, JOINT>::zeros();
        step.fixed_view_mut::<7, 7>(0, 0).copy_from(&f);
        step.fixed_view_mut::<7, 2>(0, STATES).copy_from(&g);
        step[(BIAS, BIAS)] = 1.0;
        self.p = step * joint * step.transpose();
        let distance = f64::midpoint(travel[0].abs(), travel[1].abs());
        self.p[(3, 3)] += self.model.scale_variance * distance;
        self.p[(4, 4)] += self.model.scale_variance * distance;
        self.p[(5, 5)] += self.model.width_variance * distance;
        self.p[(BIAS, BIAS)] += self.gyro.bias_walk * seconds;
    }

    /// Replaces the model, of which only the ranger differs.
    pub fn set_model(&mut self, model: Model) {
        self.model = model;
    }

    /// The covariance after a range to a wall.
    pub fn correct(&mut self, line: &Line, bearing: f64) {
        let (_, h7, noise) = self.model.measured(&self.x, line, bearing);
        let mut h = SVector::<f64, STATES>::zeros();
        h.fixed_rows_mut::<7>(0).copy_from(&h7);
        let gain = self.p * h / (h.dot(&(self.p * h)) + noise);
        let keep = SMatrix::<f64, STATES, STATES>::identity() - gain * h.transpose();
        self.p = keep * self.p * keep.transpose() + gain * gain.transpose() * noise;
    }

    /// The covariance after one state was measured with noise of this variance.
    pub fn correct_state(&mut self, state: usize, noise: f64) {
        let mut h = SVector::<f64, STATES>::zeros();
        h[state] = 1.0;
        let gain = self.p * h / (h.dot(&(self.p * h)) + noise);
        let keep = SMatrix::<f64, STATES, STATES>::identity() - gain * h.transpose();
        self.p = keep * self.p * keep.transpose() + gain * gain.transpose() * noise;
    }

    /// The covariance of the seven states.
    #[must_use]
    pub fn covariance(&self) -> Matrix {
        self.p.fixed_view::<7, 7>(0, 0).into_owned()
    }

    /// Variance of the bias, (rad/s)².
    #[must_use]
    pub fn bias_variance(&self) -> f64 {
        self.p[(BIAS, BIAS)]
    }
}
