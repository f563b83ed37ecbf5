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
//!
//! # Non-finite policy
//! Nothing here refuses a value but [`Covariance::correct`], which tells of derivatives that are NaN or too
//! large before it changes anything. What a step makes of P, [`Covariance::is_sound`] judges by the
//! variances: NaN, infinity, negative and too large are all unsound. Whoever steps puts back what was.

use nalgebra::SMatrix;

use crate::motion::{Noise, Step, Walk};
use crate::state::{State, wheels};

/// The largest variance that is computed with (m², rad², 1): a robot uncertain by a thousand
/// kilometres.
const WIDEST: f32 = 1e12;

/// What the rounding of a sum of a few terms is worth, as a share of them: four times 2⁻²⁴.
const ROUNDING: f32 = 1.0 / 4_194_304.0;

/// Pose: the rows of heading, x and y, which every step changes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[rustfmt::skip]
pub struct PoseRows {
    pub(crate) hc: f32, pub(crate) hd: f32, pub(crate) hw: f32, pub(crate) hh: f32,
    pub(crate) xc: f32, pub(crate) xd: f32, pub(crate) xw: f32, pub(crate) xh: f32, pub(crate) xx: f32,
    pub(crate) yc: f32, pub(crate) yd: f32, pub(crate) yw: f32, pub(crate) yh: f32, pub(crate) yy: f32,
    pub(crate) xy: f32,
}

/// Calibration: scale errors and track-width error.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[rustfmt::skip]
pub struct Calibration {
    pub(crate) cc: f32, pub(crate) cd: f32, pub(crate) cw: f32,
    pub(crate) dd: f32, pub(crate) dw: f32, pub(crate) ww: f32,
}

/// Upper triangle of the paper's six states.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SixStates {
    /// Of the pose.
    pub pose: PoseRows,
    /// Of the calibration.
    pub calibration: Calibration,
}

/// The covariances of the range scale.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[rustfmt::skip]
pub struct RangeScale {
    pub(crate) ck: f32, pub(crate) dk: f32, pub(crate) wk: f32,
    pub(crate) xk: f32, pub(crate) yk: f32, pub(crate) hk: f32,
    pub(crate) kk: f32,
}

