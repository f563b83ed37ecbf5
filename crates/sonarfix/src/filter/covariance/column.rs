//! Covariances of a quantity beside P with the seven states of P.

use super::gain::Gain;
use crate::filter::motion::LinearizedMotion;
use crate::sensor::range::MeasurementJacobian;

/// Covariances with x, y, h (heading), c, d, w and k, as in P.
#[derive(Debug, Clone, Copy, PartialEq)]
#[rustfmt::skip]
pub(super) struct StateColumn {
    pub x: f32, pub y: f32, pub h: f32,
    pub c: f32, pub d: f32, pub w: f32,
    pub k: f32,
}

impl StateColumn {
    /// A quantity that is independent of all states.
    pub const NONE: Self = Self { x: 0.0, y: 0.0, h: 0.0, c: 0.0, d: 0.0, w: 0.0, k: 0.0 };

    /// Removes the covariances with the pose.
    pub fn forget_pose(&mut self) {
        (self.x, self.y, self.h) = (0.0, 0.0, 0.0);
    }

    // ===== Eq. (10): column of a quantity that is constant =====
    /// Propagates the column through the motion by the wheels.
    pub fn propagate(&mut self, motion: &LinearizedMotion) {
        let t = motion.turn_by_c * self.c + motion.turn_by_d * self.d + motion.turn_by_w * self.w;
        let s = motion.advance_by_c * self.c + motion.advance_by_d * self.d;
        let m = self.h + 0.5 * t;
        self.x += motion.cos * s - motion.dy * m;
        self.y += motion.sin * s + motion.dx * m;
        self.h += t;
    }

    /// Covariance with H X.
    pub fn times(&self, h: &MeasurementJacobian) -> f32 {
        self.x * h.x + self.y * h.y + self.h * h.h + self.k * h.k
    }

    /// Adds the covariances of another quantity, as of the sum of both.
    pub fn add(&mut self, other: &Self) {
        self.x += other.x;
        self.y += other.y;
        self.h += other.h;
        self.c += other.c;
        self.d += other.d;
        self.w += other.w;
        self.k += other.k;
    }

    // ===== Eq. (6): P ← P − K m, one column =====
    /// Subtracts the gain times the covariance of this quantity with the measurement.
    pub fn subtract(&mut self, gain: &Gain, covariance: f32) {
        self.x -= gain.x * covariance;
        self.y -= gain.y * covariance;
        self.h -= gain.h * covariance;
        self.c -= gain.c * covariance;
        self.d -= gain.d * covariance;
        self.w -= gain.w * covariance;
        self.k -= gain.k * covariance;
    }
}
