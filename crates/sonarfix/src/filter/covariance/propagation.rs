//! Propagation of P over a motion (`docs/model.md`, eqs. 5 and 10).

use super::blocks::{CalibrationBlock, Covariance, PoseBlock, RangeScaleBlock};
use super::transition::Transition;
use crate::filter::process_noise::AccumulatedRandomWalk;
use crate::geometry::numeric::positive_part;

/// Relative rounding error of a sum of a few terms: 4 u, four times 2⁻²⁴.
const ROUNDING: f32 = 1.0 / 4_194_304.0;

impl PoseBlock {
    // ===== Eqs. (5) and (10): P ← F P Fᵀ + Q, rows of the pose =====
    /// The rows of the pose after a motion.
    ///
    /// The new pose is the old pose plus the turn t and the displacement a, b, which are linear in the old heading and the
    /// calibration. The covariance of two new errors is built up factor by factor: `xh` of the new x with the old heading, then
    /// `p.xh` of both new ones. A variance grows by the form of its own displacement on the sum of its old and its new row.
    #[inline]
    #[must_use]
    pub fn propagated(
        &self,
        calibration: &CalibrationBlock,
        walk: &AccumulatedRandomWalk,
        f: &Transition,
    ) -> Self {
        let (p, q) = (self, calibration);
        let (cc, dd, ww) = q.variances_with(walk);
        let (gx, gy) = (-f.dy, f.dx);
        let turn = |c: f32, d: f32, w: f32| f.turn_by_c * c + f.turn_by_d * d + f.turn_by_w * w;
        let along_x =
            |h: f32, c: f32, d: f32, w: f32| gx * h + f.x_by_c * c + f.x_by_d * d + f.x_by_w * w;
        let along_y =
            |h: f32, c: f32, d: f32, w: f32| gy * h + f.y_by_c * c + f.y_by_d * d + f.y_by_w * w;
        let missing = |variance: f32, noise: f32| positive_part(0.5 * ROUNDING * variance - noise);
        // The growth of a variance may cancel to zero, but must not exceed its rounding downwards.
        let widened = |growth: f32| growth + ROUNDING * growth.abs();

        // The new x and y with the old heading and the calibration.
        let xh = p.xh + along_x(p.hh, p.hc, p.hd, p.hw);
        let xc = p.xc + along_x(p.hc, cc, q.cd, q.cw);
        let xd = p.xd + along_x(p.hd, q.cd, dd, q.dw);
        let xw = p.xw + along_x(p.hw, q.cw, q.dw, ww);
        let yh = p.yh + along_y(p.hh, p.hc, p.hd, p.hw);
        let yc = p.yc + along_y(p.hc, cc, q.cd, q.cw);
        let yd = p.yd + along_y(p.hd, q.cd, dd, q.dw);
        let yw = p.yw + along_y(p.hw, q.cw, q.dw, ww);

        let xx = along_x(p.xh + xh, p.xc + xc, p.xd + xd, p.xw + xw);
        let yy = along_y(p.yh + yh, p.yc + yc, p.yd + yd, p.yw + yw);
        let xy = along_y(p.xh, p.xc, p.xd, p.xw) + along_x(yh, yc, yd, yw);

        // The new heading with the calibration, and with itself.
        let hc = p.hc + turn(cc, q.cd, q.cw);
        let hd = p.hd + turn(q.cd, dd, q.dw);
        let hw = p.hw + turn(q.cw, q.dw, ww);
        let hh = turn(p.hc + hc, p.hd + hd, p.hw + hw);
        Self {
            xx: p.xx + (missing(p.xx, f.advance) + (widened(xx) + f.xx)),
            xy: p.xy + (xy + f.xy),
            yy: p.yy + (missing(p.yy, f.advance) + (widened(yy) + f.yy)),
            hh: p.hh + (missing(p.hh, f.hh) + (hh + f.hh)),
            xh: xh + (turn(xc, xd, xw) + f.xh),
            yh: yh + (turn(yc, yd, yw) + f.yh),
            xc,
            xd,
            xw,
            yc,
            yd,
            yw,
            hc,
            hd,
            hw,
        }
    }
}

impl RangeScaleBlock {
    // ===== Eq. (10): column of the range scale error, which has no process noise =====
    /// Propagates the covariances of the pose with the range scale error.
    #[inline]
    pub fn propagate(&mut self, f: &Transition) {
        let p = self;
        p.xk += f.x_by_c * p.ck + f.x_by_d * p.dk + f.x_by_w * p.wk - f.dy * p.hk;
        p.yk += f.y_by_c * p.ck + f.y_by_d * p.dk + f.y_by_w * p.wk + f.dx * p.hk;
        p.hk += f.turn_by_c * p.ck + f.turn_by_d * p.dk + f.turn_by_w * p.wk;
    }
}

impl Covariance {
    // ===== Eqs. (5) and (10): P ← F P Fᵀ + Q =====
    /// Propagates P, its calibration with the random walk.
    #[inline]
    pub fn propagate(&mut self, walk: &AccumulatedRandomWalk, f: &Transition) {
        self.pose = self.pose.propagated(&self.calibration, walk, f);
        self.range_scale.propagate(f);
    }
}