impl SixStates {
    /// F P Fᵀ + Q, multiplied out (`docs/model.md`, eq. 9).
    ///
    /// The step is seen as three small movements: half the turn, the advance along the
    /// mid-heading, the other half. So the pose after it is linear in the pose before it, the turn
    /// t and the advance s, and all that is needed are the covariances of these: `ht` is that of
    /// heading and turn, `xm` that of x and the mid-heading m = h + t/2, and so on.
    #[inline]
    pub fn propagate(&mut self, step: &Step, noise: &Noise) {
        let (p, q) = (&mut self.pose, &self.calibration);
        let (cc, dd, ww) = noise.walked.added_to(q);
        let (sin, cos) = (step.sin, step.cos);
        // ∂x/∂m and ∂y/∂m.
        let (swing_x, swing_y) = (-step.advance * sin, step.advance * cos);
        let turn_with =
            |c: f32, d: f32, w: f32| step.turn_c * c + step.turn_d * d + step.turn_w * w;
        let advance_with = |c: f32, d: f32| step.advance_c * c + step.advance_d * d;

        let (tc, sc) = (turn_with(cc, q.cd, q.cw), advance_with(cc, q.cd));
        let (td, sd) = (turn_with(q.cd, dd, q.dw), advance_with(q.cd, dd));
        let (tw, sw) = (turn_with(q.cw, q.dw, ww), advance_with(q.cw, q.dw));
        let tt = noise.turn + step.turn_c * tc + step.turn_d * td + step.turn_w * tw;
        let ts = noise.advance_turn + step.advance_c * tc + step.advance_d * td;
        let ss = noise.advance + step.advance_c * sc + step.advance_d * sd;

        let (ht, hs) = (turn_with(p.hc, p.hd, p.hw), advance_with(p.hc, p.hd));
        let (cm, dm, wm) = (p.hc + 0.5 * tc, p.hd + 0.5 * td, p.hw + 0.5 * tw);
        p.hc += tc;
        p.hd += td;
        p.hw += tw;
        let hm = p.hh + 0.5 * ht;
        let mt = ht + 0.5 * tt;
        let (mm, ms) = (hm + 0.5 * mt, hs + 0.5 * ts);
        let (m_new, s_new) = (hm + mt, hs + ts);
        p.hh += mt + mt + noise.heading;
        // A way's variance is a sum that may cancel to nothing, but must not round to less.
        let (mm, ss) = (mm + ROUNDING * mm, ss + ROUNDING * ss);

        // x_m is the covariance of the new x with the mid-heading, x_s that with the advance.
        let (xt, xs) = (turn_with(p.xc, p.xd, p.xw), advance_with(p.xc, p.xd));
        p.xc = p.xc + swing_x * cm + cos * sc;
        p.xd = p.xd + swing_x * dm + cos * sd;
        p.xw = p.xw + swing_x * wm + cos * sw;
        let xm = p.xh + 0.5 * xt;
        p.xh += xt + swing_x * m_new + cos * s_new;
        let x_m = xm + swing_x * mm + cos * ms;
        let x_s = xs + swing_x * ms + cos * ss;
        p.xx += noise.x + swing_x * (xm + x_m) + cos * (xs + x_s);

        let (yt, ys) = (turn_with(p.yc, p.yd, p.yw), advance_with(p.yc, p.yd));
        p.yc = p.yc + swing_y * cm + sin * sc;
        p.yd = p.yd + swing_y * dm + sin * sd;
        p.yw = p.yw + swing_y * wm + sin * sw;
        let ym = p.yh + 0.5 * yt;
        p.yh += yt + swing_y * m_new + sin * s_new;
        p.xy += swing_y * x_m + sin * x_s + swing_x * ym + cos * ys;
        let y_m = ym + swing_y * mm + sin * ms;
        let y_s = ys + swing_y * ms + sin * ss;
        p.yy += noise.y + swing_y * (ym + y_m) + sin * (ys + y_s);
    }
}

impl PoseRows {
    /// What the wheels' noise lacks of the rounding that a step of this covariance may bring, for x,
    /// y and heading (`docs/model.md`, eq. 9).
    #[inline]
    pub fn rounding(&self, advance: f32, turn: f32) -> [f32; 3] {
        let lacking = |variance: f32, noise: f32| {
            let lack = 0.5 * ROUNDING * variance - noise;
            if lack > 0.0 { lack } else { 0.0 }
        };
        [lacking(self.xx, advance), lacking(self.yy, advance), lacking(self.hh, turn)]
    }

    /// Whether the variances of the pose are sound.
    #[inline]
    pub fn is_sound(&self) -> bool {
        is_sound(self.xx) && is_sound(self.yy) && is_sound(self.hh)
    }
}

impl RangeScale {
    /// The same for the range scale: its covariances turn as the states do, and it has no noise.
    #[inline]
    pub fn propagate(&mut self, step: &Step) {
        let p = &mut *self;
        let tk = step.turn_c * p.ck + step.turn_d * p.dk + step.turn_w * p.wk;
        let sk = step.advance_c * p.ck + step.advance_d * p.dk;
        let km = p.hk + 0.5 * tk;
        p.xk += step.cos * sk - step.advance * step.sin * km;
        p.yk += step.sin * sk + step.advance * step.cos * km;
        p.hk += tk;
    }
}

/// The sharpest that the covariance gets along a range's direction: this share of the variances
/// that make it up.
///
/// A slanted wall ties x and y together. If each is uncertain by 100 m and the range by 0.1 mm, the
/// tie is a difference of numbers 10¹² times larger, where an `f32` has seven digits: P would soon
/// have a negative eigenvalue. 2⁻¹⁴ leaves ten bits for the rounding of the steps to come (measured
/// by `tests/properties/covariance.rs`: at 2⁻¹⁶ it goes wrong within a few hundred runs of a parked
/// robot, at 2⁻¹⁵ it does not).
const SHARPEST: f32 = 1.0 / 16_384.0;

