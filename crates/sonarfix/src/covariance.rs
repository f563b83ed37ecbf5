//! The filter's covariance: 28 numbers, the upper triangle of a symmetric 7×7 matrix, by name.
//!
//! Named fields instead of indices keep the filter's equations readable, straight-line and free
//! of bounds checks. The letters are those of the state, in its order: `x`, `y`, `h` (heading),
//! `r` and `l` (scale errors of the right and left wheel), `w` (track-width error), `k` (range
//! scale error).

use nalgebra::SMatrix;

/// Calls `$do!(entry row column)` for each entry of the upper triangle.
macro_rules! each_entry {
    ($do:ident) => {
        $do!(xx x x); $do!(xy x y); $do!(xh x h); $do!(xr x r); $do!(xl x l); $do!(xw x w); $do!(xk x k);
        $do!(yy y y); $do!(yh y h); $do!(yr y r); $do!(yl y l); $do!(yw y w); $do!(yk y k);
        $do!(hh h h); $do!(hr h r); $do!(hl h l); $do!(hw h w); $do!(hk h k);
        $do!(rr r r); $do!(rl r l); $do!(rw r w); $do!(rk r k);
        $do!(ll l l); $do!(lw l w); $do!(lk l k);
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
    pub r: f32,
    pub l: f32,
    pub w: f32,
    pub k: f32,
}

/// Upper triangle of the covariance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[rustfmt::skip]
pub(crate) struct Covariance {
    pub xx: f32, pub xy: f32, pub xh: f32, pub xr: f32, pub xl: f32, pub xw: f32, pub xk: f32,
    pub yy: f32, pub yh: f32, pub yr: f32, pub yl: f32, pub yw: f32, pub yk: f32,
    pub hh: f32, pub hr: f32, pub hl: f32, pub hw: f32, pub hk: f32,
    pub rr: f32, pub rl: f32, pub rw: f32, pub rk: f32,
    pub ll: f32, pub lw: f32, pub lk: f32,
    pub ww: f32, pub wk: f32,
    pub kk: f32,
}

impl Covariance {
    /// The whole matrix, for whoever wants to compute with it.
    #[rustfmt::skip]
    pub fn to_matrix(self) -> SMatrix<f32, 7, 7> {
        let p = self;
        SMatrix::<f32, 7, 7>::from_row_slice(&[
            p.xx, p.xy, p.xh, p.xr, p.xl, p.xw, p.xk,
            p.xy, p.yy, p.yh, p.yr, p.yl, p.yw, p.yk,
            p.xh, p.yh, p.hh, p.hr, p.hl, p.hw, p.hk,
            p.xr, p.yr, p.hr, p.rr, p.rl, p.rw, p.rk,
            p.xl, p.yl, p.hl, p.rl, p.ll, p.lw, p.lk,
            p.xw, p.yw, p.hw, p.rw, p.lw, p.ww, p.wk,
            p.xk, p.yk, p.hk, p.rk, p.lk, p.wk, p.kk,
        ])
    }

    /// P Hᵀ for a measurement that depends on x, y, heading and range scale alone.
    #[inline]
    pub fn times(&self, x: f32, y: f32, h: f32, k: f32) -> Row {
        let p = self;
        Row {
            x: p.xx * x + p.xy * y + p.xh * h + p.xk * k,
            y: p.xy * x + p.yy * y + p.yh * h + p.yk * k,
            h: p.xh * x + p.yh * y + p.hh * h + p.hk * k,
            r: p.xr * x + p.yr * y + p.hr * h + p.rk * k,
            l: p.xl * x + p.yl * y + p.hl * h + p.lk * k,
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
            && p.rr >= 0.0
            && p.ll >= 0.0
            && p.ww >= 0.0
            && p.kk >= 0.0;
        none_negative && f32::is_finite(sum)
    }
}

impl Row {
    /// Every number times `factor`.
    pub fn scaled(self, factor: f32) -> Self {
        Self {
            x: self.x * factor,
            y: self.y * factor,
            h: self.h * factor,
            r: self.r * factor,
            l: self.l * factor,
            w: self.w * factor,
            k: self.k * factor,
        }
    }
}
