//! Correction by one range (`docs/model.md`, eqs. 6 and 18 to 20).

use super::blocks::Covariance;
use super::projection::{CrossCovariance, PredictedMeasurement};
use crate::sensor::range::MeasurementJacobian;
use crate::state::estimate::FilterEstimate;

/// ε of eq. (20): the smallest variance along H, as a share of the variances that make it up.
///
/// A slanted wall correlates x and y. If each is uncertain by 100 m and the range by 0.1 mm, the
/// correlated part is a difference of numbers 10¹² times larger, where an `f32` has seven digits: P
/// would soon have a negative eigenvalue. 2⁻¹⁴ leaves ten bits for the rounding of later steps.
/// Measured with `tests/properties/covariance.rs`: at 2⁻¹⁶ a parked robot loses definiteness within a
/// few hundred runs, at 2⁻¹⁵ it does not.
const MIN_VARIANCE_SHARE: f32 = 1.0 / 16_384.0;

/// Largest S/R of a measurement that is corrected by the first pass of eq. (19) alone. Along H its rounding is then below 10⁻⁴ of
/// the remaining variance.
const PLAIN_UP_TO: f32 = 256.0;

/// The gain K, one number for each state.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Gain {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) h: f32,
    pub(super) c: f32,
    pub(super) d: f32,
    pub(super) w: f32,
    pub(super) k: f32,
    /// 1/S, 1/m².
    pub(super) per_variance: f32,
}

impl Gain {
    /// The correction of all states that has led from one estimate to another: a gain for an innovation of one.
    pub fn between(before: &FilterEstimate, after: &FilterEstimate) -> Self {
        let (x, y, h) = after.pose_since(before);
        Self {
            x,
            y,
            h,
            c: after.scale_common - before.scale_common,
            d: after.scale_difference - before.scale_difference,
            w: after.track_width_error - before.track_width_error,
            k: after.range_scale - before.range_scale,
            per_variance: 1.0,
        }
    }

    // ===== Eqs. (6) and (18): X̂ ← X̂ + K ν =====
    /// Corrects the estimate by an innovation.
    #[inline]
    pub fn correct(&self, estimate: &mut FilterEstimate, innovation: f32) {
        estimate.add_to_pose(self.x * innovation, self.y * innovation, self.h * innovation);
        estimate.scale_common += self.c * innovation;
        estimate.scale_difference += self.d * innovation;
        estimate.track_width_error += self.w * innovation;
        estimate.range_scale += self.k * innovation;
    }
}

/// Result of a correction of P.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Correction {
    /// P is corrected; the estimate is to be corrected with this gain.
    Applied(Gain),
    /// Numerically saturated: P is already as small along H as `f32` can hold, eq. (20). P is
    /// unchanged.
    Saturated,
    /// The innovation variance is not positive; P is unchanged.
    Indefinite,
}

/// One number for each state that a range depends on.
#[derive(Clone, Copy)]
struct Column {
    x: f32,
    y: f32,
    h: f32,
    k: f32,
}

impl Column {
    /// H times the column.
    fn times(&self, h: &MeasurementJacobian) -> f32 {
        h.x * self.x + h.y * self.y + h.h * self.h + h.k * self.k
    }
}

/// R, 1/S, K and the diagonal of P − K mᵀ, after eq. (20).
struct FirstPass {
    noise: f32,
    per_variance: f32,
    gain: Column,
    variances: Column,
}

/// e of eq. (19), and R − ½ H d, with which the remaining columns compute theirs.
struct SecondPass {
    e: Column,
    remaining_noise: f32,
}

impl Covariance {
    // ===== Eqs. (6), (18) and (19): K, and P ← P − K H P in Joseph's form =====
    /// Corrects P by a measurement with noise variance `noise`, and returns the gain.
    #[inline]
    pub fn correct(&mut self, prediction: &PredictedMeasurement, noise: f32) -> Correction {
        let h = &prediction.expected.jacobian();
        // False for NaN.
        let is_positive = noise + prediction.variance >= f32::MIN_POSITIVE;
        if !is_positive {
            return Correction::Indefinite;
        }
        let Some(first) = self.first_pass(h, prediction, noise) else {
            return Correction::Saturated;
        };
        let m = &prediction.cross_covariance;
        let is_sharp = prediction.variance > (PLAIN_UP_TO - 1.0) * first.noise;
        let second = self.correct_range_states(h, m, &first, is_sharp);
        let [c, d, w] = self.correct_calibration(h, &first, second.as_ref());
        let Column { x, y, h, k } = first.gain;
        Correction::Applied(Gain { x, y, h, c, d, w, k, per_variance: first.per_variance })
    }

