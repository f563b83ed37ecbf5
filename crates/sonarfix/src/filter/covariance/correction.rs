//! Correction by one range (`docs/model.md`, eqs. 6 and 18 to 20).

use super::blocks::Covariance;
use super::column::StateColumn;
use super::gain::Gain;
use super::projection::{CrossCovariance, PredictedMeasurement};
use crate::sensor::range::MeasurementJacobian;

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

/// R, S and K, as far as it concerns the states that a range depends on, after eq. (20).
struct Raised {
    noise: f32,
    variance: f32,
    scaled: Scaled,
}

/// P Hᵀ/S, and 1/S.
#[derive(Clone, Copy)]
struct Scaled {
    gain: Column,
    per_variance: f32,
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
        let Some(Raised { noise, variance, scaled }) = self.raised(h, prediction, noise) else {
            return Correction::Saturated;
        };
        let gain = self.gain_of(prediction, scaled);
        // P₁ = P − S K Kᵀ.
        self.add_along_gain(&gain, -variance);
        if variance > PLAIN_UP_TO * noise {
            self.second_pass(prediction, &gain, noise);
        }
        Correction::Applied(gain)
    }

    // ===== Eq. (20): R raised where f32 would lose definiteness =====
    #[inline]
    fn raised(
        &self,
        h: &MeasurementJacobian,
        prediction: &PredictedMeasurement,
        noise: f32,
    ) -> Option<Raised> {
        let m = &prediction.cross_covariance;
        let along = prediction.variance;
        let variance = noise + along;
        let scaled = Scaled::new(m, variance);
        let Scaled { gain, per_variance } = &scaled;
        let after = Column {
            x: self.pose.xx - gain.x * m.x,
            y: self.pose.yy - gain.y * m.y,
            h: self.pose.hh - gain.h * m.h,
            k: self.range_scale.kk - gain.k * m.k,
        };
        let least = MIN_VARIANCE_SHARE * after.times(&h.squared());
        if noise * along * per_variance >= least {
            return Some(Raised { noise, variance, scaled });
        }
        if along <= least {
            return None;
        }
        // The noise that leaves v R/(v + R) = least.
        let noise = along * least / (along - least);
        let variance = noise + along;
        Some(Raised { noise, variance, scaled: Scaled::new(m, variance) })
    }

    // ===== Eq. (19): P⁺ = P₁ + e Kᵀ + K eᵀ =====
    #[inline(never)]
    fn second_pass(&mut self, prediction: &PredictedMeasurement, gain: &Gain, noise: f32) {
        let h = &prediction.expected.jacobian();
        let (p, q, r) = (&mut self.pose, &mut self.calibration, &mut self.range_scale);
        // P₁ Hᵀ, and what the mount adds to it.
        let mut m = StateColumn {
            x: p.xx * h.x + p.xy * h.y + p.xh * h.h + r.xk * h.k,
            y: p.xy * h.x + p.yy * h.y + p.yh * h.h + r.yk * h.k,
            h: p.xh * h.x + p.yh * h.y + p.hh * h.h + r.hk * h.k,
            c: p.xc * h.x + p.yc * h.y + p.hc * h.h + r.ck * h.k,
            d: p.xd * h.x + p.yd * h.y + p.hd * h.h + r.dk * h.k,
            w: p.xw * h.x + p.yw * h.y + p.hw * h.h + r.wk * h.k,
            k: r.xk * h.x + r.yk * h.y + r.hk * h.h + r.kk * h.k,
        };
        if let Some(mount) = prediction.mount() {
            m.add(&mount.states);
            m.subtract(gain, mount.along);
        }
        // d = K R − P₁ Hᵀ; zero in exact arithmetic. e = d − ½ K (H d).
        let Gain { x, y, h: hh, c, d, w, k, .. } = *gain;
        let along = h.x * x + h.y * y + h.h * hh + h.k * k;
        let rest = noise - 0.5 * (along * noise - m.times(h));
        let e = StateColumn {
            x: x * rest - m.x,
            y: y * rest - m.y,
            h: hh * rest - m.h,
            c: c * rest - m.c,
            d: d * rest - m.d,
            w: w * rest - m.w,
            k: k * rest - m.k,
        };
        p.xx += e.x * x + e.x * x;
        p.xy += e.x * y + x * e.y;
        p.xh += e.x * hh + x * e.h;
        p.xc += e.x * c + x * e.c;
        p.xd += e.x * d + x * e.d;
        p.xw += e.x * w + x * e.w;
        r.xk += e.x * k + x * e.k;
        p.yy += e.y * y + e.y * y;
        p.yh += e.y * hh + y * e.h;
        p.yc += e.y * c + y * e.c;
        p.yd += e.y * d + y * e.d;
        p.yw += e.y * w + y * e.w;
        r.yk += e.y * k + y * e.k;
        p.hh += e.h * hh + e.h * hh;
        p.hc += e.h * c + hh * e.c;
        p.hd += e.h * d + hh * e.d;
        p.hw += e.h * w + hh * e.w;
        r.hk += e.h * k + hh * e.k;
        q.cc += e.c * c + e.c * c;
        q.cd += e.c * d + c * e.d;
        q.cw += e.c * w + c * e.w;
        r.ck += e.c * k + c * e.k;
        q.dd += e.d * d + e.d * d;
        q.dw += e.d * w + d * e.w;
        r.dk += e.d * k + d * e.k;
        q.ww += e.w * w + e.w * w;
        r.wk += e.w * k + w * e.k;
        r.kk += e.k * k + e.k * k;
    }
}

impl Covariance {
    // ===== Eq. (18): K = P Hᵀ/S, P unchanged =====
    /// The gain of a measurement with innovation variance `s`.
    #[must_use]
    pub fn gain(&self, prediction: &PredictedMeasurement, s: f32) -> Gain {
        self.gain_of(prediction, Scaled::new(&prediction.cross_covariance, s))
    }

    fn gain_of(&self, prediction: &PredictedMeasurement, scaled: Scaled) -> Gain {
        let h = &prediction.expected.jacobian();
        let (p, r) = (&self.pose, &self.range_scale);
        let Scaled { gain: Column { x, y, h: hh, k }, per_variance } = scaled;
        let column = |x: f32, y: f32, hh: f32, k: f32| x * h.x + y * h.y + hh * h.h + k * h.k;
        let mut c = column(p.xc, p.yc, p.hc, r.ck);
        let mut d = column(p.xd, p.yd, p.hd, r.dk);
        let mut w = column(p.xw, p.yw, p.hw, r.wk);
        if let Some(mount) = prediction.mount() {
            c += mount.states.c;
            d += mount.states.d;
            w += mount.states.w;
        }
        let (c, d, w) = (c * per_variance, d * per_variance, w * per_variance);
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

impl Scaled {
    /// For an innovation variance `s`.
    #[inline]
    fn new(m: &CrossCovariance, s: f32) -> Self {
        let v = 1.0 / s;
        Self { gain: Column { x: m.x * v, y: m.y * v, h: m.h * v, k: m.k * v }, per_variance: v }
    }
}
