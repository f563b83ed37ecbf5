//! numeris: models and Jacobians as closures; Joseph's form. Its `estimate` needs an allocator to
//! link, although its `Ekf` does not allocate.

use numeris::Matrix as Numeris;
use numeris::estimate::Ekf;

use crate::model::{Matrix, Motion, Range, STATES, Step, Vector};
use crate::{Filter, diagonal};

/// The filter.
pub struct NumerisEkf(Ekf<f32, STATES, 1>);

impl Filter for NumerisEkf {
    fn new(state: Vector, variances: Vector) -> Self {
        let p = Numeris::new(diagonal(&variances));
        Self(Ekf::new(numeris::Vector::from_array(state), p))
    }

    #[inline]
    fn predict(&mut self, step: &Step) {
        let state = self.state();
        let motion = Motion::new(&state, step);
        self.0.predict(
            |_| numeris::Vector::from_array(motion.moved(&state)),
            |_| Numeris::new(motion.jacobian()),
            Some(&Numeris::new(diagonal(&step.noise))),
        );
    }

    #[inline]
    fn update(&mut self, range: &Range) {
        // It fails only for an innovation variance that is not positive.
        let _ = self.0.update(
            &numeris::Vector::from_array([range.measured]),
            |x| numeris::Vector::from_array([range.expected(x[0], x[1])]),
            |_| Numeris::new([[range.by_x, range.by_y, 0.0, 0.0, 0.0, 0.0]]),
            &Numeris::new([[range.variance]]),
        );
    }

    #[inline]
    fn state(&self) -> Vector {
        core::array::from_fn(|i| self.0.state()[i])
    }

    fn covariance(&self) -> Matrix {
        core::array::from_fn(|i| core::array::from_fn(|j| self.0.covariance()[(i, j)]))
    }
}
