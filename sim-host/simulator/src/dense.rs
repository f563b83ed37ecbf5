//! The same estimation problem in `f64` and dense matrices, written from the equations of
//! `docs/model.md` without code of the core: the oracle that the `f32` filter is compared with, and
//! the recursion of the bound.

#![expect(
    clippy::indexing_slicing,
    reason = "vectors and matrices of a fixed size, indexed by constants of the model"
)]

use std::ops::Range;

use nalgebra::{SMatrix, SVector};
use sonarfix::config::{Config, RangerParameters, Ranging};

use crate::angle;

/// Number of states.
const STATES: usize = 7;
/// x, y, heading, right and left scale error, track-width error, range scale error.
pub type Vector = SVector<f64, STATES>;
/// 7×7, in the order of [`Vector`].
pub type Matrix = SMatrix<f64, STATES, STATES>;

/// The states that a motion changes: x, y, heading.
const MOVED: usize = 3;
/// The states that a motion depends on: heading, scale errors of the wheels, track-width error.
const MOVING: Range<usize> = 2..6;

/// P becomes F P Fᵀ. F differs from the identity only in the rows of [`MOVED`] states and the columns of [`MOVING`] ones, above its
/// diagonal: only the products with those entries are computed, in place, as no state is changed before it is used.
fn transform(p: &mut Matrix, f: &Matrix) {
    for column in 0..STATES {
        for k in MOVING {
            for row in 0..MOVED.min(k) {
                p[(row, column)] += f[(row, k)] * p[(k, column)];
            }
        }
    }
    for k in MOVING {
        for column in 0..MOVED.min(k) {
            for row in 0..STATES {
                p[(row, column)] += p[(row, k)] * f[(column, k)];
            }
        }
    }
}

/// A wall's line, as a point on it and its unit normal, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// A point on the line.
    pub point: [f64; 2],
    /// Unit normal (a, b) of eq. (1).
    pub normal: [f64; 2],
}

impl Line {
    /// The line through two points.
    #[must_use]
    pub fn through(from: [f64; 2], to: [f64; 2]) -> Self {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length = libm::hypot(dx, dy);
        Self { point: from, normal: [-dy / length, dx / length] }
    }
}

/// The parameters of the filter's model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model {
    /// Nominal track width, metres.
    pub track_width: f64,
    /// Variance of a wheel's travel per metre, m²/m.
    pub wheel_variance: f64,
    /// Random walk of a scale error: variance per metre, 1/m.
    pub scale_variance: f64,
    /// Random walk of the track-width error: variance per metre, m²/m.
    pub width_variance: f64,
    /// Mounting position of the sonar: ahead and left, metres.
    pub mount: [f64; 2],
    /// Range noise at zero range, metres.
    pub noise_floor: f64,
    /// Range noise per metre of range.
    pub noise_per_metre: f64,
    /// Of a time-of-flight ranger the standard deviation of the direction of its beam, radians; of a sonar none.
    pub pointing: Option<f64>,
}

impl Model {
    /// The model of a filter's configuration.
    #[must_use]
    pub fn of(config: &Config) -> Self {
        let square = |v: f32| f64::from(v) * f64::from(v);
        Self {
            track_width: config.drive.track_width.0.into(),
            wheel_variance: square(config.drive.wheel_noise.0.0),
            scale_variance: square(config.drive.scale_walk.0),
            width_variance: square(config.drive.track_width_walk.0.0),
            mount: [config.rangers.first.mount.x.0.into(), config.rangers.first.mount.y.0.into()],
            noise_floor: config.rangers.first.noise.floor.0.into(),
            noise_per_metre: config.rangers.first.noise.per_metre.into(),
            pointing: match config.rangers.first.ranging {
                Ranging::Sound => None,
                Ranging::Light(beam) => Some(beam.pointing.0.into()),
            },
        }
    }

    /// The same with another ranger of the robot.
    #[must_use]
    pub fn of_ranger(config: &Config, sonar: &RangerParameters) -> Self {
        let mut config = *config;
        config.rangers.first = *sonar;
        Self::of(&config)
    }

