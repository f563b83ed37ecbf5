//! The bias of a gyro: an eighth state beside P, for robots that have one (`docs/model.md`, "Gyro").
//!
//! Its covariances form a column of their own, so that a robot without a gyro neither stores nor computes them.
//!
//! # Non-finite policy
//! No value is refused here. The variance of the bias is at least [`MIN_VARIANCE`]; the caller checks the variances of P.

use super::blocks::Covariance;
use super::column::StateColumn;
use super::gain::Gain;
use super::projection::{MountCovariance, PredictedMeasurement};
use crate::filter::motion::LinearizedMotion;
use crate::geometry::numeric::{at_least, at_most};
use crate::state::estimate::FilterEstimate;

/// Least variance of a bias, (rad/s)²: that of 1e-7 rad/s, or 0.02°/h.
const MIN_VARIANCE: f32 = 1e-14;

/// A bias b and its covariances: `b` with x, y, h (heading), c, d, w, k (as in P) and itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GyroBias {
    /// The estimate, rad/s.
    pub(crate) rate: f32,
    pub(super) states: StateColumn,
    /// Covariances with the errors of the mount, ahead and to the left.
    pub(super) mount: MountCovariance,
    pub(super) bb: f32,
}

/// Turn by the gyro less turn by the wheels, as a linear measurement of the errors that both do not share.
///
/// A sum of several steps is one as well, because c, d, w and b are constant between them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TurnDifference {
    /// The difference with all systematic errors zero, rad: the difference at an estimate is this less
    /// [`Self::expected`].
    pub value: f32,
    /// Derivatives by c, d, w and b.
    pub by_c: f32,
    pub by_d: f32,
    pub by_w: f32,
    pub by_b: f32,
    /// Variance of the white noise of both, rad².
    pub noise: f32,
}

impl TurnDifference {
    /// The difference over both periods.
    #[inline]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            value: self.value + other.value,
            by_c: self.by_c + other.by_c,
            by_d: self.by_d + other.by_d,
            by_w: self.by_w + other.by_w,
            by_b: self.by_b + other.by_b,
            noise: self.noise + other.noise,
        }
    }

    /// What the systematic errors of an estimate explain of the difference, rad.
    #[inline]
    pub fn expected(&self, estimate: &FilterEstimate, bias: &GyroBias) -> f32 {
        let wheels = self.by_c * estimate.scale_common + self.by_d * estimate.scale_difference;
        wheels + self.by_w * estimate.track_width_error + self.by_b * bias.rate
    }

    /// Covariance of the difference with a quantity that has these covariances with c, d, w and b.
    pub(super) fn times(&self, c: f32, d: f32, w: f32, b: f32) -> f32 {
        self.by_c * c + self.by_d * d + self.by_w * w + self.by_b * b
    }
}

impl GyroBias {
    /// A bias of zero with this standard deviation, rad/s.
    pub fn unknown(deviation: f32) -> Self {
        let bb = at_least(deviation * deviation, MIN_VARIANCE);
        Self { rate: 0.0, states: StateColumn::NONE, mount: (0.0, 0.0), bb }
    }

    /// The same estimate, independent of all states, with this standard deviation, rad/s.
    pub fn forgotten(self, deviation: f32) -> Self {
        Self { rate: self.rate, ..Self::unknown(deviation) }
    }

    /// The same estimate and variance, independent of all states.
    pub fn independent(self) -> Self {
        let GyroBias { rate, bb, .. } = self;
        Self { rate, bb, ..Self::unknown(0.0) }
    }

    /// Removes the covariance with the pose.
    pub fn forget_pose(&mut self) {
        self.states.forget_pose();
    }

    /// Variance, (rad/s)².
    pub fn variance(&self) -> f32 {
        self.bb
    }

    /// Adds a random walk of this variance, up to a largest variance.
    pub fn walk(&mut self, variance: f32, most: f32) {
        if self.bb < most {
            self.bb = at_most(self.bb + variance, most);
        }
    }

    // ===== Eq. (37): half of the turn by the bias =====
    /// Propagates P and this column through a turn by `factor` times the bias: ψ ← ψ + factor · b.
    #[inline]
    pub fn turn(&mut self, p: &mut Covariance, factor: f32) {
        let (pose, k) = (&mut p.pose, &mut p.range_scale);
        pose.hc += factor * self.states.c;
        pose.hd += factor * self.states.d;
        pose.hw += factor * self.states.w;
        pose.xh += factor * self.states.x;
        pose.yh += factor * self.states.y;
        k.hk += factor * self.states.k;
        let more = factor * self.bb;
        pose.hh += factor * (self.states.h + self.states.h + more);
        self.states.h += more;
    }