/// The largest sum of squares of a range's derivatives that is computed with.
const STEEPEST: f32 = 1e6;

/// H: how a range depends on x, y, heading and range scale; also P Hᵀ in these states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Derivatives {
    /// By x, dimensionless.
    pub x: f32,
    /// By y, dimensionless.
    pub y: f32,
    /// By heading, metres per radian.
    pub h: f32,
    /// By range scale, metres.
    pub k: f32,
}

impl Derivatives {
    /// H times a column.
    #[must_use]
    pub fn times(&self, column: &Self) -> f32 {
        self.x * column.x + self.y * column.y + self.h * column.h + self.k * column.k
    }

    fn scaled(&self, factor: f32) -> Self {
        Self { x: self.x * factor, y: self.y * factor, h: self.h * factor, k: self.k * factor }
    }
}

/// K: how much of an innovation each state takes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Gain {
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) h: f32,
    pub(crate) c: f32,
    pub(crate) d: f32,
    pub(crate) w: f32,
    pub(crate) k: f32,
}

/// What a correction came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Correction {
    /// P has changed; the state is to change by this gain.
    Taken(Gain),
    /// The range adds nothing: P is as sharp along H as it can be held (eq. 17).
    Spare,
    /// A derivative is too large to compute with, or not a number; nothing has changed.
    NotFinite,
    /// The range's variance is not positive; nothing has changed.
    Indefinite,
}

impl Covariance {
    /// P Hᵀ, of the states that the range depends on.
    #[inline]
    #[must_use]
    pub fn cross(&self, h: &Derivatives) -> Derivatives {
        let (p, k) = (&self.six.pose, &self.scale);
        Derivatives {
            x: p.xx * h.x + p.xy * h.y + p.xh * h.h + k.xk * h.k,
            y: p.xy * h.x + p.yy * h.y + p.yh * h.h + k.yk * h.k,
            h: p.xh * h.x + p.yh * h.y + p.hh * h.h + k.hk * h.k,
            k: k.xk * h.x + k.yk * h.y + k.hk * h.h + k.kk * h.k,
        }
    }

    /// P Hᵀ, of the common part and the difference of the scale errors.
    #[must_use]
    pub fn cross_wheels(&self, h: &Derivatives) -> (f32, f32) {
        let (p, k) = (&self.six.pose, &self.scale);
        (
            p.xc * h.x + p.yc * h.y + p.hc * h.h + k.ck * h.k,
            p.xd * h.x + p.yd * h.y + p.hd * h.h + k.dk * h.k,
        )
    }