    // ===== Eqs. (18) and (20): K = P Hᵀ/S, with R raised where f32 would lose definiteness =====
    #[inline]
    fn first_pass(
        &self,
        h: &MeasurementJacobian,
        prediction: &PredictedMeasurement,
        noise: f32,
    ) -> Option<FirstPass> {
        let m = &prediction.cross_covariance;
        let along = prediction.variance;
        let variances = |gain: &Column| Column {
            x: self.pose.xx - gain.x * m.x,
            y: self.pose.yy - gain.y * m.y,
            h: self.pose.hh - gain.h * m.h,
            k: self.range_scale.kk - gain.k * m.k,
        };
        let per_variance = 1.0 / (noise + along);
        let gain = scaled(m, per_variance);
        let first = FirstPass { noise, per_variance, gain, variances: variances(&gain) };
        let least = MIN_VARIANCE_SHARE * first.variances.times(&h.squared());
        if noise * along * per_variance >= least {
            return Some(first);
        }
        if along <= least {
            return None;
        }
        // The noise that leaves v R/(v + R) = least.
        let noise = along * least / (along - least);
        let per_variance = 1.0 / (noise + along);
        let gain = scaled(m, per_variance);
        Some(FirstPass { noise, per_variance, gain, variances: variances(&gain) })
    }

    // ===== Eq. (19), block of the states that the range depends on =====
    /// The second pass only for a sharp range.
    #[inline]
    fn correct_range_states(
        &mut self,
        h: &MeasurementJacobian,
        m: &CrossCovariance,
        first: &FirstPass,
        is_sharp: bool,
    ) -> Option<SecondPass> {
        let FirstPass { noise, gain, variances, .. } = first;
        let (p, r) = (&mut self.pose, &mut self.range_scale);
        // P₁ = P − K mᵀ.
        (p.xx, p.yy, p.hh, r.kk) = (variances.x, variances.y, variances.h, variances.k);
        p.xy -= gain.x * m.y;
        p.xh -= gain.x * m.h;
        r.xk -= gain.x * m.k;
        p.yh -= gain.y * m.h;
        r.yk -= gain.y * m.k;
        r.hk -= gain.h * m.k;
        if !is_sharp {
            return None;
        }
        // d = K R − P₁ Hᵀ; zero in exact arithmetic.
        let d = Column {
            x: gain.x * noise - (p.xx * h.x + p.xy * h.y + p.xh * h.h + r.xk * h.k),
            y: gain.y * noise - (p.xy * h.x + p.yy * h.y + p.yh * h.h + r.yk * h.k),
            h: gain.h * noise - (p.xh * h.x + p.yh * h.y + p.hh * h.h + r.hk * h.k),
            k: gain.k * noise - (r.xk * h.x + r.yk * h.y + r.hk * h.h + r.kk * h.k),
        };
        // e = d − ½ K (H d).
        let half = 0.5 * d.times(h);
        let e = Column {
            x: d.x - half * gain.x,
            y: d.y - half * gain.y,
            h: d.h - half * gain.h,
            k: d.k - half * gain.k,
        };
        // P⁺ = P₁ + e Kᵀ + K eᵀ.
        p.xx = p.xx + e.x * gain.x + e.x * gain.x;
        p.xy = p.xy + e.x * gain.y + gain.x * e.y;
        p.xh = p.xh + e.x * gain.h + gain.x * e.h;
        r.xk = r.xk + e.x * gain.k + gain.x * e.k;
        p.yy = p.yy + e.y * gain.y + e.y * gain.y;
        p.yh = p.yh + e.y * gain.h + gain.y * e.h;
        r.yk = r.yk + e.y * gain.k + gain.y * e.k;
        p.hh = p.hh + e.h * gain.h + e.h * gain.h;
        r.hk = r.hk + e.h * gain.k + gain.h * e.k;
        r.kk = r.kk + e.k * gain.k + e.k * gain.k;
        Some(SecondPass { e, remaining_noise: noise - half })
    }

