//! adskalman: models as traits; the filter's step is a method of the model.

use adskalman::{
    CovarianceUpdateMethod, ObservationModel, StateAndCovariance, TransitionModelLinearNoControl,
};
use nalgebra::{SMatrix, SVector, U1, U6, Vector1};

use super::naive::{Column, Row, Square, observation, rows, square};
use crate::model::{Matrix, Motion, Range, Step, Vector};
use crate::{Filter, diagonal};

/// Linearised at the state, as its documentation describes for nonlinear models.
struct Transition {
    moved: Column,
    f: Square,
    f_transposed: Square,
    q: Square,
}

impl TransitionModelLinearNoControl<f32, U6> for Transition {
    fn F(&self) -> &Square {
        &self.f
    }

    fn FT(&self) -> &Square {
        &self.f_transposed
    }

    fn Q(&self) -> &Square {
        &self.q
    }

    /// The library's prediction is F x for the state; here the state moves by the model.
    #[inline]
    fn predict(&self, previous: &StateAndCovariance<f32, U6>) -> StateAndCovariance<f32, U6> {
        let covariance = ((self.F() * previous.covariance()) * self.FT()) + self.Q();
        StateAndCovariance::new(self.moved, covariance)
    }
}

struct Observation {
    range: Range,
    h: Row,
    h_transposed: Column,
    r: SMatrix<f32, 1, 1>,
}

impl ObservationModel<f32, U6, U1> for Observation {
    fn H(&self) -> &Row {
        &self.h
    }

    fn HT(&self) -> &Column {
        &self.h_transposed
    }

    fn R(&self) -> &SMatrix<f32, 1, 1> {
        &self.r
    }

    fn predict_observation(&self, state: &Column) -> SVector<f32, 1> {
        Vector1::new(self.range.expected(state[0], state[1]))
    }
}

/// Its default, Joseph's form.
pub type Joseph = Adskalman<true>;
/// Its `OptimalKalmanForcedSymmetric`.
pub type Symmetric = Adskalman<false>;

/// The filter.
pub struct Adskalman<const JOSEPH: bool>(StateAndCovariance<f32, U6>);

impl<const JOSEPH: bool> Filter for Adskalman<JOSEPH> {
    fn new(state: Vector, variances: Vector) -> Self {
        Self(StateAndCovariance::new(state.into(), square(&diagonal(&variances))))
    }

    #[inline]
    fn predict(&mut self, step: &Step) {
        let state = (*self.0.state()).into();
        let motion = Motion::new(&state, step);
        let f = square(&motion.jacobian());
        let model = Transition {
            moved: motion.moved(&state).into(),
            f,
            f_transposed: f.transpose(),
            q: Square::from_diagonal(&step.noise.into()),
        };
        self.0 = model.predict(&self.0);
    }

    #[inline]
    fn update(&mut self, range: &Range) {
        let h = observation(range);
        let model = Observation {
            range: *range,
            h,
            h_transposed: h.transpose(),
            r: SMatrix::<f32, 1, 1>::new(range.variance),
        };
        let method = if JOSEPH {
            CovarianceUpdateMethod::JosephForm
        } else {
            CovarianceUpdateMethod::OptimalKalmanForcedSymmetric
        };
        if let Ok(corrected) = model.update(&self.0, &Vector1::new(range.measured), method) {
            self.0 = corrected;
        }
    }

    fn state(&self) -> Vector {
        (*self.0.state()).into()
    }

    fn covariance(&self) -> Matrix {
        rows(self.0.covariance())
    }
}
