//! The filter that ships, on the bench's drive: seven states, sine and cosine of its own, and the
//! noise of each wheel in full, where the peers have six, get them passed in, and add a diagonal Q.

#![no_std]

use bench_workload::Filter;
use bench_workload::model::{Matrix, Range, Step, TRACK_WIDTH, Vector};
use sonarfix::ekf::{Ekf, State};
use sonarfix::motion::{Drive, WheelTravel};
use sonarfix::pose::Heading;
use sonarfix::range::ExpectedRange;
use sonarfix::units::{Metres, PerRootMetre, SquareMetres};

/// The filter.
pub struct Shipped {
    ekf: Ekf,
    /// Where the wall is seen; the filter has no use for it.
    direction: Heading,
}

impl Filter for Shipped {
    fn new(state: Vector, variances: Vector) -> Self {
        let [x, y, heading, mean, difference, track_width_error] = state;
        let state = State {
            x,
            y,
            heading,
            scale_right: mean + 0.5 * difference,
            scale_left: mean - 0.5 * difference,
            track_width_error,
            range_scale: 0.0,
        };
        // Of two equal and independent errors the mean has half the variance.
        let [x, y, heading, mean, _, width] = variances.map(libm::sqrtf);
        let scale = mean * core::f32::consts::SQRT_2;
        let deviation = State {
            x,
            y,
            heading,
            scale_right: scale,
            scale_left: scale,
            track_width_error: width,
            range_scale: 0.01,
        };
        let drive = Drive {
            track_width: Metres(TRACK_WIDTH),
            wheel_noise: PerRootMetre(Metres(0.001)),
            scale_walk: PerRootMetre(5e-6),
            track_width_walk: PerRootMetre(Metres(5e-6)),
        };
        let ekf = Ekf::new(drive, state, deviation).expect("the drive starts with finite numbers");
        Self { ekf, direction: Heading::default() }
    }

    #[inline]
    fn predict(&mut self, step: &Step) {
        // It fails on numbers that are not finite, which here are none.
        let _ = self.ekf.predict(WheelTravel::new(step.right, step.left));
    }

    #[inline]
    fn update(&mut self, range: &Range) {
        let state = self.ekf.state();
        let expected = range.expected(state.x, state.y);
        let expected = ExpectedRange {
            range: Metres(expected),
            by_x: range.by_x,
            by_y: range.by_y,
            by_heading: 0.0,
            by_range_scale: expected,
            direction: self.direction,
        };
        // As above.
        let _ = self.ekf.update(Metres(range.measured), &expected, SquareMetres(range.variance));
    }

    fn state(&self) -> Vector {
        let state = self.ekf.state();
        let (right, left) = (state.scale_right, state.scale_left);
        [
            state.x,
            state.y,
            state.heading,
            0.5 * (right + left),
            right - left,
            state.track_width_error,
        ]
    }

    /// The scale errors wheel by wheel, as the crate shows them.
    fn covariance(&self) -> Matrix {
        let p = self.ekf.covariance();
        core::array::from_fn(|i| core::array::from_fn(|j| p[(i, j)]))
    }
}