    /// Joseph's form in two passes (`docs/model.md`, eqs. 15 and 17).
    #[inline]
    pub fn correct(&mut self, h: &Derivatives, noise: f32) -> Correction {
        let squares = Derivatives { x: h.x * h.x, y: h.y * h.y, h: h.h * h.h, k: h.k * h.k };
        // Neither holds for NaN.
        let gentle = squares.x + squares.y + squares.h + squares.k <= STEEPEST;
        if !gentle {
            return Correction::NotFinite;
        }
        let m = self.cross(h);
        let along = h.times(&m);
        let s = noise + along;
        let positive = s >= f32::MIN_POSITIVE;
        if !positive {
            return Correction::Indefinite;
        }
        let (p, q, k) = (&mut self.six.pose, &mut self.six.calibration, &mut self.scale);
        let mut noise = noise;
        let mut per_variance = 1.0 / s;
        let mut gain = m.scaled(per_variance);
        let variances = |gain: &Derivatives| Derivatives {
            x: p.xx - gain.x * m.x,
            y: p.yy - gain.y * m.y,
            h: p.hh - gain.h * m.h,
            k: k.kk - gain.k * m.k,
        };
        let mut first = variances(&gain);
        let least = SHARPEST * squares.times(&first);
        if noise * along * per_variance < least {
            if along <= least {
                return Correction::Spare;
            }
            // What leaves v r/(v + r) = least.
            noise = along * least / (along - least);
            per_variance = 1.0 / (noise + along);
            gain = m.scaled(per_variance);
            first = variances(&gain);
        }
        // First pass.
        let xy = p.xy - gain.x * m.y;
        let xh = p.xh - gain.x * m.h;
        let xk = k.xk - gain.x * m.k;
        let yh = p.yh - gain.y * m.h;
        let yk = k.yk - gain.y * m.k;
        let hk = k.hk - gain.h * m.k;
        // In exact arithmetic P₁ Hᵀ = K R, and the second pass adds nothing.
        let d = Derivatives {
            x: gain.x * noise - (first.x * h.x + xy * h.y + xh * h.h + xk * h.k),
            y: gain.y * noise - (xy * h.x + first.y * h.y + yh * h.h + yk * h.k),
            h: gain.h * noise - (xh * h.x + yh * h.y + first.h * h.h + hk * h.k),
            k: gain.k * noise - (xk * h.x + yk * h.y + hk * h.h + first.k * h.k),
        };
        let half = 0.5 * h.times(&d);
        let e = Derivatives {
            x: d.x - half * gain.x,
            y: d.y - half * gain.y,
            h: d.h - half * gain.h,
            k: d.k - half * gain.k,
        };
        p.xx = first.x + e.x * gain.x + e.x * gain.x;
        p.xy = xy + e.x * gain.y + gain.x * e.y;
        p.xh = xh + e.x * gain.h + gain.x * e.h;
        k.xk = xk + e.x * gain.k + gain.x * e.k;
        p.yy = first.y + e.y * gain.y + e.y * gain.y;
        p.yh = yh + e.y * gain.h + gain.y * e.h;
        k.yk = yk + e.y * gain.k + gain.y * e.k;
        p.hh = first.h + e.h * gain.h + e.h * gain.h;
        k.hk = hk + e.h * gain.k + gain.h * e.k;
        k.kk = first.k + e.k * gain.k + e.k * gain.k;
        macro_rules! column {
            ($x:expr, $y:expr, $h:expr, $k:expr) => {{
                let m = $x * h.x + $y * h.y + $h * h.h + $k * h.k;
                let g = m * per_variance;
                let (x, y) = ($x - gain.x * m, $y - gain.y * m);
                let (h_, k_) = ($h - gain.h * m, $k - gain.k * m);
                let e_j = g * noise - (x * h.x + y * h.y + h_ * h.h + k_ * h.k) - half * g;
                $x = x + e.x * g + gain.x * e_j;
                $y = y + e.y * g + gain.y * e_j;
                $h = h_ + e.h * g + gain.h * e_j;
                $k = k_ + e.k * g + gain.k * e_j;
                (m, g, e_j)
            }};
        }
        let (mc, gc, ec) = column!(p.xc, p.yc, p.hc, k.ck);
        q.cc = q.cc - gc * mc + ec * gc + ec * gc;
        let (md, gd, ed) = column!(p.xd, p.yd, p.hd, k.dk);
        q.cd = q.cd - gc * md + ec * gd + gc * ed;
        q.dd = q.dd - gd * md + ed * gd + ed * gd;
        let (mw, gw, ew) = column!(p.xw, p.yw, p.hw, k.wk);
        q.cw = q.cw - gc * mw + ec * gw + gc * ew;
        q.dw = q.dw - gd * mw + ed * gw + gd * ew;
        q.ww = q.ww - gw * mw + ew * gw + ew * gw;
        Correction::Taken(Gain { x: gain.x, y: gain.y, h: gain.h, k: gain.k, c: gc, d: gd, w: gw })
    }
}

