//! kfilter: an `EKF` with a step function, and a linear measurement. It depends on another
//! version of nalgebra.

use kfilter::kalman::{EKF, KalmanFilter, KalmanPredictInput, KalmanUpdate};
use kfilter::measurement::LinearMeasurement;
use kfilter::system::StepReturn;
use nalgebra_of_kfilter::{Matrix1, SMatrix, SVector, Vector1};

use crate::model::{Matrix, Motion, Range, STATES, Step, Vector};
use crate::{Filter, diagonal};

/// Right, left, sine, cosine, and the diagonal of Q.
const INPUTS: usize = 4 + STATES;

/// The filter.
pub struct Kfilter(EKF<f32, STATES, INPUTS>);

fn step(state: SVector<f32, STATES>, input: SVector<f32, INPUTS>) -> StepReturn<f32, STATES> {
    let [right, left, sin, cos, noise @ ..]: [f32; INPUTS] = input.into();
    let state = state.into();
    let motion = Motion::new(&state, &Step { right, left, sin, cos, noise });
    let jacobian = motion.jacobian();
    StepReturn {
        state: motion.moved(&state).into(),
        jacobian: SMatrix::from_fn(|i, j| jacobian[i][j]),
        covariance: SMatrix::from_diagonal(&noise.into()),
    }
}

impl Filter for Kfilter {
    fn new(state: Vector, variances: Vector) -> Self {
        let p = diagonal(&variances);
        Self(EKF::new_ekf_with_input(step, state.into(), SMatrix::from_fn(|i, j| p[i][j])))
    }

    #[inline]
    fn predict(&mut self, step: &Step) {
        let [a, b, c, d, e, f] = step.noise;
        let input = [step.right, step.left, step.sin, step.cos, a, b, c, d, e, f];
        // It never fails.
        let _ = self.0.predict(input.into());
    }

    #[inline]
    fn update(&mut self, range: &Range) {
        let h = SMatrix::<f32, 1, STATES>::new(range.by_x, range.by_y, 0.0, 0.0, 0.0, 0.0);
        let z = Vector1::new(range.measured - range.offset);
        // It fails only for an innovation variance of zero.
        let _ = self.0.update(&LinearMeasurement::new(h, Matrix1::new(range.variance), z));
    }

    fn state(&self) -> Vector {
        (*self.0.state()).into()
    }

    fn covariance(&self) -> Matrix {
        self.0.covariance().transpose().into()
    }
}
