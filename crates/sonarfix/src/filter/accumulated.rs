//! The motion of several odometry increments, accumulated until P is asked for (`docs/model.md`, "Covariance on demand").
//!
//! An error of the travel of one wheel turns the robot about the contact point of the other wheel. So do an error of its scale
//! and its noise. The Jacobian and the process noise of an interval therefore follow from sums over its increments of the
//! travel and of the noise of a wheel, times powers of the position of the other wheel, relative to the start of the interval.
//! An increment costs a few additions to these sums instead of a propagation of P.
//!
//! # Non-finite policy
//! No value is refused here; [`Ekf::predict`](crate::filter::ekf::Ekf::predict) limits the interval.

use crate::filter::covariance::Transition;
use crate::filter::motion::{Drive, WheelTravel};
use crate::filter::process_noise::NoiseDensities;
use crate::geometry::numeric::at_most;
use crate::state::estimate::{FilterEstimate, wheels};

/// Longest distance of both wheels together over which motion is accumulated, metres.
pub const LONGEST: f32 = 2.0;
/// The same in wheel noise per random walk. The random walk within the interval, which P has only in the mean, is then less
/// than a thousandth of the variance by the noise.
const LONGEST_IN_NOISE_PER_WALK: f32 = 0.15;

/// The longest interval by the noise of a drive, metres of both wheels together.
pub fn longest_interval(drive: &Drive) -> f32 {
    let noise = LONGEST_IN_NOISE_PER_WALK * drive.wheel_noise.0.0;
    let limit = |longest: f32, noise: f32, walk: f32| {
        if walk.abs() > 0.0 { at_most((noise / walk).abs(), longest) } else { longest }
    };
    let by_scale = limit(LONGEST, noise, drive.scale_walk.0);
    limit(by_scale, noise * drive.track_width.0, drive.track_width_walk.0.0)
}

/// What an increment needs of the drive at an estimate of its calibration.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CalibratedDrive {
    /// A quarter of 1 + S of each wheel: half of the advance by the travel of this wheel.
    quarter_right: f32,
    quarter_left: f32,
    /// 2/W, 1/m.
    twice_per_width: f32,
    /// W/2, metres.
    half_width: f32,
    /// Variance of the turn that the noise of a wheel causes, per metre of its travel, rad²/m: `σ_w²` (1 + S)²/W².
    noise_right: f32,
    noise_left: f32,
}

impl CalibratedDrive {
    /// A drive of this nominal track width at an estimate.
    #[must_use]
    pub fn new(track_width: f32, densities: &NoiseDensities, at: &FilterEstimate) -> Self {
        let (right, left) = wheels(1.0 + at.scale_common, at.scale_difference);
        let width = track_width + at.track_width_error;
        let twice_per_width = 2.0 / width;
        let noise = densities.advance() * twice_per_width * twice_per_width;
        Self {
            quarter_right: 0.25 * right,
            quarter_left: 0.25 * left,
            twice_per_width,
            half_width: 0.5 * width,
            noise_right: noise * right * right,
            noise_left: noise * left * left,
        }
    }

    /// W, metres.
    pub(crate) fn width(&self) -> f32 {
        self.half_width + self.half_width
    }

    /// Whether the true travel of each wheel is at most twice the measured one.
    pub(crate) fn is_usual(&self) -> bool {
        // False for NaN.
        self.quarter_right.abs() <= 0.5 && self.quarter_left.abs() <= 0.5
    }

    /// Turn of a travel, radians.
    pub(crate) fn turn(&self, travel: WheelTravel) -> f32 {
        let half = travel.right.0 * self.quarter_right - travel.left.0 * self.quarter_left;
        (half + half) * self.twice_per_width
    }

    /// The noise of a travel.
    #[inline]
    #[must_use]
    pub fn noise(&self, travel: WheelTravel) -> WheelNoise {
        WheelNoise {
            right: self.noise_right * travel.right.0.abs(),
            left: self.noise_left * travel.left.0.abs(),
        }
    }
}

/// Noise of each wheel in one increment, as the variance of the turn that it causes, rad².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WheelNoise {
    /// Of the right wheel.
    pub right: f32,
    /// Of the left wheel.
    pub left: f32,
}

/// A vector in the map frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Sum {
    x: f32,
    y: f32,
}