    /// f(x, u): the state after the encoders read `travel` (right, left), metres.
    #[must_use]
    pub fn moved(&self, x: &Vector, travel: [f64; 2]) -> Vector {
        let (right, left) = (travel[0] * (1.0 + x[3]), travel[1] * (1.0 + x[4]));
        let turn = (right - left) / (self.track_width + x[5]);
        let (sin, cos) = libm::sincos(x[2] + turn / 2.0);
        let advance = f64::midpoint(right, left);
        let mut next = *x;
        next[0] += advance * cos;
        next[1] += advance * sin;
        next[2] = angle::wrap(x[2] + turn);
        next
    }

    /// The turn of the robot when the encoders read `travel` (right, left), metres: radians.
    #[must_use]
    pub fn turn(&self, x: &Vector, travel: [f64; 2]) -> f64 {
        (travel[0] * (1.0 + x[3]) - travel[1] * (1.0 + x[4])) / (self.track_width + x[5])
    }

    /// ∂f/∂x and ∂f/∂u at a state and travel.
    #[must_use]
    pub fn motion_jacobians(&self, x: &Vector, travel: [f64; 2]) -> (Matrix, SMatrix<f64, 7, 2>) {
        let factor = [1.0 + x[3], 1.0 + x[4]];
        let width = self.track_width + x[5];
        let turn = (travel[0] * factor[0] - travel[1] * factor[1]) / width;
        let advance = f64::midpoint(travel[0] * factor[0], travel[1] * factor[1]);
        let (sin, cos) = libm::sincos(x[2] + turn / 2.0);
        // Rows x, y, heading of the derivative by anything that changes advance and turn.
        let column = |by_advance: f64, by_turn: f64| {
            [
                by_advance * cos - advance * sin * by_turn / 2.0,
                by_advance * sin + advance * cos * by_turn / 2.0,
                by_turn,
            ]
        };
        let mut f = Matrix::identity();
        f[(0, 2)] = -advance * sin;
        f[(1, 2)] = advance * cos;
        let scale_right = column(travel[0] / 2.0, travel[0] / width);
        let scale_left = column(travel[1] / 2.0, -travel[1] / width);
        let track_width = column(0.0, -turn / width);
        let mut g = SMatrix::<f64, 7, 2>::zeros();
        let right = column(factor[0] / 2.0, factor[0] / width);
        let left = column(factor[1] / 2.0, -factor[1] / width);
        for row in 0..3 {
            f[(row, 3)] = scale_right[row];
            f[(row, 4)] = scale_left[row];
            f[(row, 5)] = track_width[row];
            g[(row, 0)] = right[row];
            g[(row, 1)] = left[row];
        }
        (f, g)
    }

    /// h(x) for a wall's line, and its derivative H.
    #[must_use]
    pub fn range(&self, x: &Vector, line: &Line) -> (f64, Vector) {
        let (sin, cos) = libm::sincos(x[2]);
        let [ahead, aside] = self.mount;
        let lever = [cos * ahead - sin * aside, sin * ahead + cos * aside];
        let [a, b] = line.normal;
        let signed = a * (x[0] + lever[0] - line.point[0]) + b * (x[1] + lever[1] - line.point[1]);
        let slope = signed.signum() * (1.0 + x[6]);
        let mut h = Vector::zeros();
        h[0] = slope * a;
        h[1] = slope * b;
        h[2] = slope * (b * lever[0] - a * lever[1]);
        h[6] = signed.abs();
        ((1.0 + x[6]) * signed.abs(), h)
    }

    /// What a ping at a bearing measures of a wall's line: h(x), H, and the variance of its noise.
    #[must_use]
    pub fn measured(&self, x: &Vector, line: &Line, bearing: f64) -> (f64, Vector, f64) {
        let Some(pointing) = self.pointing else {
            let (range, h) = self.range(x, line);
            return (range, h, self.range_variance(range));
        };
        let (range, h, by_bearing) = self.range_along(x, line, bearing);
        (range, h, self.range_variance(range) + (by_bearing * pointing).powi(2))
    }

