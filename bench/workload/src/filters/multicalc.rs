//! multicalc: differentiates the model, which is written in generic numbers. There is a model with its own sine and cosine, and one with
//! sine and cosine as arguments.

use multicalc::estimation::ExtendedKalmanFilter;
use multicalc::linear_algebra::{Matrix as Multicalc, Vector as Column};
use multicalc::scalar::{Numeric, VectorFn};

use crate::model::{Matrix, Range, STATES, Step, TRACK_WIDTH, Vector, turn};
use crate::{Filter, diagonal};

/// The model with the library's sine and cosine, as in its documentation.
pub type OwnTrigonometry = MulticalcEkf<true>;
/// The model with sine and cosine of the mid-heading as arguments, continued to first order.
pub type PassedIn = MulticalcEkf<false>;

/// The filter.
pub struct MulticalcEkf<const OWN: bool>(ExtendedKalmanFilter<STATES, 1, f32>);

struct Motion<'a, const OWN: bool> {
    step: &'a Step,
    /// The heading of sine and cosine.
    mid_heading: f32,
}

impl<const OWN: bool> VectorFn<STATES, STATES> for Motion<'_, OWN> {
    #[inline]
    fn eval<S: Numeric>(&self, state: &[S; STATES]) -> [S; STATES] {
        let [x, y, heading, mean, difference, width_error] = *state;
        let number = |value: f32| S::from_f64(f64::from(value));
        let (right, left) = (self.step.right, self.step.left);
        let (sum, spread) = (number(right + left), number(right - left));
        let factor = S::ONE + mean;
        let rolled = spread * factor + S::HALF * sum * difference;
        let turn = rolled / (number(TRACK_WIDTH) + width_error);
        let advance = S::HALF * (sum * factor + S::HALF * spread * difference);
        let mid_heading = heading + S::HALF * turn;
        let (sin, cos) = if OWN {
            (mid_heading.sin(), mid_heading.cos())
        } else {
            let off = mid_heading - number(self.mid_heading);
            let (sin, cos) = (number(self.step.sin), number(self.step.cos));
            (sin + cos * off, cos - sin * off)
        };
        [x + advance * cos, y + advance * sin, heading + turn, mean, difference, width_error]
    }
}

struct Expected<'a>(&'a Range);

impl VectorFn<STATES, 1> for Expected<'_> {
    #[inline]
    fn eval<S: Numeric>(&self, state: &[S; STATES]) -> [S; 1] {
        let number = |value: f32| S::from_f64(f64::from(value));
        let Range { by_x, by_y, offset, .. } = *self.0;
        [number(by_x) * state[0] + number(by_y) * state[1] + number(offset)]
    }
}

impl<const OWN: bool> Filter for MulticalcEkf<OWN> {
    fn new(state: Vector, variances: Vector) -> Self {
        Self(ExtendedKalmanFilter::new(
            Column::new(state),
            Multicalc::new(diagonal(&variances)),
            Multicalc::zeros(),
            Multicalc::zeros(),
        ))
    }

    #[inline]
    fn predict(&mut self, step: &Step) {
        let [_, _, heading, mean, difference, width_error] = self.state();
        let (turned, _) = turn(mean, difference, width_error, step.right, step.left);
        let model = Motion::<OWN> { step, mid_heading: heading + 0.5 * turned };
        self.0.set_process_noise(Multicalc::from_diagonal(step.noise));
        // It fails only for numbers that are not finite.
        let _ = self.0.predict(&model);
    }

    #[inline]
    fn update(&mut self, range: &Range) {
        self.0.set_measurement_noise(Multicalc::new([[range.variance]]));
        // As above.
        let _ = self.0.update(&Expected(range), Column::new([range.measured]));
    }

    #[inline]
    fn state(&self) -> Vector {
        *self.0.state().as_array()
    }

    fn covariance(&self) -> Matrix {
        self.0.covariance().into_array()
    }
}
