//! The bias of a gyro: an eighth state beside P, for robots that have one (`docs/model.md`, "Gyro").
//!
//! Its covariances form a column of their own, so that a robot without a gyro neither stores nor computes them.
//!
//! # Non-finite policy
//! No value is refused here. The variance of the bias is at least [`MIN_VARIANCE`]; the caller checks the variances of P.

use super::blocks::Covariance;
use super::correction::Gain;
use super::projection::PredictedMeasurement;
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
    xb: f32,
    yb: f32,
    hb: f32,
    cb: f32,
    db: f32,
    wb: f32,
    kb: f32,
    bb: f32,
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

    fn times(&self, c: f32, d: f32, w: f32, b: f32) -> f32 {
        self.by_c * c + self.by_d * d + self.by_w * w + self.by_b * b
    }
}

impl GyroBias {
    /// A bias of zero with this standard deviation, rad/s.
    pub fn unknown(deviation: f32) -> Self {
        let bb = at_least(deviation * deviation, MIN_VARIANCE);
        Self { rate: 0.0, xb: 0.0, yb: 0.0, hb: 0.0, cb: 0.0, db: 0.0, wb: 0.0, kb: 0.0, bb }
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
        (self.xb, self.yb, self.hb) = (0.0, 0.0, 0.0);
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
        pose.hc += factor * self.cb;
        pose.hd += factor * self.db;
        pose.hw += factor * self.wb;
        pose.xh += factor * self.xb;
        pose.yh += factor * self.yb;
        k.hk += factor * self.kb;
        let more = factor * self.bb;
        pose.hh += factor * (self.hb + self.hb + more);
        self.hb += more;
    }

    // ===== Eq. (10): column of the bias =====
    /// Propagates this column through the motion by the wheels.
    #[inline]
    pub fn propagate(&mut self, motion: &LinearizedMotion) {
        let tb =
            motion.turn_by_c * self.cb + motion.turn_by_d * self.db + motion.turn_by_w * self.wb;
        let sb = motion.advance_by_c * self.cb + motion.advance_by_d * self.db;
        let bm = self.hb + 0.5 * tb;
        self.xb += motion.cos * sb - motion.dy * bm;
        self.yb += motion.sin * sb + motion.dx * bm;
        self.hb += tb;
    }

    // ===== Eqs. (6) and (16): the bias in the correction by a range =====
    /// Corrects bias and column by a range whose gain has corrected P. `share`: of K mᵀ that P has lost, eq. (16).
    pub fn correct(
        &mut self,
        prediction: &PredictedMeasurement,
        gain: &Gain,
        innovation: f32,
        share: f32,
    ) {
        let h = &prediction.expected.jacobian();
        let m = self.xb * h.x + self.yb * h.y + self.hb * h.h + self.kb * h.k;
        let k = m * gain.per_variance;
        let lost = m * share;
        self.xb -= gain.x * lost;
        self.yb -= gain.y * lost;
        self.hb -= gain.h * lost;
        self.cb -= gain.c * lost;
        self.db -= gain.d * lost;
        self.wb -= gain.w * lost;
        self.kb -= gain.k * lost;
        self.bb = at_least(self.bb - k * lost, MIN_VARIANCE);
        self.rate += k * innovation;
    }
}

impl GyroBias {
    // ===== Eq. (44): column of the bias =====
    /// Adds `amount` times the outer product of a correction of all states and of the bias since `before`.
    pub fn add_along(&mut self, before: &Self, correction: &Gain, amount: f32) {
        let scaled = amount * (self.rate - before.rate);
        self.xb += scaled * correction.x;
        self.yb += scaled * correction.y;
        self.hb += scaled * correction.h;
        self.cb += scaled * correction.c;
        self.db += scaled * correction.d;
        self.wb += scaled * correction.w;
        self.kb += scaled * correction.k;
        self.bb += scaled * (self.rate - before.rate);
    }
}

impl Covariance {
    /// Variance of a difference of turns at the estimate, without its noise, rad².
    #[inline]
    #[must_use]
    pub fn variance_of(&self, difference: &TurnDifference, bias: &GyroBias) -> f32 {
        let (q, b, a) = (&self.calibration, bias, difference);
        let c = a.times(q.cc, q.cd, q.cw, b.cb);
        let d = a.times(q.cd, q.dd, q.dw, b.db);
        let w = a.times(q.cw, q.dw, q.ww, b.wb);
        a.times(c, d, w, a.times(b.cb, b.db, b.wb, b.bb))
    }

    // ===== Eq. (38): correction by a difference of turns =====
    /// Corrects P and the bias, with its column, by a difference of turns. `innovation` is the difference less its expected
    /// value. Returns the gain; without a gain nothing has changed.
    pub fn correct_by_turns(
        &mut self,
        bias: &mut GyroBias,
        difference: &TurnDifference,
        innovation: f32,
    ) -> Option<Gain> {
        let (before, column) = (*self, *bias);
        let a = difference;
        let (p, q, r) = (&mut self.pose, &mut self.calibration, &mut self.range_scale);
        let b = bias;
        let mx = a.times(p.xc, p.xd, p.xw, b.xb);
        let my = a.times(p.yc, p.yd, p.yw, b.yb);
        let mh = a.times(p.hc, p.hd, p.hw, b.hb);
        let mc = a.times(q.cc, q.cd, q.cw, b.cb);
        let md = a.times(q.cd, q.dd, q.dw, b.db);
        let mw = a.times(q.cw, q.dw, q.ww, b.wb);
        let mk = a.times(r.ck, r.dk, r.wk, b.kb);
        let mb = a.times(b.cb, b.db, b.wb, b.bb);
        let s = a.times(mc, md, mw, mb) + a.noise;
        // False for NaN.
        let is_positive = s >= f32::MIN_POSITIVE;
        if !is_positive {
            return None;
        }
        let v = 1.0 / s;
        let gain = Gain {
            x: mx * v,
            y: my * v,
            h: mh * v,
            c: mc * v,
            d: md * v,
            w: mw * v,
            k: mk * v,
            per_variance: v,
        };
        p.xx -= gain.x * mx;
        p.xy -= gain.x * my;
        p.xh -= gain.x * mh;
        p.xc -= gain.x * mc;
        p.xd -= gain.x * md;
        p.xw -= gain.x * mw;
        r.xk -= gain.x * mk;
        b.xb -= gain.x * mb;
        p.yy -= gain.y * my;
        p.yh -= gain.y * mh;
        p.yc -= gain.y * mc;
        p.yd -= gain.y * md;
        p.yw -= gain.y * mw;
        r.yk -= gain.y * mk;
        b.yb -= gain.y * mb;
        p.hh -= gain.h * mh;
        p.hc -= gain.h * mc;
        p.hd -= gain.h * md;
        p.hw -= gain.h * mw;
        r.hk -= gain.h * mk;
        b.hb -= gain.h * mb;
        q.cc -= gain.c * mc;
        q.cd -= gain.c * md;
        q.cw -= gain.c * mw;
        r.ck -= gain.c * mk;
        b.cb -= gain.c * mb;
        q.dd -= gain.d * md;
        q.dw -= gain.d * mw;
        r.dk -= gain.d * mk;
        b.db -= gain.d * mb;
        q.ww -= gain.w * mw;
        r.wk -= gain.w * mk;
        b.wb -= gain.w * mb;
        r.kk -= gain.k * mk;
        b.kb -= gain.k * mb;
        b.bb = at_least(b.bb - mb * v * mb, MIN_VARIANCE);
        b.rate += mb * v * innovation;
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
