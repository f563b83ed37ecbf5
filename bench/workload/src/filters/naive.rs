//! The textbook's equations directly in nalgebra.

use nalgebra::{SMatrix, SVector};

use crate::model::{Matrix, Motion, Range, STATES, Step, Vector};
use crate::{Filter, diagonal};

/// A 6×6 matrix.
pub(crate) type Square = SMatrix<f32, STATES, STATES>;
/// A row of six.
pub(crate) type Row = SMatrix<f32, 1, STATES>;
/// A column of six.
pub(crate) type Column = SVector<f32, STATES>;

/// A matrix of nalgebra from rows.
#[inline]
pub(crate) fn square(rows: &Matrix) -> Square {
    Square::from_fn(|i, j| rows[i][j])
}

/// The rows of a matrix of nalgebra.
pub(crate) fn rows(matrix: &Square) -> Matrix {
    matrix.transpose().into()
}

/// H of a range.
#[inline]
pub(crate) fn observation(range: &Range) -> Row {
    Row::new(range.by_x, range.by_y, 0.0, 0.0, 0.0, 0.0)
}

/// P ← (I − K H) P.
pub type Plain = Naive<false>;
/// P ← (I − K H) P (I − K H)ᵀ + K R Kᵀ.
pub type Joseph = Naive<true>;

/// The filter.
pub struct Naive<const JOSEPH: bool> {
    x: Column,
    p: Square,
}

impl<const JOSEPH: bool> Filter for Naive<JOSEPH> {
    fn new(state: Vector, variances: Vector) -> Self {
        Self { x: state.into(), p: square(&diagonal(&variances)) }
    }

    #[inline]
    fn predict(&mut self, step: &Step) {
        let state = self.x.into();
        let motion = Motion::new(&state, step);
        let f = square(&motion.jacobian());
        self.x = motion.moved(&state).into();
        self.p = f * self.p * f.transpose() + Square::from_diagonal(&step.noise.into());
    }

    #[inline]
    fn update(&mut self, range: &Range) {
        let h = observation(range);
        let innovation = range.measured - range.expected(self.x[0], self.x[1]);
        let m = self.p * h.transpose();
        let k = m / ((h * m)[0] + range.variance);
        self.x += k * innovation;
        let rest = Square::identity() - k * h;
        self.p = if JOSEPH {
            rest * self.p * rest.transpose() + k * range.variance * k.transpose()
        } else {
            rest * self.p
        };
    }

    fn state(&self) -> Vector {
        self.x.into()
    }

    fn covariance(&self) -> Matrix {
        rows(&self.p)
    }
}
