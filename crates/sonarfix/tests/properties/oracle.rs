//! The equations of `docs/model.md` in dense `f64`, written from that page and not from the code.
//! Equation (7) is implemented once as a function; its Jacobians are central differences, so no
//! analytic derivative is written twice.

use nalgebra::{RowSVector, SMatrix, SVector};
use sonarfix::filter::ekf::Ekf;
use sonarfix::filter::motion::{Drive, WheelTravel};
use sonarfix::geometry::pose::Point;
use sonarfix::sensor::range::ExpectedRange;

pub type Vector = SVector<f64, 7>;
pub type Matrix = SMatrix<f64, 7, 7>;
pub type Wheels = SMatrix<f64, 7, 2>;
pub type Row = RowSVector<f64, 7>;

/// Half a unit in the last place of 1: the largest rounding error of an `f32` of magnitude 1.
pub const ROUNDING: f64 = f32::EPSILON as f64 / 2.0;

/// ε of eq. (20): the smallest variance as a share of its terms.
pub const SHARPEST: f64 = 1.0 / 16_384.0;

/// Index of a state in the vector.
pub const X: usize = 0;
pub const Y: usize = 1;
pub const HEADING: usize = 2;
pub const SCALE_RIGHT: usize = 3;
pub const SCALE_LEFT: usize = 4;
pub const TRACK_WIDTH: usize = 5;
pub const RANGE_SCALE: usize = 6;

/// The estimate of a filter, exactly.
pub fn state_of(ekf: &Ekf) -> Vector {
    ekf.state_vector().map(f64::from)
}

/// The covariance of a filter, exactly.
pub fn covariance_of(ekf: &Ekf) -> Matrix {
    ekf.covariance().map(f64::from)
}

/// The parameters of the drive.
#[derive(Debug, Clone, Copy)]
pub struct Robot {
    pub track_width: f64,
    pub wheel_noise: f64,
    pub scale_walk: f64,
    pub track_width_walk: f64,
}

impl From<&Drive> for Robot {
    fn from(drive: &Drive) -> Self {
        Self {
            track_width: drive.track_width.0.into(),
            wheel_noise: drive.wheel_noise.0.0.into(),
            scale_walk: drive.scale_walk.0.into(),
            track_width_walk: drive.track_width_walk.0.0.into(),
        }
    }
}

/// Right and left travel, exactly.
pub fn travel_of(travel: WheelTravel) -> SVector<f64, 2> {
    SVector::<f64, 2>::new(travel.right.0.into(), travel.left.0.into())
}

impl Robot {
    /// Eq. (7): the change of the state by a step.
    pub fn step(&self, state: &Vector, travel: &SVector<f64, 2>) -> Vector {
        let right = travel[0] * (1.0 + state[SCALE_RIGHT]);
        let left = travel[1] * (1.0 + state[SCALE_LEFT]);
        let turn = (right - left) / (self.track_width + state[TRACK_WIDTH]);
        let advance = f64::midpoint(right, left);
        let middle = state[HEADING] + turn / 2.0;
        let mut step = Vector::zeros();
        step[X] = advance * middle.cos();
        step[Y] = advance * middle.sin();
        step[HEADING] = turn;
        step
    }

    /// F: derivative of the state after a step by the state before it.
    pub fn by_state(&self, state: &Vector, travel: &SVector<f64, 2>) -> Matrix {
        // All functions are smooth over a tenth of a unit, the track width over a tenth of itself.
        let h = 1e-5;
        let by = |j| {
            let mut d = Vector::zeros();
            d[j] = h;
            (self.step(&(state + d), travel) - self.step(&(state - d), travel)) / (2.0 * h)
        };
        Matrix::identity() + Matrix::from_columns(&core::array::from_fn::<_, 7, _>(by))
    }

    /// G: derivative by the measured travels.
    pub fn by_travel(&self, state: &Vector, travel: &SVector<f64, 2>) -> Wheels {
        let h = 1e-5;
        let (right, left) = (SVector::<f64, 2>::new(h, 0.0), SVector::<f64, 2>::new(0.0, h));
        let column = |step| {
            (self.step(state, &(travel + step)) - self.step(state, &(travel - step))) / (2.0 * h)
        };
        Wheels::from_columns(&[column(right), column(left)])
    }

    /// Q of eq. (9): the process noise of a step.
    pub fn noise(&self, state: &Vector, travel: &SVector<f64, 2>) -> Matrix {
        let g = self.by_travel(state, travel);
        let per_metre = self.wheel_noise * self.wheel_noise;
        let wheels = SMatrix::<f64, 2, 2>::from_diagonal(&(travel.abs() * per_metre));
        g * wheels * g.transpose() + self.walk(travel)
    }

