//! Propagation of P over a motion (`docs/model.md`, eqs. 5 and 10).

use super::blocks::{CalibrationBlock, Covariance, PoseBlock, RangeScaleBlock};
use super::transition::Transition;
use crate::numeric::{at_most_max_variance, positive_part};
use crate::process_noise::AccumulatedRandomWalk;

/// Relative rounding error of a sum of a few terms: 4 u, four times 2⁻²⁴.
const ROUNDING: f32 = 1.0 / 4_194_304.0;

impl PoseBlock {
    // ===== Eqs. (5) and (10): P ← F P Fᵀ + Q, rows of the pose =====
    /// Propagates the rows of the pose.
    ///
    /// The new pose is the old pose plus the turn t and the displacement a, which are linear in the old heading and the
    /// calibration, so only their covariances are needed: `ht` is that of heading and turn, `x_ax` that of x and its
    /// displacement, and so on.
    #[inline]
    pub fn propagate(
        &mut self,
        calibration: &CalibrationBlock,
        walk: &AccumulatedRandomWalk,
        f: &Transition,
    ) {
        let (p, q) = (self, calibration);
        let (cc, dd, ww) = q.variances_with(walk);
        let (gx, gy) = (-f.dy, f.dx);
        let turn = |c: f32, d: f32, w: f32| f.turn_by_c * c + f.turn_by_d * d + f.turn_by_w * w;
        let along_x =
            |h: f32, c: f32, d: f32, w: f32| gx * h + f.x_by_c * c + f.x_by_d * d + f.x_by_w * w;
        let along_y =
            |h: f32, c: f32, d: f32, w: f32| gy * h + f.y_by_c * c + f.y_by_d * d + f.y_by_w * w;
        let missing = |variance: f32, noise: f32| positive_part(0.5 * ROUNDING * variance - noise);

        let (tc, td, tw) = (turn(cc, q.cd, q.cw), turn(q.cd, dd, q.dw), turn(q.cw, q.dw, ww));
        let (ht, tt) = (turn(p.hc, p.hd, p.hw), turn(tc, td, tw));
        // Covariances of the displacement along x with heading, calibration, turn and itself.
        let (xc, xd, xw) = (
            along_x(p.hc, cc, q.cd, q.cw),
            along_x(p.hd, q.cd, dd, q.dw),
            along_x(p.hw, q.cw, q.dw, ww),
        );
        let xh = along_x(p.hh, p.hc, p.hd, p.hw);
        let xx = along_x(xh, xc, xd, xw);
        let xt = along_x(ht, tc, td, tw);
        let (yc, yd, yw) = (
            along_y(p.hc, cc, q.cd, q.cw),
            along_y(p.hd, q.cd, dd, q.dw),
            along_y(p.hw, q.cw, q.dw, ww),
        );
        let yh = along_y(p.hh, p.hc, p.hd, p.hw);
        let yy = along_y(yh, yc, yd, yw);
        let xy = along_x(yh, yc, yd, yw);
        let yt = along_y(ht, tc, td, tw);
        // Covariances of the old x and y with the displacement.
        let x_ax = along_x(p.xh, p.xc, p.xd, p.xw);
        let x_ay = along_y(p.xh, p.xc, p.xd, p.xw);
        let y_ax = along_x(p.yh, p.yc, p.yd, p.yw);
        let y_ay = along_y(p.yh, p.yc, p.yd, p.yw);

        p.xh += turn(p.xc, p.xd, p.xw) + xh + xt + f.xh;
        p.yh += turn(p.yc, p.yd, p.yw) + yh + yt + f.yh;
        p.xc += xc;
        p.xd += xd;
        p.xw += xw;
        p.yc += yc;
        p.yd += yd;
        p.yw += yw;
        // The variance of the displacement may cancel to zero but must not become negative.
        let (xx, yy) = (xx * (1.0 + ROUNDING) + f.xx, yy * (1.0 + ROUNDING) + f.yy);
        p.xx += missing(p.xx, f.advance) + (x_ax + x_ax + xx);
        p.yy += missing(p.yy, f.advance) + (y_ay + y_ay + yy);
        p.xy += x_ay + y_ax + xy + f.xy;
        p.hh += missing(p.hh, f.hh) + (ht + ht + tt + f.hh);
        p.hc += tc;
        p.hd += td;
        p.hw += tw;
    }

    /// Sets variances that are not valid to the limit that they exceed.
    #[inline]
    pub fn limit_variances(&mut self) {
        if !self.is_valid() {
            self.limit_each();
        }
    }

    #[cold]
    fn limit_each(&mut self) {
        for variance in [&mut self.xx, &mut self.yy, &mut self.hh] {
            *variance = if *variance < 0.0 { 0.0 } else { at_most_max_variance(*variance) };
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
        self.pose.propagate(&self.calibration, walk, f);
        self.range_scale.propagate(f);
    }
}

#[cfg(test)]
mod tests;