    // ===== Eq. (10): column of the bias =====
    /// Propagates this column through the motion by the wheels.
    #[inline]
    pub fn propagate(&mut self, motion: &LinearizedMotion) {
        self.states.propagate(motion);
    }

    // ===== Eqs. (6) and (16): the bias in the correction by a range =====
    /// Corrects bias and column by a measurement whose gain has corrected P, and with which the mount has the covariances `own`.
    /// `share`: of K mᵀ that P has lost, eq. (16).
    pub fn correct(
        &mut self,
        prediction: &PredictedMeasurement,
        own: MountCovariance,
        gain: &Gain,
        innovation: f32,
        share: f32,
    ) {
        let m = prediction.covariance_with(&self.states, self.mount);
        self.subtract(m, own, gain, innovation, share);
    }

    /// Corrects by a measurement with which the bias has the covariance `m`.
    fn subtract(&mut self, m: f32, own: MountCovariance, gain: &Gain, innovation: f32, share: f32) {
        let k = m * gain.per_variance;
        self.states.subtract(gain, m * share);
        self.mount.0 -= k * own.0 * share;
        self.mount.1 -= k * own.1 * share;
        self.bb = at_least(self.bb - k * m * share, MIN_VARIANCE);
        self.rate += k * innovation;
    }
}

impl GyroBias {
    // ===== Eq. (44): column of the bias =====
    /// Adds `amount` times the outer product of a correction of all states, of the bias since `before`, and of the mount, which has
    /// moved by `moved`.
    pub fn add_along(
        &mut self,
        before: &Self,
        correction: &Gain,
        moved: MountCovariance,
        amount: f32,
    ) {
        let scaled = amount * (self.rate - before.rate);
        self.states.subtract(correction, -scaled);
        self.mount.0 += scaled * moved.0;
        self.mount.1 += scaled * moved.1;
        self.bb += scaled * (self.rate - before.rate);
    }
}

impl Covariance {
    /// Variance of a difference of turns at the estimate, without its noise, rad².
    #[inline]
    #[must_use]
    pub fn variance_of(&self, difference: &TurnDifference, bias: &GyroBias) -> f32 {
        let (q, b, a) = (&self.calibration, bias, difference);
        let c = a.times(q.cc, q.cd, q.cw, b.states.c);
        let d = a.times(q.cd, q.dd, q.dw, b.states.d);
        let w = a.times(q.cw, q.dw, q.ww, b.states.w);
        a.times(c, d, w, a.times(b.states.c, b.states.d, b.states.w, b.bb))
    }

    // ===== Eq. (38): correction by a difference of turns =====
    /// Corrects P and the bias, with its column, by a difference of turns with which the mount has the covariances `own`. `innovation` is the difference less its expected
    /// value. Returns the gain; without a gain nothing has changed.
    pub fn correct_by_turns(
        &mut self,
        bias: &mut GyroBias,
        difference: &TurnDifference,
        own: MountCovariance,
        innovation: f32,
    ) -> Option<Gain> {
        let (before, column) = (*self, *bias);
        let (a, b) = (difference, bias);
        let (p, q, r) = (&self.pose, &self.calibration, &self.range_scale);
        let (mc, md) =
            (a.times(q.cc, q.cd, q.cw, b.states.c), a.times(q.cd, q.dd, q.dw, b.states.d));
        let mw = a.times(q.cw, q.dw, q.ww, b.states.w);
        let mb = a.times(b.states.c, b.states.d, b.states.w, b.bb);
        let s = a.times(mc, md, mw, mb) + a.noise;
        // False for NaN.
        let is_positive = s >= f32::MIN_POSITIVE;
        if !is_positive {
            return None;
        }
        let v = 1.0 / s;
        let gain = Gain {
            x: a.times(p.xc, p.xd, p.xw, b.states.x) * v,
            y: a.times(p.yc, p.yd, p.yw, b.states.y) * v,
            h: a.times(p.hc, p.hd, p.hw, b.states.h) * v,
            c: mc * v,
            d: md * v,
            w: mw * v,
            k: a.times(r.ck, r.dk, r.wk, b.states.k) * v,
            per_variance: v,
        };
        // K m = S K Kᵀ.
        self.add_along_gain(&gain, -s);
        b.subtract(mb, own, &gain, innovation, 1.0);
        if self.is_valid() && b.rate.is_finite() {
            return Some(gain);
        }
        *self = before;
        *b = column;
        None
    }
}

#[cfg(test)]
mod tests;
