//! Sonarfix on the drive of the benchmark. [`kernel`] is the arithmetic alone, at the peers' task. [`Shipped`] is the shipped filter:
//! seven states, its own sine and cosine, and the full noise of each wheel, where the peers have six states, sine and
//! cosine as arguments, and a diagonal Q.

#![no_std]

pub mod kernel;

use bench_workload::Filter;
use bench_workload::model::{Matrix, Range, Step, TRACK_WIDTH, Vector};
use sonarfix::filter::ekf::{Ekf, StandardDeviations, StateEstimate};
use sonarfix::filter::motion::{Drive, WheelTravel};
use sonarfix::geometry::pose::Heading;
use sonarfix::geometry::units::{Metres, PerRootMetre, SquareMetres};
use sonarfix::sensor::range::ExpectedRange;

/// The filter.
pub struct Shipped {
    ekf: Ekf,
    /// The pose at which the wall is measured; the filter does not need it.
    direction: Heading,
}

impl Filter for Shipped {
    fn new(state: Vector, variances: Vector) -> Self {
        let ekf = Ekf::new(drive(), shown(state), deviation(variances));
        let ekf = ekf.expect("the drive starts with finite numbers");
        Self { ekf, direction: Heading::default() }
    }

    #[inline]
    fn predict(&mut self, step: &Step) {
        // It fails only for numbers that are not finite.
        let _ = self.ekf.predict(WheelTravel::new(step.right, step.left));
    }

    #[inline]
    fn update(&mut self, range: &Range) {
        let state = self.ekf.state();
        let expected = range.expected(state.x.0, state.y.0);
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
        scales(&self.ekf.state())
    }

    fn covariance(&self) -> Matrix {
        let p = self.ekf.covariance();
        scales_of(|i, j| p[(i, j)])
    }
}

/// The wheels of the benchmark.
fn drive() -> Drive {
    Drive {
        track_width: Metres(TRACK_WIDTH),
        wheel_noise: PerRootMetre(Metres(0.001)),
        scale_walk: PerRootMetre(5e-6),
        track_width_walk: PerRootMetre(Metres(5e-6)),
    }
}

/// The six states of the benchmark in the crate's public state.
fn shown([x, y, heading, mean, difference, track_width_error]: Vector) -> StateEstimate {
    let (right, left) = (mean + 0.5 * difference, mean - 0.5 * difference);
    StateEstimate::from_array([x, y, heading, right, left, track_width_error, 0.0])
}

/// The inverse.
fn scales(state: &StateEstimate) -> Vector {
    let (right, left) = (state.scale_right, state.scale_left);
    let (mean, difference) = (0.5 * (right + left), right - left);
    [state.x.0, state.y.0, state.heading.0, mean, difference, state.track_width_error.0]
}

/// The covariance of the benchmark from that of the crate's public state.
fn scales_of(p: impl Fn(usize, usize) -> f32) -> Matrix {
    // Rows of the six states by those of the public state.
    let row = |i: usize, p: [f32; 7]| match i {
        3 => 0.5 * (p[3] + p[4]),
        4 => p[3] - p[4],
        _ => p[i],
    };
    let column =
        |j: usize| core::array::from_fn::<f32, 7, _>(|i| row(j, core::array::from_fn(|k| p(i, k))));
    core::array::from_fn(|i| core::array::from_fn(|j| row(i, column(j))))
}

/// Standard deviations in the crate's type.
fn deviation(variances: Vector) -> StandardDeviations {
    let [x, y, heading, mean, _, width] = variances.map(libm::sqrtf);
    // Of two equal and independent errors the mean has half the variance.
    let scale = mean * core::f32::consts::SQRT_2;
    StandardDeviations::from_array([x, y, heading, scale, scale, width, 0.01])
}
