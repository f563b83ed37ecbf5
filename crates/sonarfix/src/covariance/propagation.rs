//! Propagation of P through one odometry increment (`docs/model.md`, eqs. 5 and 10).

use super::blocks::{CalibrationBlock, PoseBlock, RangeScaleBlock};
use crate::motion::LinearizedMotion;
use crate::numeric::positive_part;
use crate::process_noise::{AccumulatedRandomWalk, ProcessNoise};

/// Relative rounding error of a sum of a few terms: 4 u, four times 2⁻²⁴.
const ROUNDING: f32 = 1.0 / 4_194_304.0;

/// Process noise that compensates for rounding: `q_x`, `q_y` and `q_h` of eq. (10).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RoundingNoise {
    x: f32,
    y: f32,
    heading: f32,
}

impl PoseBlock {
    /// The part of the rounding error of a step that the noise of the wheels does not cover.
    #[inline]
    #[must_use]
    pub fn rounding_noise(&self, noise: &ProcessNoise) -> RoundingNoise {
        let missing = |variance: f32, noise: f32| positive_part(0.5 * ROUNDING * variance - noise);
        RoundingNoise {
            x: missing(self.xx, noise.advance),
            y: missing(self.yy, noise.advance),
            heading: missing(self.hh, noise.turn),
        }
    }

    // ===== Eqs. (5) and (10): P ← F P Fᵀ + Q, rows of the pose =====
    /// Propagates the rows of the pose.
    ///
    /// The increment is three small movements: half the turn, the advance along the mid-heading, the
    /// other half. The new pose is linear in the old pose, the turn t and the advance s, so only their
    /// covariances are needed: `ht` is that of heading and turn, `xm` that of x and the mid-heading
    /// m = h + t/2, and so on.
    #[inline]
    pub fn propagate(
        &mut self,
        calibration: &CalibrationBlock,
        motion: &LinearizedMotion,
        noise: &ProcessNoise,
        rounding: &RoundingNoise,
        walk: &AccumulatedRandomWalk,
    ) {
        let (p, q) = (self, calibration);
        let (cc, dd, ww) = q.variances_with(walk);
        let (sin, cos) = (motion.sin, motion.cos);
        // ∂x/∂m and ∂y/∂m.
        let (gx, gy) = (-motion.dy, motion.dx);
        let turn_with = |c: f32, d: f32, w: f32| {
            motion.turn_by_c * c + motion.turn_by_d * d + motion.turn_by_w * w
        };
        let advance_with = |c: f32, d: f32| motion.advance_by_c * c + motion.advance_by_d * d;

        let (tc, sc) = (turn_with(cc, q.cd, q.cw), advance_with(cc, q.cd));
        let (td, sd) = (turn_with(q.cd, dd, q.dw), advance_with(q.cd, dd));
        let (tw, sw) = (turn_with(q.cw, q.dw, ww), advance_with(q.cw, q.dw));
        let tt = noise.turn + motion.turn_by_c * tc + motion.turn_by_d * td + motion.turn_by_w * tw;
        let ts = noise.advance_turn + motion.advance_by_c * tc + motion.advance_by_d * td;
        let ss = noise.advance + motion.advance_by_c * sc + motion.advance_by_d * sd;

        let (ht, hs) = (turn_with(p.hc, p.hd, p.hw), advance_with(p.hc, p.hd));
        let (cm, dm, wm) = (p.hc + 0.5 * tc, p.hd + 0.5 * td, p.hw + 0.5 * tw);
        p.hc += tc;
        p.hd += td;
        p.hw += tw;
        let hm = p.hh + 0.5 * ht;
        let mt = ht + 0.5 * tt;
        let (mm, ms) = (hm + 0.5 * mt, hs + 0.5 * ts);
        let (m_new, s_new) = (hm + mt, hs + ts);
        p.hh += mt + mt + rounding.heading;
        // The displacement variance may cancel to zero but must not become negative.
        let (mm, ss) = (mm * (1.0 + ROUNDING), ss * (1.0 + ROUNDING));

        // x_m and x_s: covariance of the new x with the mid-heading and with the advance.
        let (xt, xs) = (turn_with(p.xc, p.xd, p.xw), advance_with(p.xc, p.xd));
        p.xc = p.xc + gx * cm + cos * sc;
        p.xd = p.xd + gx * dm + cos * sd;
        p.xw = p.xw + gx * wm + cos * sw;
        let xm = p.xh + 0.5 * xt;
        p.xh += xt + gx * m_new + cos * s_new;
        let x_m = xm + gx * mm + cos * ms;
        let x_s = xs + gx * ms + cos * ss;
        p.xx += rounding.x + gx * (xm + x_m) + cos * (xs + x_s);

        let (yt, ys) = (turn_with(p.yc, p.yd, p.yw), advance_with(p.yc, p.yd));
        p.yc = p.yc + gy * cm + sin * sc;
        p.yd = p.yd + gy * dm + sin * sd;
        p.yw = p.yw + gy * wm + sin * sw;
        let ym = p.yh + 0.5 * yt;
        p.yh += yt + gy * m_new + sin * s_new;
        p.xy += gy * x_m + sin * x_s + gx * ym + cos * ys;
        let y_m = ym + gy * mm + sin * ms;
        let y_s = ys + gy * ms + sin * ss;
        p.yy += rounding.y + gy * (ym + y_m) + sin * (ys + y_s);
    }
}

impl RangeScaleBlock {
    // ===== Eq. (10): column of the range scale error, which has no process noise =====
    /// Propagates the covariances of the pose with the range scale error.
    #[inline]
    pub fn propagate(&mut self, motion: &LinearizedMotion) {
        let p = self;
        let tk = motion.turn_by_c * p.ck + motion.turn_by_d * p.dk + motion.turn_by_w * p.wk;
        let sk = motion.advance_by_c * p.ck + motion.advance_by_d * p.dk;
        let km = p.hk + 0.5 * tk;
        p.xk += motion.cos * sk - motion.dy * km;
        p.yk += motion.sin * sk + motion.dx * km;
        p.hk += tk;
    }
}