    /// The range along a beam at a bearing, its derivative H, and that by the bearing: eqs. (45) and (46).
    #[must_use]
    pub fn range_along(&self, x: &Vector, line: &Line, bearing: f64) -> (f64, Vector, f64) {
        let (sin, cos) = libm::sincos(x[2]);
        let [ahead, aside] = self.mount;
        let lever = [cos * ahead - sin * aside, sin * ahead + cos * aside];
        let [a, b] = line.normal;
        let signed = a * (x[0] + lever[0] - line.point[0]) + b * (x[1] + lever[1] - line.point[1]);
        let (sin, cos) = libm::sincos(x[2] + bearing);
        let approach = a * cos + b * sin;
        let distance = -signed / approach;
        let scale = 1.0 + x[6];
        let by_bearing = -scale * distance * (b * cos - a * sin) / approach;
        let mut h = Vector::zeros();
        h[0] = -scale * a / approach;
        h[1] = -scale * b / approach;
        h[2] = -scale * (b * lever[0] - a * lever[1]) / approach + by_bearing;
        h[6] = distance;
        (scale * distance, h, by_bearing)
    }

    /// Variance of a range, m².
    #[must_use]
    pub fn range_variance(&self, range: f64) -> f64 {
        self.noise_floor.powi(2) + (self.noise_per_metre * range).powi(2)
    }
}

/// The textbook filter: state, covariance, dense products.
#[derive(Debug, Clone, PartialEq)]
pub struct DenseFilter {
    /// The model.
    pub model: Model,
    /// The state X̂, or, for the bound, the truth.
    pub x: Vector,
    /// The covariance P.
    pub p: Matrix,
}

impl DenseFilter {
    /// Eqs. (4)–(5) and (7)–(8).
    pub fn predict(&mut self, travel: [f64; 2]) {
        self.propagate(travel);
        self.x = self.model.moved(&self.x, travel);
    }

    /// Eq. (5): the covariance after the encoders read `travel` (right, left), metres.
    pub fn propagate(&mut self, travel: [f64; 2]) {
        let (f, g) = self.model.motion_jacobians(&self.x, travel);
        let m = &self.model;
        let wheels = [travel[0].abs(), travel[1].abs()].map(|metres| metres * m.wheel_variance);
        let distance = f64::midpoint(travel[0].abs(), travel[1].abs());
        transform(&mut self.p, &f);
        for row in 0..MOVED {
            for column in 0..MOVED {
                self.p[(row, column)] += g[(row, 0)] * wheels[0] * g[(column, 0)]
                    + g[(row, 1)] * wheels[1] * g[(column, 1)];
            }
        }
        self.p[(3, 3)] += m.scale_variance * distance;
        self.p[(4, 4)] += m.scale_variance * distance;
        self.p[(5, 5)] += m.width_variance * distance;
    }

    /// Eqs. (6) and (10)–(14), in Joseph's form.
    pub fn correct(&mut self, line: &Line, range: f64) {
        self.correct_at(line, 0.0, range);
    }

    /// The same for a ping at a bearing, which matters to a time-of-flight ranger.
    pub fn correct_at(&mut self, line: &Line, bearing: f64, range: f64) {
        let (expected, h, noise) = self.model.measured(&self.x, line, bearing);
        let gain = self.p * h / (h.dot(&(self.p * h)) + noise);
        let keep = Matrix::identity() - gain * h.transpose();
        self.p = keep * self.p * keep.transpose() + gain * gain.transpose() * noise;
        self.x += gain * (range - expected);
        self.x[2] = angle::wrap(self.x[2]);
    }

    /// The covariance after one state was measured with noise of this variance.
    pub fn correct_state(&mut self, state: usize, noise: f64) {
        let mut h = Vector::zeros();
        h[state] = 1.0;
        let gain = self.p * h / (h.dot(&(self.p * h)) + noise);
        let keep = Matrix::identity() - gain * h.transpose();
        self.p = keep * self.p * keep.transpose() + gain * gain.transpose() * noise;
    }

    /// One standard deviation of each state.
    #[must_use]
    pub fn standard_deviations(&self) -> Vector {
        self.p.diagonal().map(f64::sqrt)
    }
}
