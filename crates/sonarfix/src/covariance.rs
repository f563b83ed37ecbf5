//! The filter's covariance: 28 numbers, the upper triangle of a symmetric 7×7 matrix, by name.
//!
//! Named fields instead of indices keep the filter's equations readable, straight-line and free
//! of bounds checks. The letters, in their order: `x`, `y`, `h` (heading), `c` and `d` (common part
//! and difference of the wheels' scale errors), `w` (track-width error), `k` (range scale error).
//!
//! The paper's states are the scale errors of the right and the left wheel. Here they are held as
//! `c = (S_R + S_L)/2` and `d = S_R − S_L`, because a robot on a straight leg learns d to 1e-4 from the
//! first walls while c stays unknown to 1e-2: held wheel by wheel, the variance of d would be a
//! difference of numbers 10⁴ times larger, and a step's process noise would vanish in their
//! rounding. What the crate shows of itself is wheel by wheel.

use nalgebra::SMatrix;

use crate::state::{State, wheels};

/// Calls `$do!(entry row column)` for each entry of the upper triangle.
macro_rules! each_entry {
    ($do:ident) => {
        $do!(xx x x); $do!(xy x y); $do!(xh x h); $do!(xc x c); $do!(xd x d); $do!(xw x w); $do!(xk x k);
        $do!(yy y y); $do!(yh y h); $do!(yc y c); $do!(yd y d); $do!(yw y w); $do!(yk y k);
        $do!(hh h h); $do!(hc h c); $do!(hd h d); $do!(hw h w); $do!(hk h k);
        $do!(cc c c); $do!(cd c d); $do!(cw c w); $do!(ck c k);
        $do!(dd d d); $do!(dw d w); $do!(dk d k);
        $do!(ww w w); $do!(wk w k);
        $do!(kk k k);
    };
}
pub(crate) use each_entry;

/// One number for each state: a row of the covariance, a gain.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Row {
    pub x: f32,
    pub y: f32,
    pub h: f32,
    pub c: f32,
    pub d: f32,
    pub w: f32,
    pub k: f32,
}

/// Upper triangle of the covariance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[rustfmt::skip]
pub(crate) struct Covariance {
    pub xx: f32, pub xy: f32, pub xh: f32, pub xc: f32, pub xd: f32, pub xw: f32, pub xk: f32,
    pub yy: f32, pub yh: f32, pub yc: f32, pub yd: f32, pub yw: f32, pub yk: f32,
    pub hh: f32, pub hc: f32, pub hd: f32, pub hw: f32, pub hk: f32,
    pub cc: f32, pub cd: f32, pub cw: f32, pub ck: f32,
    pub dd: f32, pub dw: f32, pub dk: f32,
    pub ww: f32, pub wk: f32,
    pub kk: f32,
}

impl Covariance {
    /// Independent errors with these standard deviations.
    pub fn independent(deviation: &State) -> Self {
        let square = |sigma: f32| sigma * sigma;
        let (rr, ll) = (square(deviation.scale_right), square(deviation.scale_left));
        Self {
            xx: square(deviation.x),
            yy: square(deviation.y),
            hh: square(deviation.heading),
            cc: 0.25 * (rr + ll),
            cd: 0.5 * (rr - ll),
            dd: rr + ll,
            ww: square(deviation.track_width_error),
            kk: square(deviation.range_scale),
            ..Self::default()
        }
    }

    /// The whole matrix in the order of [`State`], with the scale errors wheel by wheel
    /// (`docs/model.md`, eq. 9).
    #[rustfmt::skip]
    pub fn to_matrix(self) -> SMatrix<f32, 7, 7> {
        let p = self;
        let (xr, xl) = wheels(p.xc, p.xd);
        let (yr, yl) = wheels(p.yc, p.yd);
        let (hr, hl) = wheels(p.hc, p.hd);
        let (wr, wl) = wheels(p.cw, p.dw);
        let (kr, kl) = wheels(p.ck, p.dk);
        let (rr, ll) = self.wheel_variances();
        let rl = p.cc - 0.25 * p.dd;
        SMatrix::<f32, 7, 7>::from_row_slice(&[
            p.xx, p.xy, p.xh,   xr,   xl, p.xw, p.xk,
            p.xy, p.yy, p.yh,   yr,   yl, p.yw, p.yk,
            p.xh, p.yh, p.hh,   hr,   hl, p.hw, p.hk,
              xr,   yr,   hr,   rr,   rl,   wr,   kr,
              xl,   yl,   hl,   rl,   ll,   wl,   kl,
            p.xw, p.yw, p.hw,   wr,   wl, p.ww, p.wk,
            p.xk, p.yk, p.hk,   kr,   kl, p.wk, p.kk,
        ])
    }

    /// Variances of the right and the left wheel's scale error.
    pub fn wheel_variances(&self) -> (f32, f32) {
        wheels(self.cc + 0.25 * self.dd, 2.0 * self.cd)
    }

    /// P Hᵀ for a measurement that depends on x, y, heading and range scale alone.
    #[inline]
    pub fn times(&self, x: f32, y: f32, h: f32, k: f32) -> Row {
        let p = self;
        Row {
            x: p.xx * x + p.xy * y + p.xh * h + p.xk * k,
            y: p.xy * x + p.yy * y + p.yh * h + p.yk * k,
            h: p.xh * x + p.yh * y + p.hh * h + p.hk * k,
            c: p.xc * x + p.yc * y + p.hc * h + p.ck * k,
            d: p.xd * x + p.yd * y + p.hd * h + p.dk * k,
            w: p.xw * x + p.yw * y + p.hw * h + p.wk * k,
            k: p.xk * x + p.yk * y + p.hk * h + p.kk * k,
        }
    }

    /// Whether every variance is finite and none is negative, and every covariance is finite.
    pub fn is_sound(&self) -> bool {
        let p = self;
        let mut sum = 0.0;
        macro_rules! add {
            ($entry:ident $i:ident $j:ident) => {
                // 0·v is 0 for any finite v and NaN otherwise: one comparison for all 28.
                sum += p.$entry * 0.0;
            };
        }
        each_entry!(add);
        let none_negative = p.xx >= 0.0
            && p.yy >= 0.0
            && p.hh >= 0.0
            && p.cc >= 0.0
            && p.dd >= 0.0
            && p.ww >= 0.0
            && p.kk >= 0.0;
        none_negative && f32::is_finite(sum)
    }
}

impl Row {
    /// The sum of this and `factor` times `other`.
    pub fn plus_scaled(self, other: &Self, factor: f32) -> Self {
        Self {
            x: self.x + factor * other.x,
            y: self.y + factor * other.y,
            h: self.h + factor * other.h,
            c: self.c + factor * other.c,
            d: self.d + factor * other.d,
            w: self.w + factor * other.w,
            k: self.k + factor * other.k,
        }
    }

    /// Every number times `factor`.
    pub fn scaled(self, factor: f32) -> Self {
        Self {
            x: self.x * factor,
            y: self.y * factor,
            h: self.h * factor,
            c: self.c * factor,
            d: self.d * factor,
            w: self.w * factor,
            k: self.k * factor,
        }
    }
}