/// Sums over the increments of an interval, eq. (27). Positions are relative to that at its start.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AccumulatedMotion {
    /// Displacement, metres.
    x: f32,
    y: f32,
    /// Turn, radians.
    turn: f32,
    /// Travel of each wheel, metres.
    right: f32,
    left: f32,
    /// Travel of a wheel times the position of the other wheel, m².
    about_left: Sum,
    about_right: Sum,
    /// Noise of the turn, rad², times powers of the position of the wheel about which it turns.
    noise: f32,
    noise_at: Sum,
    noise_xx: f32,
    noise_xy: f32,
    noise_yy: f32,
}

impl AccumulatedMotion {
    // ===== Eqs. (7) and (27): displacement and sums =====
    /// Adds an increment. `heading`: at the start of the interval; `sin_cos` is called with the mid-heading of the increment.
    #[inline]
    pub fn add(
        &mut self,
        drive: &CalibratedDrive,
        heading: f32,
        travel: WheelTravel,
        noise: WheelNoise,
        sin_cos: impl FnOnce(f32) -> (f32, f32),
    ) {
        let (right, left) = (travel.right.0, travel.left.0);
        let (of_right, of_left) = (right * drive.quarter_right, left * drive.quarter_left);
        let half_turn = (of_right - of_left) * drive.twice_per_width;
        let turned = self.turn + half_turn;
        self.turn = turned + half_turn;
        let (sin, cos) = sin_cos(heading + turned);
        let half_advance = of_right + of_left;
        let (half_x, half_y) = (half_advance * cos, half_advance * sin);
        let (x, y) = (self.x + half_x, self.y + half_y);
        (self.x, self.y) = (x + half_x, y + half_y);
        // The contact points of the wheels in the middle of the increment.
        let (aside_x, aside_y) = (drive.half_width * sin, drive.half_width * cos);
        let (left_x, left_y) = (x - aside_x, y + aside_y);
        let (right_x, right_y) = (x + aside_x, y - aside_y);
        self.right += right;
        self.left += left;
        self.about_left.x += right * left_x;
        self.about_left.y += right * left_y;
        self.about_right.x += left * right_x;
        self.about_right.y += left * right_y;
        let (ax, ay) = (noise.right * left_x, noise.right * left_y);
        let (bx, by) = (noise.left * right_x, noise.left * right_y);
        self.noise += noise.right + noise.left;
        self.noise_at.x += ax + bx;
        self.noise_at.y += ay + by;
        self.noise_xx += ax * left_x + bx * right_x;
        self.noise_xy += ax * left_y + bx * right_y;
        self.noise_yy += ay * left_y + by * right_y;
    }

    // ===== Eq. (4) over the interval =====
    /// Moves the estimate at the start of the interval to its end.
    #[inline]
    pub fn advance(&self, estimate: &mut FilterEstimate) {
        estimate.add_to_pose(self.x, self.y, self.turn);
    }

    // ===== Eqs. (28) and (29): F and Q of the interval =====
    /// Jacobian and process noise of the interval, for the drive and the estimate with which it was accumulated.
    #[inline]
    #[must_use]
    pub fn transition(&self, drive: &CalibratedDrive, at: &FilterEstimate) -> Transition {
        let Self { x, y, right, left, noise, .. } = *self;
        let per_width = 0.5 * drive.twice_per_width;
        // The displacement since each increment, times the travel of a wheel.
        let (ax, ay) = (
            (x * right - self.about_left.x) * per_width,
            (y * right - self.about_left.y) * per_width,
        );
        let (bx, by) = (
            (x * left - self.about_right.x) * per_width,
            (y * left - self.about_right.y) * per_width,
        );
        let (x_by_c, x_by_d) = (by - ay, -0.5 * (ay + by));
        let (y_by_c, y_by_d) = (ax - bx, 0.5 * (ax + bx));
        let (c, d) = (1.0 + at.scale_common, at.scale_difference);
        // The same with the noise.
        let (nx, ny) = (noise * x - self.noise_at.x, noise * y - self.noise_at.y);
        Transition {
            dx: x,
            dy: y,
            x_by_c,
            x_by_d,
            x_by_w: (x - c * x_by_c - d * x_by_d) * per_width,
            y_by_c,
            y_by_d,
            y_by_w: (y - c * y_by_c - d * y_by_d) * per_width,
            turn_by_c: (right - left) * per_width,
            turn_by_d: 0.5 * (right + left) * per_width,
            turn_by_w: -self.turn * per_width,
            xx: self.noise_yy + y * (ny - self.noise_at.y),
            xy: self.noise_at.x * y - self.noise_xy - x * ny,
            yy: self.noise_xx + x * (nx - self.noise_at.x),
            xh: -ny,
            yh: nx,
            hh: noise,
            advance: noise * drive.half_width * drive.half_width,
        }
    }
}

#[cfg(test)]
mod tests;
