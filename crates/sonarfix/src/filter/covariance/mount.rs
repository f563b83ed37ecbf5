//! The place of the sonar in the robot frame: two states beside P, for robots that have it measured with a ruler
//! (`docs/model.md`, "Mount").
//!
//! Their covariances form two columns of their own, so that a robot whose mount is exact neither stores nor computes them.
//!
//! # Non-finite policy
//! No value is refused here. The variances are at least [`MIN_VARIANCE`]; the caller checks the variances of P.

use super::bias::{GyroBias, TurnDifference};
use super::column::StateColumn;
use super::gain::Gain;
use super::projection::{MountCovariance, MountShare, PredictedMeasurement};
use crate::filter::motion::LinearizedMotion;
use crate::geometry::elementary::sqrt;
use crate::geometry::numeric::at_least;
use crate::geometry::pose::Point;
use crate::geometry::units::Metres;

/// Least variance of a coordinate of the mount, m²: that of 10 µm.
const MIN_VARIANCE: f32 = 1e-10;

/// The estimated place of the sonar, and the covariances of its errors ahead and to the left: with the seven states, and with
/// themselves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mount {
    /// Robot frame.
    pub place: Point,
    ahead: StateColumn,
    left: StateColumn,
    aa: f32,
    al: f32,
    ll: f32,
}

impl Mount {
    /// A mount that is not estimated. Its variances are zero, which those of another one never are.
    #[cfg(feature = "mount")]
    pub const EXACT: Self = Self {
        place: Point { x: Metres(0.0), y: Metres(0.0) },
        ahead: StateColumn::NONE,
        left: StateColumn::NONE,
        aa: 0.0,
        al: 0.0,
        ll: 0.0,
    };

    /// Estimates an exact mount: at a place with this standard deviation of each coordinate, independent of each other and of all
    /// states.
    #[cfg(feature = "mount")]
    #[inline]
    pub fn estimate(&mut self, place: Point, deviation: Metres) {
        let variance = at_least(deviation.0 * deviation.0, MIN_VARIANCE);
        (self.place, self.aa, self.ll) = (place, variance, variance);
    }

    /// Whether it is estimated.
    #[cfg(feature = "mount")]
    #[inline]
    pub fn is_estimated(&self) -> bool {
        self.aa.to_bits() != 0
    }

    /// Removes the covariances with the pose.
    pub fn forget_pose(&mut self) {
        self.ahead.forget_pose();
        self.left.forget_pose();
    }

    /// Standard deviations of both coordinates, ahead and to the left.
    pub fn deviations(&self) -> (Metres, Metres) {
        (Metres(sqrt(self.aa)), Metres(sqrt(self.ll)))
    }

    // ===== Eq. (10): columns of the mount =====
    /// Propagates the columns through the motion by the wheels.
    #[inline(never)]
    pub fn propagate(&mut self, motion: &LinearizedMotion) {
        self.ahead.propagate(motion);
        self.left.propagate(motion);
    }

    // ===== Eq. (55): H P Hᵀ with the mount =====
    /// Adds the mount to a measurement with the derivatives `by`, by its coordinates ahead and to the left.
    #[inline]
    pub fn add_to(&self, prediction: &mut PredictedMeasurement, by: (f32, f32)) {
        let h = &prediction.expected.jacobian();
        let (a, l) = (&self.ahead, &self.left);
        let sum = |ahead: f32, left: f32| by.0 * ahead + by.1 * left;
        let states = StateColumn {
            x: sum(a.x, l.x),
            y: sum(a.y, l.y),
            h: sum(a.h, l.h),
            c: sum(a.c, l.c),
            d: sum(a.d, l.d),
            w: sum(a.w, l.w),
            k: sum(a.k, l.k),
        };
        let of_states = states.times(h);
        let along = of_states + sum(sum(self.aa, self.al), sum(self.al, self.ll));
        let m = &mut prediction.cross_covariance;
        m.x += states.x;
        m.y += states.y;
        m.h += states.h;
        m.k += states.k;
        prediction.variance += of_states + along;
        prediction.mount = Some(MountShare { states, by, along });
    }

    /// Covariances of the errors with a measurement: Cᵀ Hᵀ + E Lᵀ.
    pub fn covariance_with(&self, prediction: &PredictedMeasurement) -> MountCovariance {
        (
            prediction.covariance_with(&self.ahead, (self.aa, self.al)),
            prediction.covariance_with(&self.left, (self.al, self.ll)),
        )
    }

    /// Covariances of the errors with a difference of turns.
    pub fn covariance_with_turns(
        &self,
        difference: &TurnDifference,
        bias: &GyroBias,
    ) -> MountCovariance {
        let of = |column: &StateColumn, b: f32| difference.times(column.c, column.d, column.w, b);
        (of(&self.ahead, bias.mount.0), of(&self.left, bias.mount.1))
    }

    // ===== Eq. (37): the mount in half of the turn by the bias =====
    /// Propagates the columns through a turn by `factor` times the bias.
    pub fn turn(&mut self, bias: &GyroBias, factor: f32) {
        self.ahead.h += factor * bias.mount.0;
        self.left.h += factor * bias.mount.1;
    }

    // ===== Eqs. (6), (16) and (38): the mount in the correction by a measurement =====
    /// Corrects mount and columns by a measurement whose gain has corrected P, and with which the errors have the covariances `own`.
    /// `share`: of K mᵀ that P has lost, eq. (16).
    pub fn correct(&mut self, own: MountCovariance, gain: &Gain, innovation: f32, share: f32) {
        let (a, l) = (own.0 * gain.per_variance, own.1 * gain.per_variance);
        let (lost_a, lost_l) = (own.0 * share, own.1 * share);
        self.ahead.subtract(gain, lost_a);
        self.left.subtract(gain, lost_l);
        self.aa = at_least(self.aa - a * lost_a, MIN_VARIANCE);
        self.al -= a * lost_l;
        self.ll = at_least(self.ll - l * lost_l, MIN_VARIANCE);
        self.place.x.0 += a * innovation;
        self.place.y.0 += l * innovation;
    }

    /// By how much the estimate has changed.
    pub fn moved_since(&self, before: &Self) -> MountCovariance {
        ((self.place.x - before.place.x).0, (self.place.y - before.place.y).0)
    }

    // ===== Eq. (44): columns of the mount =====
    /// Adds `amount` times the outer product of a correction of all states and of the mount, which has moved by `moved`.
    pub fn add_along(&mut self, correction: &Gain, (a, l): MountCovariance, amount: f32) {
        self.ahead.subtract(correction, -amount * a);
        self.left.subtract(correction, -amount * l);
        self.aa += amount * a * a;
        self.al += amount * a * l;
        self.ll += amount * l * l;
    }
}

#[cfg(test)]
#[cfg(feature = "mount")]
mod tests;