/// Whether 0 ≤ `value` ≤ `limit`. As integers, the bits of negative numbers and of NaN are larger
/// than those of any number in question.
pub(crate) fn is_within(value: f32, limit: f32) -> bool {
    value.to_bits() <= limit.to_bits()
}

/// Whether a variance is one to compute with.
pub(crate) fn is_sound(variance: f32) -> bool {
    is_within(variance, WIDEST)
}

/// Upper triangle of the covariance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Covariance {
    /// Of the paper's states.
    pub six: SixStates,
    /// Of the range scale.
    pub scale: RangeScale,
}

impl Covariance {
    /// Independent errors with these standard deviations.
    #[must_use]
    pub fn independent(deviation: &State) -> Self {
        let square = |sigma: f32| sigma * sigma;
        let (rr, ll) = (square(deviation.scale_right), square(deviation.scale_left));
        Self {
            six: SixStates {
                pose: PoseRows {
                    xx: square(deviation.x),
                    yy: square(deviation.y),
                    hh: square(deviation.heading),
                    ..PoseRows::default()
                },
                calibration: Calibration {
                    cc: 0.25 * (rr + ll),
                    cd: 0.5 * (rr - ll),
                    dd: rr + ll,
                    ww: square(deviation.track_width_error),
                    ..Calibration::default()
                },
            },
            scale: RangeScale { kk: square(deviation.range_scale), ..RangeScale::default() },
        }
    }

    /// The whole matrix in the order of [`State`], with the scale errors wheel by wheel
    /// (`docs/model.md`, eq. 9).
    #[rustfmt::skip]
    #[must_use]
    pub fn to_matrix(self) -> SMatrix<f32, 7, 7> {
        let (p, q, k) = (self.six.pose, self.six.calibration, self.scale);
        let (xr, xl) = wheels(p.xc, p.xd);
        let (yr, yl) = wheels(p.yc, p.yd);
        let (hr, hl) = wheels(p.hc, p.hd);
        let (wr, wl) = wheels(q.cw, q.dw);
        let (kr, kl) = wheels(k.ck, k.dk);
        let (rr, ll) = self.wheel_variances();
        let rl = q.cc - 0.25 * q.dd;
        SMatrix::from([
            [p.xx, p.xy, p.xh,   xr,   xl, p.xw, k.xk],
            [p.xy, p.yy, p.yh,   yr,   yl, p.yw, k.yk],
            [p.xh, p.yh, p.hh,   hr,   hl, p.hw, k.hk],
            [  xr,   yr,   hr,   rr,   rl,   wr,   kr],
            [  xl,   yl,   hl,   rl,   ll,   wl,   kl],
            [p.xw, p.yw, p.hw,   wr,   wl, q.ww, k.wk],
            [k.xk, k.yk, k.hk,   kr,   kl, k.wk, k.kk],
        ])
    }

    /// Variances of the right and the left wheel's scale error.
    #[must_use]
    pub fn wheel_variances(&self) -> (f32, f32) {
        let p = &self.six.calibration;
        wheels(p.cc + 0.25 * p.dd, 2.0 * p.cd)
    }

    /// The same with the variances that the calibration has gained by walking.
    #[inline]
    #[must_use]
    pub fn after(mut self, walk: &Walk) -> Self {
        let q = &mut self.six.calibration;
        (q.cc, q.dd, q.ww) = walk.added_to(q);
        self
    }

    /// Whether a variance is negative: no covariance any more.
    #[cold]
    #[must_use]
    pub fn is_negative(&self) -> bool {
        let (p, q, k) = (&self.six.pose, &self.six.calibration, &self.scale);
        [p.xx, p.yy, p.hh, q.cc, q.dd, q.ww, k.kk].iter().any(|&variance| variance < 0.0)
    }

    /// Whether all variances are sound.
    #[inline]
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let q = &self.six.calibration;
        self.six.pose.is_sound()
            && is_sound(q.cc)
            && is_sound(q.dd)
            && is_sound(q.ww)
            && is_sound(self.scale.kk)
    }
}
