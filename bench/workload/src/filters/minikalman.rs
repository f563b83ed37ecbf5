//! minikalman: an extended filter over buffers: arrays, its fastest, or boxes, as in the examples of its documentation.

use minikalman::buffers::types as buffer;
use minikalman::extended::builder::{
    KalmanFilterBuilder, KalmanFilterObservationType, KalmanFilterType,
};
use minikalman::extended::{
    ExtendedKalman, ExtendedKalmanBuilder, ExtendedObservation, ExtendedObservationBuilder,
};
use minikalman::prelude::*;

use crate::model::{Matrix, Motion, Range, STATES, Step, Vector};
use crate::{Filter, diagonal};

const ENTRIES: usize = STATES * STATES;
type Square = MatrixDataArray<STATES, STATES, ENTRIES, f32>;
type Column = MatrixDataArray<STATES, 1, STATES, f32>;
type Row = MatrixDataArray<1, STATES, STATES, f32>;
type Scalar = MatrixDataArray<1, 1, 1, f32>;

type System = ExtendedKalman<
    STATES,
    f32,
    buffer::StateTransitionMatrixMutBuffer<STATES, f32, Square>,
    buffer::StateVectorBuffer<STATES, f32, Column>,
    buffer::EstimateCovarianceMatrixBuffer<STATES, f32, Square>,
    buffer::DirectProcessNoiseCovarianceMatrixMutBuffer<STATES, f32, Square>,
    buffer::PredictedStateEstimateVectorBuffer<STATES, f32, Column>,
    buffer::TemporaryStateMatrixBuffer<STATES, f32, Square>,
>;
type Observation = ExtendedObservation<
    STATES,
    1,
    f32,
    buffer::ObservationMatrixMutBuffer<1, STATES, f32, Row>,
    buffer::MeasurementVectorBuffer<1, f32, Scalar>,
    buffer::MeasurementNoiseCovarianceMatrixBuffer<1, f32, Scalar>,
    buffer::InnovationVectorBuffer<1, f32, Scalar>,
    buffer::InnovationCovarianceMatrixBuffer<1, f32, Scalar>,
    buffer::KalmanGainMatrixBuffer<STATES, 1, f32, Column>,
    buffer::TemporaryResidualCovarianceInvertedMatrixBuffer<1, f32, Scalar>,
    buffer::TemporaryHPMatrixBuffer<1, STATES, f32, Row>,
    buffer::TemporaryPHTMatrixBuffer<STATES, 1, f32, Column>,
    buffer::TemporaryKHPMatrixBuffer<STATES, f32, Square>,
>;

/// A filter over arrays.
pub struct Minikalman {
    system: System,
    observation: Observation,
}

impl Minikalman {
    fn build() -> Self {
        let zeros = [0.0; ENTRIES];
        let column = [0.0; STATES];
        let system = ExtendedKalmanBuilder::new::<STATES, f32>(
            zeros.into(),
            column.into(),
            zeros.into(),
            zeros.into(),
            column.into(),
            zeros.into(),
        );
        let observation = ExtendedObservationBuilder::new::<STATES, 1, f32>(
            column.into(),
            [0.0].into(),
            [0.0].into(),
            [0.0].into(),
            [0.0].into(),
            column.into(),
            [0.0].into(),
            column.into(),
            column.into(),
            zeros.into(),
        );
        Self { system, observation }
    }
}

/// A filter over buffers on the heap, as in the examples of its documentation.
pub struct Boxed {
    system: KalmanFilterType<STATES, f32>,
    observation: KalmanFilterObservationType<STATES, 1, f32>,
}

impl Boxed {
    fn build() -> Self {
        let builder = KalmanFilterBuilder::<STATES, f32>::default();
        Self { system: builder.build(), observation: builder.observations().build::<1>() }
    }
}

/// The two differ in their types only, which have too many parameters for a generic function.
macro_rules! filter {
    ($filter:ty) => {
        impl Filter for $filter {
            fn new(state: Vector, variances: Vector) -> Self {
                let mut filter = Self::build();
                let Self { system, .. } = &mut filter;
                system.state_vector_mut().apply(|x| {
                    for (i, &entry) in state.iter().enumerate() {
                        x.set_at(i, 0, entry);
                    }
                });
                copy(&diagonal(&variances), |i, j, entry| {
                    system.estimate_covariance_mut().as_matrix_mut().set_at(i, j, entry);
                });
                filter
            }

            #[inline]
            fn predict(&mut self, step: &Step) {
                let motion = Motion::new(&self.state(), step);
                let f = motion.jacobian();
                self.system.state_transition_jacobian_mut().apply(|matrix| {
                    copy(&f, |i, j, entry| matrix.set_at(i, j, entry));
                });
                self.system.direct_process_noise_mut().apply(|matrix| {
                    for (i, &entry) in step.noise.iter().enumerate() {
                        matrix.set_at(i, i, entry);
                    }
                });
                self.system.predict_nonlinear(|state, next| {
                    let moved = motion.moved(&core::array::from_fn(|i| state[i]));
                    for (i, &entry) in moved.iter().enumerate() {
                        next[i] = entry;
                    }
                });
            }

            #[inline]
            fn update(&mut self, range: &Range) {
                let observation = &mut self.observation;
                observation.measurement_vector_mut().apply(|z| z.set_at(0, 0, range.measured));
                observation
                    .measurement_noise_covariance_mut()
                    .apply(|r| r.set_at(0, 0, range.variance));
                observation.observation_jacobian_matrix_mut().apply(|h| {
                    h.set_at(0, 0, range.by_x);
                    h.set_at(0, 1, range.by_y);
                });
                self.system.correct_nonlinear(observation, |state, expected| {
                    expected[0] = range.expected(state[0], state[1]);
                });
            }

            #[inline]
            fn state(&self) -> Vector {
                core::array::from_fn(|i| self.system.state_vector()[i])
            }

            fn covariance(&self) -> Matrix {
                let p = self.system.estimate_covariance().as_matrix();
                core::array::from_fn(|i| core::array::from_fn(|j| p.get_at(i, j)))
            }
        }
    };
}

filter!(Minikalman);
filter!(Boxed);

#[inline]
fn copy(from: &Matrix, mut set: impl FnMut(usize, usize, f32)) {
    for (i, row) in from.iter().enumerate() {
        for (j, &entry) in row.iter().enumerate() {
            set(i, j, entry);
        }
    }
}