    /// The random walk of the calibration over a step.
    pub fn walk(&self, travel: &SVector<f64, 2>) -> Matrix {
        let rolled = travel.abs().sum() / 2.0;
        let mut q = Matrix::zeros();
        q[(SCALE_RIGHT, SCALE_RIGHT)] = self.scale_walk * self.scale_walk * rolled;
        q[(SCALE_LEFT, SCALE_LEFT)] = self.scale_walk * self.scale_walk * rolled;
        q[(TRACK_WIDTH, TRACK_WIDTH)] = self.track_width_walk * self.track_width_walk * rolled;
        q
    }

    /// `q_x`, `q_y` and `q_h` of eq. (10): the part of the rounding that the wheel noise does not
    /// cover.
    pub fn rounding_noise(&self, p: &Matrix, state: &Vector, travel: &SVector<f64, 2>) -> Matrix {
        let per_metre = self.wheel_noise * self.wheel_noise;
        let of = |wheel: usize, scale: usize| {
            per_metre * travel[wheel].abs() * (1.0 + state[scale]).powi(2)
        };
        let wheels = of(0, SCALE_RIGHT) + of(1, SCALE_LEFT);
        let width = self.track_width + state[TRACK_WIDTH];
        let mut q = Matrix::zeros();
        for (state, noise) in
            [(X, wheels / 4.0), (Y, wheels / 4.0), (HEADING, wheels / (width * width))]
        {
            q[(state, state)] = (2.0 * ROUNDING * p[(state, state)] - noise).max(0.0);
        }
        q
    }

    /// Eq. (5).
    pub fn predicted(&self, p: &Matrix, state: &Vector, travel: &SVector<f64, 2>) -> Matrix {
        let f = self.by_state(state, travel);
        f * p * f.transpose() + self.noise(state, travel)
    }

    /// Magnitude of the terms of which the entries of [`Self::predicted`] are the sums: the same
    /// sums without cancellation, with 1 for sine and cosine and without the difference of the
    /// wheels in the turn. Single precision is exact to a small multiple of this times
    /// [`ROUNDING`].
    pub fn size_of_terms(&self, p: &Matrix, state: &Vector, travel: &SVector<f64, 2>) -> Matrix {
        let width = self.track_width + state[TRACK_WIDTH];
        let (right, left) = (travel[0].abs() * 1.1, travel[1].abs() * 1.1);
        let advance = f64::midpoint(right, left);
        // Derivatives of Δψ by S_R, S_L, δD; of x or y by ψ, S_R, S_L, δD.
        let turn = [right / width, left / width, (right + left) / width / width];
        let mut f = Matrix::identity();
        for (axis, along) in [(X, 1.0), (Y, 1.0), (HEADING, 0.0)] {
            let by_heading = if axis == HEADING { 1.0 } else { advance };
            f[(axis, HEADING)] = by_heading;
            // The scale errors are held as mean and difference: each wheel contributes to both.
            let by_scale = along * advance + by_heading * (turn[0] + turn[1]);
            f[(axis, SCALE_RIGHT)] = by_scale;
            f[(axis, SCALE_LEFT)] = by_scale;
            f[(axis, TRACK_WIDTH)] = by_heading * turn[2];
        }
        let mut g = Wheels::zeros();
        for axis in [X, Y] {
            g.row_mut(axis).fill(0.55 + advance / width);
        }
        g.row_mut(HEADING).fill(1.1 / width);
        let per_metre = self.wheel_noise * self.wheel_noise;
        let wheels = SMatrix::<f64, 2, 2>::from_diagonal(&(travel.abs() * per_metre));
        let rolled = self.noise(state, travel);
        f * size_by_both_wheels(&p.abs()) * f.transpose()
            + g * wheels * g.transpose()
            + rolled.abs()
    }
}

/// Magnitude at which entries are rounded when the scale errors are held as mean and difference:
/// entries of one wheel are rounded at the magnitude of both.
pub fn size_by_both_wheels(size: &Matrix) -> Matrix {
    let mut both = Matrix::identity();
    both[(SCALE_RIGHT, SCALE_LEFT)] = 1.0;
    both[(SCALE_LEFT, SCALE_RIGHT)] = 1.0;
    both * size * both.transpose()
}

/// A wall by its two ends, and the position of the sonar on the robot.
#[derive(Debug, Clone, Copy)]
pub struct View {
    pub from: (f64, f64),
    pub to: (f64, f64),
    pub mount: (f64, f64),
}