    // ===== Eq. (19), columns of the calibration =====
    /// Corrects the columns of c, d and w, and returns their gains.
    #[inline]
    fn correct_calibration(
        &mut self,
        h: &MeasurementJacobian,
        first: &FirstPass,
        second: Option<&SecondPass>,
    ) -> [f32; 3] {
        let FirstPass { per_variance, gain, .. } = first;
        let (p, q, r) = (&mut self.pose, &mut self.calibration, &mut self.range_scale);
        let column = |x: &mut f32, y: &mut f32, h_: &mut f32, k: &mut f32| {
            let m = *x * h.x + *y * h.y + *h_ * h.h + *k * h.k;
            let g = m * per_variance;
            *x -= gain.x * m;
            *y -= gain.y * m;
            *h_ -= gain.h * m;
            *k -= gain.k * m;
            let Some(SecondPass { e, remaining_noise }) = second else { return (m, g, 0.0) };
            let e_j = g * remaining_noise - (*x * h.x + *y * h.y + *h_ * h.h + *k * h.k);
            *x = *x + e.x * g + gain.x * e_j;
            *y = *y + e.y * g + gain.y * e_j;
            *h_ = *h_ + e.h * g + gain.h * e_j;
            *k = *k + e.k * g + gain.k * e_j;
            (m, g, e_j)
        };
        let (mc, gc, ec) = column(&mut p.xc, &mut p.yc, &mut p.hc, &mut r.ck);
        let (md, gd, ed) = column(&mut p.xd, &mut p.yd, &mut p.hd, &mut r.dk);
        let (mw, gw, ew) = column(&mut p.xw, &mut p.yw, &mut p.hw, &mut r.wk);
        q.cc -= gc * mc;
        q.cd -= gc * md;
        q.dd -= gd * md;
        q.cw -= gc * mw;
        q.dw -= gd * mw;
        q.ww -= gw * mw;
        if second.is_some() {
            q.cc = q.cc + ec * gc + ec * gc;
            q.cd = q.cd + ec * gd + gc * ed;
            q.dd = q.dd + ed * gd + ed * gd;
            q.cw = q.cw + ec * gw + gc * ew;
            q.dw = q.dw + ed * gw + gd * ew;
            q.ww = q.ww + ew * gw + ew * gw;
        }
        [gc, gd, gw]
    }
}

impl Covariance {
    // ===== Eq. (18): K = P Hᵀ/S, P unchanged =====
    /// The gain of a measurement with innovation variance `s`.
    #[must_use]
    pub fn gain(&self, prediction: &PredictedMeasurement, s: f32) -> Gain {
        let h = &prediction.expected.jacobian();
        let (p, r) = (&self.pose, &self.range_scale);
        let per_variance = 1.0 / s;
        let Column { x, y, h: hh, k } = scaled(&prediction.cross_covariance, per_variance);
        let column = |x: f32, y: f32, hh: f32, k: f32| {
            (x * h.x + y * h.y + hh * h.h + k * h.k) * per_variance
        };
        let c = column(p.xc, p.yc, p.hc, r.ck);
        let d = column(p.xd, p.yd, p.hd, r.dk);
        let w = column(p.xw, p.yw, p.hw, r.wk);
        Gain { x, y, h: hh, c, d, w, k, per_variance }
    }

    // ===== Eq. (16): P ← P + a K Kᵀ =====
    /// Adds the variance `amount` of the innovation, mapped to the states by the gain: the uncertainty
    /// of the association of a measurement.
    pub fn add_along_gain(&mut self, gain: &Gain, amount: f32) {
        let (p, q, r) = (&mut self.pose, &mut self.calibration, &mut self.range_scale);
        let Gain { x, y, h, c, d, w, k, .. } = *gain;
        let (ax, ay, ah, ac) = (amount * x, amount * y, amount * h, amount * c);
        let (ad, aw, ak) = (amount * d, amount * w, amount * k);
        p.xx += ax * x;
        p.xy += ax * y;
        p.xh += ax * h;
        p.xc += ax * c;
        p.xd += ax * d;
        p.xw += ax * w;
        r.xk += ax * k;
        p.yy += ay * y;
        p.yh += ay * h;
        p.yc += ay * c;
        p.yd += ay * d;
        p.yw += ay * w;
        r.yk += ay * k;
        p.hh += ah * h;
        p.hc += ah * c;
        p.hd += ah * d;
        p.hw += ah * w;
        r.hk += ah * k;
        q.cc += ac * c;
        q.cd += ac * d;
        q.cw += ac * w;
        r.ck += ac * k;
        q.dd += ad * d;
        q.dw += ad * w;
        r.dk += ad * k;
        q.ww += aw * w;
        r.wk += aw * k;
        r.kk += ak * k;
    }
}

fn scaled(m: &CrossCovariance, factor: f32) -> Column {
    Column { x: m.x * factor, y: m.y * factor, h: m.h * factor, k: m.k * factor }
}