/// Coordinates of a point, exactly.
pub fn coordinates(point: Point) -> (f64, f64) {
    (point.x.0.into(), point.y.0.into())
}

impl View {
    pub fn new(from: Point, to: Point, mount: Point) -> Self {
        Self { from: coordinates(from), to: coordinates(to), mount: coordinates(mount) }
    }

    /// Unit tangent and length.
    pub fn tangent(&self) -> (f64, f64, f64) {
        let (dx, dy) = (self.to.0 - self.from.0, self.to.1 - self.from.1);
        let length = dx.hypot(dy);
        (dx / length, dy / length, length)
    }

    /// Position of the sonar.
    pub fn sonar(&self, state: &Vector) -> (f64, f64) {
        let (sin, cos) = state[HEADING].sin_cos();
        (
            state[X] + cos * self.mount.0 - sin * self.mount.1,
            state[Y] + sin * self.mount.0 + cos * self.mount.1,
        )
    }

    /// Eq. (1) for any point: signed distance.
    pub fn distance(&self, point: (f64, f64)) -> f64 {
        let (tx, ty, _) = self.tangent();
        -ty * (point.0 - self.from.0) + tx * (point.1 - self.from.1)
    }

    /// Distance of the foot of a point along the wall.
    pub fn along(&self, point: (f64, f64)) -> f64 {
        let (tx, ty, _) = self.tangent();
        tx * (point.0 - self.from.0) + ty * (point.1 - self.from.1)
    }

    /// Eq. (11).
    pub fn expected_range(&self, state: &Vector) -> f64 {
        (1.0 + state[RANGE_SCALE]) * self.distance(self.sonar(state)).abs()
    }

    /// H, by central differences of eq. (11).
    pub fn by_state(&self, state: &Vector) -> Row {
        let step = 1e-5;
        Row::from_fn(|_, j| {
            let mut h = Vector::zeros();
            h[j] = step;
            (self.expected_range(&(state + h)) - self.expected_range(&(state - h))) / (2.0 * step)
        })
    }
}

/// H of the crate as a row.
pub fn jacobian_of(expected: &ExpectedRange) -> Row {
    Row::from([
        expected.by_x.into(),
        expected.by_y.into(),
        expected.by_heading.into(),
        0.0,
        0.0,
        0.0,
        expected.by_range_scale.into(),
    ])
}

/// The gain, eq. (18), and Joseph's form, eq. (19), of a correction.
pub fn corrected(p: &Matrix, h: &Row, r: f64) -> (Vector, Matrix) {
    let s = (h * p * h.transpose())[0] + r;
    let gain = p * h.transpose() / s;
    let left = Matrix::identity() - gain * h;
    (gain, left * p * left.transpose() + gain * r * gain.transpose())
}

/// Eq. (20): the noise with which a range is used, or `None` if it is saturated.
pub fn limited_noise(p: &Matrix, h: &Row, r: f64) -> Option<f64> {
    let (_, exact) = corrected(p, h, r);
    let least = SHARPEST * variance_of_terms(&exact, h);
    let along = variance_along(p, h);
    (along > least).then(|| r.max(along * least / (along - least)))
}

/// The correlations of the states that are not known exactly; 1 on the diagonal of the others.
pub fn correlations(p: &Matrix) -> Matrix {
    let known = |i: usize| p.row(i).iter().all(|v| *v == 0.0);
    Matrix::from_fn(|i, j| {
        if i == j || known(i) || known(j) {
            f64::from(u8::from(i == j))
        } else {
            p[(i, j)] / (p[(i, i)] * p[(j, j)]).sqrt()
        }
    })
}

/// Whether every eigenvalue of the correlations is positive, which is equivalent to the existence
/// of the Cholesky factorisation. In `f64` it resolves 1e-15, and needs no iteration that might not
/// converge.
pub fn is_positive_definite(p: &Matrix) -> bool {
    let variances_are_sound = p.diagonal().iter().all(|v| *v >= 0.0);
    variances_are_sound && correlations(p).cholesky().is_some()
}

/// H P Hᵀ.
pub fn variance_along(p: &Matrix, h: &Row) -> f64 {
    (h * p * h.transpose())[0]
}

/// Sum of the magnitudes of the terms of H P Hᵀ.
pub fn variance_of_terms(p: &Matrix, h: &Row) -> f64 {
    (0..7).map(|i| h[i] * h[i] * p[(i, i)]).sum()
}

/// The difference of two angles, in [−π, π].
pub fn turn_between(a: f64, b: f64) -> f64 {
    let turn = (a - b).rem_euclid(core::f64::consts::TAU);
    if turn > core::f64::consts::PI { turn - core::f64::consts::TAU } else { turn }
}
